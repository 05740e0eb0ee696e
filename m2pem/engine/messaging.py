"""Messages between processes of one run (BPMN 2.0.2, clause 8.4.11).

A message goes to one receiver. One that nobody waits for yet is kept for whoever waits next, as
long as something in the mission can receive it at all.
"""

from m2pem.engine import records as r
from m2pem.engine.data_flow import payload
from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.engine.triggering import deliver, message_receiver
from m2pem.model.values import Value


def send(x: Execution, token: Token, message: str) -> None:
    """Throw a message, with its data inputs, from the element that a token is on."""
    node = token.node
    data = payload(x, token)
    if data is None:
        return
    receiver = message_receiver(x, message)
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
        )
    )
    if receiver is not None:
        deliver(x, receiver, message, data)


def receive(x: Execution, message: str, data: dict[str, Value], by: str) -> None:
    """Take a message from outside; something in the mission receives it."""
    receiver = message_receiver(x, message)
    kept = receiver is None
    x.emit(r.MessageThrown(message, by=by, kept=kept, data=data if kept else {}))
    if receiver is not None:
        deliver(x, receiver, message, data)
