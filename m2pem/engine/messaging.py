"""Messages between processes of one run (BPMN 2.0.2, clause 8.4.11).

A message goes to one receiver, the one that has waited longest of those that it is for (see
`m2pem.engine.correlation`). One that nobody waits for yet is kept for whoever waits next, as
long as something in the mission can receive it at all.
"""

from m2pem.engine import records as r
from m2pem.engine.correlation import keys_of, remember
from m2pem.engine.data_flow import payload
from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import deliver, message_receiver
from m2pem.errors import ExpressionError
from m2pem.mission.values import Value


def send(x: Execution, token: Token, message: str) -> None:
    """Throw a message, with its data inputs, from the element that a token is on."""
    node = token.node
    data = payload(x, token)
    if data is None:
        return
    try:
        keys = keys_of(x, message, data, token)
    except ExpressionError as error:
        throw_error(x, token, "EXPRESSION", f"correlation of message {message}: {error}")
        return
    remember(x, token, keys)
    receiver = message_receiver(x, message, keys)
    kept = receiver is None and message in x.receivable
    x.emit(
        r.MessageThrown(
            message,
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            kept=kept,
            data=data if kept else {},
            keys=keys,
        )
    )
    if receiver is not None:
        deliver(x, receiver, message, data, keys)


def receive(x: Execution, message: str, data: dict[str, Value], by: str) -> None:
    """Take a message from outside; something in the mission receives it."""
    try:
        keys = keys_of(x, message, data, None)
    except ExpressionError as error:
        x.ignore(f"message {message} cannot be matched: {error}")
        return
    receiver = message_receiver(x, message, keys)
    kept = receiver is None
    x.emit(r.MessageThrown(message, by=by, kept=kept, data=data if kept else {}, keys=keys))
    if receiver is not None:
        deliver(x, receiver, message, data, keys)
