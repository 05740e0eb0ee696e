"""Frames of MAVLink vehicles that pass m2pem as they are, by the rules of MAVLink routing."""

import asyncio
import logging
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_gcs import (
    FLEET,
    GroundStation,
    gateway,
    ground_station,
    messages_dropped,
    stalled_station,
)
from mavlink_mavsdk_world import free_port
from mavlink_simulated import specs
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.errors import PluginError
from m2pem.testing import scenarios

ARM: int = dialect.MAV_CMD_COMPONENT_ARM_DISARM
SET_MODE: int = dialect.MAV_CMD_DO_SET_MODE
GUIDED = 15
SYSTEM = 1

ROVER = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  rover1:
    domain: ground
    arbiter: mavlink
    sitl: true
    lost_after: 40 s
    connection: {{url: "udpout://{host}:{port}", system_id: 1}}
  rover2: {{domain: ground, arbiter: sim, connection: {{}}}}
"""


@asynccontextmanager
async def forwarding(
    folder: Path, **settings: Any
) -> AsyncIterator[tuple[Any, Simulator, GroundStation, int]]:
    """A simulated autopilot behind an executive that forwards it, and a ground station."""
    async with Simulator(specs(Kind.ROVER), speed=1.0, to=None) as simulator:
        host, port = simulator[SYSTEM].address
        fleet = ROVER.format(host=host, port=port)
        async with (
            gateway(folder, fleet=fleet, **{"forward": ["rover1"], **settings}) as (control, own),
            ground_station(own) as station,
        ):
            await station.hears("HEARTBEAT", is_autopilot)
            yield control, simulator, station, own


def is_autopilot(message: Any) -> bool:
    return message.get_srcSystem() == SYSTEM and message.get_srcComponent() == 1


def test_frames_of_a_vehicle_arrive_as_they_are_and_no_others_in_its_name(tmp_path: Path) -> None:
    async def main() -> None:
        async with forwarding(tmp_path) as (_, _, station, _):
            beats = [await station.hears("HEARTBEAT", is_autopilot)]
            since = len(station.received)
            await station.hears("GLOBAL_POSITION_INT", is_autopilot)
            beats.append(await station.hears("HEARTBEAT", is_autopilot, since))
            assert {each.autopilot for each in beats} == {dialect.MAV_AUTOPILOT_ARDUPILOTMEGA}
            numbers = [each.get_seq() for each in station.received if is_autopilot(each)]
            steps = {(b - a) % 256 for a, b in pairwise(numbers)}
            # Of frames that are addressed to m2pem alone, the station sees the numbers' gaps.
            assert 0 not in steps
            other = await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == 2)
            assert other.autopilot == dialect.MAV_AUTOPILOT_GENERIC

    asyncio.run(main())


def test_what_only_asks_passes_to_the_vehicle_and_commands_do_not(tmp_path: Path) -> None:
    async def main() -> None:
        async with forwarding(tmp_path) as (_, simulator, station, _):
            station.mav.param_request_list_send(SYSTEM, 1)
            await station.hears("PARAM_VALUE")
            request = dialect.MAV_CMD_REQUEST_MESSAGE
            assert await station.command(SYSTEM, request, 148) == dialect.MAV_RESULT_ACCEPTED
            await station.hears("AUTOPILOT_VERSION")
            mode = simulator[SYSTEM].autopilot.modes.mode.number
            assert await station.command(SYSTEM, SET_MODE, 1, GUIDED) == dialect.MAV_RESULT_DENIED
            await station.told("rover1: COMMAND_LONG is not forwarded", "forward_commands")
            station.mav.set_mode_send(SYSTEM, 1, GUIDED)
            station.mav.manual_control_send(SYSTEM, 1000, 0, 0, 0, 0)
            await station.told("SET_MODE is not forwarded")
            await station.command(SYSTEM, request, 148)
            assert simulator[SYSTEM].autopilot.modes.mode.number == mode

    asyncio.run(main())


def test_what_does_not_pass_is_refused_as_its_own_protocol_says(tmp_path: Path) -> None:
    async def main() -> None:
        async with forwarding(tmp_path) as (_, _, station, _):
            station.mav.param_request_list_send(SYSTEM, 1)
            known = await station.hears("PARAM_VALUE")
            since = len(station.received)
            name, kind = known.param_id.encode(), known.param_type
            station.mav.param_set_send(SYSTEM, 1, name, known.param_value + 1, kind)
            own = lambda each: each.param_id == known.param_id  # noqa: E731
            error = await station.hears("PARAM_ERROR", own, since)
            assert error.error == dialect.MAV_PARAM_ERROR_READ_ONLY
            value = await station.hears("PARAM_VALUE", own, since)
            assert value.param_value == known.param_value
            for send in (
                lambda: station.mav.mission_count_send(SYSTEM, 1, 3, 0),
                lambda: station.mav.mission_clear_all_send(SYSTEM, 1, 1),
            ):
                since = len(station.received)
                send()
                refused = await station.hears("MISSION_ACK", is_autopilot, since)
                assert refused.type == dialect.MAV_MISSION_DENIED
            assert refused.mission_type == 1
            await station.told("MISSION_COUNT is not forwarded", "forward_commands")
            since = len(station.received)
            station.mav.set_mode_send(SYSTEM, 1, GUIDED)
            refused = await station.hears("COMMAND_ACK", is_autopilot, since)
            assert refused.result == dialect.MAV_RESULT_DENIED

    asyncio.run(main())


def test_commands_that_pass_move_the_vehicle_and_end_what_the_mission_did(tmp_path: Path) -> None:
    async def main() -> None:
        forward = {"forward": "all", "forward_commands": ["rover1"]}
        async with forwarding(tmp_path, **forward) as (control, _, station, _):
            far = "[47.40, 8.5456]"
            run = await control.start(scenarios.one_behavior("goto", "rover1", target=far))
            await station.hears(
                "GLOBAL_POSITION_INT", lambda each: is_autopilot(each) and each.vx > 100
            )
            hold = 4
            assert await station.command(SYSTEM, SET_MODE, 1, hold) == dialect.MAV_RESULT_ACCEPTED
            summary = await control.wait(run)
            assert "TAKEN_OVER" in summary.detail

    asyncio.run(main())


def test_stations_reach_each_other_but_not_themselves_and_targets_are_kept(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            forwarding(tmp_path) as (_, _, station, port),
            ground_station(port, system=253) as other,
        ):
            await other.hears("HEARTBEAT", lambda each: each.get_srcSystem() == 254)
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == 253)
            own = [each for each in station.received if each.get_srcSystem() == 254]
            assert own == []
            since = len(other.received)
            station.mav.ping_send(1, 7, 253, 190)
            await other.hears("PING", lambda each: each.seq == 7, since)
            station.mav.ping_send(1, 8, 252, 190)
            station.mav.ping_send(1, 9, 253, 190)
            await other.hears("PING", lambda each: each.seq == 9, since)
            assert not any(
                each.get_type() == "PING" and each.seq == 8 for each in other.received[since:]
            )

    asyncio.run(main())


def test_signed_frames_and_unknown_messages_pass_between_stations_untouched(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            forwarding(tmp_path) as (_, _, station, port),
            ground_station(port, system=253) as other,
        ):
            await other.hears("HEARTBEAT", lambda each: each.get_srcSystem() == 254)
            signer = dialect.MAVLink(None, 254, 190)
            signer.signing.secret_key = b"k" * 32
            signer.signing.sign_outgoing = True
            signed = bytes(dialect.MAVLink_ping_message(1, 5, 253, 190).pack(signer))
            unknown = b"\xfd\x02\x00\x00\x05\xfe\xbe\xff\xff\x05\x03\x01\x00\x00"
            for frame in (signed, unknown):
                station.write(frame)
            await other.gets(signed)
            await other.gets(unknown)
            # For the vehicle a message that nobody knows counts as a command.
            await station.hears("HEARTBEAT", is_autopilot, len(station.received))

    asyncio.run(main())


def test_a_station_that_does_not_read_loses_forwarded_frames_and_delays_nobody(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)

    async def main() -> None:
        tcp = free_port()
        async with (
            forwarding(tmp_path, also=f"tcpin://127.0.0.1:{tcp}") as (_, _, station, port),
            ground_station(port, system=253) as other,
            stalled_station(tcp) as stalled,
        ):
            name = "{}:{}".format(*stalled.getsockname())
            await other.hears("HEARTBEAT", lambda each: each.get_srcSystem() == 254)
            for sender, receiver in ((station, other), (other, station)):
                for number in range(700):
                    sender.mav.encapsulated_data_send(number, bytes(range(1, 254)))
                    if number % 50 == 49:  # 340 kB in all, in parts that fit into a UDP buffer
                        await receiver.hears(
                            "ENCAPSULATED_DATA", lambda each, number=number: each.seqnr == number
                        )
            since = len(station.received)
            await station.hears("HEARTBEAT", is_autopilot, since)
            stalled.close()
            assert await messages_dropped(name, caplog) > 0

    asyncio.run(main())


def test_a_station_with_the_system_id_of_m2pem_is_named_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def main() -> None:
        async with (
            forwarding(tmp_path) as (_, _, _, port),
            ground_station(port, system=255) as same,
        ):
            request = dialect.MAV_CMD_REQUEST_MESSAGE
            for _ in range(2):
                assert await same.command(SYSTEM, request, 148) == dialect.MAV_RESULT_ACCEPTED

    asyncio.run(main())
    assert caplog.text.count("has system id 255, which is m2pem's own") == 1


def test_a_station_that_poses_as_the_vehicle_is_not_listened_to(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            forwarding(tmp_path) as (_, _, station, port),
            ground_station(port, system=SYSTEM, component=1) as liar,
        ):
            liar.mav.statustext_send(dialect.MAV_SEVERITY_INFO, b"a lie")
            since = len(station.received)
            await station.hears("HEARTBEAT", is_autopilot, since)
            await station.hears("HEARTBEAT", is_autopilot, len(station.received))
            assert "a lie" not in station.texts()

    asyncio.run(main())


def test_a_vehicle_that_is_simulated_is_shown_and_not_forwarded(tmp_path: Path) -> None:
    async def main() -> None:
        fleet = ROVER.format(host="127.0.0.1", port=free_port()).replace("mavlink", "sim")
        settings = {"forward": ["rover1"], "forward_commands": ["rover1"]}
        async with (
            gateway(tmp_path, fleet=fleet, **settings) as (_, port),
            ground_station(port) as station,
        ):
            shown = await station.hears("HEARTBEAT", is_autopilot)
            assert shown.autopilot == dialect.MAV_AUTOPILOT_GENERIC

    asyncio.run(main())


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"forward": ["rover1"]}, "faces.mavlink.forward: rover1: its arbiter is sim"),
        ({"forward_commands": ["rover1"]}, "faces.mavlink.forward_commands: rover1 is not one"),
        ({"commands": ["rovr1"]}, "faces.mavlink.commands: the fleet has no vehicle 'rovr1'"),
        ({"system_ids": {"rover1": 2, "uav1": 2}}, "uav1 and rover1 both have system id 2"),
        ({"links": {"url": "udpin://127.0.0.1:1"}}, "faces.mavlink.links: "),
        ({"links": [{"vehicles": ["uav1"]}]}, "faces.mavlink.links.url: a link has a URL"),
        ({"links": [{"url": "udpin://127.0.0.1:1"}]}, "links.vehicles: a link has one vehicle"),
        (
            {"links": [{"url": "udpin://127.0.0.1:1", "vehicles": ["uav7"]}]},
            "faces.mavlink.links.vehicles: the fleet has no vehicle 'uav7'",
        ),
        (
            {
                "url": "udpin://127.0.0.1:1",
                "links": [{"url": "udpin://127.0.0.1:1", "vehicles": ["uav1"]}],
            },
            "faces.mavlink.url: udpin://127.0.0.1:1 is the URL of one of `links`, too",
        ),
        ({"system_ids": {"rover1": 255}}, "faces.mavlink.system_ids.rover1: 255"),
        ({"rates": {"ATTITUDE": "100 Hz"}}, "faces.mavlink.rates.ATTITUDE: '100 Hz'"),
        (
            {"url": "udp://127.0.0.1:14550"},
            "faces.mavlink.url: udp://127.0.0.1:14550: did you mean",
        ),
        ({"uri": "x"}, "faces.mavlink.uri: there is no such setting; did you mean 'url'?"),
    ],
)
def test_wrong_settings_are_named(tmp_path: Path, settings: dict[str, Any], error: str) -> None:
    async def main() -> None:
        async with gateway(tmp_path, fleet=FLEET, **settings):
            pass

    with pytest.raises(PluginError) as raised:
        asyncio.run(main())
    assert error in str(raised.value)


def test_the_address_of_a_vehicle_is_not_one_for_ground_stations(tmp_path: Path) -> None:
    async def main() -> None:
        host, port = "127.0.0.1", free_port()
        fleet = ROVER.format(host=host, port=port).replace("udpout", "udpin")
        async with gateway(tmp_path, fleet=fleet, url=[f"udpin://{host}:{port}"]):
            pass

    with pytest.raises(PluginError, match=r"faces\.mavlink\.url: udpin://.* is where rover1 is"):
        asyncio.run(main())


def test_a_position_target_that_is_repeated_is_one_order(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", is_autopilot)
            frame, mask = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0b110111111000
            x, y = round(38.1077 * 1e7), round(-77.3190 * 1e7)
            for _ in range(30):
                station.mav.set_position_target_global_int_send(
                    0, SYSTEM, 1, frame, mask, x, y, math.nan, *[0.0] * 8
                )
                await asyncio.sleep(0.02)
            await station.told("rover1 ends goto", "succeeded")
            assert len(await control.runs()) == 1

    asyncio.run(main())
