"""What a mission gets of a payload with an m2pem node, over real DDS."""

import asyncio
import math
from pathlib import Path

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from ptz_ros_node_world import AMPLE_S, CAMERA, connection, peer, world

from m2pem.api import BehaviorState, LinkState, Point, RunStatus
from m2pem.api.clock import SystemClock
from m2pem.testing import run_mission, scenarios
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context


@pytest.mark.long
@pytest.mark.parametrize("via", ["topics", "action"])
async def test_pictures_come_back_to_the_mission(via: str, tmp_path: Path, ros_domain: int) -> None:
    async with world(ros_domain, tmp_path, via=via) as it:
        await it.bench.start("r1.b1", "take_picture", CAMERA, count=2, interval=0.1)
        report = await it.bench.ended("r1.b1", AMPLE_S)
        assert report.state is BehaviorState.SUCCEEDED, report.reason
        files = report.outputs["picture.files"]
        assert isinstance(files, list)
        assert len(files) == 2
        pictures = [await asyncio.to_thread(Path(str(each)).read_bytes) for each in files]
        assert all(each.startswith(b"\xff\xd8") for each in pictures)
        assert report.outputs["picture.file"] == files[-1]
        assert "picture.time" in report.outputs


async def test_a_ptz_head_points_zooms_and_tells_where_it_looks(
    tmp_path: Path, ros_domain: int
) -> None:
    async with world(ros_domain, tmp_path) as it:
        east = Point((38.1075, -77.3180, 60.0), "amsl")
        await it.bench.start("r1.b1", "ptz_point_at", CAMERA, target=east)
        report = await it.bench.ended("r1.b1", AMPLE_S)
        assert report.state is BehaviorState.SUCCEEDED, report.reason
        await it.bench.start("r1.b2", "zoom", CAMERA, level=4.0)
        report = await it.bench.ended("r1.b2", AMPLE_S)
        assert report.state is BehaviorState.SUCCEEDED, report.reason

        def looks_east() -> bool:
            state = it.state
            return (
                state is not None
                and state.pan_rad is not None
                and abs(state.pan_rad - math.pi / 2) < 0.02
                and state.zoom == pytest.approx(4.0, abs=0.05)
                and len(state.footprint) >= 3
            )

        assert await it.bench.until(looks_east, AMPLE_S), it.state
        state = it.state
        assert state is not None
        assert state.tilt_rad is not None
        assert state.tilt_rad < 0.0, "the ground is below"
        assert all(corner.longitude_deg > -77.3192 for corner in state.footprint), "all east of it"


async def test_what_it_does_is_told_by_name_and_can_be_held(
    tmp_path: Path, ros_domain: int
) -> None:
    async with world(ros_domain, tmp_path) as it:
        slow = {"heading": 0.0, "sector": math.radians(170), "speed": math.radians(8)}
        await it.bench.start("r1.b1", "ptz_scan_sector", CAMERA, **slow)
        await it.bench.running("r1.b1")
        assert await it.bench.until(lambda: it.state.behavior == "ptz_scan_sector", AMPLE_S)
        await it.bench.arbiter.hold(CAMERA)
        pans = {it.state.time_us: it.state.pan_rad}

        def stands() -> bool:
            pans[it.state.time_us] = it.state.pan_rad
            recent = list(pans.values())[-8:]
            return len(recent) == 8 and max(recent) - min(recent) < 1e-6

        assert await it.bench.until(stands, AMPLE_S)
        await it.bench.arbiter.resume(CAMERA)
        stood = it.state.pan_rad
        assert await it.bench.until(lambda: abs(it.state.pan_rad - stood) > 0.05, AMPLE_S)
        assert it.bench.states_of("r1.b1") == [BehaviorState.ACCEPTED, BehaviorState.RUNNING]


async def test_what_the_camera_itself_refuses_fails_with_its_reason(
    tmp_path: Path, ros_domain: int
) -> None:
    async with world(ros_domain, tmp_path) as it:
        far = Point((39.5, -77.3192, 60_000.0), "amsl")
        await it.bench.start("r1.b1", "ptz_point_at", CAMERA, bearing=math.pi, elevation=0.0)
        report = await it.bench.ended("r1.b1", AMPLE_S)
        assert report.state is BehaviorState.FAILED
        assert report.code == "REJECTED"
        assert "180" in report.reason, "pan ends at 160 degrees"
        await it.bench.start("r1.b2", "ptz_point_at", CAMERA, target=far)
        assert (await it.bench.ended("r1.b2", AMPLE_S)).state.terminal, "it goes on to serve"


async def test_a_payload_that_is_not_there_is_lost_and_is_not_commanded(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_ros.arbiter.FIRST_CONTACT_WITHIN_S", 0.5)
    monkeypatch.setattr("m2pem_plugin_ros.vehicle.FOUND_WITHIN_S", 0.5)
    clock = SystemClock(10.0)
    arbiter = RosArbiter({CAMERA: connection(CAMERA, ros_domain)}, context(clock))
    async with ArbiterHarness(arbiter, clock) as bench:

        def is_lost() -> bool:
            state = bench.latest(CAMERA)
            return state is not None and state.link is LinkState.LOST

        assert await bench.until(is_lost, AMPLE_S)
        await bench.start("r1.b1", "zoom", CAMERA, level=2.0)
        report = await bench.ended("r1.b1", AMPLE_S)
        assert report.state is BehaviorState.REJECTED
        assert "not discovered within 0.5 s: /ugv1/ptz/vehicle_status" in report.reason


def test_a_mission_gets_the_pictures_that_a_payload_with_a_node_took(
    tmp_path: Path, ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The vehicle of the fleet is not there.
    monkeypatch.setattr("m2pem_plugin_ros.arbiter.FIRST_CONTACT_WITHIN_S", 2.0)
    own = connection(CAMERA, ros_domain).settings
    fleet = scenarios.fleet(
        "ros", {"ugv1": {"namespace": "/ugv1", "domain_id": ros_domain}, CAMERA: own}
    )
    with peer(ros_domain, CAMERA, tmp_path):
        result = run_mission(
            scenarios.one_behavior("take_picture", CAMERA, count=2, interval="0.1 s"),
            fleet,
            arbiters={"ros": RosArbiter},
        )
    assert result.summary.status is RunStatus.COMPLETED, result.records
    written = {record.key: record.value for record in result.of("DataWritten")}
    assert len(written["picture.files"]) == 2
    assert Path(written["picture.file"]).is_file()
