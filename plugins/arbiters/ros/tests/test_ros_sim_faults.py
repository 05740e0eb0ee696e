"""What goes wrong with a simulated base on request, while it runs, over DDS."""

import math
from collections.abc import AsyncIterator, Iterator

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from m2pem_interfaces.msg import Detection
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav_msgs.msg import Odometry
from ros_sim_watch import COMMAND, Heard, Joystick, insist, switch, until
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus
from std_msgs.msg import UInt32

FOR = "for 15 s"
"""Three real seconds. On a busy computer it takes one of them until that is seen."""

SETTINGS = ["sim", "ros", "--driver", "base", "--ground", "2", "--speed", "5"]
QUIET_S = 0.3
"""At five times the speed, odometry comes every 0.02 s."""


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(COMMAND, domain, SETTINGS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("watching", domain_id=domain) as ros:
        yield ros


@pytest.fixture
async def odometry(ros: RosRuntime) -> Heard:
    heard = Heard(ros, Odometry, "/ugv1/odom")
    await heard.next()
    return heard


async def test_a_silent_vehicle_says_nothing_and_then_goes_on(
    ros: RosRuntime, odometry: Heard
) -> None:
    fix, other = Heard(ros, NavSatFix, "/ugv1/fix"), Heard(ros, Odometry, "/ugv2/odom")
    await fix.next()
    assert (await switch(ros, f"ugv1: silent {FOR}")).successful
    await odometry.silence(QUIET_S)
    await fix.silence(QUIET_S)
    assert ros.node.count_publishers("/ugv1/odom") == 1
    await other.next()
    await odometry.next()
    await fix.next()


@pytest.mark.long
async def test_odometry_alone_may_stop(ros: RosRuntime, odometry: Heard) -> None:
    fix = Heard(ros, NavSatFix, "/ugv1/fix")
    await switch(ros, f"ugv1: stop odometry {FOR}")
    await odometry.silence(QUIET_S)
    await fix.next()
    await odometry.next()


@pytest.mark.long
async def test_odometry_may_freeze_at_a_stamp(ros: RosRuntime, odometry: Heard) -> None:
    await switch(ros, f"ugv1: freeze odometry {FOR}")
    await until(lambda: len(odometry) > 2 and odometry.messages[-2] == odometry.messages[-1])
    frozen = odometry.last
    assert await odometry.next() == frozen
    await odometry.next(lambda m: m.header.stamp != frozen.header.stamp)


async def test_odometry_may_be_no_number(ros: RosRuntime, odometry: Heard) -> None:
    await switch(ros, f"ugv1: odometry nan {FOR}")
    await odometry.next(lambda m: math.isnan(m.pose.pose.position.x))
    await odometry.next(lambda m: math.isfinite(m.pose.pose.position.x))


async def test_odometry_may_jump(ros: RosRuntime, odometry: Heard) -> None:
    before = odometry.last.pose.pose.position
    await switch(ros, "ugv1: jump 20 m")
    await odometry.next(lambda m: m.pose.pose.position.x == pytest.approx(before.x - 20, abs=0.1))
    assert odometry.last.pose.pose.position.y == pytest.approx(before.y, abs=0.1)


async def test_wheels_that_are_stuck_do_not_obey(ros: RosRuntime, odometry: Heard) -> None:
    motions = Heard(ros, UInt32, "/ugv1/motions", qos.STATUS)
    before = (await until(lambda: motions.last)).data
    await switch(ros, f"ugv1: stuck {FOR}")
    async with Joystick(ros, "/ugv1/cmd_vel", 1.0):
        await until(lambda: ros.node.count_subscribers("/ugv1/cmd_vel"))
        seen = len(odometry)
        await until(lambda: len(odometry) > seen + 20)
        assert len({each.pose.pose.position.y for each in odometry.messages[seen : seen + 20]}) == 1
        assert motions.last.data == before
        await odometry.next(lambda m: m.twist.twist.linear.x > 0.5)
        await until(lambda: motions.last.data > before)


@pytest.mark.long
async def test_satellites_may_be_lost(ros: RosRuntime, odometry: Heard) -> None:
    fix = Heard(ros, NavSatFix, "/ugv1/fix")
    diagnostics = Heard(ros, DiagnosticArray, "/diagnostics", qos.EVENTS)
    await switch(ros, f"ugv1: lose gps {FOR}")
    lost = await fix.next(lambda m: m.status.status == NavSatStatus.STATUS_NO_FIX)
    assert math.isnan(lost.latitude)
    warning = await diagnostics.next(lambda m: m.status[0].message == "no satellites")
    assert warning.status[0].level == DiagnosticStatus.WARN
    assert warning.status[0].hardware_id == "ugv1"
    await fix.next(lambda m: m.status.status == NavSatStatus.STATUS_FIX)


async def test_a_battery_may_be_set(ros: RosRuntime) -> None:
    battery = Heard(ros, BatteryState, "/ugv2/battery_state")
    await switch(ros, "ugv2: battery 30 %")
    await battery.next(lambda m: m.percentage == pytest.approx(0.3, abs=0.001))


async def test_something_may_be_detected_now(ros: RosRuntime) -> None:
    found = Heard(ros, Detection, "/ugv2/detections", qos.EVENTS)
    await until(lambda: ros.node.count_publishers("/ugv2/detections"))
    assert (await insist(ros, "ugv2: detect mine", found)).type == "mine"


async def test_a_node_may_die_and_come_back_where_it_was(ros: RosRuntime, odometry: Heard) -> None:
    async with Joystick(ros, "/ugv1/cmd_vel", 1.0):
        await odometry.next(lambda m: m.twist.twist.linear.x > 0.5)
    await odometry.next(lambda m: m.twist.twist.linear.x == 0)
    before = (await odometry.next()).pose.pose.position
    await switch(ros, f"ugv1: kill {FOR}")
    await until(lambda: ros.node.count_publishers("/ugv1/odom") == 0)
    assert ros.node.count_publishers("/ugv2/odom") == 1
    heard = len(odometry)
    await until(lambda: ros.node.count_publishers("/ugv1/odom") == 1)
    after = (await odometry.next()).pose.pose.position
    assert len(odometry) > heard
    assert (after.x, after.y) == pytest.approx((before.x, before.y))
    async with Joystick(ros, "/ugv1/cmd_vel", -1.0):
        await odometry.next(lambda m: m.twist.twist.linear.x < -0.5)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("ugv1: sulk", "'sulk' is no action. Actions: silent; kill"),
        ("ugv7: silent", "there is no vehicle ugv7; there are: ugv1, ugv2"),
        ("ugv1: lie", "ugv1 is a plain base"),
    ],
)
async def test_what_cannot_happen_is_refused_with_what_would_be_right(
    ros: RosRuntime, words: str, reason: str
) -> None:
    answer = await switch(ros, words)
    assert not answer.successful
    assert reason in answer.reason
