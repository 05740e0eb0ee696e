"""Pointing over ROS: what the joints really do."""

import asyncio
import json
import math
from contextlib import asynccontextmanager

import pytest
from m2pem_plugin_ptz import controller
from m2pem_plugin_ptz.arbiter import PtzArbiter
from m2pem_plugin_ros.testing import Peer
from ptz_ros_world import AMPLE_S, CAMERA, PEER, make_driver, until, world

from m2pem.api import BehaviorState, Connection
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context


@asynccontextmanager
async def commanding(settings, folder):
    """An arbiter of the camera, which may not be there."""
    own = {"driver": "ros", "pictures": str(folder), **settings}
    clock = SystemClock()
    arbiter = PtzArbiter({CAMERA: Connection(CAMERA, "ground", own, sitl=True)}, context(clock))
    async with ArbiterHarness(arbiter, clock) as harness:
        yield harness


COMMANDS = ["trajectory", pytest.param("positions", marks=pytest.mark.long)]


@pytest.mark.parametrize("command", ["trajectory", "positions"])
async def test_a_ptz_head_points_clockwise_and_up_and_says_so(
    ros_domain, tmp_path, command
) -> None:
    async with world(ros_domain, tmp_path, command=command) as it:
        await it.ready()
        it.point(40.0, 20.0)
        # A joint counts counter-clockwise (REP-103).
        await until(lambda: it.joints_are(pan_joint=-40.0, tilt_joint=20.0))
        await until(lambda: it.driver.ptz.pan_rad == pytest.approx(math.radians(40), abs=0.01))
        await until(lambda: it.driver.ptz.tilt_rad == pytest.approx(math.radians(20), abs=0.01))
        assert it.heard


@pytest.mark.parametrize("command", COMMANDS)
async def test_a_ptz_head_turns_no_faster_than_asked_and_the_last_order_counts(
    ros_domain, tmp_path, command
) -> None:
    async with world(ros_domain, tmp_path, command=command) as it:
        await it.ready()
        loop = asyncio.get_running_loop()
        it.point(90.0, 0.0)
        it.point(-30.0, 0.0, rate_deg_s=20.0)
        began_s = loop.time()
        await until(lambda: it.joints_are(pan_joint=30.0))
        assert loop.time() - began_s > 1.2
        await it.stands()
        assert it.joints_are(pan_joint=30.0)
        assert min(math.degrees(each["pan_joint"]) for each in it.history) > -80.0


@pytest.mark.long
async def test_orders_that_come_again_and_again_arrive_no_sooner(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path, command="positions") as it:
        await it.ready()
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        async with asyncio.timeout(AMPLE_S):
            while not it.joints_are(pan_joint=-30.0):
                it.point(30.0, 0.0, rate_deg_s=20.0)
                await asyncio.sleep(0.08)
        assert loop.time() - began_s > 1.2


@pytest.mark.parametrize("command", COMMANDS)
async def test_halt_stops_it_on_its_way(ros_domain, tmp_path, command) -> None:
    async with world(ros_domain, tmp_path, command=command) as it:
        await it.ready()
        it.point(150.0, 0.0, rate_deg_s=30.0)
        await until(lambda: it.joint_deg("pan_joint") < -20.0)
        it.driver.halt()
        await it.stands()
        stood = it.joint_deg("pan_joint")
        count = len(it.history)
        await until(lambda: len(it.history) > count + 10)
        assert it.joint_deg("pan_joint") == pytest.approx(stood, abs=0.3)
        assert stood > -140.0


async def test_a_ptz_head_zooms_while_it_turns(ros_domain, tmp_path) -> None:
    joints = {"pan": "pan_joint", "tilt": "tilt_joint", "zoom": "zoom_joint"}
    async with world(ros_domain, tmp_path, joints=joints) as it:
        await it.ready()
        it.point(30.0, 0.0)
        it.driver.zoom(4.0)
        await until(lambda: it.driver.ptz.zoom == pytest.approx(4.0, abs=0.05))
        await until(lambda: it.joints_are(pan_joint=-30.0))
        await until(lambda: it.joints["zoom_joint"] == pytest.approx(4.0, abs=0.05))
        assert it.driver.refusal("zoom") == ""


async def test_joints_may_be_the_other_way_round_and_have_other_names(ros_domain, tmp_path) -> None:
    joints = {"pan": "mast_yaw", "tilt": "mast_pitch", "reversed": ["tilt"]}
    async with world(ros_domain, tmp_path, joints=joints) as it:
        await it.ready()
        it.point(-20.0, 15.0)
        await until(lambda: it.joints_are(mast_yaw=20.0, mast_pitch=-15.0))
        await until(lambda: it.driver.ptz.tilt_rad == pytest.approx(math.radians(15), abs=0.01))


async def test_what_turns_endlessly_goes_the_shorter_way(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path, endless=True) as it:
        await it.ready()
        it.point(170.0, 0.0)
        await until(lambda: it.joints_are(pan_joint=-170.0))
        it.point(-170.0, 0.0)
        await until(lambda: it.joints_are(pan_joint=-190.0))
        await until(lambda: abs(it.driver.ptz.pan_rad - math.radians(-170)) < 0.02)


async def test_a_head_that_was_deaf_is_told_again(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.fault("stuck")
        it.point(30.0, 0.0)
        await asyncio.sleep(0.5)
        assert it.joints_are(pan_joint=0.0)
        await it.fault("well")
        await until(lambda: it.joints_are(pan_joint=-30.0))


async def test_joints_that_fall_silent_are_not_heard(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.fault("silent")
        loop = asyncio.get_running_loop()
        await until(lambda: it.heard[-1] < loop.time() - 0.5)
        await it.fault("well")
        await until(lambda: it.heard[-1] > loop.time() - 0.2)


@pytest.mark.long
async def test_a_fault_of_a_simulated_camera_ends_after_its_duration(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.fault("silent for 2 s")
        loop = asyncio.get_running_loop()
        await until(lambda: it.heard[-1] < loop.time() - 0.5)
        await until(lambda: it.heard[-1] > loop.time() - 0.2)


@pytest.mark.long
async def test_words_that_are_no_fault_leave_a_simulated_camera_as_it_is(
    ros_domain, tmp_path
) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.send_fault("silent for ever")
        await it.fault("stuck")
        assert it.confirmed == ["stuck"]
        await it.stands()


async def test_a_camera_that_is_not_there_says_what_is_missing(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path, camera=False) as it:
        told = it.driver.missing("ptz_point_at")
        assert told == "/evsg2/joint_states has no pan_joint and tilt_joint"
        told = it.driver.missing("take_picture")
        assert told == "no publisher of images on /evsg2/camera/image_raw/compressed"
        assert it.driver.ptz is None
        it.point(10.0, 10.0)
        it.driver.halt()
        assert not it.heard


@pytest.mark.long
async def test_joints_of_others_are_named(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        settings = {"namespace": "/evsg2", "domain_id": ros_domain, "joints": {"pan": "p"}}
        other = make_driver(settings, tmp_path, lambda: None)
        await other.open()
        try:
            known = "it has wheel, pan_joint, tilt_joint"
            await until(lambda: known in other.missing("ptz_track"))
            assert other.ptz is None
        finally:
            await other.close()


@pytest.mark.parametrize(
    ("behavior", "parameters"),
    [("ptz_point_at", {"bearing": 0.5, "elevation": 0.1}), ("take_picture", {})],
)
async def test_a_behavior_waits_for_a_camera_that_comes_late(
    ros_domain, tmp_path, monkeypatch, caplog, behavior, parameters
) -> None:
    monkeypatch.setattr(controller, "FOUND_WITHIN_S", AMPLE_S)
    settings = {"namespace": "/evsg2", "domain_id": ros_domain}
    async with commanding(settings, tmp_path) as harness:
        await harness.start("r1.b1", behavior, CAMERA, **parameters)
        await until(lambda: "evsg2/ptz: r1.b1 waits: " in caplog.text)
        peer = Peer(PEER, ros_domain, [CAMERA, json.dumps(settings), "no"])
        await asyncio.to_thread(peer.__enter__)
        try:
            end = await harness.ended("r1.b1", AMPLE_S)
            assert end.state is BehaviorState.SUCCEEDED, end.reason
        finally:
            await asyncio.to_thread(peer.__exit__, None, None, None)


async def test_a_behavior_of_a_camera_that_never_comes_is_rejected(
    ros_domain, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(controller, "FOUND_WITHIN_S", 0.5)
    async with commanding({"namespace": "/evsg2", "domain_id": ros_domain}, tmp_path) as harness:
        await harness.start("r1.b1", "ptz_point_at", CAMERA, bearing=0.0, elevation=0.0)
        end = await harness.ended("r1.b1", AMPLE_S)
        assert end.code == "REJECTED"
        missing = "/evsg2/joint_states has no pan_joint and tilt_joint"
        assert end.reason == f"not discovered within 0.5 s: {missing}"
