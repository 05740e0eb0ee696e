"""Where a vehicle is, from its topics, over real DDS."""

import logging
import math
from collections.abc import AsyncIterator, Iterator

import pytest
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sensors.localization import TopicLocalization
from m2pem_plugin_ros.settings import FixAltitude, OdomFrame, Settings
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_double import ORIGIN
from ros_sensors import PEER, TOPICS, Sensors, V, fix, odometry, until

from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import context

NAN, INF = math.nan, math.inf


@pytest.fixture
def domain() -> Iterator[int]:
    # A peer for each test: to one that others have listened to, they may seem to listen still.
    with reserved_domain() as domain, Peer(PEER, domain, TOPICS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("tested", domain_id=domain) as ros:
        yield ros


@pytest.fixture
def teller(ros: RosRuntime) -> Sensors:
    return Sensors(ros)


def localization(
    ros: RosRuntime,
    frame: OdomFrame = OdomFrame.MAP,
    fix_altitude: FixAltitude = FixAltitude.ELLIPSOID,
) -> TopicLocalization:
    settings = Settings("/evsg1", odom_frame=frame, fix_altitude=fix_altitude)
    return TopicLocalization(ros, V, settings, context(SystemClock()))


@pytest.mark.tried_with(
    "Fast DDS",
    "odometry of a robot, between processes",
    kind="ROS 2",
    result="is its pose",
    package="ros-fastrtps",
)
async def test_odometry_in_the_map_is_the_pose(ros: RosRuntime, teller: Sensors) -> None:
    where = localization(ros)
    assert (where.pose, where.twist, where.position, where.age_s) == (None, None, None, INF)
    assert where.problems == ("no odometry yet on /evsg1/odom",)
    await teller.say(odometry(30.0, 40.0, yaw=1.0, forward=1.5))
    await until(lambda: where.pose, "odometry is heard")
    assert where.pose == Pose(30.0, 40.0, pytest.approx(1.0))
    assert where.twist == Twist(1.5)
    assert where.position.latitude_deg == pytest.approx(ORIGIN[0] + 40.0 / 110_990, abs=1e-6)
    assert where.age_s < 20.0
    assert where.problems == ()


async def test_what_cannot_be_is_ignored_and_logged_once_with_a_count(
    ros: RosRuntime, teller: Sensors, caplog: pytest.LogCaptureFixture
) -> None:
    where = localization(ros)
    zero = odometry(9.0, 9.0)
    zero[1]["pose"]["pose"]["orientation"] = {"z": 0.0, "w": 0.0}
    spins = odometry(9.0, 9.0)
    spins[1]["twist"]["twist"]["angular"]["z"] = NAN
    wrong = {
        "odometry with an invalid position": [
            odometry(NAN, 0.0),
            odometry(0.0, INF),
            odometry(2e6, 0.0),
        ],
        "odometry with an invalid orientation": [odometry(9.0, 9.0, yaw=NAN), zero],
        "odometry with an invalid speed": [odometry(9.0, 9.0, forward=-INF), spins],
        "an invalid satellite fix": [
            fix(NAN, 0.0),
            fix(91.0, 0.0),
            fix(0.0, -181.0),
            fix(INF, 0.0),
        ],
    }
    await teller.say(odometry(1.0, 2.0))
    for cause, messages in wrong.items():
        await teller.say(*messages)
        counted = len(messages)
        await until(lambda c=cause, n=counted: where.log_throttle.counts[c] == n, cause)
    assert where.pose == Pose(1.0, 2.0, 0.0)
    lines = [record.message for record in caplog.records if record.levelname == "WARNING"]
    assert len(lines) == len(wrong), lines
    assert "evsg1: odometry with an invalid position: (nan, 0, 0)" in lines


def test_what_goes_on_being_wrong_is_counted_in_few_lines(
    caplog: pytest.LogCaptureFixture,
) -> None:
    log_throttle = LogThrottle(logging.getLogger("m2pem.testing"), "evsg1")
    for _ in range(2500):
        log_throttle.log("an invalid satellite fix", "(91, 0)")
    assert [record.message for record in caplog.records] == [
        "evsg1: an invalid satellite fix: (91, 0)" + so_far
        for so_far in ("", " (10 so far)", " (100 so far)", " (1000 so far)")
    ]


async def test_odometry_that_repeats_a_stamp_is_not_news(ros: RosRuntime, teller: Sensors) -> None:
    where = localization(ros)
    frozen = [odometry(5.0, 5.0, stamp=7)] * 3
    await teller.say(odometry(1.0, 1.0, stamp=7), *frozen)
    await until(lambda: where.log_throttle.counts["odometry with a repeated stamp"] == 3)
    assert where.pose.east_m == 1.0
    await teller.say(odometry(2.0, 2.0, stamp=3))
    await until(lambda: where.pose.east_m == 2.0, "a robot that was restarted is believed")


@pytest.mark.parametrize(
    ("counts_from", "altitude_m"),
    # Mean sea level is 33.97 m below the ellipsoid in Virginia.
    [(FixAltitude.ELLIPSOID, 93.97), (FixAltitude.MEAN_SEA_LEVEL, 60.0)],
)
async def test_the_altitude_of_a_fix_counts_from_what_the_vehicle_says(
    ros: RosRuntime, teller: Sensors, counts_from: FixAltitude, altitude_m: float
) -> None:
    where = localization(ros, OdomFrame.ODOM, counts_from)
    await teller.say(fix(38.1075, -77.3192, altitude=60.0))
    await until(lambda: where.position, "the fix is heard")
    assert where.position.altitude_m == pytest.approx(altitude_m, abs=0.01)


async def test_odometry_that_begins_anywhere_needs_a_fix(ros: RosRuntime, teller: Sensors) -> None:
    where = localization(ros, OdomFrame.ODOM)
    await teller.say(
        fix(80.0, 170.0, status=-1),  # no fix, whatever it says
        fix(0.0, 0.0, status=-2),  # of a receiver that has not begun
        odometry(500.0, 500.0, frame="odom"),
    )
    await until(lambda: where.twist, "odometry is heard")
    await until(lambda: where.log_throttle.counts["an invalid satellite fix"] == 1)
    assert (where.pose, where.age_s) == (None, INF)
    assert where.problems == ("no satellite fix yet",)
    await teller.say(fix(*ORIGIN[:2], altitude=NAN, status=-2))
    await until(lambda: where.pose, "the fix is heard")
    await teller.say(odometry(502.0, 501.0, frame="evsg1/odom"))
    await until(lambda: where.pose.east_m > 1.0, "how it went on is heard")
    assert where.pose.east_m == pytest.approx(2.0, abs=1e-3)
    assert where.pose.north_m == pytest.approx(1.0, abs=1e-3)
    assert where.position.altitude_m == pytest.approx(ORIGIN[2], abs=1e-3)
    assert where.problems == ()
