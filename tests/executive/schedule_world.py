"""An executive that serves a schedule in virtual time; a test says what its arbiter does."""

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any

from m2pem.api.clock import VirtualClock
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.runs import NOT_STARTED, SCHEDULE, STARTS_SOON, Alert, RunId
from m2pem.api.schedule import ScheduledMission, When
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet
from m2pem.journal import Journal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

from .conftest import START_US, FakePlugins, Fakes, behavior, fleet, mission, sequence

UTC_START = datetime.fromisoformat("2026-01-01T00:00:00+00:00")
"""What `START_US` is."""


def at(seconds: float) -> str:
    """The date that is so long after the beginning of a test."""
    return (UTC_START + timedelta(seconds=seconds)).isoformat()


def drive(*vehicles: str) -> bytes:
    """A mission in which each of these vehicles drives, one after the other."""
    tasks = [(f"Drive_{name}", behavior(f"Drive_{name}", "drive_stop", name)) for name in vehicles]
    return mission(sequence(*tasks))


def attended_fleet(*names: str) -> Fleet:
    """A fleet whose vehicles may not start unattended."""
    return fleet(*names)


def unattended_fleet(*names: str, warning_s: float = 0.0) -> Fleet:
    """A fleet whose vehicles may start unattended."""
    return replace(fleet(*names), unattended=True, start_warning_s=warning_s)


@dataclass
class Scheduling:
    """The executive under test. `alerts`: those about the schedule, with their seconds."""

    clock: VirtualClock
    executive: Executive
    fake: FakeArbiter
    journal: Journal
    alerts: list[tuple[float, str]] = field(default_factory=list)

    @property
    def now_s(self) -> float:
        """Seconds since the beginning of the test."""
        return (self.clock.now_us() - START_US) / 1_000_000

    async def at(self, seconds: float) -> None:
        """Wait until so long after the beginning of the test."""
        await self.clock.sleep_until(START_US + round(seconds * 1_000_000))

    async def schedule(self, source: bytes, priority: int = 0, by: str = "ada", **when: Any) -> str:
        """Schedule a mission."""
        return await self.executive.control.schedule(
            source, when=When(**when), priority=priority, by=by
        )

    async def entry(self, number: str) -> ScheduledMission:
        """How an entry stands."""
        found = await self.executive.control.scheduled()
        return next(each for each in found.entries if each.entry == number)

    async def begun(self) -> dict[RunId, float]:
        """When each run of the journal began."""
        return {
            line.run: (line.started_us - START_US) / 1_000_000
            for line in await self.journal.runs()
            if line.last_seq
        }

    def drives_to_its_end(self, run: RunId) -> None:
        """Let the behavior of a run succeed."""
        self.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        self.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)

    async def end(self, run: RunId) -> None:
        """Let a run of one task end, and wait for that."""
        await self.fake.until_called("start", f"{run}.b1")
        self.drives_to_its_end(run)
        await self.executive.control.wait(run)

    def say(self, vehicle: str, battery: float = 1.0, **state: Any) -> None:
        """A vehicle sends telemetry."""
        self.fake.say(
            VehicleState(
                ResourceId(vehicle),
                self.clock.now_us(),
                battery_fraction=battery,
                link=state.pop("link", LinkState.CONNECTED),
                **state,
            )
        )

    def told(self) -> list[str]:
        """What operators were told of the schedule."""
        return [text for _, text in self.alerts]


@asynccontextmanager
async def serving(
    clock: VirtualClock,
    journal: Journal,
    of: Fleet,
    alerts: list[tuple[float, str]] | None = None,
    *,
    heard: bool = True,
    options: Mapping[str, Any] | None = None,
) -> AsyncIterator[Scheduling]:
    """Serve a schedule. `heard`: each vehicle has sent telemetry."""
    fakes = Fakes()
    executive = Executive(
        of, journal, FakePlugins(fakes, []), clock, watch_links=False, **(options or {})
    )
    async with executive:
        world = Scheduling(
            clock, executive, fakes.made[0], journal, alerts if alerts is not None else []
        )

        async def listen(events: AsyncIterator[ControlEvent]) -> None:
            async for event in events:
                if isinstance(event, Alert) and event.code in (SCHEDULE, STARTS_SOON, NOT_STARTED):
                    world.alerts.append((world.now_s, event.text))

        listening = asyncio.create_task(listen(executive.control.subscribe()))
        if heard:
            for name in of.vehicles:
                world.say(name)
            await clock.sleep(0.000_001)
        await executive.load_schedule()
        executive.serve_schedule()
        yield world
        listening.cancel()
