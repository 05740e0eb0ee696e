"""Arbiters on simulated autopilots, over real UDP."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

from m2pem_plugin_mavlink import Address, VehicleLink, open_link
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import SimulatedVehicle, Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

from m2pem.api import Clock, Connection, FleetBus, LocalFrame, ResourceId, offset
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context
from m2pem.testing.loopback import run_on_loopback

HOME = (47.397742, 8.545594)
HOME_ALTITUDE_M = 488.0
AMPLE_S = 800.0
"""Of a clock that is twenty times as fast."""

PATIENT = {"lost_after_s": 40.0}
"""Two seconds of the wall clock, at twenty times its speed: tests share their processors."""

MAVSDK_SPEED = 5.0
"""Its threads keep to the wall clock, also while the processors are busy: an exchange, which gives
up after 5 s of its own clock, has a second."""

DOMAINS = {Kind.COPTER: "air", Kind.ROVER: "ground", Kind.PLANE: "air", Kind.BOAT: "surface"}


def at(east: float, north: float) -> tuple[float, float]:
    """The place so far from the first vehicle's home."""
    return offset(HOME, east, north)


def specs(*kinds: Kind, **more: Any) -> list[VehicleSpec]:
    """Vehicles side by side, 20 m apart, that know soon where they are."""
    return [
        VehicleSpec(
            kind,
            system=number,
            home=Location(*at(0.0, 20.0 * (number - 1)), HOME_ALTITUDE_M),
            estimator_s=1.0,
            **more,
        )
        for number, kind in enumerate(kinds, 1)
    ]


def connections(
    simulator: Simulator, driver: str = "pymavlink", **more: Any
) -> dict[ResourceId, Connection]:
    """The vehicles of a simulator, as v1, v2 and so on; `more`: of their connections."""
    made = {}
    for vehicle in simulator:
        number, kind = vehicle.autopilot.spec.system, vehicle.autopilot.spec.kind
        resource = ResourceId(f"v{number}")
        host, port = vehicle.address
        url = f"udpout://{host}:{port}"
        settings = {"driver": driver, "url": url, "system_id": number}
        made[resource] = Connection(resource, DOMAINS[kind], settings, **{**PATIENT, **more})
    return made


@asynccontextmanager
async def ground_station(simulator: Simulator, clock: Clock) -> AsyncIterator[VehicleLink]:
    """A link to the first vehicle beside that of its arbiter."""
    host, port = simulator[1].address
    link = await open_link(Address(1, 1), [f"udpout://{host}:{port}"], clock)
    try:
        yield link
    finally:
        await link.close()


class Bench(ArbiterHarness):
    """A bench that knows where its vehicles really are."""

    simulator: Simulator
    bus: FleetBus

    def truth(self, number: int = 1) -> SimulatedVehicle:
        """A vehicle as it really is."""
        return self.simulator[number]

    def level(self, number: int = 1) -> tuple[float, float]:
        """East and north of the first home."""
        where = self.truth(number).location
        return LocalFrame(HOME).to_local((where.latitude_deg, where.longitude_deg))

    async def do(self, id_: str, behavior: str, vehicle: str = "v1", **parameters: Any) -> None:
        """Start it and see it succeed."""
        await self.start(id_, behavior, vehicle, **parameters)
        end = await self.ended(id_, AMPLE_S)
        assert end.state == "SUCCEEDED", end

    async def stands(self, number: int = 1) -> tuple[float, float]:
        """Wait until a vehicle stands; where."""
        truth = self.truth(number)
        places = [self.level(number)]
        async with asyncio.timeout(AMPLE_S / 20):
            while (
                len(places) < 6 or max(math.dist(places[-1], each) for each in places[-6:]) > 0.02
            ):
                stepped_s = truth.autopilot.now_s
                await self.simulator.until(lambda: truth.autopilot.now_s > stepped_s + 0.5)  # noqa: B023
                places.append(self.level(number))
        return places[-1]


def fly(
    main: Callable[[Bench], Awaitable[None]], *kinds: Kind, speed: float = 20.0, **more: Any
) -> None:
    """Run `main` with an arbiter on simulated vehicles."""

    async def run(clock: Clock) -> None:
        async with Simulator(specs(*kinds), speed=speed, to=None) as simulator:
            lent = context(clock)
            arbiter = MavlinkArbiter(connections(simulator, **more), lent)
            async with Bench(arbiter, clock) as bench:
                bench.simulator, bench.bus = simulator, lent.bus
                await main(bench)

    if more.get("driver") == "mavsdk":  # its threads wait for real time to pass
        asyncio.run(run(SystemClock(speed)))
    else:
        run_on_loopback(run, speed)
