"""A bench for simulated vehicles in virtual time."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import pytest

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock
from m2pem.executive.clock import run_virtual
from m2pem.model.catalogue import ResourceId
from m2pem.sim.arbiters import SimArbiter
from m2pem.testing.contracts.bench import ArbiterBench, context

START_US = 1_767_225_600_000_000

Simulate = Callable[..., None]


def connection(resource: str, domain: str, settings: Mapping[str, Any]) -> Connection:
    detector = bool(settings.get("detector"))
    return Connection(ResourceId(resource), domain, settings, detector=detector)


def make(clock: Clock, fleet: Mapping[str, tuple[str, Mapping[str, Any]]], **kw: Any) -> SimArbiter:
    """Resources by id, each with its domain and settings."""
    connections = {
        ResourceId(name): connection(name, domain, settings)
        for name, (domain, settings) in fleet.items()
    }
    teams = {"team": tuple(r for r in connections if "/" not in r)}
    return SimArbiter(connections, context(clock, teams), **kw)


@pytest.fixture
def simulate() -> Simulate:
    """Runs a test with a connected arbiter: `simulate(fleet, main)`."""

    def run(
        fleet: Mapping[str, tuple[str, Mapping[str, Any]]],
        main: Callable[[ArbiterBench, SimArbiter], Awaitable[None]],
        **options: Any,
    ) -> None:
        async def connected(clock: Clock) -> None:
            arbiter = make(clock, fleet, **{"telemetry_hz": 0.0, **options})
            async with ArbiterBench(arbiter, clock) as bench:
                await main(bench, arbiter)

        run_virtual(connected, START_US)

    return run
