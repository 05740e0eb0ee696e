"""A rehearsal of a team of simulated vehicles that is looked at while it goes on."""

import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.engine.records import BehaviorEnded, Record
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import (
    Domain,
    Fleet,
    LostMemberPolicy,
    Payload,
    Team,
    Vehicle,
    simulated_fleet,
)
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Geometry
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import SETTINGS
from m2pem.simulation.arbiters import SimArbiter

from .carts import FRAME, ORIGIN
from .conftest import START_US

Places = Mapping[str, tuple[float, float]]


def sim_fleet(
    places: Places,
    geometries: Mapping[str, Geometry],
    *,
    policy: LostMemberPolicy = LostMemberPolicy.STOP,
    settings: Mapping[str, Mapping[str, Any]] | None = None,
    domains: Mapping[str, Domain] | None = None,
    others: tuple[str, ...] = (),
) -> Fleet:
    """Simulated vehicles that look east, each with a camera; all but `others` are team `crew`."""
    vehicles = {}
    payloads = {}
    for name, place in places.items():
        vehicle, camera = ResourceId(name), ResourceId(f"{name}/cam")
        own = {
            "home": [*FRAME.to_latlon(place)],
            "heading": "90 deg",
            **(settings or {}).get(name, {}),
        }
        domain = (domains or {}).get(name, Domain.GROUND)
        vehicles[vehicle] = Vehicle(vehicle, domain, "sim", own, payloads=(camera,))
        payloads[camera] = Payload(camera, vehicle, "sim", {"kind": "ptz"})
    members = tuple(name for name in vehicles if name not in others)
    crew = Team("crew", members, members[0], policy)
    return Fleet("test", "test.yaml", vehicles, payloads, {"crew": crew}, geometries, ORIGIN)


@dataclass
class Rehearsed:
    """What goes on. `seen`: the records so far, `at_us`: when each was committed."""

    clock: VirtualClock
    executive: Executive
    seen: list[Record] = field(default_factory=list)
    at_us: list[int] = field(default_factory=list)

    @property
    def sim(self) -> SimArbiter:
        """The arbiter of all."""
        arbiter = self.executive.arbiters.by_name["sim"]
        assert isinstance(arbiter, SimArbiter)
        return arbiter

    def ended(self) -> list[BehaviorEnded]:
        """The ends of behaviors so far."""
        return [record for record in self.seen if isinstance(record, BehaviorEnded)]

    def place(self, name: str) -> tuple[float, float]:
        """Where a vehicle is, in metres; it must be heard."""
        state = self.sim.sight(ResourceId(name))
        assert state is not None and state.position is not None, name
        return FRAME.to_local(state.position.latlon)

    def speed_m_s(self, name: str) -> float:
        """How fast a vehicle is; it must be heard."""
        state = self.sim.sight(ResourceId(name))
        assert state is not None, name
        return math.hypot(*(state.velocity_enu_m_s or (0.0,)))

    async def until_ended(self, look: Callable[[], Any] = lambda: None, *, count: int = 1) -> None:
        """Wait for the end of behaviors, and look five times a second until then."""
        for _ in range(5 * 3600):
            if len(self.ended()) >= count:
                return
            look()
            await self.clock.sleep(0.2)
        raise AssertionError(f"it had not ended in an hour; {self.seen[-5:]}")


class _Plugins(PluginManager):
    def __init__(self, told: Callable[[Any], None], kind: type[SimArbiter]) -> None:
        super().__init__(block=("all",))
        self._told = told
        self._kind = kind

    def arbiter(self, name: str) -> Callable[..., Any]:
        return self._kind if name == "sim" else super().arbiter(name)

    def records_committed(self, run_id: str, records: Any) -> None:
        self._told(records)


def rehearsed(
    fleet: Fleet,
    story: Callable[[Rehearsed], Awaitable[Any]],
    settings: Mapping[str, Any] = SETTINGS,
    kind: type[SimArbiter] = SimArbiter,
) -> Any:
    """Run a story in virtual time, with telemetry as a rehearsal has it: of changes alone.

    `kind`: of the arbiter of all.
    """

    async def main(clock: VirtualClock) -> Any:
        seen: list[Record] = []
        at_us: list[int] = []

        def told(records: Any) -> None:
            seen.extend(records)
            at_us.extend(clock.now_us() for _ in records)

        executive = Executive(
            simulated_fleet(fleet, settings),
            MemoryJournal(),
            _Plugins(told, kind),
            clock,
            watch_links=False,
        )
        async with executive:
            return await story(Rehearsed(clock, executive, seen, at_us))

    return run_virtual(main, START_US)
