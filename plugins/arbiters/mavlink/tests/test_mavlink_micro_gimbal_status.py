"""What gimbals say of themselves."""

import math
import random

import pytest
from m2pem_plugin_mavlink.microservices.gimbal_status import (
    MOST_GIMBALS,
    GimbalStatus,
    attitude_of,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from mavlink_lossy import GROUND, VEHICLE, over_the_wire
from pymavlink.dialects.v20 import ardupilotmega as dialect

ATTITUDE = message_type("GIMBAL_DEVICE_ATTITUDE_STATUS")
BOW: int = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
NORTH: int = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
LOCK: int = dialect.GIMBAL_DEVICE_FLAGS_YAW_LOCK


def attitude(roll: float, pitch: float, yaw: float, **more: float) -> Message:
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(each / 2), math.sin(each / 2)) for each in (roll, pitch, yaw)
    )
    q = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return over_the_wire(ATTITUDE.make(q=q, **more))  # type: ignore[no-any-return]


def test_angles_are_those_of_the_quaternion() -> None:
    dice = random.Random(2)
    for _ in range(200):
        roll, pitch, yaw = dice.uniform(-3, 3), dice.uniform(-1.5, 1.5), dice.uniform(-3, 3)
        found = attitude_of(attitude(roll, pitch, yaw, flags=BOW), 5.0)
        assert found is not None
        angles = (found.roll_rad, found.pitch_rad, found.yaw_from_vehicle_rad)
        assert angles == pytest.approx((roll, pitch, yaw), abs=1e-4)
        assert found.at_s == 5.0


@pytest.mark.parametrize(
    ("flags", "delta_yaw", "from_bow", "from_north"),
    [
        (BOW, 0.5, 1.0, 1.5),
        (BOW, math.nan, 1.0, None),
        (NORTH, 0.5, 0.5, 1.0),
        (NORTH, math.nan, None, 1.0),
        (LOCK, 0.5, None, 1.0),  # of before the frame was told: delta_yaw is not to be read
        (0, 0.5, 1.0, None),
        (BOW | LOCK, 3.0, 1.0, 4.0 - math.tau),
    ],
)
def test_yaw_is_told_from_the_bow_and_from_north(
    flags: int, delta_yaw: float, from_bow: float | None, from_north: float | None
) -> None:
    found = attitude_of(attitude(0.0, -0.5, 1.0, flags=flags, delta_yaw=delta_yaw), 0.0)
    assert found is not None
    for angle, expected in (
        (found.yaw_from_vehicle_rad, from_bow),
        (found.yaw_from_north_rad, from_north),
    ):
        assert angle == (None if expected is None else pytest.approx(expected, abs=1e-5))


@pytest.mark.parametrize("q", [(0, 0, 0, 0), (math.nan,) * 4, (math.inf, 0, 0, 0)])
def test_what_is_no_attitude_is_not_taken_for_one(q: tuple[float, ...]) -> None:
    assert attitude_of(ATTITUDE.make(q=q), 0.0) is None
    status = GimbalStatus()
    status.take(ATTITUDE.make(q=q), VEHICLE, 0.0)
    assert status.attitude() is None


def test_gimbals_are_told_apart() -> None:
    status = GimbalStatus()
    status.take(attitude(0, -0.1, 0, gimbal_device_id=1), VEHICLE, 1.0)
    status.take(attitude(0, -0.2, 0, gimbal_device_id=2), VEHICLE, 2.0)
    first, latest = status.attitude(1), status.attitude()
    assert first is not None
    assert latest is not None
    assert (first.pitch_rad, latest.pitch_rad) == pytest.approx((-0.1, -0.2), abs=1e-5)
    assert status.attitude(3) is None


def test_who_is_in_control_is_told() -> None:
    status = GimbalStatus()
    assert status.controller(VEHICLE) is None
    make = message_type("GIMBAL_MANAGER_STATUS").make
    status.take(make(gimbal_device_id=1), VEHICLE, 0.0)
    assert status.controller(VEHICLE) == Address(0, 0)
    ours = make(gimbal_device_id=1, primary_control_sysid=255, primary_control_compid=190)
    status.take(ours, VEHICLE, 1.0)
    assert status.controller(VEHICLE, 1) == GROUND
    assert status.controller(VEHICLE, 2) is None


def test_more_gimbals_than_can_be_take_no_memory() -> None:
    status = GimbalStatus()
    for n in range(256):
        status.take(attitude(0, 0, 0, gimbal_device_id=n), VEHICLE, 0.0)
    assert len(status.attitudes) == MOST_GIMBALS
