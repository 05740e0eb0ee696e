"""What waits for signals and messages, so that who throws them knows who catches them."""

from collections.abc import Sequence

from m2pem.mission import elements as e
from m2pem.mission.events import EventDefinition, MessageEventDefinition, SignalEventDefinition
from m2pem.verify.translate.data import Truth
from m2pem.verify.translate.making import Catcher, Making


def catching(
    making: Making,
    what: str,
    ref: str,
    waiting: int,
    told: int,
    keeps: bool,
    node: e.FlowNode,
) -> None:
    """A signal or message of that id reaches a token on `waiting`."""
    register = making.signals if what == "signal" else making.messages
    register.setdefault(ref, []).append(Catcher(waiting, told, keeps, node.id))


def what_and_ref(definition: EventDefinition) -> tuple[str, str]:
    """("signal" or "message", its id)."""
    if isinstance(definition, SignalEventDefinition):
        return "signal", definition.signal.id
    assert isinstance(definition, MessageEventDefinition)
    return "message", definition.message.id


def first(truths: Sequence[Truth]) -> Truth:
    """Of one condition, whether it is true."""
    return truths[0]
