"""Hand-over: an operator takes a vehicle from the missions, and gives it back.

The behavior that the vehicle was doing ends with error TAKEN_OVER, so that the mission can wait or
go round it as its author drew it. Until the vehicle is back, a behavior for it is refused.
"""

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.reports import give_up
from m2pem.engine.state import BehaviorPhase
from m2pem.engine.triggering import throw_signal


def taken(x: Execution, item: i.ControlTaken) -> None:
    """What the resource does for the run ends with TAKEN_OVER."""
    if item.resource in x.state.taken:
        x.ignore(f"{item.resource} is with {x.state.taken[item.resource]} already")
        return
    x.emit(r.OperatorTookControl(item.resource, item.by))
    for holder in list(x.state.held.get(item.resource, ())):
        behavior = x.state.behaviors.get(holder)
        if behavior is not None and behavior.phase is not BehaviorPhase.CANCELLING:
            give_up(x, behavior, "TAKEN_OVER", f"{item.resource} was taken by {item.by}")


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
