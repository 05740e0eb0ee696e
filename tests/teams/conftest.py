"""An executive in virtual time, with teams of carts or of simulated vehicles."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import pytest

from m2pem.api.arbiter import ArbiterContext, Connection
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.engine.records import BehaviorEnded, Record
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, LostMemberPolicy, Team, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Geometry, Route
from m2pem.plugins import PluginManager
from tests.executive.conftest import mission, sequence

from .carts import FRAME, ORIGIN, CartArbiter, WillingCartArbiter, Yard

START_US = 1_767_225_600_000_000


def route(*places: tuple[float, float]) -> Route:
    """A route through places in metres east and north of the origin."""
    return Route(tuple((*FRAME.to_latlon(place), None) for place in places))


def area(*corners: tuple[float, float]) -> Area:
    """A polygon with these corners."""
    ring = tuple((*FRAME.to_latlon(corner), None) for corner in corners)
    return Area(((*ring, ring[0]),))


def team_task(element: str, name: str, team: str = "crew", **parameters: str) -> tuple[str, str]:
    """A script task that commands a team behavior."""
    given = "".join(f'<m2pem:property name="{k}" value="{v}"/>' for k, v in parameters.items())
    return element, (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="team" name="{name}"><m2pem:properties>{given}</m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="crew" team="{team}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def one_task(name: str, **parameters: str) -> bytes:
    """A mission of one team behavior."""
    return mission(sequence(team_task("Task", name, **parameters)))


@dataclass
class World:
    """The executive under test and what surrounds it."""

    clock: VirtualClock
    executive: Executive
    yard: Yard
    seen: list[Record] = field(default_factory=list)

    def ended(self) -> list[BehaviorEnded]:
        """The ends of behaviors so far."""
        return [record for record in self.seen if isinstance(record, BehaviorEnded)]

    def arbiter(self, name: str) -> Any:
        """An arbiter of the fleet."""
        return self.executive.arbiters.by_name[name]

    async def until(self, true: Callable[[], bool], within_s: float = 600.0) -> None:
        """Wait for something to become true."""
        for _ in range(round(within_s * 10)):
            if true():
                return
            await self.clock.sleep(0.1)
        raise AssertionError(f"it was not so within {within_s:g} s; {self.seen[-5:]}")


class _Plugins(PluginManager):
    def __init__(self, yard: Yard, seen: list[Record]) -> None:
        super().__init__(block=("all",))
        self._yard = yard
        self._seen = seen

    def arbiter(self, name: str) -> Callable[..., Any]:
        kind = {"carts": CartArbiter, "willing": WillingCartArbiter}.get(name)
        if kind is not None:
            yard = self._yard

            def make(
                connections: Mapping[ResourceId, Connection], context: ArbiterContext
            ) -> CartArbiter:
                arbiter = kind(connections, context)
                arbiter.yard = yard
                return arbiter

            return make
        return super().arbiter(name)

    def records_committed(self, run_id: str, records: Any) -> None:
        self._seen.extend(records)


class Play(Protocol):
    """Runs `story(world)` in virtual time, with the carts of `yard`, all in the team `crew`.

    `arbiter`: of all, or by name. `domains`: of those that are no ground vehicles.
    """

    def __call__(
        self,
        story: Callable[[World], Awaitable[Any]],
        yard: Yard,
        *,
        arbiter: str | Mapping[str, str] = "carts",
        domains: Mapping[str, Domain] | None = None,
        geometries: Mapping[str, Geometry] | None = None,
        policy: LostMemberPolicy = LostMemberPolicy.STOP,
        others: tuple[str, ...] = (),
        journal: MemoryJournal | None = None,
        start_us: int = START_US,
        watch_links: bool = False,
    ) -> Any: ...


def fleet_of(
    names: Mapping[str, str],
    domains: Mapping[str, Domain],
    geometries: Mapping[str, Geometry],
    policy: LostMemberPolicy,
    others: tuple[str, ...],
    *,
    sooner: bool,
) -> Fleet:
    """Vehicles by name with their arbiters, and the team of all but `others`."""
    vehicles = {
        ResourceId(name): Vehicle(
            ResourceId(name),
            domains.get(name, Domain.GROUND),
            arbiter,
            {},
            # Sooner than carts' own arbiter says so, which is then too late.
            lost_after_s=1.0 if sooner else None,
        )
        for name, arbiter in names.items()
    }
    members = tuple(name for name in vehicles if name not in others)
    teams = {"crew": Team("crew", members, members[0], policy)}
    return Fleet("test", "test.yaml", vehicles, {}, teams, geometries, ORIGIN)


@pytest.fixture
def play() -> Play:
    """See `Play`."""

    def run(
        story: Callable[[World], Awaitable[Any]],
        yard: Yard,
        *,
        arbiter: str | Mapping[str, str] = "carts",
        domains: Mapping[str, Domain] | None = None,
        geometries: Mapping[str, Geometry] | None = None,
        policy: LostMemberPolicy = LostMemberPolicy.STOP,
        others: tuple[str, ...] = (),
        journal: MemoryJournal | None = None,
        start_us: int = START_US,
        watch_links: bool = False,
    ) -> Any:
        names = {
            name: arbiter if isinstance(arbiter, str) else arbiter[name] for name in yard.driven
        }
        fleet = fleet_of(names, domains or {}, geometries or {}, policy, others, sooner=watch_links)

        async def main(clock: VirtualClock) -> Any:
            seen: list[Record] = []
            executive = Executive(
                fleet,
                journal or MemoryJournal(),
                _Plugins(yard, seen),
                clock,
                watch_links=watch_links,
            )
            async with executive:
                return await story(World(clock, executive, yard, seen))

        return run_virtual(main, start_us)

    return run
