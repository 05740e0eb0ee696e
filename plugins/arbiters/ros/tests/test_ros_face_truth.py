"""What the face says is what the executive holds, and what a face says is never taken as input."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from m2pem_interfaces.msg import BehaviorStatus, FleetResource, FleetState
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.face import frames_publisher
from m2pem_plugin_ros.testing import Peer
from nav_msgs.msg import Odometry
from ros_face_client import LATCHED, behavior_goal, faced, until
from sensor_msgs.msg import JointState, NavSatFix
from tf2_msgs.msg import TFMessage

from m2pem.api import ArbiterContext, Connection, LinkState, ResourceId, VehicleState
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

PEER = Path(__file__).with_name("ros_plain_peer.py")
SENSORS = Path(__file__).with_name("ros_sensors_peer.py")
UGV1 = ResourceId("ugv1")
LATITUDE, LONGITUDE, ALTITUDE = scenarios.ORIGIN


class Simulated:
    """Makes the simulated arbiter of a world, and remembers it."""

    def __init__(self) -> None:
        self.arbiter: SimArbiter

    def __call__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> SimArbiter:
        self.arbiter = SimArbiter(connections, context)
        return self.arbiter


def status(messages: list[Any], name: str) -> Any:
    """The newest status of that name; None before the first."""
    found = [each for message in list(messages) for each in message.status if each.name == name]
    return found[-1] if found else None


async def test_a_vehicle_that_the_executive_holds_as_lost_is_lost_in_ros(ros_domain: int) -> None:
    simulated = Simulated()
    async with faced(ros_domain, arbiters={"sim": simulated}, speed=1.0) as world:
        said = world.client.hear("/diagnostics", DiagnosticArray)
        fleet = world.client.hear("/face/fleet_state", FleetState, LATCHED)
        odom = world.client.hear("/ugv1/odom", Odometry)

        def level() -> Any:
            found = status(said, "m2pem: /face: ugv1")
            return found and found.level

        await until(lambda: odom and level() == DiagnosticStatus.OK)
        simulated.arbiter.lose_link(UGV1)
        states = world.control.telemetry()
        async for state in states:
            if isinstance(state, VehicleState) and state.link is LinkState.LOST:
                break
        seen = len(fleet)
        stamped = odom[-1].header.stamp
        await until(lambda: len(fleet) > seen)
        shown = fleet[seen].resources[0]
        assert (shown.link, shown.readiness) == (FleetResource.LOST, FleetResource.NOT_READY)
        assert shown.not_ready_reasons[0].startswith("lost: no telemetry for 3.")
        assert (await world.control.unavailable())["ugv1"] == shown.not_ready_reasons[0]
        await until(lambda: level() == DiagnosticStatus.ERROR)
        assert status(said, "m2pem: /face: ugv1").message.startswith("link lost; not ready: lost: ")
        assert (await world.control.statistics()).links[UGV1].state is LinkState.LOST
        assert odom[-1].header.stamp == stamped, "where it is now is not known"
        simulated.arbiter.restore_link(UGV1)
        await until(lambda: fleet[-1].resources[0].link == FleetResource.CONNECTED)
        await until(lambda: odom[-1].header.stamp != stamped)


async def test_what_faces_say_of_a_vehicle_of_the_same_name_does_not_make_ours_not_ready(
    ros_domain: int,
) -> None:
    ours = scenarios.fleet(
        "ros", {"ugv1": {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base"}}
    )
    states: list[VehicleState] = []
    simulated = Simulated()

    async def follow(control: Any) -> None:
        async for state in control.telemetry():
            if isinstance(state, VehicleState):
                states.append(state)

    with Peer(PEER, ros_domain, ["/ugv1", "base", "map"]):
        async with (
            faced(
                ros_domain, {"namespace": "/a"}, ours, arbiters={"ros": RosArbiter}, speed=1.0
            ) as site_a,
            faced(
                ros_domain, {"namespace": "/b"}, arbiters={"sim": simulated}, speed=1.0
            ) as site_b,
        ):
            said = site_b.client.hear("/diagnostics", DiagnosticArray)
            following = asyncio.create_task(follow(site_a.control))
            await until(lambda: states and states[-1].ready)
            simulated.arbiter.lose_link(UGV1)

            def errors() -> int:
                return sum(
                    each.name == "m2pem: /b/face: ugv1" and each.level == DiagnosticStatus.ERROR
                    for message in list(said)
                    for each in message.status
                )

            await until(lambda: errors() >= 3)
            heard = len(states)
            await until(lambda: len(states) > heard + 5)
            following.cancel()
    names = {(each.name, each.hardware_id) for message in said for each in message.status}
    assert {("m2pem: /a/face: ugv1", "a/ugv1"), ("m2pem: /b/face: ugv1", "b/ugv1")} <= names
    assert {(each.ready, each.not_ready_reasons) for each in states[-10:]} == {(True, ())}


async def test_a_vehicle_that_the_face_of_another_fleet_shows_is_not_taken_for_ours(
    ros_domain: int,
) -> None:
    ours = scenarios.fleet(
        "ros", {"ugv1": {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base"}}
    )
    async with (
        faced(ros_domain, speed=1.0),
        run_executive(ours, arbiters={"ros": RosArbiter}) as control,
    ):
        states = control.telemetry()
        async with asyncio.timeout(40):
            async for state in states:
                assert isinstance(state, VehicleState)
                if any("the face of another executive" in each for each in state.not_ready_reasons):
                    break
        assert state.ready is False
        goto = scenarios.one_behavior("goto", "ugv1", target=f"[{LATITUDE}, {LONGITUDE}]")
        ended = await control.wait(await control.start(goto))
    assert "is published by /face (gid " in ended.detail
    assert "give that face a namespace" in ended.detail


async def test_a_satellite_fix_is_used_while_there_is_no_odometry(ros_domain: int) -> None:
    fleet = scenarios.fleet(
        "ros", {"ugv1": {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base"}}
    )
    states: list[VehicleState] = []

    async def follow(control: Any) -> None:
        async for state in control.telemetry():
            if isinstance(state, VehicleState):
                states.append(state)

    async with faced(ros_domain, of=fleet, arbiters={"ros": RosArbiter}, speed=1.0) as world:
        said = world.client.hear("/diagnostics", DiagnosticArray)
        publisher = world.client.node.create_publisher(NavSatFix, "/ugv1/fix", 10)
        following = asyncio.create_task(follow(world.control))
        shown = asyncio.create_task(
            until(
                lambda: (
                    states
                    and states[-1].link is LinkState.CONNECTED
                    and (found := status(said, "m2pem: /face: ugv1"))
                    and found.level == DiagnosticStatus.WARN
                ),
                lambda: (states[-1:], status(said, "m2pem: /face: ugv1")),
            )
        )
        while not shown.done():
            publisher.publish(NavSatFix(latitude=LATITUDE, longitude=LONGITUDE, altitude=26.0))
            await asyncio.sleep(0.1)
        await shown
        following.cancel()
    last = states[-1]
    assert last.position is not None
    assert last.position.latitude_deg == pytest.approx(LATITUDE)
    assert not last.ready
    assert "no odometry yet on /ugv1/odom" in last.not_ready_reasons


async def test_what_a_stray_node_has_published_is_taken_back_when_it_is_gone(
    ros_domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frames_publisher, "GONE_AFTER_S", 1.0)
    async with faced(ros_domain) as world:
        node = world.client.node
        odom = world.client.hear("/ugv1/odom", Odometry)
        frames = world.client.hear("/tf", TFMessage)
        await until(lambda: odom and frames)
        theirs = TransformStamped(child_frame_id="ugv1/base_link")
        theirs.header.frame_id = "map"
        stray = node.create_publisher(Odometry, "/ugv1/odom", 10)
        stray_tf = node.create_publisher(TFMessage, "/tf", 100)
        number = 0
        while not (
            "/ugv1/odom is left to the node /client" in caplog.text
            and "'map' -> 'ugv1/base_link': it is left to that node" in caplog.text
        ):
            number += 1
            assert number < 400
            theirs.header.stamp.sec = number
            stray_tf.publish(TFMessage(transforms=[theirs]))
            await asyncio.sleep(0.05)
        node.destroy_publisher(stray)  # but the other one stays, and publishes no more
        del odom[:], frames[:]
        await until(lambda: odom)

        def is_moving() -> bool:
            return any(
                each.child_frame_id == "ugv1/base_link"
                for message in list(frames)
                for each in message.transforms
            )

        await until(is_moving)
        assert stray_tf.get_subscription_count()
    assert "/ugv1/odom is published by the face again" in caplog.text
    assert "the transform to 'ugv1/base_link' is published by the face again" in caplog.text


async def test_what_an_arbiter_refuses_is_rejected(ros_domain: int) -> None:
    fleet = scenarios.fleet("sim", {"ugv2": {}, "ugv2/camera": {"tilt_high": "10 deg"}})
    async with faced(ros_domain, {"commands": "all"}, fleet) as world:
        goal = behavior_goal("ptz_point_at", bearing=0.0, elevation=1.5)
        sent = await world.client.send("/ugv2/camera/execute_behavior", goal)
        ended, result = await sent.end()
    assert ended == GoalStatus.STATUS_ABORTED
    assert (result.status.state, result.status.code) == (BehaviorStatus.REJECTED, "REJECTED")
    assert result.status.reason
    assert not sent.feedback


async def test_what_does_not_turn_has_no_joints(ros_domain: int) -> None:
    fleet = scenarios.fleet(
        "sim", {"ugv2": {}, "ugv2/gpr": {"kind": "gpr"}, "ugv2/camera": {"kind": "ptz"}}
    )
    async with faced(ros_domain, of=fleet) as world:
        joints = await world.client.hears("/ugv2/joint_states", JointState)
    assert list(joints.name) == ["ugv2_camera_pan", "ugv2_camera_tilt"]
