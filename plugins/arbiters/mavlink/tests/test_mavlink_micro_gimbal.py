"""Commanding gimbals through their manager."""

import math
from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.commands import REASON_S
from m2pem_plugin_mavlink.microservices.gimbal import (
    Aim,
    FindGimbal,
    Gimbal,
    YawFrame,
    point,
    pointing,
    release,
    stop,
    take_control,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, NoAnswerError
from mavlink_lossy import GROUND, VEHICLE, Played, play_table, run
from mavlink_peers import Commanded, ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

INFORMATION = message_type("GIMBAL_MANAGER_INFORMATION")
LEVEL = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK


def manages(command: Any, vehicle: Commanded) -> Sequence[Message]:
    if command.command == dialect.MAV_CMD_REQUEST_MESSAGE:
        tells = [INFORMATION.make(gimbal_device_id=n, pitch_min=-1.5, yaw_max=n) for n in (1, 2)]
        return ack(command.command), *tells
    aim = command.param1, command.param2
    if vehicle.effects[-1:] != [aim]:
        vehicle.effects.append(aim)
    return (ack(command.command),)


def test_a_gimbal_is_found_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, _: Commanded) -> None:
        if played.error is None:
            assert (played.result.device, played.result.yaw_rad[1]) == (2, 2.0)

    play_table(
        lambda: (FindGimbal(VEHICLE, 2), Commanded(manages)),
        check,
        lambda _: RETRIES.bound_s + REASON_S,
    )
    assert run(FindGimbal(VEHICLE), Commanded(manages)).result.device == 1


def test_a_gimbal_points_once_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Commanded) -> None:
        assert len(vehicle.effects) <= 1
        assert isinstance(played.error, NoAnswerError) or len(vehicle.effects) == 1

    play_table(
        lambda: (point(VEHICLE, Aim(-1.0, 0.5)), Commanded(manages)),
        check,
        lambda _: RETRIES.bound_s,
    )


def test_angles_are_sent_in_degrees_and_rates_left_alone() -> None:
    vehicle = Commanded(manages)
    run(point(VEHICLE, Aim(-math.pi / 4, 1.5 * math.pi), 2), vehicle)
    sent = vehicle.received[0]
    assert (sent.param1, sent.param2) == pytest.approx((-45.0, -90.0))
    assert math.isnan(sent.param3)
    assert math.isnan(sent.param4)
    assert (sent.param5, sent.param7) == (LEVEL, 2)


def test_yaw_from_north_is_locked() -> None:
    aim = Aim(yaw_rad=1.0, yaw_frame=YawFrame.NORTH)
    message = pointing(VEHICLE, aim)
    assert message.flags == LEVEL | dialect.GIMBAL_MANAGER_FLAGS_YAW_LOCK
    assert message.yaw == 1.0
    assert math.isnan(message.pitch)


def test_control_is_taken_and_given_back() -> None:
    vehicle = Commanded(manages)
    assert run(take_control(VEHICLE, GROUND), vehicle).error is None
    assert run(release(VEHICLE), vehicle).error is None
    taken, released = vehicle.received
    assert (taken.param1, taken.param2, taken.param3, taken.param4) == (255, 190, -1, -1)
    assert (released.param1, released.param2, released.param3) == (-3, -3, -1)


@pytest.mark.parametrize("angle_rad", [math.nan, math.inf])
def test_no_gimbal_points_nowhere(angle_rad: float) -> None:
    with pytest.raises(ValueError, match="is not an angle"):
        Aim(angle_rad)
    with pytest.raises(ValueError, match="is not an angle"):
        Aim(yaw_rad=angle_rad)


def test_a_gimbal_is_stopped_by_a_rate_of_nothing() -> None:
    gimbal = Commanded(lambda heard, _: (ack(heard.command),))
    assert run(stop(VEHICLE, YawFrame.NORTH, 3), gimbal).error is None
    (heard,) = gimbal.received
    assert heard.command == dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
    assert math.isnan(heard.param1)
    assert math.isnan(heard.param2)
    assert (heard.param3, heard.param4, heard.param7) == (0.0, 0.0, 3)
    assert int(heard.param5) == LEVEL | dialect.GIMBAL_MANAGER_FLAGS_YAW_LOCK


def test_what_a_gimbal_can_do_is_in_its_capabilities() -> None:
    locks = dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
    plain = Gimbal(VEHICLE, 1, 0, (-1.0, 1.0), (-1.0, 1.0))
    able = Gimbal(VEHICLE, 1, locks | 2048, (-1.0, 1.0), (-1.0, 1.0))
    assert (plain.locks_yaw, plain.has_endless_yaw) == (False, False)
    assert (able.locks_yaw, able.has_endless_yaw) == (True, True)
