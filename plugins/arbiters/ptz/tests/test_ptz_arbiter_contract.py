"""The contract of arbiters, on heads without a network, in virtual time."""

import math
from collections.abc import Mapping
from typing import ClassVar

import pytest
from m2pem_plugin_ptz.arbiter import PtzArbiter
from ptz_fake_camera import Gimbal, HeadDriver, connection, rad, vehicle

from m2pem.api import ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("a/ptz"), ResourceId("b/ptz")


OF_THE_HEAD = frozenset(
    {
        "test_a_behavior_that_preempts_takes_the_vehicle_over",
        "test_a_cut_link_is_lost_within_the_declared_bound",
        "test_accepted_comes_before_running_and_one_terminal_report_last",
        "test_another_arbiter_finds_the_behavior_again",
        "test_cancel_ends_a_behavior_within_the_declared_bound",
        "test_hold_stops_the_vehicle_within_the_declared_bound",
        "test_resume_goes_on_with_the_behavior",
    }
)
"""What another head or another motion could change; the other tests are of the arbiter alone."""


class _Heads(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {
        "telemetry": "a camera that turns has a look, not a speed (test_ptz_arbiter)"
    }
    settings: ClassVar[Mapping[str, object]] = {}

    @pytest.fixture
    def heads(self):
        return {A: Gimbal(), B: Gimbal()}

    @pytest.fixture
    def make_arbiter(self, heads, tmp_path):
        said = {"pictures": str(tmp_path), **self.settings}

        def make(context):
            for name in ("a", "b"):
                context.bus.publish(vehicle(name, context.clock.now_us()))
            return PtzArbiter(
                {each: connection(each, **said) for each in heads},
                context,
                lambda setup: HeadDriver(setup, heads[setup.connection.resource]),
            )

        return make

    @pytest.fixture
    def cut_link(self, heads):
        def cut(_arbiter, camera):
            heads[camera].audible = False

        return cut

    @pytest.fixture
    def effects(self, heads):
        return lambda _arbiter, camera: heads[camera].begun

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("ptz_scan_sector", {"heading": 0.0, "sector": rad(170), "speed": rad(4)}),
            short=("ptz_point_at", {"bearing": rad(150), "elevation": rad(-20)}),
            bad=("speed", -1.0),
        )


class TestPointing(_Heads):
    pass


class TestEndlessPan(_Heads):
    quick: ClassVar = OF_THE_HEAD
    settings: ClassVar[Mapping[str, object]] = {"reach": {"endless": True}}

    @pytest.fixture
    def heads(self):
        return {A: Gimbal(endless=True), B: Gimbal(endless=True)}


class TestZooming(_Heads):
    quick: ClassVar = OF_THE_HEAD
    unsupported: ClassVar[Mapping[str, str]] = {
        **_Heads.unsupported,
        "effects": "the zoom is not counted",
    }

    @pytest.fixture
    def heads(self):
        return {A: Gimbal(zoom_max=30.0), B: Gimbal(zoom_max=30.0)}

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=(
                "ptz_scan_sector",
                {"heading": math.pi / 2, "sector": rad(100), "speed": rad(2), "elevation": 0.1},
            ),
            short=("zoom", {"level": 30.0}),
            bad=("heading", "north"),
        )


class TestPictures(_Heads):
    unsupported: ClassVar[Mapping[str, str]] = {
        **_Heads.unsupported,
        "effects": "taking pictures moves nothing (test_ptz_image_files counts them)",
        "reconnect": "whether pictures were taken cannot be seen: they are taken again",
    }

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("record_video", {"duration": 40.0}),
            short=("take_picture", {"count": 3, "interval": 2.0}),
            bad=("duration", -1.0),
        )
