"""What simulated vehicles publish and hear, over DDS, in a process of their own."""

import asyncio
import math
from collections.abc import AsyncIterator, Iterator

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from m2pem_interfaces.msg import Detection
from m2pem_plugin_ros.frames import to_local, yaw_of_quaternion
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav_msgs.msg import Odometry
from ros_sim_watch import COMMAND, Heard, Joystick, until
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus
from std_msgs.msg import UInt32

from m2pem.api import GeoPosition, mean_sea_level_m

ORIGIN = (38.1075, -77.3192, 60.0)
SETTINGS = [
    *("sim", "ros", "--driver", "base", "--ground", "2", "--surface", "1", "--speed", "2"),
    *("--home", "38.1075,-77.3192,60", "--target", "gpr@38.10755,-77.3192"),
    *("--set", "battery=50 %"),
]


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(COMMAND, domain, SETTINGS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("watching", domain_id=domain) as ros:
        yield ros


def stamp_s(message: Odometry) -> float:
    return float(message.header.stamp.sec + message.header.stamp.nanosec / 1e9)


async def test_a_simulated_base_stands_where_it_was_put(ros: RosRuntime) -> None:
    first = await Heard(ros, Odometry, "/ugv1/odom").next()
    second = await Heard(ros, Odometry, "/ugv2/odom").next()
    assert (first.header.frame_id, first.child_frame_id) == ("map", "ugv1/base_link")
    assert yaw_of_quaternion(first.pose.pose.orientation) == pytest.approx(math.pi / 2)
    assert (second.pose.pose.position.x, second.pose.pose.position.y) == pytest.approx((5, 0))


async def test_a_simulated_base_drives_as_it_is_commanded_and_stops_without(
    ros: RosRuntime,
) -> None:
    odometry = Heard(ros, Odometry, "/ugv2/odom")
    motions = Heard(ros, UInt32, "/ugv2/motions", qos.STATUS)
    await until(lambda: odometry.last and motions.last)
    assert motions.last.data == 0
    async with Joystick(ros, "/ugv2/cmd_vel", 1.0, 0.2):
        await odometry.next(lambda m: m.twist.twist.linear.x > 0.9)
        await odometry.next(lambda m: m.twist.twist.angular.z > 0.15)
    await odometry.next(lambda m: m.twist.twist.linear.x == 0 == m.twist.twist.angular.z)
    assert odometry.last.pose.pose.position.y > 0.5
    late = Heard(ros, UInt32, "/ugv2/motions", qos.STATUS)
    assert (await until(lambda: late.last)).data == 1


async def test_its_time_passes_faster_on_request(ros: RosRuntime) -> None:
    odometry, loop = Heard(ros, Odometry, "/usv1/odom"), asyncio.get_running_loop()
    first, began_s = await odometry.next(), loop.time()
    last = await odometry.next(lambda m: stamp_s(m) - stamp_s(first) > 6)
    passed_s = loop.time() - began_s
    # On a busy computer either of them may have come a second late, and some not at all.
    assert 1.3 < (stamp_s(last) - stamp_s(first)) / passed_s < 3.5
    rate_hz = odometry.messages.index(last) / (stamp_s(last) - stamp_s(first))
    assert 4 < rate_hz < 21


async def test_satellites_agree_with_odometry(ros: RosRuntime) -> None:
    fix = await Heard(ros, NavSatFix, "/usv1/fix").next()
    assert fix.status.status == NavSatStatus.STATUS_FIX
    assert fix.position_covariance_type == NavSatFix.COVARIANCE_TYPE_APPROXIMATED
    # 60 m above mean sea level, which is 33.97 m below the ellipsoid there.
    assert fix.altitude == pytest.approx(26.03, abs=0.01)
    altitude_m = mean_sea_level_m(fix.latitude, fix.longitude, fix.altitude)
    place = to_local(GeoPosition(fix.latitude, fix.longitude, altitude_m), ORIGIN)
    assert place == pytest.approx((10, 0, 0), abs=1e-3)


async def test_its_battery_is_told(ros: RosRuntime) -> None:
    battery = await Heard(ros, BatteryState, "/usv1/battery_state").next()
    assert battery.percentage == pytest.approx(0.5, abs=0.01)
    assert battery.present
    assert battery.voltage > 20


async def test_its_diagnostics_are_told_once_a_second(ros: RosRuntime) -> None:
    heard = Heard(ros, DiagnosticArray, "/diagnostics", qos.EVENTS)

    def of_usv1() -> list[DiagnosticArray]:
        return [each for each in heard.messages if each.status[0].hardware_id == "usv1"]

    first, *_, last = await until(lambda: of_usv1()[1:6] if len(of_usv1()) > 5 else None)
    assert 3.4 < stamp_s(last) - stamp_s(first) < 7.0
    assert first.status[0].level == DiagnosticStatus.OK
    assert first.status[0].message == "all is well"


async def test_a_target_is_detected_once_when_it_is_near(ros: RosRuntime) -> None:
    found = Heard(ros, Detection, "/ugv1/detections", qos.EVENTS)
    odometry = Heard(ros, Odometry, "/ugv1/odom")
    await until(lambda: ros.node.count_publishers("/ugv1/detections"))
    async with Joystick(ros, "/ugv1/cmd_vel", 2.0):
        await odometry.next(lambda m: m.pose.pose.position.y > 2)
    async with Joystick(ros, "/ugv1/cmd_vel", -1.0):
        await odometry.next(lambda m: m.pose.pose.position.y < 0.3)
    await until(lambda: found.last)
    for _ in range(10):
        await odometry.next()
    (detection,) = found.messages
    assert (detection.type, detection.position_kind) == ("gpr", Detection.GEOGRAPHIC)
    place = detection.position_geographic
    assert (place.latitude_deg, place.longitude_deg) == pytest.approx((38.10755, -77.3192))
    assert place.altitude_m == 60
    assert detection.header.stamp.sec > 0
