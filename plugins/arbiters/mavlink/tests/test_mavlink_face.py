"""What ground stations see of a fleet, and what they may command; pymavlink is the other end."""

import asyncio
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.face.face import MavlinkFace
from mavlink_gcs import FLEET, HOME, gateway, ground_station, served, write_fleet
from mavlink_mavsdk_world import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem import load_fleet
from m2pem.api import LinkState, Route, RunStatus, as_geojson, distance_m
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

ROVER1, UAV1, ROVER2 = 1, 2, 3
NEAR = (38.1076, -77.3191)


def test_the_plugin_registers_the_face() -> None:
    assert PluginManager().face("mavlink") is MavlinkFace


def test_every_vehicle_is_a_system_with_its_own_position(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            types = {}
            for system in (ROVER1, UAV1, ROVER2):
                beat = await station.hears(
                    "HEARTBEAT",
                    lambda each: each.get_srcSystem() == system and each.get_srcComponent() == 1,  # noqa: B023
                )
                types[system] = beat.type
                assert beat.autopilot == dialect.MAV_AUTOPILOT_GENERIC
            assert types == {
                ROVER1: dialect.MAV_TYPE_GROUND_ROVER,
                UAV1: dialect.MAV_TYPE_QUADROTOR,
                ROVER2: dialect.MAV_TYPE_GROUND_ROVER,
            }
            for system, place in ((ROVER1, HOME), (UAV1, (38.1080, -77.3192))):
                position = await station.hears(
                    "GLOBAL_POSITION_INT",
                    lambda each: each.get_srcSystem() == system,  # noqa: B023
                )
                assert distance_m((position.lat / 1e7, position.lon / 1e7), place) < 0.1
            for name in ("ATTITUDE", "VFR_HUD", "SYS_STATUS", "GPS_RAW_INT", "EXTENDED_SYS_STATE"):
                await station.hears(name, lambda each: each.get_srcSystem() == UAV1)
            fix = await station.hears("GPS_RAW_INT", lambda each: each.get_srcSystem() == UAV1)
            # Mean sea level is 33.97 m below the ellipsoid there.
            assert abs(fix.alt_ellipsoid - fix.alt + 33_970) < 20
            home = await station.hears("HOME_POSITION", lambda each: each.get_srcSystem() == ROVER1)
            assert distance_m((home.latitude / 1e7, home.longitude / 1e7), HOME) < 0.1

    asyncio.run(main())


def test_a_vehicle_that_the_executive_holds_as_lost_sends_nothing_until_it_is_received(
    tmp_path: Path,
) -> None:
    at_home = "connection: {home: [38.1075, -77.3192]}"
    cut = f"{at_home[:-1]}, link_lost: [{{at: 2 s, for: 8 s}}]}}"

    async def main() -> None:
        fleet = FLEET.replace(at_home, cut)
        async with (
            gateway(tmp_path, fleet=fleet) as (control, port),
            ground_station(port) as station,
        ):

            def beats(system: int) -> Callable[[Any], bool]:
                own = (system, 1)
                return lambda each: (each.get_srcSystem(), each.get_srcComponent()) == own

            await station.hears("HEARTBEAT", beats(ROVER1))
            async for state in control.telemetry():
                if state.resource == "rover1" and state.link is LinkState.LOST:
                    break
            since = len(station.received)
            for _ in range(3):
                await station.hears("HEARTBEAT", beats(UAV1), len(station.received))
            sent = [each for each in station.received[since:] if each.get_type() == "HEARTBEAT"]
            assert not [each for each in sent if beats(ROVER1)(each)]
            await station.hears("HEARTBEAT", beats(ROVER1), since)

    asyncio.run(main())


def test_a_link_of_one_vehicle_has_no_other(tmp_path: Path) -> None:
    async def main() -> None:
        own = free_port()
        links = [{"url": f"udpin://127.0.0.1:{own}", "vehicles": ["uav1"]}]
        async with (
            gateway(tmp_path, speed=5.0, commands="all", links=links) as (control, port),
            ground_station(port) as every,
            ground_station(own, system=253) as one,
        ):
            takeoff, reposition = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_DO_REPOSITION
            await one.hears("HEARTBEAT")
            one.mav.command_long_send(ROVER1, 1, reposition, 0, *[0.0] * 4, *NEAR, 0.0)
            one.mav.timesync_send(0, 1)
            assert await one.command(UAV1, takeoff, *[0] * 6, 10) == dialect.MAV_RESULT_ACCEPTED
            await one.told("uav1 begins takeoff")
            await every.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            await every.told("uav1 begins takeoff")
            assert {each.get_srcSystem() for each in one.received} == {UAV1}
            assert [each.mission for each in await control.runs()] == ["takeoff of uav1"]

    asyncio.run(main())


def test_commands_are_refused_with_the_setting_that_allows_them(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (control, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            assert await station.go_to(ROVER1, NEAR) == dialect.MAV_RESULT_DENIED
            await station.told("rover1: DO_REPOSITION", "faces.mavlink.commands")
            assert not await control.runs()

    asyncio.run(main())


def test_an_allowed_command_drives_the_rover_and_the_journal_says_who_asked(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands=["rover1"]) as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            assert await station.go_to(ROVER1, NEAR) == dialect.MAV_RESULT_ACCEPTED
            await station.hears(
                "GLOBAL_POSITION_INT",
                lambda each: (
                    each.get_srcSystem() == ROVER1
                    and distance_m((each.lat / 1e7, each.lon / 1e7), NEAR) < 2.0
                ),
            )
            (run,) = await control.runs()
            assert (await control.wait(run.run)).status is RunStatus.COMPLETED
            records = [each.record for each in await control.records(run.run)]
            assert any("mavlink 254/190 at 127.0.0.1:" in str(record) for record in records)
            await station.told("rover1 begins goto")
            assert await station.go_to(ROVER2, NEAR) == dialect.MAV_RESULT_DENIED

    asyncio.run(main())


class SlowControl:
    """A `MissionControl` that begins no behavior before it is released."""

    def __init__(self, control: Any) -> None:
        self._control = control
        self.released = asyncio.Event()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._control, name)

    async def execute_behavior(self, *args: Any, **named: Any) -> Any:
        await self.released.wait()
        return await self._control.execute_behavior(*args, **named)


def test_a_command_is_in_progress_only_while_its_result_is_not_known(tmp_path: Path) -> None:
    """Simple programs take the first acknowledgement for the result."""

    async def main() -> None:
        port = free_port()
        fleet = load_fleet(str(write_fleet(tmp_path)))
        async with run_executive(fleet) as control:
            slow = SlowControl(control)
            settings = {"url": f"udpin://127.0.0.1:{port}", "commands": "all"}
            async with served(slow, **settings), ground_station(port) as station:  # type: ignore[arg-type]
                await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
                going = asyncio.create_task(station.go_to(ROVER1, NEAR))
                in_progress = dialect.MAV_RESULT_IN_PROGRESS
                await station.hears("COMMAND_ACK", lambda each: each.result == in_progress)
                slow.released.set()
                assert await going == dialect.MAV_RESULT_ACCEPTED
                since = len(station.received)
                # What is refused at once has one answer.
                assert await station.go_to(UAV1, NEAR, 10.0) == dialect.MAV_RESULT_FAILED
                answers = [each for each in station.received[since:] if is_answer(each)]
                assert len(answers) == 1

    asyncio.run(main())


def test_a_command_that_is_repeated_before_its_result_is_known_has_one_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`start_mission` of MAVSDK 4.1 fails with BUSY at IN_PROGRESS, and repeats after 0.5 s."""
    monkeypatch.setattr("m2pem_plugin_mavlink.face.orders.PROGRESS_EVERY_S", 3600.0)

    async def main() -> None:
        port = free_port()
        async with run_executive(load_fleet(str(write_fleet(tmp_path)))) as control:
            slow = SlowControl(control)
            settings = {"url": f"udpin://127.0.0.1:{port}", "commands": "all"}
            async with served(slow, **settings), ground_station(port) as station:  # type: ignore[arg-type]
                await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
                first = asyncio.create_task(station.go_to(ROVER1, NEAR))
                again = asyncio.create_task(station.go_to(ROVER1, NEAR))
                await asyncio.sleep(0)
                station.mav.param_request_read_send(ROVER1, 1, b"MAV_SYS_ID", -1)
                await station.hears("PARAM_VALUE")
                slow.released.set()
                assert await first == await again == dialect.MAV_RESULT_ACCEPTED
                assert len([each for each in station.received if is_answer(each)]) == 1

    asyncio.run(main())


def is_answer(message: Any) -> bool:
    return bool(message.get_type() == "COMMAND_ACK")


def test_a_vehicle_is_armed_for_what_follows_and_not_for_ever(tmp_path: Path) -> None:
    """pymavlink's first examples wait for the armed flag of HEARTBEAT before they go on."""

    def beats(system: int, armed: bool) -> Callable[[Any], bool]:
        flag = dialect.MAV_MODE_FLAG_SAFETY_ARMED
        return lambda each: (
            (each.get_srcSystem(), each.get_srcComponent()) == (system, 1)
            and bool(each.base_mode & flag) is armed
        )

    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            arm, takeoff = dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_NAV_TAKEOFF
            for system in (ROVER1, UAV1):
                await station.hears("HEARTBEAT", beats(system, armed=False))
                assert await station.command(system, arm, 1) == dialect.MAV_RESULT_ACCEPTED
                await station.hears("HEARTBEAT", beats(system, armed=True))
            assert not await control.runs()
            since = len(station.received)
            assert await station.command(UAV1, takeoff, *[0] * 6, 10) == 0
            await station.told("rover1: disarmed: nothing followed within 10 s")
            await station.hears("HEARTBEAT", beats(ROVER1, armed=False), since)
            assert not any("uav1: disarmed" in text for text in station.texts())
            assert await station.command(UAV1, arm, 0) == dialect.MAV_RESULT_DENIED
            assert await station.command(ROVER1, arm, 1) == dialect.MAV_RESULT_ACCEPTED
            since = len(station.received)
            assert await station.command(ROVER1, arm, 0) == dialect.MAV_RESULT_ACCEPTED
            await station.hears("HEARTBEAT", beats(ROVER1, armed=False), since)
            await control.take("rover1", by="anna")
            assert await station.command(ROVER1, arm, 1) == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await station.told("COMPONENT_ARM_DISARM: anna has it")

    asyncio.run(main())


def test_a_vehicle_that_a_mission_has_is_refused_until_the_station_takes_it(tmp_path: Path) -> None:
    async def main() -> None:
        far = f"[{HOME[0] + 0.005}, {HOME[1]}]"
        async with (
            gateway(tmp_path, speed=2.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            run = await control.start(scenarios.one_behavior("goto", "rover1", target=far))
            await station.told("rover1 begins goto")
            for command in (dialect.MAV_CMD_DO_PAUSE_CONTINUE, dialect.MAV_CMD_NAV_LOITER_UNLIM):
                result = await station.command(ROVER1, command)
                assert result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await station.told("DO_PAUSE_CONTINUE", run)
            assert await station.command(ROVER1, 32100, 1) == dialect.MAV_RESULT_ACCEPTED
            assert (await control.wait(run)).status is RunStatus.FAILED
            result = await station.command(ROVER1, dialect.MAV_CMD_DO_PAUSE_CONTINUE)
            assert result == 0
            holder = (await control.holders())["rover1"]
            assert holder.startswith("mavlink 254/190")
            async with asyncio.timeout(20):  # it is announced each five seconds
                while all(  # noqa: ASYNC110  # what is waited for has no event
                    each.by != holder for each in await control.operators()
                ):
                    await asyncio.sleep(0.05)
            async with ground_station(port, system=253) as other:
                assert await other.go_to(ROVER1, NEAR) == dialect.MAV_RESULT_TEMPORARILY_REJECTED
                await other.told("rover1: DO_REPOSITION", "mavlink 254/190")
            assert await station.command(ROVER1, 32100, 0) == dialect.MAV_RESULT_ACCEPTED
            assert not (await control.holders())["rover1"].startswith("mavlink")

    asyncio.run(main())


def test_a_station_gives_back_only_what_it_has_taken_itself(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            await control.take("rover1", by="anna")
            result = await station.command(ROVER1, 32100, 0)
            assert result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await station.told("REQUEST_OPERATOR_CONTROL", "with anna")
            assert (await control.holders())["rover1"] == "anna"

    asyncio.run(main())


def test_another_speed_on_the_way_to_a_position_target_does_not_end_the_way(
    tmp_path: Path,
) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            frame, mask = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0b110111111000
            x, y = round((HOME[0] + 0.005) * 1e7), round(HOME[1] * 1e7)
            station.mav.set_position_target_global_int_send(
                0, ROVER1, 1, frame, mask, x, y, math.nan, *[0.0] * 8
            )
            await station.told("rover1 begins goto")
            speed = dialect.MAV_CMD_DO_CHANGE_SPEED
            assert await station.command(ROVER1, speed, 1, 2.0) == dialect.MAV_RESULT_ACCEPTED
            runs = await control.runs()
            assert [each.mission for each in runs] == ["goto of rover1"] * 2
            assert sum(each.ended_us is None for each in runs) == 1

    asyncio.run(main())


def test_the_plan_is_what_the_mission_does_now_and_uploads_are_denied(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (control, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            station.mav.mission_request_list_send(ROVER1, 1, 0)
            assert (await station.hears("MISSION_COUNT")).count == 0
            run = await control.start(
                scenarios.one_behavior("single_vehicle_routing", "rover1", route="round")
            )
            await station.told("rover1 begins single_vehicle_routing")
            since = len(station.received)
            station.mav.mission_request_list_send(ROVER1, 1, 0)
            assert (await station.hears("MISSION_COUNT", since=since)).count == 3
            for number, place in enumerate(((38.1075, -77.3190), (38.1075, -77.3180))):
                station.mav.mission_request_int_send(ROVER1, 1, number, 0)
                item = await station.hears("MISSION_ITEM_INT", lambda each: each.seq == number)  # noqa: B023
                assert (item.x, item.y) == tuple(round(each * 1e7) for each in place)
            await station.hears("MISSION_CURRENT", lambda each: each.total == 3)
            station.mav.mission_request_list_send(ROVER1, 1, 1)
            fence = await station.hears("MISSION_COUNT", lambda each: each.mission_type == 1)
            assert fence.count == 4
            station.mav.mission_count_send(ROVER1, 1, 5, 0)
            answer = await station.hears("MISSION_ACK")
            assert answer.type == dialect.MAV_MISSION_DENIED
            await station.told("commands of ground stations are off")
            await control.stop(run)

    asyncio.run(main())


def test_the_plan_is_of_the_missions_own_route_and_of_one_that_was_handed_over(
    tmp_path: Path,
) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (control, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            mission = scenarios.one_behavior("single_vehicle_routing", "rover1", route="round")
            places = [(38.1075 + each / 1000, -77.319, 95.0) for each in range(5)]
            frames = ["relative", "amsl", "terrain", "amsl", "relative"]
            own = scenarios.drawn(mission, round=Route.of(places, frames))
            for source, count in ((own, 5), (mission, 2)):
                if source is mission:
                    given = as_geojson(Route(tuple(places[:2])))
                    await control.set_geometry("round", given, by="anna")
                run = await control.start(source)
                since = len(station.received)
                await station.told(f"{run} ", "rover1 begins single_vehicle_routing")
                station.mav.mission_request_list_send(ROVER1, 1, 0)
                found = await station.hears("MISSION_COUNT", since=since)
                assert found.count == count
                if source is own:
                    station.mav.mission_request_int_send(ROVER1, 1, 1, 0)
                    item = await station.hears("MISSION_ITEM_INT", since=since)
                    assert (item.frame, item.z) == (dialect.MAV_FRAME_GLOBAL_INT, 95.0)
                await control.stop(run)
                await control.wait(run)

    asyncio.run(main())


def test_parameters_messages_intervals_and_modes_on_request(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == UAV1)
            station.mav.param_request_list_send(UAV1, 1)
            first = await station.hears("PARAM_VALUE")
            for index in range(first.param_count):
                await station.hears("PARAM_VALUE", lambda each: each.param_index == index)  # noqa: B023
            station.mav.param_set_send(UAV1, 1, b"MAV_SYS_ID", 9.0, dialect.MAV_PARAM_TYPE_REAL32)
            await station.told("parameters are read-only")
            request = dialect.MAV_CMD_REQUEST_MESSAGE
            assert await station.command(UAV1, request, 148) == dialect.MAV_RESULT_ACCEPTED
            version = await station.hears("AUTOPILOT_VERSION")
            assert version.capabilities & dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2
            assert await station.command(UAV1, request, 9999) == dialect.MAV_RESULT_UNSUPPORTED
            assert await station.command(UAV1, request, 435) == dialect.MAV_RESULT_ACCEPTED
            interval, attitude = dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 30
            assert await station.command(UAV1, interval, attitude, 100) == 0
            got = dialect.MAV_CMD_GET_MESSAGE_INTERVAL
            assert await station.command(UAV1, got, attitude) == dialect.MAV_RESULT_ACCEPTED
            bounded = await station.hears("MESSAGE_INTERVAL")
            assert bounded.interval_us == 50_000
            assert await station.command(UAV1, interval, 0, -1) == dialect.MAV_RESULT_DENIED

    asyncio.run(main())


def test_payloads_are_a_camera_and_a_gimbal_that_can_be_commanded(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (_, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.type == dialect.MAV_TYPE_CAMERA)
            request = dialect.MAV_CMD_REQUEST_MESSAGE
            result = await station.command(UAV1, request, 259, component=100)
            assert result == dialect.MAV_RESULT_ACCEPTED
            camera = await station.hears("CAMERA_INFORMATION")
            assert bytes(camera.model_name).rstrip(b"\0") == b"eye"
            assert await station.command(UAV1, request, 280) == dialect.MAV_RESULT_ACCEPTED
            gimbal = await station.hears("GIMBAL_MANAGER_INFORMATION")
            assert gimbal.gimbal_device_id == camera.gimbal_device_id == 1
            nan, pitch_yaw = math.nan, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
            result = await station.command(UAV1, pitch_yaw, -30, 40, nan, nan, 0, 0, 1)
            assert result == dialect.MAV_RESULT_ACCEPTED

            def points(message: dialect.MAVLink_gimbal_device_attitude_status_message) -> bool:
                w, x, y, z = message.q
                yaw = math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
                pitch = math.degrees(math.asin(2 * (w * y - z * x)))
                return abs(yaw - 40) < 1 and abs(pitch + 30) < 1

            await station.hears("GIMBAL_DEVICE_ATTITUDE_STATUS", points)
            shoot = dialect.MAV_CMD_IMAGE_START_CAPTURE
            assert await station.command(UAV1, shoot, 0, 1, 1, component=100) == 0

    asyncio.run(main())
