"""Which vehicles and payloads an activity's behavior holds."""

from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.verify.translate.making import Making


def held_by(making: Making, node: e.Activity) -> tuple[tuple[str, ...], str]:
    """What a token on an activity holds, and by which behavior; nothing, of a loop's whole."""
    behavior = behavior_of(node)
    if behavior is None or node.loop is not None:
        return (), ""
    held = resources(making, behavior)
    return held or (), behavior.name if held else ""


def behavior_of(node: e.Activity) -> Behavior | None:
    """The behavior that an activity commands."""
    if isinstance(node, e.ScriptTask | e.ServiceTask | e.SendTask):
        return node.behavior
    return None


def resources(making: Making, behavior: Behavior) -> tuple[str, ...] | None:
    """What a behavior holds; None: the fleet lacks it."""
    try:
        return tuple(allocate(behavior, making.fleet).resources)
    except AllocationError:
        return None
