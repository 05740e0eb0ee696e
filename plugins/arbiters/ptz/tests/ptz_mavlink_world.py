"""A camera driver on a simulated autopilot, over real UDP."""

import asyncio
import logging
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.camera import Camera
from m2pem_plugin_mavlink.simulator.gimbal import Gimbal
from m2pem_plugin_mavlink.simulator.simulator import SimulatedVehicle, Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_ptz.drivers.driver import DriverSetup
from m2pem_plugin_ptz.drivers.mavlink import MavlinkDriver
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.settings import DriverName, Settings

from m2pem.api import ArbiterContext, Connection, ResourceId, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.telemetry.bus import Bus
from m2pem.testing.loopback import loop_clock

SPEED = 10.0
AMPLE_S = 40.0
VEHICLE, CAMERA = ResourceId("v1"), ResourceId("v1/ptz")
REACH = Reach(zoom_max=11.0, rate_rad_s=2.0)


async def until(true: Callable[[], bool]) -> None:
    """Wait until something is so, or fail."""
    async with asyncio.timeout(AMPLE_S):
        while not true():  # noqa: ASYNC110  # what is waited for has no event
            await asyncio.sleep(0.005)


@dataclass
class World:
    """The driver, and what is true of its camera."""

    driver: MavlinkDriver
    real: SimulatedVehicle
    clock: SystemClock
    bus: Bus
    heard: list[float] = field(default_factory=list)

    @property
    def gimbal(self) -> Gimbal:
        (found,) = (each for each in self.real.autopilot.components if isinstance(each, Gimbal))
        return found

    @property
    def camera(self) -> Camera:
        (found,) = (each for each in self.real.autopilot.components if isinstance(each, Camera))
        return found

    @property
    def truly_deg(self) -> tuple[float, float]:
        """Pan from the bow and tilt from the horizon, as it really is."""
        pointing = self.gimbal.pointing
        return math.degrees(pointing.yaw_rad), math.degrees(pointing.pitch_rad)

    async def ready(self, behavior: str = "ptz_point_at") -> None:
        await until(lambda: self.driver.refusal(behavior) == "")
        if behavior.startswith("ptz"):
            await until(lambda: self.driver.ptz is not None)

    async def stands(self) -> tuple[float, float]:
        """Wait until it has not turned for half a second of its own time; where it points."""
        async with asyncio.timeout(AMPLE_S):
            while True:
                before, flown = self.truly_deg, self.real.autopilot
                since_s = flown.now_s
                await until(lambda: flown.now_s > since_s + 0.5)  # noqa: B023
                if self.truly_deg == pytest.approx(before, abs=0.1):
                    return self.truly_deg

    def is_at(self, pan_deg: float, tilt_deg: float, within_deg: float = 0.6) -> bool:
        pan, tilt = self.truly_deg
        return abs(pan - pan_deg) < within_deg and abs(tilt - tilt_deg) < within_deg

    def point(self, pan_deg: float, tilt_deg: float, rate_deg_s: float | None = None) -> None:
        rate = None if rate_deg_s is None else math.radians(rate_deg_s)
        self.driver.point(math.radians(pan_deg), math.radians(tilt_deg), rate)

    def vehicle_is(self, **state: Any) -> None:
        """What the arbiter of the vehicle says of it."""
        self.bus.publish(VehicleState(VEHICLE, self.clock.now_us(), **state))


def make_seat(
    settings: dict[str, Any], clock: SystemClock, heard: Callable[[], None], **more: Any
) -> DriverSetup:
    context = ArbiterContext(clock, Bus(), logging.getLogger("test"), (47.4, 8.5, 488.0))
    own = Settings(DriverName.MAVLINK, REACH, own=settings, **{"stabilized": True, **more})
    return DriverSetup(Connection(CAMERA, "air", settings), own, context, heard)


@asynccontextmanager
async def world(
    kind: Kind = Kind.COPTER,
    *,
    to: tuple[str, int] | None = None,
    spec: dict[str, Any] | None = None,
    own: dict[str, Any] | None = None,
    **more: Any,
) -> AsyncIterator[World]:
    """A vehicle with gimbal and camera. `own`: of the connection; `more`: of its settings."""
    what = {"gimbal": True, "camera": True, "heading_deg": 90.0, **(spec or {})}
    async with Simulator(
        [VehicleSpec(kind, **what, estimator_s=6.0)], speed=SPEED, to=to
    ) as simulator:
        real = simulator[1]
        host, port = real.address
        clock = loop_clock(SPEED)
        heard: list[float] = []
        connection = {"url": f"udpout://{host}:{port}", "system_id": 1, **(own or {})}
        setup = make_seat(connection, clock, lambda: heard.append(clock.now_us() / 1e6), **more)
        driver = MavlinkDriver(setup)
        await driver.open()
        try:
            bus = setup.context.bus
            assert isinstance(bus, Bus)
            yield World(driver, real, clock, bus, heard)
        finally:
            await driver.close()
