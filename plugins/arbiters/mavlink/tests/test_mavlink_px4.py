import asyncio
import math
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, RefusedError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.modes import px4_mode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from mavlink_vehicle_world import (
    ACCEPTED,
    DENIED,
    FAILED,
    Playing,
    ScriptedLink,
    fail_its_checks,
    fly,
    make,
    px4,
)
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock

Run = Callable[[Callable[[Clock], Any]], Any]

ARM, SET_MODE = dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_DO_SET_MODE
TAKEOFF, REPOSITION = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_DO_REPOSITION
ORBIT = dialect.MAV_CMD_DO_ORBIT
AUTO_TAKEOFF, AUTO_LOITER, AUTO_MISSION = px4_mode(4, 2), px4_mode(4, 3), px4_mode(4, 4)
POSCTL, POSCTL_ORBIT, OFFBOARD = px4_mode(3), px4_mode(3, 1), px4_mode(6)


async def in_the_air(link: ScriptedLink, vehicle: Vehicle) -> None:
    fly(link)
    link.custom_mode = AUTO_LOITER
    await vehicle.until(
        lambda: vehicle.state.landed is False and vehicle.state.custom_mode == AUTO_LOITER, 5.0
    )


def enters(link: ScriptedLink, mode: int) -> Callable[[Any], int]:
    def obey(_: Any) -> int:
        link.custom_mode = mode
        return ACCEPTED

    return obey


def test_modes_are_commanded_by_main_and_sub_mode(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await vehicle.driver.set_mode(FlightMode.MISSION)
            (command,) = link.of("COMMAND_LONG", SET_MODE)
            assert (command.param1, command.param2, command.param3) == (1.0, 4.0, 4.0)
            assert vehicle.driver.mode_name(vehicle.state.custom_mode or 0) == "AUTO.MISSION"

    virtual(main)


def test_a_mission_that_was_just_uploaded_is_tried_again_while_it_is_denied(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            accept, ready_s = link.obey[SET_MODE], link.now_s() + 3.0

            def obey(message: Any) -> int | None:
                return accept(message) if link.now_s() > ready_s else DENIED

            link.obey[SET_MODE] = obey
            await vehicle.driver.set_mode(FlightMode.MISSION)
            assert vehicle.state.custom_mode == AUTO_MISSION

    virtual(main)


def test_a_heartbeat_from_before_its_mission_ended_does_not_show_that_the_next_one_is_flown(
    virtual: Run,
) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            link.custom_mode = AUTO_MISSION
            await vehicle.until(lambda: vehicle.state.custom_mode == AUTO_MISSION, 5.0)
            link.custom_mode = AUTO_LOITER
            accept, ready_s = link.obey[SET_MODE], link.now_s() + 0.1

            def obey(message: Any) -> int | None:
                return accept(message) if link.now_s() > ready_s else DENIED

            link.obey[SET_MODE] = obey
            await vehicle.driver.set_mode(FlightMode.MISSION)
            assert link.custom_mode == AUTO_MISSION

    virtual(main)


def test_a_px4_copter_arms_in_a_mode_that_holds_and_takes_off_to_a_height_above_the_sea(
    virtual: Run,
) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            link.obey[TAKEOFF] = enters(link, AUTO_TAKEOFF)
            await vehicle.driver.take_off(12.0)
            (takeoff,) = link.of("COMMAND_LONG", TAKEOFF)
            assert takeoff.param7 == 500.0
            assert math.isnan(takeoff.param5)
            kinds = [message.command for message in link.of("COMMAND_LONG")]
            assert kinds.index(SET_MODE) < kinds.index(ARM) < kinds.index(TAKEOFF)

    virtual(main)


def test_a_vehicle_whose_checks_fail_is_made_to_say_why(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = px4(clock)
        fail_its_checks(link, "Preflight: GPS fix too low")
        async with Playing((link, vehicle)):
            with pytest.raises(RefusedError, match="not ready: prearm: GPS fix too low"):
                await vehicle.driver.arm()
            assert not link.of("COMMAND_LONG", ARM)

    virtual(main)


def test_a_place_is_told_by_its_height_above_the_sea(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.go_to(TargetPosition(47.4, 8.55, 20.0, heading_rad=1.5), 6.0)
            await vehicle.driver.go_to(TargetPosition(47.4, 8.55))
            first, second = link.of("COMMAND_INT", REPOSITION)
            assert (first.frame, first.z, first.param1) == (0, 508.0, 6.0)
            assert first.param4 == 1.5
            assert math.isnan(second.z)
            assert math.isnan(second.param4)
            with pytest.raises(RefusedError, match="no heights above terrain"):
                await vehicle.driver.go_to(TargetPosition(47.4, 8.55, 20.0, "terrain"))

    virtual(main)


def test_a_refused_place_is_a_refusal_although_the_mode_is_right_already(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            link.obey[REPOSITION] = lambda _: DENIED
            with pytest.raises(RefusedError):
                await vehicle.driver.go_to(TargetPosition(47.4, 8.55, 20.0))

    virtual(main)


def test_a_px4_copter_orbits_by_command_where_it_can(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            link.obey[ORBIT] = enters(link, POSCTL_ORBIT)
            assert await vehicle.driver.orbit(TargetPosition(47.4, 8.55, 20.0), 30.0, 4.0) is True
            (orbit,) = link.of("COMMAND_INT", ORBIT)
            assert (orbit.param1, orbit.param2, orbit.z) == (30.0, 4.0, 508.0)
            assert vehicle.state.mode is FlightMode.ORBIT
            link.obey[ORBIT] = lambda _: dialect.MAV_RESULT_UNSUPPORTED
            assert await vehicle.driver.orbit(TargetPosition(47.4, 8.55, 20.0), 30.0, 4.0) is False

    virtual(main)


def test_offboard_has_setpoints_before_and_during_its_entry(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            accept = link.obey[SET_MODE]
            before: list[int] = []

            def obey(message: Any) -> int | None:
                before.append(len(link.of("SET_POSITION_TARGET_LOCAL_NED")))
                return accept(message) if len(before) > 1 else FAILED

            link.obey[SET_MODE] = obey
            await vehicle.driver.move((1.0, 2.0, 0.0))
            assert vehicle.state.custom_mode == OFFBOARD
            assert before[0] >= 5
            assert before[1] - before[0] >= 4
            sent = len(link.of("SET_POSITION_TARGET_LOCAL_NED"))
            await vehicle.driver.move((1.0, 2.0, 0.0))
            await vehicle.sleep(1.0)
            assert len(link.of("SET_POSITION_TARGET_LOCAL_NED")) == sent + 1

    virtual(main)


def test_a_move_that_is_given_up_sends_no_more_setpoints(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            moving = asyncio.get_running_loop().create_task(vehicle.driver.move((1.0, 2.0, 0.0)))
            await vehicle.sleep(0.5)
            moving.cancel()
            await asyncio.wait([moving])
            sent = len(link.sent)
            await vehicle.sleep(2.0)
            assert len(link.sent) == sent > 0

    virtual(main)


def test_velocities_do_not_fight_for_offboard(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.move((1.0, 2.0, 0.0))
            link.custom_mode = POSCTL
            await vehicle.until(lambda: vehicle.state.custom_mode == POSCTL)
            with pytest.raises(ExchangeError, match="it is in mode POSCTL now"):
                await vehicle.driver.move((1.0, 2.0, 0.0))
            await vehicle.driver.stop()
            assert link.custom_mode == AUTO_LOITER

    virtual(main)


def test_a_stop_ends_a_way_to_a_place_too(virtual: Run) -> None:
    """It goes to places in the mode in which it holds: to enter that mode would stop nothing."""

    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            await vehicle.driver.go_to(TargetPosition(47.4, 8.55, 20.0))
            await vehicle.driver.stop()
            (nowhere,) = link.of("COMMAND_LONG", REPOSITION)
            assert link.sent[-1] is nowhere
            assert nowhere.param2 == dialect.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
            place = (nowhere.param4, nowhere.param5, nowhere.param6, nowhere.param7)
            assert all(map(math.isnan, place))

    virtual(main)


def test_items_are_counted_from_the_first_real_one(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            link.says["MISSION_CURRENT"] = {"seq": 0, "total": 3}
            await vehicle.until(lambda: vehicle.driver.current_item == 0, 3.0)
            await vehicle.driver.start_mission(2)
            assert (link.custom_mode, link.armed) == (AUTO_MISSION, True)

    virtual(main)


def test_an_item_of_the_mission_before_that_it_still_repeats_does_not_count(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(px4(clock)) as (link, vehicle):
            await in_the_air(link, vehicle)
            set_current = dialect.MAV_CMD_DO_SET_MISSION_CURRENT

            def obey(_: Any) -> int:
                link.hear(make("MISSION_ITEM_REACHED", seq=1))
                link.says["MISSION_CURRENT"] = {"seq": 0, "total": 2, "mission_state": 3}
                return ACCEPTED

            link.obey[set_current] = obey
            await vehicle.driver.start_mission()
            assert vehicle.driver.reached_item is None
            link.hear(make("MISSION_ITEM_REACHED", seq=1))
            assert vehicle.driver.reached_item == 1

    virtual(main)
