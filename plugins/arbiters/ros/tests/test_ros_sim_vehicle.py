"""A simulated vehicle without ROS: odometry, satellites, battery and detectors."""

import math
from dataclasses import replace
from random import Random

import pytest
from m2pem_plugin_ros.frames import to_local
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Settings
from m2pem_plugin_ros.simulator.sensors import (
    Battery,
    Capacity,
    DetectorSpec,
    Inaccuracy,
    Odometer,
    Target,
)
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.vehicle import Vehicle

START = Pose(100.0, -50.0, math.pi / 2)


def vehicle(**differences: object) -> Vehicle:
    return Vehicle(replace(VehicleSpec("ugv1", Settings("/ugv1"), start=START), **differences))


def drive(vehicle: Vehicle, seconds: float, twist: Twist = Twist(1.0)) -> None:  # noqa: B008
    """Command it ten times a second."""
    end_s = vehicle.now_s + seconds
    while vehicle.now_s < end_s - 1e-6:
        vehicle.command(twist)
        vehicle.pass_until(vehicle.now_s + 0.1)


def test_how_often_time_passes_changes_nothing() -> None:
    often, seldom = vehicle(), vehicle()
    for each in (often, seldom):
        each.command(Twist(1.0, 0.4))
    for number in range(1, 101):
        often.pass_until(number * 0.0137)
    seldom.pass_until(1.37)
    assert often.body.pose == seldom.body.pose != START


def test_odometry_in_the_map_says_where_it_is() -> None:
    tested = vehicle()
    drive(tested, 10)
    read = tested.odometer.read(7)
    assert read.time_us == 7
    assert read.pose.east_m == pytest.approx(tested.body.pose.east_m)
    assert read.pose.north_m == pytest.approx(tested.body.pose.north_m)
    assert read.twist == tested.body.twist


def test_odometry_in_its_own_frame_begins_at_nothing() -> None:
    tested = vehicle(settings=Settings("/ugv1", odom_frame="odom"))
    assert tested.odometer.read(0).pose == Pose(0, 0, 0)
    drive(tested, 10)
    pose = tested.odometer.read(0).pose
    assert pose.east_m == pytest.approx(tested.body.pose.north_m - START.north_m)  # it drove north
    assert pose.north_m == pytest.approx(0, abs=1e-6)


def test_drift_grows_with_the_way_and_noise_does_not() -> None:
    exact, drifting = (Odometer(Pose(0, 0, 0), Inaccuracy(drift), Random(0)) for drift in (0, 0.01))
    for odometer in (exact, drifting):
        odometer.step(Twist(1.0), 10)
    assert drifting.read(0).pose.east_m == pytest.approx(10.1, abs=0.05)
    assert drifting.read(0).pose.north_m > 0.01
    noisy = Odometer(Pose(0, 0, 0), Inaccuracy(noise_m=0.1), Random(0))
    readings = [noisy.read(0).pose.east_m for _ in range(400)]
    assert abs(sum(readings) / 400) < 0.03
    assert math.sqrt(sum(x * x for x in readings) / 400) == pytest.approx(0.1, rel=0.2)


def test_frozen_odometry_says_the_same_with_the_same_stamp() -> None:
    tested = vehicle()
    before = tested.odometer.read(1)
    tested.odometer.frozen = True
    drive(tested, 2)
    assert tested.odometer.read(2) == before
    tested.odometer.frozen = False
    assert tested.odometer.read(3).pose.north_m > before.pose.north_m


def test_a_jump_is_believed_and_not_true() -> None:
    tested = vehicle()
    tested.odometer.jump(20)
    assert tested.odometer.read(0).pose.east_m == pytest.approx(START.east_m - 20)
    assert tested.body.pose == START


def test_satellites_say_where_it_is_on_earth() -> None:
    tested = vehicle()
    drive(tested, 10)
    east_m, north_m, up_m = to_local(tested.position, tested.spec.origin)
    assert (east_m, north_m) == pytest.approx(
        (tested.body.pose.east_m, tested.body.pose.north_m), abs=1e-3
    )
    assert up_m == pytest.approx(0, abs=1e-2)


def test_a_battery_drains_with_way_and_time_and_not_below_nothing() -> None:
    battery = Battery(Capacity(range_m=1000, standing_s=10_000))
    battery.drain(100, 100)
    assert battery.fraction == pytest.approx(1 - 0.1 - 0.01)
    battery.drain(5000, 0)
    assert battery.fraction == 0
    assert battery.voltage_v > 0


def test_a_standing_vehicle_drains_too() -> None:
    tested = vehicle(capacity=Capacity(standing_s=100))
    tested.pass_until(10)
    assert tested.battery.fraction == pytest.approx(0.9)


def test_each_target_is_found_once_where_it_lies() -> None:
    near, far = Target("gpr", START.east_m + 1, START.north_m + 8), Target("gpr", 0, 0)
    tested = vehicle(detectors=(DetectorSpec(range_m=2.0, targets=(near, far)),))
    tested.pass_until(1)
    assert list(tested.detections()) == []
    drive(tested, 20)
    drive(tested, 20, Twist(-1.0))
    ((detector, found),) = tested.detections()
    assert (found.type, found.east_m, found.north_m) == ("gpr", near.east_m, near.north_m)
    assert detector.hidden == 1


def test_what_lies_where_it_starts_is_found_at_once() -> None:
    target = Target("gpr", START.east_m, START.north_m)
    tested = vehicle(detectors=(DetectorSpec(targets=(target,)),))
    tested.pass_until(0.1)
    assert [found.type for _, found in tested.detections()] == ["gpr"]


def test_a_vehicle_without_detectors_detects_nothing() -> None:
    with pytest.raises(ValueError, match="ugv1 carries no detector"):
        vehicle().detect()


def test_troubles_are_named() -> None:
    tested = vehicle(battery=0.1)
    tested.gps_lost = tested.body.stuck = True
    assert tested.problems == ("no satellites", "battery low", "wheels stuck")
    assert vehicle().problems == ()
