"""What measures a team over ROS finds the errors that were made on purpose, and no others."""

import math

import numpy as np
import pytest

from bench.column.pointing import Mount, along_sector, at_target
from bench.column.series import Array, Heard, Series, errors
from bench.column.spacing import Way, gaps_m

TIMES_S = np.arange(0.0, 20.0, 0.05)
SPEED_M_S = 4.0
MOUNT = Mount(forward_m=0.5, left_m=0.0, up_m=3.0)


def driving(ahead_m: Array | float = 0.0, yaw_rad: float = 0.0) -> Series:
    """A vehicle that drives along a straight line."""
    along = SPEED_M_S * TIMES_S + ahead_m
    zero = np.zeros_like(TIMES_S)
    return Series(
        TIMES_S,
        np.stack([along * math.cos(yaw_rad), along * math.sin(yaw_rad), zero, zero + yaw_rad], 1),
    )


def looking(pan_rad: Array, tilt_rad: Array) -> Series:
    return Series(TIMES_S, np.stack([pan_rad, tilt_rad], axis=1))


def test_clocks_are_told_apart_by_the_message_that_was_quickest() -> None:
    heard = Heard()
    for number, delay_s in enumerate([0.3, 0.001, 2.0, 0.001]):
        heard.add(1000.0 + number, 5.0 + number + delay_s, float(number))
    series = heard.series()
    assert series.times_s == pytest.approx([5.001, 6.001, 7.001, 8.001])
    assert series.values[:, 0] == pytest.approx([0, 1, 2, 3])


def test_a_gap_that_opens_is_measured_along_the_way() -> None:
    behind = -20.0 - np.where(TIMES_S > 10, 1.5, 0.0)
    gaps = gaps_m([driving(yaw_rad=1.0), driving(behind, 1.0)], 2.0, 19.0)
    off = errors((gaps - 20.0).ravel())
    assert off.most == pytest.approx(1.5, abs=0.01)
    assert off.rms == pytest.approx(1.5 * math.sqrt(9 / 17), abs=0.03)


def test_on_a_bend_the_way_counts_and_not_the_distance() -> None:
    angles = np.linspace(0.0, math.pi, 200)
    way = Way([(30 * math.cos(each), 30 * math.sin(each)) for each in angles])
    first, last = way.along_m(np.array([[30.0, 0.0]])), way.along_m(np.array([[-30.0, 0.0]]))
    assert last - first == pytest.approx([30 * math.pi], abs=0.1)


def test_a_way_that_was_not_driven_is_none() -> None:
    with pytest.raises(ValueError, match="did not move"):
        gaps_m([Series(TIMES_S, np.zeros((len(TIMES_S), 4)))], 1.0, 2.0)


def test_a_camera_beside_its_target_is_found_out_from_a_moving_vehicle() -> None:
    target = np.array([60.0, 40.0, 12.0])
    vehicle = driving()
    eyes = vehicle.values[:, :3] + np.array([0.5, 0.0, 3.0])
    wanted = target - eyes
    pan = np.arctan2(wanted[:, 1], wanted[:, 0])
    tilt = np.arctan2(wanted[:, 2], np.hypot(wanted[:, 0], wanted[:, 1]))
    tilt = tilt + math.radians(0.7) * (TIMES_S > 10) + math.radians(5.0) * (TIMES_S < 1.0)
    looked = at_target(vehicle, looking(pan, tilt), MOUNT, target, (0.0, 19.0))
    assert looked.acquired_s == pytest.approx(1.0, abs=0.06)
    assert math.degrees(errors(looked.off_rad).most) == pytest.approx(0.7, abs=0.01)
    assert looked.moving.all()


def test_a_camera_that_never_got_there_has_no_error_but_was_never_on_its_target() -> None:
    pan = np.full_like(TIMES_S, 1.0)
    looked = at_target(driving(), looking(pan, pan), MOUNT, np.array([500.0, 0.0, 0.0]), (0.0, 9.0))
    assert looked.acquired_s == math.inf
    assert len(looked.off_rad) == 0


@pytest.mark.parametrize(("rate", "lag_deg"), [(1.0, 0.0), (0.9, 3.0)])
def test_a_sweep_that_is_not_steady_is_found_out(rate: float, lag_deg: float) -> None:
    # From heading 0 to 60 degrees at 12 deg/s, on a vehicle that heads east, in a turn to the left.
    yaw = 0.1 * TIMES_S
    swept_s = np.clip(TIMES_S - 2.0, 0.0, 5.0 / rate) * rate
    heading = np.radians(12.0) * swept_s
    zero = np.zeros_like(TIMES_S)
    vehicle = Series(TIMES_S, np.stack([zero, zero, zero, yaw], axis=1))
    head = looking(math.pi / 2 - heading - yaw, zero - math.radians(4.0))
    sector = 0.0, math.radians(60.0), math.radians(-4.0)
    looked = along_sector(vehicle, head, sector, math.radians(12.0), (0.5, 12.0))
    most_deg = math.degrees(errors(looked.off_rad).most)
    # At 0.9 of the speed, half of the sweep takes 0.28 s longer, in which it makes 3 deg.
    assert most_deg == pytest.approx(lag_deg, abs=0.1)
    assert not looked.moving.any()
