"""The contract of arbiters, on payloads with m2pem nodes in other processes, over real DDS."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import ClassVar
from uuid import uuid4

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.testing import Peer
from ptz_ros_node_world import CAMERA, OTHER, connection, peer, place_carriers
from ptz_ros_watcher import Watcher

from m2pem.api import Arbiter, ArbiterContext, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

BOTH = (CAMERA, OTHER)


class PayloadNodes(ArbiterContract):
    """Inherit, and say by which `via` they are commanded."""

    unsupported: ClassVar[Mapping[str, str]] = {
        "virtual clock": "payloads are told over real DDS",
        "telemetry": "a payload that turns has a look, not a speed",
    }
    via: ClassVar[str]
    quick: ClassVar[Collection[str]] = ()

    @pytest.fixture
    def peers(self, ros_domain: int, tmp_path: Path) -> Iterator[dict[ResourceId, Peer]]:
        with ExitStack() as stack:
            made = {camera: peer(ros_domain, camera, tmp_path) for camera in BOTH}
            for each in made.values():
                stack.enter_context(each)
            yield made

    @pytest.fixture
    def watcher(self, ros_domain: int, peers: dict[ResourceId, Peer]) -> Iterator[Watcher]:
        watcher = Watcher(ros_domain, {camera: f"/{camera}" for camera in BOTH})
        yield watcher
        watcher.close()

    @pytest.fixture
    def make_arbiter(
        self, ros_domain: int, watcher: Watcher
    ) -> Callable[[ArbiterContext], Arbiter]:
        journal = uuid4()

        def make(context: ArbiterContext) -> Arbiter:
            place_carriers(context)
            own = {camera: connection(camera, ros_domain, via=self.via) for camera in BOTH}
            return RosArbiter(own, replace(context, journal=journal))

        return make

    @pytest.fixture
    def cut_link(self, peers: dict[ResourceId, Peer]) -> Callable[[Arbiter, ResourceId], None]:
        return lambda _, camera: peers[camera].kill()

    @pytest.fixture
    def effects(self, watcher: Watcher) -> Callable[[Arbiter, ResourceId], int]:
        return lambda _, camera: watcher.motions[camera]

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=CAMERA,
            other=OTHER,
            long=(
                "ptz_scan_sector",
                {"heading": 0.0, "sector": math.radians(170), "speed": math.radians(8)},
            ),
            short=("ptz_point_at", {"bearing": math.radians(150), "elevation": -0.4}),
            bad=("speed", -1.0),
            short_s=10.0,
            watch_s=2.0,
        )


class TestByTopics(PayloadNodes):
    via = "topics"
    quick: ClassVar = ("test_a_cut_link_is_lost_within_the_declared_bound",)


class TestByAction(PayloadNodes):
    via = "action"
    quick: ClassVar = ("test_cancel_ends_a_behavior_within_the_declared_bound",)
