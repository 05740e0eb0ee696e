"""The contract of arbiters, on the gimbals of simulated autopilots, over real UDP."""

import math
from typing import ClassVar

import pytest
from m2pem_plugin_mavlink.simulator.gimbal import Gimbal
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_ptz.arbiter import PtzArbiter

from m2pem.api import Connection, GeoPosition, ResourceId, VehicleState
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.loopback import run_on_loopback

A, B = ResourceId("v1/ptz"), ResourceId("v2/ptz")
NUMBERS = {A: 1, B: 2}
SPEED = 10.0
STOOD_S = 0.5


class CountedMotions:
    """Sees a gimbal begin to move."""

    def __init__(self, gimbal: Gimbal) -> None:
        self.begun = 0
        self._stands_s = STOOD_S
        step = gimbal.step

        def counted(dt_s: float) -> None:
            before = gimbal.pointing.pitch_rad, gimbal.pointing.yaw_rad
            step(dt_s)
            after = gimbal.pointing.pitch_rad, gimbal.pointing.yaw_rad
            if math.dist(before, after) < 1e-6:
                self._stands_s += dt_s
            else:
                self.begun += self._stands_s >= STOOD_S
                self._stands_s = 0.0

        gimbal.step = counted  # type: ignore[method-assign]


class _Gimbals(ArbiterContract):
    """The vehicles are simulated in the same event loop, and outlive the arbiters."""

    unsupported: ClassVar = {"telemetry": "a camera that turns has a look, not a speed"}
    kind = Kind.COPTER
    firmware = "ardupilot"

    @pytest.fixture
    def simulator(self):
        spec = {"gimbal": True, "camera": True, "firmware": self.firmware}
        specs = [
            VehicleSpec(self.kind, system=number, **spec, estimator_s=6.0) for number in (1, 2)
        ]
        return Simulator(specs, speed=SPEED, to=None)

    @pytest.fixture
    def run(self, simulator):
        def run(main) -> None:
            async def on_vehicles(clock) -> None:
                async with simulator:
                    await main(clock)

            run_on_loopback(on_vehicles, SPEED)

        return run

    @pytest.fixture
    def motions(self, simulator):
        found = {}
        for camera, number in NUMBERS.items():
            parts = simulator[number].autopilot.components
            (gimbal,) = (each for each in parts if isinstance(each, Gimbal))
            found[camera] = CountedMotions(gimbal)
        return found

    @pytest.fixture
    def make_arbiter(self, simulator, motions, tmp_path):
        def connection(camera: ResourceId) -> Connection:
            host, port = simulator[NUMBERS[camera]].address
            settings = {
                "driver": "mavlink",
                "url": f"udpout://{host}:{port}",
                "system_id": NUMBERS[camera],
                "stabilized": True,
                "pictures": str(tmp_path),
                "reach": {"rate": "60 deg/s"},
            }
            return Connection(camera, "air", settings, lost_after_s=8.0)

        def make(context):
            for camera in NUMBERS:
                vehicle = ResourceId(camera.partition("/")[0])
                place = GeoPosition(47.397742, 8.545594, 488.0)
                now_us = context.clock.now_us()
                north = {"yaw_rad": math.pi / 2, "velocity_enu_m_s": (0.0, 0.0, 0.0)}
                context.bus.publish(VehicleState(vehicle, now_us, place, **north))
            return PtzArbiter({each: connection(each) for each in NUMBERS}, context)

        return make

    @pytest.fixture
    def cut_link(self, simulator):
        def cut(_arbiter, camera) -> None:
            port = simulator[NUMBERS[camera]].port
            port.outward.carry = port.inward.carry = lambda *_: None

        return cut

    @pytest.fixture
    def effects(self, motions):
        return lambda _arbiter, camera: motions[camera].begun

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=(
                "ptz_scan_sector",
                {"heading": 0.0, "sector": math.radians(170), "speed": math.radians(3)},
            ),
            short=("ptz_point_at", {"bearing": math.radians(150), "elevation": -0.4}),
            bad=("speed", -1.0),
            short_s=25.0,
        )


class TestGimbalsOfCopters(_Gimbals):
    pass


@pytest.mark.long
class TestGimbalsOfRovers(_Gimbals):
    kind = Kind.ROVER


class TestGimbalsOfPx4Copters(_Gimbals):
    firmware = "px4"
    quick: ClassVar = {"test_a_cut_link_is_lost_within_the_declared_bound"}
