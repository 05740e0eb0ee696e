"""The contract of arbiters, on simulated ONVIF cameras, over HTTP."""

import asyncio
from collections.abc import Mapping
from functools import partial
from typing import ClassVar

import pytest
from m2pem_plugin_ptz.arbiter import PtzArbiter
from m2pem_plugin_ptz.simulator.onvif.camera import CameraSpec
from m2pem_plugin_ptz.simulator.onvif.server import OnvifServer
from onvif_bench import ACCOUNT, write_credentials
from ptz_fake_camera import rad, vehicle

from m2pem.api import Connection, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.loopback import run_on_loopback

A, B = ResourceId("a/ptz"), ResourceId("b/ptz")


class _Over(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {
        "telemetry": "a camera that turns has a look, not a speed (test_ptz_arbiter)",
    }
    spec = CameraSpec(account=ACCOUNT, latency_s=0.01, rate_deg_s=60.0)
    reach: ClassVar[Mapping[str, object]] = {}

    @pytest.fixture
    def cameras(self):
        """Filled by `run`: they outlive the arbiters."""
        return {}

    @pytest.fixture
    def run(self, cameras):
        async def with_cameras(main, clock) -> None:
            now = asyncio.get_running_loop().time
            async with (
                OnvifServer(self.spec, monotonic=now) as cameras[A],
                OnvifServer(self.spec, monotonic=now) as cameras[B],
            ):
                await main(clock)

        return lambda main: run_on_loopback(partial(with_cameras, main))

    @pytest.fixture
    def make_arbiter(self, cameras, tmp_path):
        said = {
            "driver": "onvif",
            "host": "127.0.0.1",
            "credentials": str(write_credentials(tmp_path)),
            "pictures": str(tmp_path),
            "reach": self.reach,
        }

        def make(context):
            for name in ("a", "b"):
                context.bus.publish(vehicle(name, context.clock.now_us()))
            connections = {
                each: Connection(each, "ground", {**said, "port": camera.port})
                for each, camera in cameras.items()
            }
            return PtzArbiter(connections, context)

        return make

    @pytest.fixture
    def cut_link(self, cameras):
        return lambda _arbiter, camera: cameras[camera].faults.silent(True)

    @pytest.fixture
    def effects(self, cameras):
        return lambda _arbiter, camera: cameras[camera].camera.moves

    @pytest.fixture
    def is_arbiters(self):
        return lambda task: not task.get_coro().__qualname__.startswith("RequestHandler.")

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("ptz_scan_sector", {"heading": 0.0, "sector": rad(170), "speed": rad(4)}),
            short=("ptz_point_at", {"bearing": rad(60), "elevation": rad(-20)}),
            bad=("speed", -1.0),
            short_s=6.0,
            watch_s=3.0,
        )


class TestInDegrees(_Over):
    pass
