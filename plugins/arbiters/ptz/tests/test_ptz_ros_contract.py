"""The contract of arbiters, on simulated heads in another process, over real DDS."""

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, ClassVar
from uuid import UUID

import pytest
from m2pem_plugin_ptz.arbiter import PtzArbiter
from m2pem_plugin_ros.testing import Peer
from ptz_ros_watcher import Watcher
from ptz_ros_world import PEER

from m2pem.api import ArbiterContext, Connection, GeoPosition, ResourceId, VehicleState
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("ugv1/ptz"), ResourceId("ugv2/ptz")
JOURNAL = UUID("7a4f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f11")
"""The same after a restart."""


def settings(camera: ResourceId, domain: int) -> dict[str, Any]:
    return {"namespace": f"/{camera.partition('/')[0]}", "domain_id": domain}


@pytest.mark.long
class TestHeads(ArbiterContract):
    unsupported: ClassVar = {
        "virtual clock": "cameras are told over real DDS",
        "telemetry": "a camera that turns has a look, not a speed",
    }

    @pytest.fixture
    def watcher(self, ros_domain: int) -> Iterator[Watcher]:
        def peer(camera: ResourceId) -> Peer:
            said = json.dumps(settings(camera, ros_domain))
            return Peer(PEER, ros_domain, [camera, said, "no"])

        with peer(A), peer(B):
            watcher = Watcher(ros_domain, {A: "/ugv1", B: "/ugv2"})
            yield watcher
            watcher.close()

    @pytest.fixture
    def make_arbiter(self, ros_domain: int, watcher: Watcher, tmp_path) -> Any:
        said = {
            "driver": "ros",
            "pictures": str(tmp_path),
            "reach": {
                "pan": ["-160 deg", "160 deg"],
                "tilt": ["-85 deg", "45 deg"],
                "rate": "2 rad/s",
            },
        }

        def make(context: ArbiterContext) -> Any:
            for camera in (A, B):
                vehicle = ResourceId(camera.partition("/")[0])
                place = GeoPosition(38.1075, -77.3192, 60.0)
                now_us = context.clock.now_us()
                north = {"yaw_rad": math.pi / 2, "velocity_enu_m_s": (0.0, 0.0, 0.0)}
                context.bus.publish(VehicleState(vehicle, now_us, place, **north))
            connections = {
                camera: Connection(
                    camera,
                    "ground",
                    {**settings(camera, ros_domain), **said},
                    lost_after_s=2.0,
                    sitl=True,
                )
                for camera in (A, B)
            }
            return PtzArbiter(connections, replace(context, journal=JOURNAL))

        return make

    @pytest.fixture
    def cut_link(self, watcher: Watcher) -> Callable[[object, ResourceId], None]:
        return lambda _, camera: watcher.silence(camera)

    @pytest.fixture
    def effects(self, watcher: Watcher) -> Callable[[object, ResourceId], int]:
        return lambda _, camera: watcher.motions[camera]

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=(
                "ptz_scan_sector",
                {"heading": 0.0, "sector": math.radians(170), "speed": math.radians(8)},
            ),
            short=("ptz_point_at", {"bearing": math.radians(150), "elevation": -0.4}),
            bad=("speed", -1.0),
            short_s=10.0,
        )
