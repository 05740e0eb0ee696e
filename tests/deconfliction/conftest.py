"""An executive in virtual time with simulated aircraft, some of them in a team."""

import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.telemetry import VehicleState
from m2pem.engine.records import BehaviorEnded, BehaviorProgressed, Record
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Team, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Geometry
from m2pem.plugins import PluginManager
from tests.executive.conftest import mission, sequence

from .sky import FRAME, GROUND_M

START_US = 1_767_225_600_000_000
ORIGIN = (*FRAME.to_latlon((0.0, 0.0)), GROUND_M)
Homes = Mapping[str, tuple[float, float]]


def task(element: str, name: str, who: str, **parameters: str) -> tuple[str, str]:
    """A script task; `who` is a vehicle, or the team `crew`."""
    given = "".join(f'<m2pem:property name="{k}" value="{v}"/>' for k, v in parameters.items())
    kind = "team" if who == "crew" else "vehicle"
    return element, (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="{kind}" name="{name}"><m2pem:properties>{given}</m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="doer" {kind}="{who}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


@dataclass
class World:
    """The executive under test and what surrounds it."""

    clock: VirtualClock
    executive: Executive
    seen: list[Record] = field(default_factory=list)

    async def begin(self, *tasks: tuple[str, str]) -> str:
        """Start a mission of these tasks in a row."""
        return await self.executive.control.start(mission(sequence(*tasks)))

    async def all_of(self, *tasks: tuple[str, str]) -> None:
        """Run a mission to its end; all its behaviors must be allowed."""
        run = await self.begin(*tasks)
        await self.executive.control.wait(run)
        assert {end.state for end in self.ends(run)} == {BehaviorState.SUCCEEDED}, self.ends(run)

    async def refused(self, *tasks: tuple[str, str]) -> str:
        """Run a mission whose last behavior must be refused; why it was."""
        run = await self.begin(*tasks)
        await self.executive.control.wait(run)
        end = self.ends(run)[-1]
        assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED"), self.ends(run)
        return end.reason

    async def under_way(self, run: str, behavior: int = 1) -> None:
        """Wait until a behavior goes on."""
        await self.until(lambda: BehaviorState.RUNNING in self.states(f"{run}.b{behavior}"))

    def states(self, behavior: str) -> list[BehaviorState]:
        """What was reported of a behavior that goes on."""
        told = (each for each in self.seen if isinstance(each, BehaviorProgressed))
        return [each.state for each in told if each.behavior == behavior]

    def ends(self, run: str) -> list[BehaviorEnded]:
        """How its behaviors ended."""
        ended = [each for each in self.seen if isinstance(each, BehaviorEnded)]
        return [each for each in ended if each.behavior.startswith(f"{run}.")]

    async def until(self, true: Callable[[], bool], within_s: float = 600.0) -> None:
        """Wait for something to become true."""
        for _ in range(round(within_s * 10)):
            if true():
                return
            await self.clock.sleep(0.1)
        raise AssertionError(f"it was not so within {within_s:g} s; {self.seen[-5:]}")

    def place(self, name: str) -> tuple[float, float, float]:
        """Where a vehicle says it is: east, north, above the ground."""
        state = self.executive.bus.latest(ResourceId(name))
        assert isinstance(state, VehicleState)
        assert state.position is not None
        where = FRAME.to_local(state.position.latlon)
        return (*where, state.position.altitude_m - GROUND_M)

    def apart_m(self, one: str, other: str) -> tuple[float, float]:
        """On the map, and in height."""
        a, b = self.place(one), self.place(other)
        return math.dist(a[:2], b[:2]), abs(a[2] - b[2])


class _Plugins(PluginManager):
    def __init__(self, seen: list[Record]) -> None:
        super().__init__(block=("all",))
        self._seen = seen

    def records_committed(self, run_id: str, records: Any) -> None:
        self._seen.extend(records)


class Play(Protocol):
    """Runs `story(world)` in virtual time; all but `others` are in the team
    `crew`. `settings`: of all connections; `own`: of that of each vehicle."""

    def __call__(
        self,
        story: Callable[[World], Awaitable[Any]],
        homes: Homes,
        *,
        geometries: Mapping[str, Geometry] | None = None,
        policy: Mapping[str, Any] | None = None,
        ground: tuple[str, ...] = (),
        others: tuple[str, ...] = (),
        settings: Mapping[str, Any] | None = None,
        own: Mapping[str, Mapping[str, Any]] | None = None,
        watch_links: bool = False,
        manned: tuple[str, ...] = (),
        journal: MemoryJournal | None = None,
        start_us: int = START_US,
    ) -> Any: ...


@pytest.fixture
def play(tmp_path: Path) -> Play:
    """See `Play`."""

    def run(
        story: Callable[[World], Awaitable[Any]],
        homes: Homes,
        *,
        geometries: Mapping[str, Geometry] | None = None,
        policy: Mapping[str, Any] | None = None,
        ground: tuple[str, ...] = (),
        others: tuple[str, ...] = (),
        settings: Mapping[str, Any] | None = None,
        own: Mapping[str, Mapping[str, Any]] | None = None,
        watch_links: bool = False,
        manned: tuple[str, ...] = (),
        journal: MemoryJournal | None = None,
        start_us: int = START_US,
    ) -> Any:
        vehicles = {}
        for name, home in homes.items():
            domain = Domain.GROUND if name in ground else Domain.AIR
            given = {"home": [*FRAME.to_latlon(home)], **(settings or {})}
            given |= (own or {}).get(name, {})
            vehicles[ResourceId(name)] = Vehicle(
                ResourceId(name), domain, "sim", given, manned=name in manned
            )
        members = tuple(name for name in vehicles if name not in (*others, *manned))
        fleet = Fleet(
            "test",
            "test.yaml",
            vehicles,
            {},
            {"crew": Team("crew", members, members[0])},
            geometries or {},
            ORIGIN,
            **{"vertical_separation_m": 10.0, **(policy or {})},
        )

        async def main(clock: VirtualClock) -> Any:
            seen: list[Record] = []
            executive = Executive(
                fleet, journal or MemoryJournal(), _Plugins(seen), clock, watch_links=watch_links
            )
            async with executive:
                return await story(World(clock, executive, seen))

        return run_virtual(main, start_us)

    return run
