"""Hand-over: an operator takes a vehicle from the missions, and gives it back.

The behavior that the vehicle was doing ends with error TAKEN_OVER, so that the mission can wait or
go round it as its author drew it. Until the vehicle is back, a behavior for it is refused.
"""

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.reports import give_up
from m2pem.engine.state import Behavior, BehaviorPhase, RunState
from m2pem.engine.throwing import catcher_of_error
from m2pem.engine.triggering import throw_signal
from m2pem.mission.elements import Event

CODE = "TAKEN_OVER"


def taken(x: Execution, item: i.ControlTaken) -> None:
    """What the resource does for the run ends with TAKEN_OVER."""
    if item.resource in x.state.taken:
        x.ignore(f"{item.resource} is with {x.state.taken[item.resource]} already")
        return
    x.emit(r.OperatorTookControl(item.resource, item.by))
    for behavior in _commanding(x.state, item.resource):
        if behavior.phase is not BehaviorPhase.CANCELLING:  # as the behavior before it left it
            give_up(x, behavior, CODE, f"{item.resource} was taken by {item.by}")


def preview_taken(state: RunState, resource: str) -> list[tuple[Behavior, Event | None]]:
    """The behaviors that `taken` would end now, each with the event that would catch its error.

    None: no event catches it, so the run would fail.
    """
    return [
        (behavior, catcher_of_error(state.tokens[behavior.token], CODE))
        for behavior in _commanding(state, resource)
    ]


def _commanding(state: RunState, resource: str) -> list[Behavior]:
    """The behaviors that command a resource and are not being cancelled."""
    holders = [state.behaviors.get(each) for each in state.held.get(resource, ())]
    return [
        each for each in holders if each is not None and each.phase is not BehaviorPhase.CANCELLING
    ]


def returned(x: Execution, item: i.ControlReturned) -> None:
    """The resource can be commanded again; signals that wait for it are thrown."""
    if item.resource not in x.state.taken:
        x.ignore(f"{item.resource} is not with an operator")
        return
    x.emit(r.OperatorGaveControlBack(item.resource, item.by))
    for signal in x.mission.signals.values():
        if signal.returned == item.resource:
            x.emit(r.SignalThrown(signal.id, by=item.by))
            throw_signal(x, signal.id, {})
