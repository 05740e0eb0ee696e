"""The topics of the face, as a client in plain rclpy receives them."""

import asyncio
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pymap3d
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geographic_msgs.msg import GeoPointStamped
from geometry_msgs.msg import TransformStamped
from m2pem_interfaces.msg import FleetState
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sensors.endpoints import Endpoints
from m2pem_plugin_ros.settings import DriverName, Settings
from nav_msgs.msg import Odometry
from rclpy.node import Node
from ros_face_client import LATCHED, STATIC, Client, World, faced, point, two_vehicles, until
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Imu, JointState, NavSatFix, NavSatStatus
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from m2pem.api import (
    Area,
    GeoPosition,
    LinkState,
    PayloadState,
    ResourceId,
    Route,
    VehicleState,
    ellipsoidal_m,
)
from m2pem.testing import scenarios

UGV1, CAMERA = ResourceId("ugv1"), ResourceId("ugv2/camera")
LATITUDE, LONGITUDE, ALTITUDE = scenarios.ORIGIN
TIME_US = 1_700_000_000_123_456
PLACE = GeoPosition(LATITUDE + 0.01, LONGITUDE - 0.02, ALTITUDE + 42.0)
STATE = VehicleState(
    UGV1,
    TIME_US,
    PLACE,
    velocity_enu_m_s=(1.0, 2.0, 0.5),
    roll_rad=0.1,
    pitch_rad=-0.2,
    yaw_rad=math.pi / 2,
    battery_fraction=0.75,
    mode="GUIDED",
)


async def said(world: World, state: Any, heard: Any) -> None:
    """Say a state until it was heard: of what changes quickly only the latest is published."""
    while not heard.done():
        world.bus.publish(state)
        await asyncio.sleep(0.02)


async def hears(
    world: World, state: Any, topic: str, kind: Any, wanted: Any = lambda _: True
) -> Any:
    heard = asyncio.create_task(world.client.hears(topic, kind, wanted=wanted))
    await said(world, state, heard)
    return heard.result()


def of_state(message: Any) -> bool:
    """Whether a message is of `STATE`, and not of the simulation."""
    stamp = message.header.stamp
    return bool((stamp.sec, stamp.nanosec) == (1_700_000_000, 123_456_000))


def rotation(q: Any) -> Any:
    """The matrix of a quaternion."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def vector(v: Any) -> Any:
    return np.array([v.x, v.y, v.z])


def matrix(transform: Any) -> Any:
    """The homogeneous matrix of a transform."""
    whole = np.eye(4)
    whole[:3, :3] = rotation(transform.rotation)
    whole[:3, 3] = vector(transform.translation)
    return whole


@pytest.mark.tried_with(
    "tf2_msgs",
    "reads the transforms of the ROS face, from the earth on",
    kind="ROS 2",
    result="the place of the fix",
    version="Jazzy",
)
async def test_tf_leads_from_the_earth_to_where_the_fix_says(ros_domain: int) -> None:
    async with faced(ros_domain) as world:
        static = world.client.hear("/tf_static", TFMessage, STATIC)
        await until(lambda: static)
        fix = await hears(world, STATE, "/ugv1/fix", NavSatFix, of_state)

        def moves(message: Any) -> bool:
            return any(
                each.child_frame_id == "ugv1/base_link" and of_state(each)
                for each in message.transforms
            )

        moving = await hears(world, STATE, "/tf", TFMessage, moves)
    tree = {each.child_frame_id: each for each in (*static[0].transforms, *moving.transforms)}
    chain, frame = [], "ugv1/base_link"
    while frame != "earth":
        chain.insert(0, tree[frame])
        frame = tree[frame].header.frame_id
    assert [each.child_frame_id for each in chain] == ["map", "ugv1/odom", "ugv1/base_link"]
    whole = np.linalg.multi_dot([matrix(each.transform) for each in chain])
    expected = pymap3d.geodetic2ecef(fix.latitude, fix.longitude, fix.altitude)
    assert np.linalg.norm(whole[:3, 3] - np.array(expected)) < 0.001
    # Its x axis points north, as its yaw says, and 0.2 rad up, as it pitches.
    forward = whole[:3, :3] @ np.array([1.0, 0.0, 0.0])
    east, north, up = pymap3d.ecef2enuv(*forward, LATITUDE, LONGITUDE)
    assert (east, north, up) == pytest.approx((0.0, math.cos(0.2), math.sin(0.2)), abs=1e-9)


async def test_a_state_that_no_transform_can_have_ends_nothing(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    def moves(message: Any) -> bool:
        return any(of_state(each) for each in message.transforms)

    async with faced(ros_domain) as world:
        await hears(world, STATE, "/tf", TFMessage, moves)
        strange = VehicleState(ResourceId("ugv2"), TIME_US, PLACE, roll_rad=math.inf)
        told = asyncio.create_task(until(lambda: "ugv2" in caplog.text))
        await said(world, strange, told)
        frames = world.client.hear("/tf", TFMessage)
        del frames[:]
        later = replace(STATE, time_us=TIME_US + 1_000_000)
        came = asyncio.create_task(
            until(
                lambda: [
                    e
                    for each in list(frames)
                    for e in each.transforms
                    if e.header.stamp.sec == 1_700_000_001
                ]
            )
        )
        await said(world, later, came)
    assert caplog.text.count("no transform of ugv2 can be published") == 1


async def test_odometry_has_the_place_in_the_fleets_frame_and_the_twist_in_the_vehicles(
    ros_domain: int,
) -> None:
    async with faced(ros_domain) as world:
        odom = await hears(world, STATE, "/ugv1/odom", Odometry, of_state)
    assert (odom.header.frame_id, odom.child_frame_id) == ("ugv1/odom", "ugv1/base_link")
    height_m = ellipsoidal_m(*PLACE.latlon, PLACE.altitude_m)
    origin = LATITUDE, LONGITUDE, ellipsoidal_m(*scenarios.ORIGIN)
    expected = pymap3d.geodetic2enu(*PLACE.latlon, height_m, *origin)
    assert vector(odom.pose.pose.position) == pytest.approx(expected, abs=1e-3)
    # Turned back into ENU, the twist is the velocity of the vehicle.
    turned = rotation(odom.pose.pose.orientation) @ vector(odom.twist.twist.linear)
    assert turned == pytest.approx((1.0, 2.0, 0.5))
    assert odom.pose.covariance[35] == 0.0
    assert [odom.twist.covariance[index] for index in (0, 21, 28, 35)] == [0.0, -1.0, -1.0, -1.0]


@pytest.mark.tried_with(
    "sensor_msgs, nav_msgs",
    "a client reads fix, odometry, battery, joints and markers of the ROS face",
    kind="ROS 2",
    result="the values of the vehicle",
    package="ros-common-interfaces",
)
async def test_the_other_topics_say_what_is_known_and_what_is_not(ros_domain: int) -> None:
    bare = VehicleState(UGV1, TIME_US)
    async with faced(ros_domain) as world:
        fix = await hears(world, STATE, "/ugv1/fix", NavSatFix, of_state)
        battery = await hears(world, STATE, "/ugv1/battery_state", BatteryState, of_state)
        imu = await hears(world, STATE, "/ugv1/imu", Imu, of_state)
        no_fix = await hears(
            world,
            bare,
            "/ugv1/fix",
            NavSatFix,
            lambda each: each.status.status == NavSatStatus.STATUS_NO_FIX,
        )
        no_imu = await hears(
            world, bare, "/ugv1/imu", Imu, lambda each: each.orientation_covariance[0] == -1.0
        )
        look = PayloadState(CAMERA, TIME_US, pan_rad=0.5, tilt_rad=-0.25)
        joints = await hears(
            world,
            look,
            "/ugv2/joint_states",
            JointState,
            lambda each: list(each.position) == [-0.5, 0.25],
        )
    assert (fix.latitude, fix.longitude) == PLACE.latlon
    # Mean sea level is 34.0 m below the ellipsoid there.
    assert fix.altitude == pytest.approx(PLACE.altitude_m - 33.98, abs=0.05)
    assert fix.header.frame_id == "ugv1/base_link"
    assert battery.percentage == pytest.approx(0.75)
    assert battery.present
    assert math.isnan(battery.voltage)
    assert imu.angular_velocity_covariance[0] == imu.linear_acceleration_covariance[0] == -1.0
    assert imu.orientation_covariance[0] == 0.0
    assert math.isnan(no_fix.latitude)
    assert no_imu.angular_velocity_covariance[0] == -1.0
    assert list(joints.name) == ["ugv2_camera_pan", "ugv2_camera_tilt"]


async def test_diagnostics_say_link_readiness_with_reasons_and_mode(ros_domain: int) -> None:
    state = VehicleState(
        UGV1, TIME_US, mode="GUIDED", ready=False, not_ready_reasons=("no fix", "low battery")
    )

    def status(message: Any) -> Any:
        return next((each for each in message.status if each.name == "m2pem: /face: ugv1"), None)

    async with faced(ros_domain) as world:
        array = await hears(
            world,
            state,
            "/diagnostics",
            DiagnosticArray,
            lambda each: status(each) and "no fix" in status(each).message,
        )
    found = status(array)
    assert found.level == DiagnosticStatus.WARN
    assert found.message == "not ready: no fix; low battery"
    values = {each.key: each.value for each in found.values}
    assert (values["mode"], values["link"]) == ("GUIDED", "connected")


async def test_topics_keep_their_rate(ros_domain: int) -> None:
    async with faced(ros_domain, {"rate": {"odom": "5 Hz"}}) as world:
        odom = world.client.hear("/ugv1/odom", Odometry)
        await hears(world, STATE, "/ugv1/odom", Odometry)
        loop, count = asyncio.get_running_loop(), len(odom)
        began_s = loop.time()
        heard = asyncio.create_task(until(lambda: len(odom) >= count + 10))
        await said(world, STATE, heard)
        took_s = loop.time() - began_s
    assert took_s > 10 / 5.0 * 0.85


async def test_names_have_the_namespace_and_frames_too(ros_domain: int) -> None:
    async with faced(ros_domain, {"namespace": "/site_a"}) as world:
        static = world.client.hear("/tf_static", TFMessage, STATIC)
        odom = await hears(world, STATE, "/site_a/ugv1/odom", Odometry, of_state)
        fleet = await world.client.hears("/site_a/face/fleet_state", FleetState, LATCHED)
        await until(lambda: static)
    assert odom.header.frame_id == "site_a/ugv1/odom"
    assert fleet.resources[0].action == "/site_a/ugv1/execute_behavior"
    assert {(e.header.frame_id, e.child_frame_id) for e in static[0].transforms} >= {
        ("earth", "site_a/map"),
        ("site_a/map", "site_a/ugv1/odom"),
    }


async def test_the_origin_of_the_fleet_is_latched(ros_domain: int) -> None:
    async with faced(ros_domain) as world:
        origin = await world.client.hears("/face/origin", GeoPointStamped, LATCHED)
    position = origin.position
    # 60 m above mean sea level, which is 33.97 m below the ellipsoid there.
    expected = (LATITUDE, LONGITUDE, pytest.approx(26.03, abs=0.01))
    assert (position.latitude, position.longitude, position.altitude) == expected
    assert origin.header.frame_id == "map"


async def test_the_state_of_the_fleet_is_published_on_change(ros_domain: int) -> None:
    async with faced(ros_domain, {"commands": ["ugv1"]}) as world:
        states = world.client.hear("/face/fleet_state", FleetState, LATCHED)
        first = await until(lambda: states and states[-1])
        assert [each.resource for each in first.resources] == ["ugv1", "ugv2", "ugv2/camera"]
        assert [each.takes_commands for each in first.resources] == [True, False, False]
        assert "goto" in first.resources[0].behaviors
        await world.control.take("ugv2", by="anna")
        await until(lambda: states[-1].resources[1].holder == "anna")
        run = await world.control.start(
            scenarios.one_behavior("goto", "ugv1", target=f"[{LATITUDE + 0.1}, {LONGITUDE}]")
        )
        moving = await until(
            lambda: next((each for each in states if each.resources[0].behavior), None),
            lambda: states[-1],
        )
        assert moving.resources[0].holder.startswith(f"{run}.")
        assert moving.resources[0].holder_label == f"Task of {run}"
        assert moving.resources[0].link == moving.resources[0].CONNECTED
        await world.control.stop(run)
        await until(lambda: states[-1].runs[0].status == states[-1].runs[0].STOPPED)


async def test_markers_show_geometries_and_footprints_and_come_again_on_change_only(
    ros_domain: int,
) -> None:
    corner = (LATITUDE, LONGITUDE, None)
    ring = (corner, (LATITUDE + 0.01, LONGITUDE, None), (LATITUDE, LONGITUDE + 0.01, None), corner)
    geometries = {
        "road": Route((corner, (LATITUDE + 0.001, LONGITUDE, 5.0))),
        "zone": Area((ring,)),
        "limits": Area((ring,)),
    }

    fleet = replace(two_vehicles(), geometries=geometries, fence="limits")
    async with faced(ros_domain, of=fleet) as world:
        arrays = world.client.hear("/face/markers", MarkerArray, LATCHED)
        await until(lambda: arrays)
        shown = arrays[0].markers
        assert shown[0].action == Marker.DELETEALL
        kinds = {each.ns for each in shown[1:]}
        assert kinds == {"routes", "areas", "fence", "names", "labels"}
        road = next(each for each in shown if each.ns == "routes")
        assert vector(road.points[1]) == pytest.approx((0.0, 111.0, 5.0), abs=0.5)
        label = next(each for each in shown if each.text == "ugv1")
        assert (label.header.frame_id, label.frame_locked) == ("ugv1/base_link", True)
        diagnostics = world.client.hear("/diagnostics", DiagnosticArray)
        seen = len(diagnostics)
        await until(lambda: len(diagnostics) >= seen + 3)
        assert len(arrays) == 1
        await world.control.set_geometry("rally", point(0.002), by="anna")
        await until(lambda: len(arrays) == 2)
        assert any(each.text == "rally" for each in arrays[1].markers)
        lane = Route((corner, (LATITUDE, LONGITUDE + 0.001, None)))
        run = await world.control.start(scenarios.drawn(scenarios.question(), lane=lane))
        await until(lambda: any(each.text == f"{run}/lane" for each in arrays[-1].markers))
        await world.control.stop(run)
        await until(lambda: not any("lane" in each.text for each in arrays[-1].markers))
        corners = (PLACE, GeoPosition(LATITUDE, LONGITUDE, ALTITUDE), PLACE)
        sees = PayloadState(CAMERA, TIME_US, footprint=corners)
        footprints = world.client.hear("/face/footprints", MarkerArray, LATCHED)
        drawn = asyncio.create_task(until(lambda: any(len(e.markers) == 2 for e in footprints)))
        await said(world, sees, drawn)
        gone = PayloadState(CAMERA, TIME_US, footprint=corners, link=LinkState.LOST)
        hidden = asyncio.create_task(until(lambda: len(footprints[-1].markers) == 1))
        await said(world, gone, hidden)


async def test_a_topic_that_another_node_publishes_is_left_to_it(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    async with faced(ros_domain) as world:
        node = world.client.node
        await hears(world, STATE, "/ugv1/odom", Odometry, of_state)
        node.create_publisher(Odometry, "/ugv1/odom", 10)
        await until(lambda: node.count_publishers("/ugv1/odom") == 1)
        assert [each.node_name for each in node.get_publishers_info_by_topic("/ugv1/odom")] == [
            "client"
        ]
        await hears(world, STATE, "/ugv1/imu", Imu, of_state)
    assert "/ugv1/odom is left to the node /client, which publishes it" in caplog.text


async def test_a_topic_is_left_to_a_node_when_its_name_is_known(
    ros_domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level("INFO")
    looks, info = 0, Node.get_publishers_info_by_topic

    def late(self: Node, topic: str, *arguments: Any) -> Any:
        nonlocal looks
        looks += topic == "/ugv1/odom"
        found = info(self, topic, *arguments)
        for each in found if looks < 3 else ():
            each.node_name, each.node_namespace = "_NODE_NAME_UNKNOWN_", "_NODE_NAMESPACE_UNKNOWN_"
        return found

    monkeypatch.setattr(Node, "get_publishers_info_by_topic", late)
    async with faced(ros_domain) as world:
        await hears(world, STATE, "/ugv1/odom", Odometry, of_state)
        world.client.node.create_publisher(Odometry, "/ugv1/odom", 10)
        await until(lambda: "/ugv1/odom is left to the node" in caplog.text)
    assert looks >= 3
    assert "/ugv1/odom is left to the node /client, which publishes it" in caplog.text


async def test_frames_that_another_node_publishes_are_left_to_it_and_said_once(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:

    async with faced(ros_domain) as world:
        theirs = TransformStamped(child_frame_id="ugv1/base_link")
        theirs.header.frame_id = "map"
        publisher = world.client.node.create_publisher(TFMessage, "/tf", 100)
        frames = world.client.hear("/tf", TFMessage)
        number = 0
        while "is left to that node" not in caplog.text:
            number += 1
            theirs.header.stamp.sec = number
            publisher.publish(TFMessage(transforms=[theirs]))
            world.bus.publish(STATE)
            await asyncio.sleep(0.05)
            assert number < 400
        del frames[:]
        second = VehicleState(ResourceId("ugv2"), TIME_US, PLACE)
        ours = asyncio.create_task(
            until(lambda: [e for each in list(frames) for e in each.transforms if of_state(e)])
        )
        await said(world, second, ours)
        publisher.publish(TFMessage(transforms=[theirs]))
        children = {e.child_frame_id for each in list(frames) for e in each.transforms}
        assert "ugv2/base_link" in children
    assert caplog.text.count("is left to that node") == 1
    ours_too = [e for each in frames for e in each.transforms if e.header.stamp.sec > number]
    assert not [e for e in ours_too if e.child_frame_id == "ugv1/base_link"]


async def test_a_robot_never_sees_its_frames_from_the_face(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    theirs = TransformStamped(child_frame_id="ugv1/base_link")
    theirs.header.frame_id = "map"
    theirs.transform.translation.x = 77.0
    async with Client(ros_domain) as robot:
        frames = robot.hear("/tf", TFMessage)
        publisher = robot.node.create_publisher(TFMessage, "/tf", 100)

        async def publish() -> None:
            while True:
                theirs.header.stamp.nanosec += 1
                publisher.publish(TFMessage(transforms=[theirs]))
                await asyncio.sleep(0.05)

        publishing = asyncio.create_task(publish())
        async with faced(ros_domain) as world:
            left = asyncio.create_task(until(lambda: "is left to that node" in caplog.text))
            while not left.done():
                world.bus.publish(STATE)
                await asyncio.sleep(0.001)
            # Others are published from then on.
            second = VehicleState(ResourceId("ugv2"), TIME_US, PLACE)
            theirs_too = asyncio.create_task(
                until(lambda: [e for each in list(frames) for e in each.transforms if of_state(e)])
            )
            await said(world, second, theirs_too)
        publishing.cancel()
    seen = [each for message in frames for each in message.transforms]
    robots = [each for each in seen if each.child_frame_id == "ugv1/base_link"]
    assert {each.transform.translation.x for each in robots} == {77.0}


async def test_the_face_of_an_executive_that_is_replaced_takes_no_frames_from_the_next_one(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    place = GeoPosition(LATITUDE, LONGITUDE, ALTITUDE)

    def moves(message: Any) -> bool:
        return any(each.child_frame_id == "ugv1/base_link" for each in message.transforms)

    async with faced(ros_domain) as new:
        async with faced(ros_domain) as old:
            frames = new.client.hear("/tf", TFMessage)
            node, number = new.client.node, 0
            while node.count_subscribers("/tf") < 3 or number < 60:  # both listen to each other
                number += 1
                for world, offset_us in ((old, 0), (new, 7)):
                    moment_us = TIME_US + number * 1000 + offset_us
                    world.bus.publish(VehicleState(UGV1, moment_us, place))
                await asyncio.sleep(0.05)
                assert number < 400
        assert "is left to that node" not in caplog.text
        assert caplog.text.count("another node is /face, too") == 2
        del frames[:]
        ours = asyncio.create_task(until(lambda: [each for each in list(frames) if moves(each)]))
        await said(new, STATE, ours)


async def test_with_use_sim_time_stamps_are_those_of_the_clock(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("M2PEM_ROS_ARGS", "-p use_sim_time:=true")
    async with faced(ros_domain) as world:
        clock = world.client.node.create_publisher(Clock, "/clock", 10)
        odom = world.client.hear("/ugv1/odom", Odometry)
        came = asyncio.create_task(until(lambda: odom and odom[-1].header.stamp.sec == 77))
        while not came.done():
            clock.publish(Clock(clock=Time(sec=77)))
            world.bus.publish(STATE)
            await asyncio.sleep(0.05)
        await came


async def test_a_vehicle_that_is_not_there_is_not_found_in_what_the_face_publishes(
    ros_domain: int,
) -> None:
    settings = Settings("/ugv1x", driver=DriverName.BASE)
    async with faced(ros_domain) as world, RosRuntime("looks", domain_id=ros_domain) as ros:
        await until(lambda: ros.node.count_publishers("/ugv1/odom"))
        endpoints = Endpoints(ros, settings, ros_domain)
        assert "/ugv1x/odom (nav_msgs/msg/Odometry) has no publisher" in endpoints.absence
        assert "namespace: /ugv1'" not in endpoints.absence
        world.client.node.create_publisher(Odometry, "/rover/odom", 10)
        await until(
            lambda: "write 'namespace: /rover'" in endpoints.absence, lambda: endpoints.absence
        )


async def test_nothing_is_published_when_the_face_has_ended(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    after_all = asyncio.Event()
    async with faced(ros_domain, {"rate": "10 Hz"}) as world:
        await hears(world, STATE, "/ugv1/odom", Odometry, of_state)
        for _ in range(2):  # the second one waits for its time, up to 0.1 s
            world.bus.publish(STATE)
        await asyncio.sleep(0)
    asyncio.get_running_loop().call_later(0.2, after_all.set)  # timers end in their order
    await after_all.wait()
    assert "cannot be published" not in caplog.text
