"""The contract of arbiters, on simulated ONVIF cameras, over HTTP, with faster clocks."""

import asyncio
import threading
import time
from collections.abc import Mapping
from typing import ClassVar

import pytest
from m2pem_plugin_ptz.arbiter import PtzArbiter
from m2pem_plugin_ptz.simulator.onvif.camera import CameraSpec
from m2pem_plugin_ptz.simulator.onvif.server import OnvifServer
from onvif_bench import ACCOUNT, write_credentials
from ptz_fake_camera import rad, vehicle

from m2pem.api import Connection, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("a/ptz"), ResourceId("b/ptz")
SPEED = 3.0


class _Cameras:
    """Two cameras in a thread of their own: they outlive the event loop of a test."""

    def __init__(self, spec: CameraSpec) -> None:
        self.servers = {
            each: OnvifServer(spec, monotonic=lambda: time.monotonic() * SPEED) for each in (A, B)
        }
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)

    def __enter__(self):
        self._thread.start()
        for server in self.servers.values():
            self._do(server.__aenter__())
        return self

    def __exit__(self, *_):
        for server in self.servers.values():
            self._do(server.__aexit__(None, None, None))
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _do(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(40)

    def silence(self, camera):
        self._loop.call_soon_threadsafe(self.servers[camera].faults.silent, True)


@pytest.fixture(scope="module")
def descriptions():
    """The library reads its service descriptions once; the clock should not run meanwhile."""
    from onvif.client import ONVIFCamera

    async def read():
        for name in ("devicemgmt", "media", "ptz", "recording"):
            async with OnvifServer(CameraSpec(latency_s=0.0)) as server:
                found = ONVIFCamera("127.0.0.1", server.port, "", "", no_cache=True)
                await found.update_xaddrs()
                await found.create_onvif_service(name)
                await found.close()

    asyncio.run(read())


class _Over(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {
        "telemetry": "a camera that turns has a look, not a speed (test_ptz_arbiter)",
        "virtual clock": "HTTP takes real time",
    }
    speed = SPEED
    spec = CameraSpec(account=ACCOUNT, latency_s=0.01, rate_deg_s=60.0)
    reach: ClassVar[Mapping[str, object]] = {}

    @pytest.fixture
    def cameras(self, descriptions):
        with _Cameras(self.spec) as cameras:
            yield cameras

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
            ports = {each: server.port for each, server in cameras.servers.items()}
            connections = {
                each: Connection(each, "ground", {**said, "port": ports[each]}) for each in ports
            }
            return PtzArbiter(connections, context)

        return make

    @pytest.fixture
    def cut_link(self, cameras):
        return lambda _arbiter, camera: cameras.silence(camera)

    @pytest.fixture
    def effects(self, cameras):
        return lambda _arbiter, camera: cameras.servers[camera].camera.moves

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
