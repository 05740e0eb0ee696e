import math

import pytest
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.sensors.localization import PoseEstimator
from m2pem_plugin_ros.settings import OdomFrame

from m2pem.api import GeoPosition

ORIGIN = (38.1075, -77.3192, 60.0)


def fix(east: float, north: float, up: float = 0.0) -> GeoPosition:
    return to_geodetic(east, north, up, ORIGIN)


def local(where: PoseEstimator) -> tuple[float, float]:
    assert where.position is not None
    return to_local(where.position, ORIGIN)[:2]


def test_odometry_in_the_map_is_the_pose_whatever_the_receiver_says() -> None:
    where = PoseEstimator(OdomFrame.MAP, ORIGIN)
    where.odometry(Pose(10.0, 20.0, 0.5), Twist(1.0))
    where.fix(fix(300.0, 300.0))
    assert where.pose == Pose(10.0, 20.0, 0.5)
    assert where.twist == Twist(1.0)
    assert local(where) == pytest.approx((10.0, 20.0), abs=1e-3)


def test_without_odometry_the_position_is_the_fix_and_there_is_no_pose() -> None:
    for frame in OdomFrame:
        where = PoseEstimator(frame, ORIGIN)
        assert where.position is None
        where.fix(fix(3.0, 4.0))
        assert where.pose is None
        assert local(where) == pytest.approx((3.0, 4.0), abs=1e-3)


@pytest.mark.parametrize("fix_first", [True, False])
def test_odometry_that_begins_anywhere_goes_on_from_the_fix(fix_first: bool) -> None:
    where = PoseEstimator(OdomFrame.ODOM, ORIGIN)
    first = [lambda: where.fix(fix(100.0, 50.0)), lambda: where.odometry(Pose(-7, 9, 1), Twist())]
    for say in first if fix_first else reversed(first):
        assert where.pose is None
        say()
    assert where.pose.east_m == pytest.approx(100.0, abs=1e-3)
    where.odometry(Pose(-4.0, 10.0, 1.2), Twist())
    assert where.pose.east_m == pytest.approx(103.0, abs=1e-3)
    assert where.pose.north_m == pytest.approx(51.0, abs=1e-3)
    assert where.pose.yaw_rad == 1.2
    where.fix(fix(90.0, 40.0))
    assert local(where) == pytest.approx((90.0, 40.0), abs=1e-3)


def test_a_fix_without_an_altitude_is_as_high_as_the_origin() -> None:
    where = PoseEstimator(OdomFrame.ODOM, ORIGIN)
    where.fix(GeoPosition(ORIGIN[0], ORIGIN[1], math.nan))
    assert where.position.altitude_m == ORIGIN[2]
    where.odometry(Pose(0.0, 0.0, 0.0, 0.0), Twist())
    assert where.pose.up_m == pytest.approx(0.0, abs=1e-6)
