import asyncio
import math
import re
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from m2pem_plugin_mavlink.sitl.readiness import ready
from m2pem_plugin_mavlink.vehicle.autopilot import ModeLeftError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from mavlink_vehicle_world import (
    ACCEPTED,
    AUTO,
    BRAKE,
    DENIED,
    FAILED,
    GUIDED,
    LOITER,
    READY_FLAGS,
    RTL,
    WAITING_FLAGS,
    Playing,
    ScriptedLink,
    copter,
    fail_its_checks,
    fly,
    plane,
    rover,
)
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock

Run = Callable[[Callable[[Clock], Any]], Any]

ARM, SET_MODE = dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_DO_SET_MODE
TAKEOFF, REPOSITION = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_DO_REPOSITION
HOLD = 4
SPEED = dialect.MAV_CMD_DO_CHANGE_SPEED
THERE = TargetPosition(47.4, 8.55, 20.0)


def commands(link: ScriptedLink) -> list[int]:
    """What was commanded, in order, without the asking for streams."""
    named = [each for each in link.sent if each.TYPE.name in ("COMMAND_LONG", "COMMAND_INT")]
    asking = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
    return [each.command for each in named if each.command != asking]


async def in_the_air(link: ScriptedLink, vehicle: Vehicle) -> None:
    fly(link)
    await vehicle.until(lambda: vehicle.state.landed is False and bool(vehicle.state.armed), 5.0)


def test_arming_waits_for_a_position_then_sets_guided_then_arms(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        link.says["EKF_STATUS_REPORT"] = {"flags": WAITING_FLAGS}
        async with Playing((link, vehicle)):
            arming = asyncio.get_running_loop().create_task(vehicle.driver.arm())
            await vehicle.sleep(41.0)
            assert commands(link) == []
            link.says["EKF_STATUS_REPORT"] = {"flags": READY_FLAGS}
            await arming
            assert commands(link) == [SET_MODE, ARM]
            assert (link.custom_mode, vehicle.state.armed) == (GUIDED, True)
            await vehicle.driver.arm()
            assert commands(link) == [SET_MODE, ARM]

    virtual(main)


def test_a_vehicle_that_does_not_become_ready_is_not_armed_and_says_why(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        link.says["EKF_STATUS_REPORT"] = {"flags": WAITING_FLAGS}
        async with Playing((link, vehicle)):
            with pytest.raises(RefusedError, match=r"not ready: EKF: no position yet, 9\d s"):
                await vehicle.driver.arm()
            assert commands(link) == []

    virtual(main)


def test_a_check_that_fails_in_a_mode_that_cannot_be_armed_is_no_obstacle(virtual: Run) -> None:
    """A copter that was held on the ground is in BRAKE, disarms itself, and must take off."""

    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        bit = 0x10000000
        used = {
            "onboard_control_sensors_present": bit,
            "onboard_control_sensors_enabled": bit,
            "battery_remaining": 90,
        }
        accept = link.obey[SET_MODE]

        def obey(message: Any) -> int | None:
            link.says["SYS_STATUS"] = {**used, "onboard_control_sensors_health": bit}
            return accept(message)

        link.custom_mode, link.says["SYS_STATUS"], link.obey[SET_MODE] = BRAKE, used, obey
        async with Playing((link, vehicle)):
            assert vehicle.telemetry().ready is False
            await vehicle.driver.arm()
            assert (link.custom_mode, vehicle.state.armed) == (GUIDED, True)

    virtual(main)


def test_a_vehicle_whose_checks_fail_is_made_to_say_why(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        fail_its_checks(link, "PreArm: Compass not calibrated")
        async with Playing((link, vehicle)):
            with pytest.raises(RefusedError, match="not ready: prearm: Compass not calibrated"):
                await vehicle.driver.arm()
            assert ARM not in commands(link)

    virtual(main)


def test_guided_is_repeated_until_the_heartbeat_shows_it(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            accept, tries = link.obey[SET_MODE], []

            def obey(message: Any) -> int | None:
                tries.append(message)
                return accept(message) if len(tries) > 3 else FAILED

            link.obey[SET_MODE] = obey
            await vehicle.driver.set_mode(FlightMode.GUIDED)
            assert (len(tries), vehicle.state.custom_mode) == (4, GUIDED)
            assert vehicle.commanded.custom_mode == GUIDED

    virtual(main)


def test_a_mode_that_is_acknowledged_but_does_not_come_is_left_to_whoever_revoked_it(
    virtual: Run,
) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            link.obey[SET_MODE] = lambda _: ACCEPTED
            with pytest.raises(
                ModeLeftError,
                match=r"mode GUIDED was accepted, and then .* changed the mode to STABILIZE",
            ):
                await vehicle.driver.set_mode(FlightMode.GUIDED)
            assert commands(link) == [SET_MODE]

    virtual(main)


def test_a_mode_that_is_acknowledged_and_then_silence_is_no_success(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            link.obey[SET_MODE] = lambda _: ACCEPTED
            await link.switch_off()
            with pytest.raises(
                NoAnswerError, match="mode GUIDED was accepted, but was not confirmed"
            ):
                await vehicle.driver.set_mode(FlightMode.GUIDED)
            assert commands(link).count(SET_MODE) > 1

    virtual(main)


def test_a_pilot_who_stops_a_rover_while_it_is_armed_is_not_overridden(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(rover(clock)) as (link, vehicle):
            arm = link.obey[ARM]

            def arm_and_hold(message: Any) -> int | None:
                link.custom_mode = HOLD
                return arm(message)

            link.obey[ARM] = arm_and_hold
            with pytest.raises(ModeLeftError, match=r"it was in GUIDED, and then .* to HOLD"):
                await vehicle.driver.go_to(THERE)
            assert link.custom_mode == HOLD
            assert commands(link) == [SET_MODE, ARM]

    virtual(main)


def test_a_pilot_who_stops_a_rover_before_it_has_a_target_is_not_overridden(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(rover(clock)) as (link, vehicle):

            def refuse_outside_guided(message: Any) -> int:
                link.custom_mode = HOLD  # just before, and no heartbeat has shown it yet
                return ACCEPTED if message.param2 else DENIED

            link.obey[REPOSITION] = refuse_outside_guided
            with pytest.raises(ModeLeftError, match=r"it was in GUIDED, and then .* to HOLD"):
                await vehicle.driver.go_to(THERE)
            assert commands(link) == [SET_MODE, ARM, REPOSITION]

    virtual(main)


def test_a_mode_that_comes_without_an_acknowledgement_is_a_success(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            accept = link.obey[SET_MODE]

            def obey(message: Any) -> None:
                assert accept(message) == ACCEPTED

            link.obey[SET_MODE] = obey
            await vehicle.driver.set_mode(FlightMode.GUIDED)
            assert vehicle.state.mode is FlightMode.GUIDED

    virtual(main)


def test_a_mode_that_stays_refused_is_refused_and_not_ours(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            link.obey[SET_MODE] = lambda _: FAILED
            with pytest.raises(RefusedError):
                await vehicle.driver.set_mode(FlightMode.MISSION)
            assert (vehicle.commanded.custom_mode, vehicle.commanded.changing) == (None, 0)

    virtual(main)


@pytest.mark.parametrize("mode", [FlightMode.MANUAL, FlightMode.OTHER, FlightMode.TAKEOFF])
def test_modes_of_people_and_modes_that_are_not_there_are_not_commanded(
    virtual: Run, mode: FlightMode
) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            with pytest.raises(RefusedError):
                await vehicle.driver.set_mode(mode)
            assert commands(link) == []

    virtual(main)


def test_arming_is_tried_again_and_the_heartbeat_is_believed(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            answers: list[int | None] = [FAILED, FAILED]

            def obey(message: Any) -> int | None:
                if answers:
                    return answers.pop()
                link.armed = True
                return None  # the acknowledgement is lost

            link.obey[ARM] = obey
            await vehicle.driver.arm()
            assert vehicle.state.armed is True

    virtual(main)


def test_a_copter_takes_off_in_guided_after_arming(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await vehicle.driver.take_off(15.0)
            assert commands(link) == [SET_MODE, ARM, TAKEOFF]
            assert link.of("COMMAND_LONG", TAKEOFF)[0].param7 == 15.0

    virtual(main)


def test_a_takeoff_that_is_refused_is_tried_again_with_arming(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):

            def refuse(message: Any) -> int:
                link.armed = False
                link.heartbeat()
                del link.obey[TAKEOFF]
                return FAILED

            link.obey[TAKEOFF] = refuse
            await vehicle.driver.take_off(15.0)
            assert commands(link).count(ARM) == 2
            assert commands(link)[-1] == TAKEOFF

    virtual(main)


def test_a_takeoff_in_the_air_is_a_climb(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.take_off(30.0)
            (there,) = link.of("COMMAND_INT", REPOSITION)
            assert (there.x, there.y, there.z) == (473977420, 85455940, 30.0)
            assert TAKEOFF not in commands(link)

    virtual(main)


def test_what_drives_neither_takes_off_nor_lands(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(rover(clock)) as (link, vehicle):
            with pytest.raises(RefusedError, match="a rover does not take off"):
                await vehicle.driver.take_off(10.0)
            with pytest.raises(RefusedError, match="a rover does not land"):
                await vehicle.driver.land()
            assert commands(link) == []

    virtual(main)


@pytest.mark.parametrize(("frame", "number"), [("relative", 3), ("amsl", 0), ("terrain", 10)])
def test_a_place_is_told_in_its_altitude_frame(virtual: Run, frame: str, number: int) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.go_to(TargetPosition(47.4, 8.55, 20.0, frame), 5.0)
            (there,) = link.of("COMMAND_INT", REPOSITION)
            assert (there.frame, there.x, there.y, there.z) == (
                number, 474_000_000, 85_500_000, 20.0,
            )  # fmt: skip
            assert (there.param1, there.param2) == (-1.0, 0.0)
            (speed,) = link.of("COMMAND_LONG", SPEED)
            assert speed.param2 == 5.0
            assert commands(link) == [SET_MODE, REPOSITION, SPEED]

    virtual(main)


def test_a_rover_gets_its_speed_after_its_target_as_it_takes_none_without(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(rover(clock)) as (link, vehicle):
            link.obey[SPEED] = lambda _: ACCEPTED if REPOSITION in commands(link) else FAILED
            link.obey[REPOSITION] = lambda message: FAILED if message.param1 > 0 else ACCEPTED
            await vehicle.driver.go_to(THERE, 2.0)
            assert commands(link)[-2:] == [REPOSITION, SPEED]

    virtual(main)


def test_a_place_without_a_height_is_at_the_height_that_it_has(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.go_to(TargetPosition(47.4, 8.55, heading_rad=math.pi / 2))
            (there,) = link.of("COMMAND_INT", REPOSITION)
            assert (there.frame, there.z) == (0, 498.0)
            (yaw,) = link.of("COMMAND_LONG", dialect.MAV_CMD_CONDITION_YAW)
            assert yaw.param1 == pytest.approx(90.0)

    virtual(main)


def test_a_copter_on_the_ground_goes_nowhere_and_a_rover_is_armed(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            with pytest.raises(RefusedError, match="it must take off first"):
                await vehicle.driver.go_to(THERE)
            assert commands(link) == []
        async with Playing(rover(clock)) as (link, vehicle):
            await vehicle.driver.go_to(THERE)
            assert link.armed
            assert link.of("COMMAND_INT", REPOSITION)[0].z == 0.0

    virtual(main)


def test_a_copter_brakes_and_where_that_is_refused_loiters(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await vehicle.driver.stop()
            assert commands(link) == []  # it is not armed
            await in_the_air(link, vehicle)
            await vehicle.driver.stop()
            await vehicle.driver.stop()
            assert link.custom_mode == BRAKE
            accept = link.obey[SET_MODE]
            link.custom_mode = GUIDED
            await vehicle.until(lambda: vehicle.state.custom_mode == GUIDED)
            link.obey[SET_MODE] = lambda each: FAILED if each.param2 == BRAKE else accept(each)
            await vehicle.driver.stop()
            assert link.custom_mode == LOITER

    virtual(main)


def test_orbits_are_for_planes(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            assert await vehicle.driver.orbit(THERE, 30.0, None) is False
            assert commands(link) == []
        async with Playing(plane(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            assert await vehicle.driver.orbit(THERE, 80.0, None) is True
            assert link.of("COMMAND_INT", REPOSITION)[0].param3 == 80.0

    virtual(main)


def test_velocities_go_out_in_guided_and_do_not_fight_for_it(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.move((3.0, 1.0, -0.5))
            (setpoint,) = link.of("SET_POSITION_TARGET_LOCAL_NED")
            assert (setpoint.vx, setpoint.vy, setpoint.vz) == (3.0, 1.0, -0.5)
            assert (setpoint.type_mask, setpoint.coordinate_frame) == (0xDC7, 1)
            link.custom_mode = LOITER
            await vehicle.until(lambda: vehicle.state.custom_mode == LOITER)
            with pytest.raises(ExchangeError, match="it is in mode LOITER now"):
                await vehicle.driver.move((3.0, 1.0, -0.5))
            assert link.custom_mode == LOITER

    virtual(main)


def test_a_return_is_rtl_and_a_disarming_is_noted_as_ours(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.return_home()
            assert link.custom_mode == RTL
            await vehicle.driver.disarm()
            assert (link.armed, vehicle.commanded.disarming) == (False, True)

    virtual(main)


def test_a_disarming_in_flight_is_refused_once(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            link.obey[ARM] = lambda _: FAILED
            with pytest.raises(RefusedError):
                await vehicle.driver.disarm()
            assert (commands(link), vehicle.commanded.disarming) == ([ARM], False)

    virtual(main)


def test_a_mission_on_the_ground_is_started_armed_and_with_its_first_item(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await vehicle.driver.start_mission()
            assert (link.custom_mode, link.armed) == (AUTO, True)
            assert commands(link)[-1] == dialect.MAV_CMD_MISSION_START

    virtual(main)


def test_a_plane_is_armed_last_since_it_sets_out_then(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(plane(clock)) as (link, vehicle):
            await vehicle.driver.start_mission()
            assert commands(link)[-1] == ARM
            assert link.custom_mode == 10

    virtual(main)


def test_a_second_mission_is_begun_by_leaving_auto_first(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        async with Playing((link, vehicle)):
            await in_the_air(link, vehicle)
            link.custom_mode = AUTO
            assert await vehicle.until(lambda: vehicle.state.custom_mode == AUTO, 3.0)
            await vehicle.driver.start_mission()
            modes = [int(each.param2) for each in link.of("COMMAND_LONG", SET_MODE)]
            assert modes == [GUIDED, AUTO]

    virtual(main)


@pytest.mark.parametrize(("state", "words"), [(2, "not started"), (4, "paused"), (1, "has none")])
def test_a_mission_that_does_not_begin_is_a_failure(virtual: Run, state: int, words: str) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        async with Playing((link, vehicle)):
            await in_the_air(link, vehicle)
            link.says["MISSION_CURRENT"] = {"seq": 1, "total": 3, "mission_state": state}
            with pytest.raises(NoAnswerError, match=f"the mission does not begin: .*{words}.*AUTO"):
                await vehicle.driver.start_mission()
            link.says["MISSION_CURRENT"] = {"seq": 1, "total": 3, "mission_state": 3}
            await vehicle.driver.start_mission()
            link.says["MISSION_CURRENT"] = {"seq": 1, "total": 3}  # it does not say it
            await vehicle.driver.start_mission()

    virtual(main)


def test_home_is_not_counted_among_the_items(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            driver = vehicle.driver
            assert (driver.current_item, driver.reached_item) == (None, None)
            link.says["MISSION_CURRENT"] = {"seq": 0, "total": 3}
            await vehicle.until(lambda: vehicle.state.mission_sequence == 0, 3.0)
            assert driver.current_item is None
            link.says["MISSION_CURRENT"] = {"seq": 3, "total": 3}
            await vehicle.until(lambda: vehicle.state.mission_sequence == 3, 3.0)
            assert driver.current_item == 2

    virtual(main)


def test_a_plane_that_waits_in_rtl_for_its_ground_station_is_ready_when_it_has_a_position(
    virtual: Run,
) -> None:
    """It cannot be armed in RTL, and takes off in another mode."""

    async def main(clock: Clock) -> None:
        link, vehicle = plane(clock)
        bit = dialect.MAV_SYS_STATUS_PREARM_CHECK
        link.says["SYS_STATUS"] = {
            "onboard_control_sensors_present": bit,
            "onboard_control_sensors_enabled": bit,
        }
        link.says["EKF_STATUS_REPORT"] = {"flags": WAITING_FLAGS}
        link.custom_mode = 11
        async with Playing((link, vehicle)):
            waits = asyncio.get_running_loop().create_task(ready([vehicle], print))
            await clock.sleep(5.0)
            assert not waits.done()
            link.says["EKF_STATUS_REPORT"] = {"flags": READY_FLAGS}
            await clock.sleep(5.0)
            assert waits.done()
            await waits

    virtual(main)


def test_what_the_vehicles_of_a_fleet_are_waited_for_is_said_every_few_seconds(
    virtual: Run,
) -> None:
    said: list[str] = []

    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        async with Playing((link, vehicle)):
            link.says["EKF_STATUS_REPORT"] = {"flags": WAITING_FLAGS}
            await clock.sleep(2.0)
            waits = asyncio.get_running_loop().create_task(ready([vehicle], said.append))
            await clock.sleep(11.0)
            await link.switch_off()
            await clock.sleep(15.0)
            link.says["EKF_STATUS_REPORT"] = {"flags": READY_FLAGS}
            link.switch_on()
            await waits

    virtual(main)
    assert len(said) == 5
    assert re.fullmatch(r"waiting for uav1: EKF: no position yet, \d+ s", said[1])
    assert re.fullmatch(r"waiting for uav1: silent for \d+ s", said[-1])
