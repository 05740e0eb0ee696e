"""What ground stations ask for when they connect: each request has the answer of its protocol, and
operators read nothing that means nothing. The stations are pymavlink 2.4.50 and MAVSDK 4.1; what
MAVProxy 1.8.75 sends is sent here by pymavlink."""

import asyncio
import math
from collections.abc import Callable
from pathlib import Path
from struct import pack, unpack_from
from typing import Any

import pytest
from m2pem_plugin_mavlink.face.commands import Command, RefusedCommandError, order_of
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_gcs import FIELD, FLEET, GroundStation, gateway, ground_station
from mavlink_ground import Ground
from mavlink_simulated import specs
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import ResourceId

ROVER1, UAV1 = 1, 2
FENCE: int = dialect.MAV_SYS_STATUS_GEOFENCE
BOAT = "  boat1: {domain: surface, arbiter: sim, connection: {home: [38.1070, -77.3192]}}\n"
OUTSIDE = FLEET.replace("home: [38.1075, -77.3192]", "home: [38.0990, -77.3192]")
PLANE = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  plane1:
    domain: air
    arbiter: mavlink
    sitl: true
    connection: {{url: "udpout://{host}:{port}", system_id: 1}}
"""


def of(system: int) -> Callable[[Any], bool]:
    return lambda message: bool(message.get_srcSystem() == system)


async def asked(station: GroundStation, system: int, name: str) -> Any:
    """What comes after everything that the station has sent."""
    since = len(station.received)
    station.mav.param_request_read_send(system, 1, b"MAV_SYS_ID", -1)
    await station.hears("PARAM_VALUE", of(system), since)
    return [each for each in station.received if each.get_type() == name]


def ftp_request(sequence: int, session: int, opcode: int) -> bytes:
    return pack("<HBBBBBxI", sequence, session, opcode, 0, 0, 0, 0).ljust(251, b"\0")


async def refused_file(station: GroundStation, system: int) -> None:
    since = len(station.received)
    open_for_reading = 4
    station.mav.file_transfer_protocol_send(0, system, 1, ftp_request(65_535, 7, open_for_reading))
    answer = await station.hears("FILE_TRANSFER_PROTOCOL", of(system), since)
    assert (answer.target_system, answer.target_component) == (254, 190)
    sequence, session, opcode, size, requested = unpack_from("<HBBBB", bytes(answer.payload))
    nak, unknown_command = 129, 7
    assert (sequence, session, opcode, size, requested) == (0, 7, nak, 1, open_for_reading)
    assert answer.payload[12] == unknown_command


def test_a_fence_that_does_not_exist_or_is_kept_is_healthy(tmp_path: Path) -> None:
    """MAVProxy 1.8.75 says "fence breach" when the bit is missing from the health alone."""

    async def bits(fleet: str, system: int) -> tuple[bool, ...]:
        async with gateway(tmp_path, fleet=fleet) as (_, port), ground_station(port) as station:
            status = await station.hears("SYS_STATUS", of(system))
            kinds = ("present", "enabled", "health")
            return tuple(
                bool(getattr(status, f"onboard_control_sensors_{each}") & FENCE) for each in kinds
            )

    without = FLEET.replace("fence: field\n", "")
    assert asyncio.run(bits(without, ROVER1)) == (False, False, True)
    assert asyncio.run(bits(FLEET, ROVER1)) == (True, True, True)
    assert asyncio.run(bits(OUTSIDE, ROVER1)) == (True, True, False)
    assert asyncio.run(bits(OUTSIDE, UAV1)) == (True, True, True)


def test_keep_out_areas_of_the_fence_are_downloaded_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            station.mav.mission_request_list_send(ROVER1, 1, 1)
            count = (await station.hears("MISSION_COUNT")).count
            items = []
            for number in range(count):
                station.mav.mission_request_int_send(ROVER1, 1, number, 1)
                is_it = lambda each: each.seq == number  # noqa: B023, E731
                items.append(await station.hears("MISSION_ITEM_INT", is_it))
            kept_in = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
            kept_out = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
            assert [(each.command, each.param1) for each in items] == (
                [(kept_in, 4)] * 4 + [(kept_out, 3)] * 3
            )

    hole = "[[-77.32, 38.11], [-77.312, 38.115], [-77.315, 38.115], [-77.32, 38.11]]"
    monkeypatch.setattr("mavlink_gcs.FIELD", FIELD.replace("]]]}", f"]], {hole}]}}"))
    asyncio.run(main())


def test_files_are_refused_at_once_so_that_parameters_come_by_their_own_protocol(
    tmp_path: Path,
) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            await refused_file(station, ROVER1)
            since = len(station.received)
            station.mav.file_transfer_protocol_send(0, ROVER1, 1, ftp_request(1, 7, 129))
            assert len(await asked(station, ROVER1, "FILE_TRANSFER_PROTOCOL")) == 1
            assert since and not station.texts()

    asyncio.run(main())


def test_a_data_stream_is_sent_as_often_as_it_was_asked_for_and_ends(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            interval = dialect.MAV_CMD_GET_MESSAGE_INTERVAL
            attitude, position, home, extra1 = 30, 33, 242, 10
            for stream, rate, starts, expected in (
                (0, 10, 1, {attitude: 100_000, position: 100_000, home: 5_000_000}),
                (extra1, 2, 1, {attitude: 500_000, position: 100_000}),
                (extra1, 0, 1, {attitude: -1, position: 100_000}),
                (0, 4, 0, {attitude: -1, position: -1, home: 5_000_000}),
                (0, 65_535, 1, {attitude: 50_000}),
                (99, 1, 1, {attitude: 50_000}),
            ):
                station.mav.request_data_stream_send(ROVER1, 1, stream, rate, starts)
                for id_, interval_us in expected.items():
                    since = len(station.received)
                    assert await station.command(ROVER1, interval, id_) == 0
                    answer = await station.hears("MESSAGE_INTERVAL", since=since)
                    assert (answer.message_id, answer.interval_us) == (id_, interval_us)
            assert not station.texts()

    asyncio.run(main())


def test_requests_without_a_content_are_answered_and_not_commented(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            unsupported = dialect.MAV_RESULT_UNSUPPORTED
            for command in (
                dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION,
                dialect.MAV_CMD_REQUEST_FLIGHT_INFORMATION,
                dialect.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION,
                dialect.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS,
            ):
                assert await station.command(ROVER1, command, 1) == unsupported
            for message in (300, 397, 395, 410, 11_030):
                request = dialect.MAV_CMD_REQUEST_MESSAGE
                assert await station.command(ROVER1, request, message) == unsupported
            station.mav.log_request_list_send(ROVER1, 1, 0, 0xFFFF)
            assert (await station.hears("LOG_ENTRY", of(ROVER1))).num_logs == 0
            station.mav.log_request_end_send(ROVER1, 1)
            station.mav.param_request_read_send(ROVER1, 1, b"SYSID_THISMAV", -1)
            error = await station.hears("PARAM_ERROR", of(ROVER1))
            assert error.error == dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST
            assert (error.param_id, error.target_system) == ("SYSID_THISMAV", 254)
            station.mav.mission_request_list_send(ROVER1, 1, 2)
            rally = await station.hears("MISSION_COUNT", lambda each: each.mission_type == 2)
            assert rally.count == 0
            assert not station.texts()

    asyncio.run(main())


def test_every_vehicle_answers_pings_and_time_requests(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            for system in (ROVER1, UAV1):
                await station.hears("HEARTBEAT", of(system))
            station.mav.ping_send(1, 42, 0, 0)
            station.mav.timesync_send(0, 77)
            for system in (ROVER1, UAV1):
                ping = await station.hears("PING", of(system))
                assert (ping.seq, ping.target_system, ping.target_component) == (42, 254, 190)
                clock = await station.hears("TIMESYNC", of(system))
                place = await station.hears("SYS_STATUS", of(system))
                assert clock.ts1 == 77
                assert clock.tc1 > 0
                assert place
            station.mav.ping_send(1, 43, UAV1, 1)  # these are answers
            station.mav.timesync_send(1, 78)
            assert len(await asked(station, UAV1, "PING")) == 3
            assert len(await asked(station, UAV1, "TIMESYNC")) == 3

    asyncio.run(main())


@pytest.mark.tried_with(
    "pymavlink",
    "sets modes on the MAVLink face by their names",
    kind="MAVLink clients",
    result="the vehicle does so",
    package="pymavlink",
)
@pytest.mark.parametrize(
    ("system", "names"),
    [
        (ROVER1, {"RTL": "return_to_launch", "HOLD": "hold", "LOITER": "hold"}),
        (UAV1, {"RTL": "return_to_launch", "LAND": "land", "LOITER": "hold", "BRAKE": "hold"}),
        (4, {"RTL": "return_to_launch", "LOITER": "hold"}),
    ],
)
def test_pymavlink_sets_modes_by_the_names_that_it_gives_them(
    tmp_path: Path, system: int, names: dict[str, str]
) -> None:
    def scene(port: int) -> None:
        ground = Ground(f"udpout:127.0.0.1:{port}", system=254)
        while ground.link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.2) is None:
            ground.link.mav.heartbeat_send(6, 8, 0, 0, 0)
        ground.wait("HEARTBEAT", that=of(system))
        ground.link.sysid = ground.link.target_system = system
        ground.link.target_component = 1
        for name in names:
            ground.link.set_mode(ground.link.mode_mapping()[name])
            done = lambda each: each.get_srcSystem() == system and each.result != 5  # noqa: E731
            assert ground.wait("COMMAND_ACK", that=done).result == 0
        ground.link.set_mode(ground.link.mode_mapping()["GUIDED"])
        assert ground.wait("COMMAND_ACK", that=done).result == 0
        for name in ("AUTO", "MANUAL", "STABILIZE", "SMART_RTL"):
            if (number := ground.link.mode_mapping().get(name)) is not None:
                ground.link.set_mode(number)
                assert ground.wait("COMMAND_ACK", that=of(system)).result == 2
                said = "it has no plan" if name == "AUTO" else name
                ground.wait("STATUSTEXT", that=lambda each, said=said: said in each.text)  # type: ignore[misc]
        ground.close()

    async def main() -> None:
        async with gateway(tmp_path, fleet=FLEET + BOAT, commands="all") as (control, port):
            await asyncio.to_thread(scene, port)
            began = [each.mission.split(" of ")[0] for each in await control.runs()]
            assert set(began) == set(names.values())

    asyncio.run(main())


@pytest.mark.parametrize("asks_for", ["streams", "parameters"])
def test_a_station_that_asks_as_those_of_ardupilot_do_reads_its_modes(
    tmp_path: Path, asks_for: str
) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, fleet=FLEET + BOAT) as (_, port),
            ground_station(port) as station,
            ground_station(port, system=253) as other,
        ):
            for system, name in ((ROVER1, "HOLD"), (UAV1, "BRAKE"), (4, "LOITER")):
                await station.hears("HEARTBEAT", of(system))
                if asks_for == "streams":
                    station.mav.request_data_stream_send(system, 1, 0, 4, 1)
                else:
                    ask = ftp_request(1, 7, 4)[:12] + b"@PARAM/param.pck?withdefaults=1"
                    station.mav.file_transfer_protocol_send(0, system, 1, ask.ljust(251, b"\0"))
                    await station.hears("FILE_TRANSFER_PROTOCOL", of(system))
                since = len(station.received)
                await station.hears(
                    "HEARTBEAT",
                    lambda each: of(system)(each) and mavutil.mode_string_v10(each) == name,  # noqa: B023
                    since,
                )
                request, available_modes = dialect.MAV_CMD_REQUEST_MESSAGE, 435
                assert await station.command(system, request, available_modes) == 3
                assert await other.command(system, request, available_modes) == 0
                beats = [each for each in other.received if each.get_type() == "HEARTBEAT"]
                px4_hold = 4 << 16 | 3 << 24
                assert {each.custom_mode for each in beats if each.type != 30} == {px4_hold}

    asyncio.run(main())


@pytest.mark.parametrize(
    ("base", "rest"),
    [
        (1, [math.nan] * 4),  # MAVSDK, and the parameters that it does not use
        (29, [0.0] * 4),  # px4_map["OFFBOARD"] of pymavlink's mavutil 2.4.50
    ],
)
@pytest.mark.parametrize("as_int", [False, True])
def test_offboard_of_px4_is_not_taken_for_the_return_of_ardupilot(
    tmp_path: Path, base: int, rest: list[float], as_int: bool
) -> None:
    """Both are mode 6."""

    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(UAV1))
            mode = dialect.MAV_CMD_DO_SET_MODE
            if as_int:
                values = (base, 6, 0, rest[0], 0, 0, rest[3])
                station.mav.command_int_send(UAV1, 1, 0, mode, 0, 0, *values)
                ack = await station.hears("COMMAND_ACK", of(UAV1))
                assert ack.result == dialect.MAV_RESULT_DENIED
            else:
                answer = await station.command(UAV1, mode, base, 6, 0, *rest)
                assert answer == dialect.MAV_RESULT_DENIED
            await station.told("Offboard needs a target")
            assert not await control.runs()
            assert await station.command(UAV1, mode, base, 4, 5, *rest) == 0
            assert await station.command(UAV1, mode, base, 4, 3) == 0

    asyncio.run(main())


@pytest.mark.parametrize("asks_for_streams", [False, True])
def test_a_mode_of_both_autopilots_from_a_station_that_may_speak_to_px4_is_refused(
    tmp_path: Path, asks_for_streams: bool
) -> None:
    """PX4 enters Offboard only while targets come in; data streams are ArduPilot's."""

    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(UAV1))
            ignore_all = 0xFFF
            place = (1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
            station.mav.set_position_target_local_ned_send(0, UAV1, 1, 1, ignore_all, *place)
            if asks_for_streams:
                station.mav.request_data_stream_send(UAV1, 1, 0, 4, 1)
            rtl, land, set_mode = 6, 9, dialect.MAV_CMD_DO_SET_MODE
            answer = await station.command(UAV1, set_mode, 1, rtl)
            assert (answer == 0) is asks_for_streams
            if not asks_for_streams:
                await station.told("mode 6 is OFFBOARD of PX4 and RTL of ArduPilot")
                assert not await control.runs()
                assert await station.command(UAV1, set_mode, 1, land) == 0
                since = len(station.received)
                station.mav.set_mode_send(UAV1, 29, rtl)
                accepted = lambda each: each.result == 0  # noqa: E731
                await station.hears("COMMAND_ACK", accepted, since)

    asyncio.run(main())


@pytest.mark.parametrize(
    ("type_", "params", "behavior"),
    [
        (dialect.MAV_TYPE_QUADROTOR, (1.0, 6.0, 0.0, 0.0), "return_to_launch"),
        (dialect.MAV_TYPE_QUADROTOR, (1.0, 6.0, math.nan, 0.0), ""),
        (dialect.MAV_TYPE_QUADROTOR, (1.0, 4.0, 262.0, 0.0), ""),
        (dialect.MAV_TYPE_VTOL_QUADROTOR, (1.0, 20.0, 0.0, 0.0), "land"),
        # A plane lands by the sequence of its mission, not by QLAND.
        (dialect.MAV_TYPE_FIXED_WING, (1.0, 20.0, 0.0, 0.0), ""),
        # 6 is HOLD of ArduPilot's Blimp.
        (dialect.MAV_TYPE_AIRSHIP, (1.0, 6.0, 0.0, 0.0), ""),
    ],
)
def test_a_mode_number_means_what_the_protocol_and_the_vehicle_have(
    type_: int, params: tuple[float, float, float, float], behavior: str
) -> None:
    behaviors = ("land", "return_to_launch", "hold")
    vehicle = ShownVehicle(ResourceId("uav1"), "air", UAV1, behaviors, type=type_)
    command = Command(dialect.MAV_CMD_DO_SET_MODE, params, None, 0.0, "amsl", 0)
    if behavior:
        order = order_of(command, vehicle, None)
        assert order is not None
        assert order.behavior == behavior
    else:
        with pytest.raises(RefusedCommandError):
            order_of(command, vehicle, None)


def test_a_mavlink_plane_is_shown_as_a_plane(tmp_path: Path) -> None:
    async def main() -> None:
        async with Simulator(specs(Kind.PLANE), speed=1.0, to=None) as simulator:
            host, port = simulator[1].address
            fleet = PLANE.format(host=host, port=port)
            async with (
                gateway(tmp_path, fleet=fleet) as (_, own),
                ground_station(own) as station,
            ):
                is_plane = lambda each: each.type == dialect.MAV_TYPE_FIXED_WING  # noqa: E731
                await station.hears("HEARTBEAT", is_plane)
                station.mav.request_data_stream_send(1, 1, 0, 4, 1)
                since = len(station.received)
                beat = await station.hears("HEARTBEAT", is_plane, since)
                assert mavutil.mode_string_v10(beat) == "LOITER"

    asyncio.run(main())


def test_a_forwarded_vehicle_is_not_asked_for_files_and_streams_and_no_text_says_so(
    tmp_path: Path,
) -> None:
    async def main() -> None:
        async with Simulator(specs(Kind.ROVER), speed=1.0, to=None) as simulator:
            host, port = simulator[1].address
            fleet = PLANE.format(host=host, port=port).replace("air", "ground")
            async with (
                gateway(tmp_path, fleet=fleet, forward="all") as (_, own),
                ground_station(own) as station,
            ):
                await station.hears("HEARTBEAT", of(1))
                station.mav.request_data_stream_send(1, 1, 0, 1, 0)
                await refused_file(station, 1)
                station.mav.param_request_list_send(1, 1)
                await station.hears("PARAM_VALUE")
                assert not any("not forwarded" in each for each in station.texts())

    asyncio.run(main())
