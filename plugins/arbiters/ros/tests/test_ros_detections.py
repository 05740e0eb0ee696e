"""Detections from topics of any type, published by plain rclpy over real DDS."""

import asyncio
from typing import Any

import pytest
from geographic_msgs.msg import GeoPoint, GeoPointStamped
from geometry_msgs.msg import PointStamped
from m2pem_plugin_ros.installation import RosError
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_double import ORIGIN, at
from ros_face_client import Client, until
from ros_sensors import AMPLE_S, GPR, connected
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Float32, String

from m2pem.api import Detection, PayloadState

TAGGED = {"latitude": 38.1075, "longitude": -77.3192, "altitude": 5.0}
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def found(bench: Any) -> list[Detection]:
    return [d for s in bench.states if isinstance(s, PayloadState) for d in s.detections]


async def publish(client: Client, bench: Any, topic: str, message: Any, qos: Any = 10) -> Detection:
    """Publish again and again, with where the vehicle is, until something is detected."""
    odometry = Odometry()
    odometry.header.frame_id = "map"
    where = client.node.create_publisher(Odometry, "/evsg1/odom", 10)
    what = client.node.create_publisher(type(message), topic, qos)
    async with asyncio.timeout(AMPLE_S):
        while not found(bench):
            where.publish(odometry)
            what.publish(message)
            await asyncio.sleep(0.05)
    return found(bench)[0]


async def test_a_number_above_a_bound_is_a_detection_where_the_vehicle_is(ros_domain: int) -> None:
    smoke = {
        "topic": "/smoke",
        "message": "std_msgs/msg/Float32",
        "when": "data > 0.7",
        "type": "smoke ${data}",
    }
    async with connected(ros_domain, {GPR: smoke}) as bench, Client(ros_domain) as client:
        low = client.node.create_publisher(Float32, "/smoke", 10)
        low.publish(Float32(data=0.5))
        seen = await publish(client, bench, "/smoke", Float32(data=0.75), BEST_EFFORT)
        for _ in range(10):  # it has become true once
            low.publish(Float32(data=0.75))
        assert (seen.type, seen.source) == ("smoke 0.75", GPR)
        own = seen.position
        expected = pytest.approx(ORIGIN, abs=1e-6)
        assert (own.latitude_deg, own.longitude_deg, own.altitude_m) == expected
        assert {each.type for each in found(bench)} == {"smoke 0.75"}


@pytest.mark.parametrize(
    ("type_", "path", "message"),
    [
        ("sensor_msgs/NavSatFix", ".", NavSatFix(**TAGGED)),
        (
            "geographic_msgs/GeoPointStamped",
            "position",
            GeoPointStamped(position=GeoPoint(**TAGGED)),
        ),
    ],
)
async def test_a_place_in_the_message_is_that_of_the_detection(
    ros_domain: int, type_: str, path: str, message: Any
) -> None:
    tag = {"topic": "/tag", "message": type_, "type": "tag", "position": path}
    async with connected(ros_domain, {GPR: tag}) as bench, Client(ros_domain) as client:
        seen = (await publish(client, bench, "/tag", message)).position
    assert (seen.latitude_deg, seen.longitude_deg) == (38.1075, -77.3192)
    # 5 m above the ellipsoid, which is 33.97 m above mean sea level there.
    assert seen.altitude_m == pytest.approx(38.97, abs=0.01)


async def test_a_point_in_the_message_is_in_the_frame_of_its_header(ros_domain: int) -> None:
    mine = {
        "topic": "mine",
        "message": "geometry_msgs/msg/PointStamped",
        "type": "mine",
        "position": "point",
    }
    async with connected(ros_domain, {GPR: mine}) as bench, Client(ros_domain) as client:
        message = PointStamped()
        message.header.frame_id = "map"
        message.point.x, message.point.y = 10.0, 20.0
        seen = (await publish(client, bench, "/evsg1/mine", message)).position
    expected = pytest.approx(at(10.0, 20.0).position[:2], abs=1e-7)
    assert (seen.latitude_deg, seen.longitude_deg) == expected


async def test_a_message_that_does_not_fit_is_no_detection(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    words = {"topic": "/w", "message": "std_msgs/String", "type": "x", "when": "data - 1 > 2"}
    async with connected(ros_domain, {GPR: words}) as bench, Client(ros_domain) as client:
        publisher = client.node.create_publisher(String, "/w", 10)
        async with asyncio.timeout(AMPLE_S):
            while not any("`when`" in each for each in caplog.messages):
                publisher.publish(String(data="x"))
                await asyncio.sleep(0.05)
        assert found(bench) == []


async def test_a_topic_of_another_type_is_named(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    smoke = {"topic": "/smoke", "message": "std_msgs/msg/Float32", "type": "smoke"}
    async with connected(ros_domain, {GPR: smoke}), Client(ros_domain) as client:
        client.node.create_publisher(String, "/smoke", 10)
        said = "evsg1/gpr: /smoke is published as std_msgs/msg/String by /client, but its "
        await until(lambda: any(each.startswith(said) for each in caplog.messages))


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ({"message": "smoke_msgs/msg/Smoke"}, "the ROS package smoke_msgs is not installed"),
        ({"message": "std_msgs/msg/Flot32"}, "did you mean 'Float32'"),
        ({"position": "data"}, "'data' of std_msgs/msg/Float32 is neither a point"),
        ({"position": "pose"}, "'pose' of std_msgs/msg/Float32 is neither a point"),
    ],
)
async def test_what_cannot_be_subscribed_is_named(
    ros_domain: int, said: dict[str, Any], problem: str
) -> None:
    smoke = {"topic": "/smoke", "message": "std_msgs/msg/Float32", "type": "smoke", **said}
    with pytest.raises(RosError, match=problem) as raised:
        async with connected(ros_domain, {GPR: smoke}):
            pass
    assert str(raised.value).startswith("evsg1/gpr: connection: ")
