"""Messages between processes of one run (BPMN 2.0.2, clause 8.4.11).

A message goes to one receiver. One that nobody waits for yet is kept for whoever waits next, as
long as something in the mission can receive it at all.
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.engine.waiting import deliver, message_receiver
from m2pem.model.elements import EndEvent, Event, IntermediateThrowEvent, Mission, ReceiveTask
from m2pem.model.events import MessageEventDefinition
from m2pem.model.values import Value


def can_be_received(mission: Mission, message: str) -> bool:
    """Whether any element of the mission catches the message."""
    for node in mission.nodes:
        if isinstance(node, ReceiveTask):
            if node.message is not None and node.message.id == message:
                return True
        elif isinstance(node, Event) and not isinstance(node, (EndEvent, IntermediateThrowEvent)):
            for definition in node.definitions:
                if (
                    isinstance(definition, MessageEventDefinition)
                    and definition.message.id == message
                ):
                    return True
    return False


def send(x: Execution, token: Token, message: str) -> None:
    """Throw a message from the element that a token is on."""
    node = token.node
    receiver = message_receiver(x, message)
    kept = receiver is None and can_be_received(x.mission, message)
    x.emit(
        r.MessageThrown(message, token.id, x.process_of(node), node.id, token.scope.id, kept=kept)
    )
    if receiver is not None:
        deliver(x, receiver, {})


def receive(x: Execution, message: str, data: dict[str, Value], by: str) -> bool:
    """Take a message from outside. False: nothing in the mission could ever receive it."""
    receiver = message_receiver(x, message)
    if receiver is None and not can_be_received(x.mission, message):
        return False
    kept = receiver is None
    x.emit(r.MessageThrown(message, by=by, kept=kept, data=data if kept else {}))
    if receiver is not None:
        deliver(x, receiver, data)
    return True
