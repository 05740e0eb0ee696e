"""The links to simulated vehicles: what passes, what waits, and what is lost."""

from collections.abc import Callable
from dataclasses import dataclass, field

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.async_queue import AsyncQueue
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.simulation.executions import Execution, Outcome


@dataclass(slots=True)
class _Broken:
    """A broken link. `lost`: it has been for so long that the arbiter has given up."""

    reports: list[tuple[Execution, Outcome]] = field(default_factory=list)
    commands: list[tuple[str, Callable[[int], None]]] = field(default_factory=list)
    lost: bool = False


class Links:
    """While a vehicle's link is broken, reports about it and commands to it wait.

    `muted`: reports are counted and remembered, but not sent; only `query` reports what
    happened while no executive was there.
    """

    def __init__(self) -> None:
        self.reports: AsyncQueue[BehaviorReport] = AsyncQueue()
        self.muted = False
        self._broken: dict[ResourceId, _Broken] = {}
        self._cuts: dict[ResourceId, int] = {}

    def up(self, vehicle: ResourceId) -> bool:
        return vehicle not in self._broken

    def lost(self, vehicle: ResourceId) -> bool:
        """Whether the arbiter has given the vehicle up."""
        return vehicle in self._broken and self._broken[vehicle].lost

    def broken_of(self, execution: Execution) -> ResourceId | None:
        """The first of a behavior's vehicles whose link is lost."""
        return next((vehicle for vehicle in execution.carriers if not self.up(vehicle)), None)

    def report(self, execution: Execution, outcome: Outcome) -> None:
        """Say what became of a behavior, as soon as it can be known."""
        if execution.reported_end:
            return
        vehicle = self.broken_of(execution)
        if vehicle is None or outcome.state is BehaviorState.LOST:
            self._emit(execution, outcome)
        else:
            self._broken[vehicle].reports.append((execution, outcome))

    def cut(self, vehicle: ResourceId) -> None:
        if vehicle not in self._broken:
            self._broken[vehicle] = _Broken()
            self._cuts[vehicle] = self.cuts(vehicle) + 1

    def cuts(self, vehicle: ResourceId) -> int:
        return self._cuts.get(vehicle, 0)

    def give_up(self, vehicle: ResourceId) -> None:
        """The link was broken for too long: nothing of what waits to be said ever will be, nor any
        behavior that waits be started."""
        broken = self._broken[vehicle]
        broken.lost = True
        broken.reports.clear()
        broken.commands[:] = [kept for kept in broken.commands if not kept[0].startswith("start ")]

    def defer(self, vehicle: ResourceId, name: str, command: Callable[[int], None]) -> None:
        """Keep a command until the link is mended; one of each `name`, the newest."""
        commands = self._broken[vehicle].commands
        commands[:] = [kept for kept in commands if kept[0] != name]
        commands.append((name, command))

    def mend(self, vehicle: ResourceId, now_us: int) -> None:
        """Restore a link: what waited is said and done, in order."""
        broken = self._broken.pop(vehicle, None)
        if broken is None:
            return
        for execution, outcome in broken.reports:
            self.report(execution, outcome)
        for _, command in broken.commands:
            command(now_us)

    def _emit(self, execution: Execution, outcome: Outcome) -> None:
        report = execution.next_report(outcome)
        if not self.muted:
            self.reports.put(report)
