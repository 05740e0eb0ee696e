"""A bench for simulated vehicles in virtual time."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from typing import Any, Protocol, TypeAlias
from uuid import UUID

import pytest

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock, run_virtual
from m2pem.api.telemetry import GeoPosition
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Coordinate, Route
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.frame import FlatFrame
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import JOURNAL, ORIGIN, ArbiterHarness, context

START_US = 1_767_225_600_000_000

Fleet: TypeAlias = Mapping[str, tuple[str, Mapping[str, Any]]]
"""Resources by id, each with its domain and settings."""

Main: TypeAlias = Callable[[ArbiterHarness, SimArbiter], Awaitable[None]]


class Simulate(Protocol):
    """Runs a test with a connected arbiter in virtual time; `options` go to `make`."""

    def __call__(self, fleet: Fleet, main: Main, **options: Any) -> None: ...


def connection(resource: str, domain: str, settings: Mapping[str, Any]) -> Connection:
    detector = bool(settings.get("detector"))
    return Connection(ResourceId(resource), domain, settings, detector=detector)


def make(
    clock: Clock, fleet: Fleet, journal: UUID = JOURNAL, bus: Bus | None = None, **kw: Any
) -> SimArbiter:
    """An arbiter, not connected; all vehicles are the team "team"."""
    connections = {
        ResourceId(name): connection(name, domain, settings)
        for name, (domain, settings) in fleet.items()
    }
    teams = {"team": tuple(r for r in connections if "/" not in r)}
    lent = replace(context(clock, teams), journal=journal, bus=bus or Bus())
    return SimArbiter(connections, lent, **kw)


@pytest.fixture
def simulate() -> Simulate:
    """Runs a test with a connected arbiter: `simulate(fleet, main)`."""

    def run(
        fleet: Fleet,
        main: Main,
        **options: Any,
    ) -> None:
        async def connected(clock: Clock) -> None:
            arbiter = make(clock, fleet, **{"telemetry_hz": 0.0, **options})
            async with ArbiterHarness(arbiter, clock) as bench:
                await main(bench, arbiter)

        run_virtual(connected, START_US)

    return run


def position(east_m: float, north_m: float) -> GeoPosition:
    """A position so far from the origin of the bench, at its height."""
    return FlatFrame(ORIGIN).to_position((east_m, north_m, 0.0))


def place(east_m: float, north_m: float, altitude_m: float | None = None) -> Coordinate:
    """A coordinate so far from the origin of the bench."""
    geo = position(east_m, north_m)
    return geo.latitude_deg, geo.longitude_deg, altitude_m


def route(*places: tuple[float, ...]) -> Route:
    """A route through places, in metres east and north (and up) of the origin."""
    return Route(tuple(place(*at) for at in places))


def area(*corners: tuple[float, float]) -> Area:
    """A polygon, in metres east and north of the origin."""
    ring = tuple(place(*corner) for corner in corners)
    return Area(((*ring, ring[0]),))


def local(position: GeoPosition | None) -> tuple[float, float]:
    """Metres east and north of the origin."""
    assert position is not None
    return FlatFrame(ORIGIN).to_place(position.latlon)
