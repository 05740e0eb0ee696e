"""Running an executive, or one mission on it, in the tests of plugins."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from m2pem.api.clock import Clock, SystemClock
from m2pem.api.control import MissionControl
from m2pem.api.runs import OpenPrompt, RunSummary, StampedRecord
from m2pem.engine.records import Record, TokenEntered
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

Factories = Mapping[str, Callable[..., Any]]


class _WithMore(PluginManager):
    """The installed plugins, and those that a test adds under names of its own."""

    def __init__(self, arbiters: Factories, services: Factories) -> None:
        super().__init__()
        self._arbiters = dict(arbiters)
        self._services = dict(services)

    def arbiter(self, name: str) -> Callable[..., Any]:
        return self._arbiters.get(name) or super().arbiter(name)

    def service(self, name: str) -> Callable[[], Any]:
        return self._services.get(name) or super().service(name)


@asynccontextmanager
async def run_executive(
    fleet: Fleet,
    *,
    clock: Clock | None = None,
    speed: float = 1.0,
    simulated: bool = False,
    arbiters: Factories | None = None,
    services: Factories | None = None,
    serves_schedule: bool = False,
) -> AsyncIterator[MissionControl]:
    """Run an executive with a journal in memory; at the end all runs are stopped.

    `clock`: a wall clock of `speed`, unless one is given. `simulated`: the simulated arbiter
    replaces every arbiter. `arbiters`, `services`: factories by name, beside those of the installed
    plugins, so that a tested plugin need not be installed. `serves_schedule`: it starts scheduled
    missions.

    Raises:
        PluginError: the fleet names an arbiter that no plugin offers, or one cannot connect.
    """
    executive = Executive(
        simulated_fleet(fleet) if simulated else fleet,
        MemoryJournal(),
        _WithMore(arbiters or {}, services or {}),
        clock or SystemClock(speed),
        speed=speed,
    )
    async with executive:
        if serves_schedule:
            await executive.load_schedule()
            executive.serve_schedule()
        yield executive.control


@dataclass(frozen=True, slots=True)
class MissionResult:
    """The result of a mission."""

    summary: RunSummary
    stamped: Sequence[StampedRecord]

    @property
    def records(self) -> list[Record]:
        """The records, without their stamps."""
        return [each.record for each in self.stamped]

    @property
    def visited(self) -> list[str]:
        """Ids of the elements that were entered, in order."""
        return [record.element for record in self.records if isinstance(record, TokenEntered)]

    def of(self, name: str) -> list[Any]:
        """The records of a name: "BehaviorEnded"."""
        return [record for record in self.records if type(record).__name__ == name]


async def run_mission_on(
    control: MissionControl, mission: bytes, answers: Mapping[str, str] | None = None
) -> MissionResult:
    """Run a mission to its end. `answers`: decisions by the id of the user task."""
    events = control.subscribe()
    run = await control.start(mission, by="test")
    answering = asyncio.create_task(_answer(control, events, answers or {}))
    try:
        summary = await control.wait(run)
    finally:
        answering.cancel()
    return MissionResult(summary, await control.records(run, limit=1_000_000))


def run_mission(
    mission: bytes,
    fleet: Fleet,
    *,
    answers: Mapping[str, str] | None = None,
    within_s: float = 60.0,
    **options: Any,
) -> MissionResult:
    """Run a mission to its end on an executive of its own, within `within_s` real seconds.

    `answers`: decisions by the id of the user task; the first one of all others. `options` are
    those of `run_executive`.

    Raises:
        MissionError: the mission does not fit the fleet, with every finding.
        TimeoutError: it did not end.
    """

    async def main() -> MissionResult:
        async with asyncio.timeout(within_s), run_executive(fleet, **options) as control:
            return await run_mission_on(control, mission, answers)

    return asyncio.run(main())


async def _answer(
    control: MissionControl, events: AsyncIterator[Any], answers: Mapping[str, str]
) -> None:
    async for event in events:
        if isinstance(event, OpenPrompt):
            decision = answers.get(event.element, event.decisions[0].value)
            await control.answer(event.run, event.prompt, decision, by="test")
