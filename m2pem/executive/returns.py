"""Says to runs that what they lost has returned: its link is restored and it is held, or its
battery is charged again. Tasks that wait for someone to do their rest may then get it again.
"""

from collections.abc import Iterable, Iterator, Mapping

from m2pem.api.runs import RunId
from m2pem.api.telemetry import VehicleState
from m2pem.engine import records as r
from m2pem.engine.inputs import ResourceReturned
from m2pem.engine.state import OutOfReach, RunState
from m2pem.executive.runner import Runner
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.losses import BATTERY_LOW, LINK_LOST, Loss

CHARGED = 0.8
"""Charge from which on a vehicle whose battery was too low is given again to the task that lost it:
well above what is left when a battery is low, so that a task is not passed to and fro."""


class Returns:
    """Which runs are to learn that a resource has returned. `runners`: those driven here."""

    def __init__(self, runners: Mapping[RunId, Runner]) -> None:
        self._runners = runners
        self._lost: dict[str, set[RunId]] = {}
        self._low: dict[str, set[RunId]] = {}

    def faulted(self, resource: str, run: RunId) -> None:
        """A run gets the input that the link of a resource is lost; it may decide that later."""
        self._lost.setdefault(resource, set()).add(run)

    def take_up(self, runner: Runner) -> None:
        """Note what a run that is resumed has lost."""
        for resource in still_lost(runner.run.state):
            self.faulted(resource, runner.id)
        for resource, loss in _lost_by_tasks(runner.run.state):
            if loss.code == BATTERY_LOW:
                self._low.setdefault(resource, set()).add(runner.id)

    def on_records(self, run: RunId, records: Iterable[r.Record]) -> None:
        """Note what a run loses; what it commands now has returned for all others."""
        for record in records:
            match record:
                case r.WorkReassigned():
                    lost = {BATTERY_LOW: self._low, LINK_LOST: self._lost}.get(record.code)
                    if lost is not None:
                        for resource in record.excluded:
                            lost.setdefault(resource, set()).add(run)
                case r.BehaviorEnded(state=BehaviorState.LOST):
                    for resource in self._runners[run].run.state.lost:
                        self.faulted(resource, run)
                case r.BehaviorRequested() if self._lost:
                    for resource in record.resources:
                        others = self._lost.get(resource, set()) - {run}
                        self._post(others, resource, LINK_LOST, f"{record.behavior} has it")

    def returned(self, resource: str, reason: str) -> None:
        """A lost resource was received again and has stopped."""
        self._post(self._lost.pop(resource, set()), resource, LINK_LOST, reason)

    def on_telemetry(self, state: object) -> None:
        """A vehicle published its state."""
        if not isinstance(state, VehicleState) or state.resource not in self._low:
            return
        charge = state.battery_fraction
        if charge is not None and charge >= CHARGED:
            runs = self._low.pop(state.resource)
            self._post(runs, state.resource, BATTERY_LOW, f"at {charge:.0%}")

    def _post(self, runs: Iterable[RunId], resource: str, code: str, reason: str) -> None:
        for number in sorted(runs):
            runner = self._runners.get(number)
            if runner is not None and not runner.done.is_set():
                runner.post(ResourceReturned(resource, code, reason))


def still_lost(state: RunState) -> dict[str, OutOfReach]:
    """Return the resources that a run has lost and that may still do what they were commanded."""
    returned = {
        item.resource
        for item in state.deferred
        if isinstance(item, ResourceReturned) and item.code == LINK_LOST
    }
    found = {
        resource: OutOfReach(token.lost_work.behavior, None)
        for token in state.tokens.values()
        if token.lost_work is not None
        for resource, loss in token.lost_work.resources.items()
        if loss.code == LINK_LOST
    }
    found |= state.lost
    return {resource: lost for resource, lost in found.items() if resource not in returned}


def _lost_by_tasks(state: RunState) -> Iterator[tuple[str, Loss]]:
    for token in state.tokens.values():
        if token.lost_work is not None:
            yield from token.lost_work.resources.items()
