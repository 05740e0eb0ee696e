"""Programs that send garbage, too much, or do not read: nothing happens to the others."""

import asyncio
import logging
import random
from pathlib import Path

import pytest
from m2pem_plugin_mavlink.face import modes
from mavlink_gcs import gateway, ground_station, messages_dropped, stalled_station
from mavlink_mavsdk_world import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import RunStatus
from m2pem.testing import scenarios

ROVER1 = 1


def test_garbage_and_floods_change_nothing(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0) as (control, port),
            ground_station(port) as station,
            ground_station(port, system=253) as flooding,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            run = await control.start(
                scenarios.one_behavior("goto", "rover1", target="[38.1077, -77.3190]")
            )
            random_ = random.Random(1)
            for number in range(3000):
                flooding.write(random_.randbytes(random_.randrange(1, 300)))
                flooding.mav.command_long_send(ROVER1, 1, number % 4000, 0, *[float("nan")] * 7)
                flooding.mav.param_request_list_send(ROVER1, 1)
                flooding.mav.mission_item_int_send(ROVER1, 1, number, 0, 16, 0, 0, *[0] * 7)
                if number % 50 == 0:
                    await asyncio.sleep(0)
            assert (await control.wait(run)).status is RunStatus.COMPLETED
            assert len(await control.runs()) == 1
            since = len(station.received)
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1, since)
            assert await station.command(ROVER1, dialect.MAV_CMD_REQUEST_MESSAGE, 148) == 0

    asyncio.run(main())


def test_a_station_that_does_not_read_loses_messages_and_delays_nobody(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)

    async def main() -> None:
        tcp = free_port()
        async with (
            gateway(tmp_path, speed=5.0, also=f"tcpin://127.0.0.1:{tcp}") as (control, udp),
            ground_station(udp) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            async with stalled_station(tcp) as stalled:
                loop = asyncio.get_running_loop()
                name = "{}:{}".format(*stalled.getsockname())
                asking = dialect.MAVLink(None, 253, 190)
                request = dialect.MAV_CMD_REQUEST_MESSAGE
                for _ in range(700):  # each is answered with seven messages
                    message = asking.command_long_encode(
                        ROVER1, 1, request, 0, modes.AVAILABLE_MODES, *[0.0] * 6
                    )
                    await loop.sock_sendall(stalled, message.pack(asking))
                run = await control.start(
                    scenarios.one_behavior("goto", "rover1", target="[38.1077, -77.3190]")
                )
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                await station.hears("ATTITUDE", since=len(station.received))
                parser = dialect.MAVLink(None)
                parser.robust_parsing = True
                found = parser.parse_buffer(await loop.sock_recv(stalled, 4096))
                assert len(found) > 10
                assert "BAD_DATA" not in {each.get_type() for each in found[:-1]}
            assert await messages_dropped(name, caplog) > 100

    asyncio.run(main())


def test_two_stations_have_their_own_intervals_and_answers(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path) as (_, port),
            ground_station(port) as station,
            ground_station(port, system=253) as other,
        ):
            for each in (station, other):
                await each.hears("ATTITUDE", lambda message: message.get_srcSystem() == ROVER1)
            interval = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
            assert await station.command(ROVER1, interval, 30, -1) == dialect.MAV_RESULT_ACCEPTED
            since, before = len(station.received), len(other.received)
            for _ in range(3):
                number = len(other.received)
                await other.hears(
                    "ATTITUDE", lambda message: message.get_srcSystem() == ROVER1, number
                )
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1, since)
            assert not any(
                each.get_type() == "ATTITUDE" and each.get_srcSystem() == ROVER1
                for each in station.received[since:]
            )
            assert not any(each.get_type() == "COMMAND_ACK" for each in other.received[before:])

    asyncio.run(main())


def test_an_interval_that_is_changed_often_is_one_interval(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), ground_station(port) as station:
            await station.hears("ATTITUDE", lambda message: message.get_srcSystem() == ROVER1)
            interval = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
            attitude = dialect.MAVLINK_MSG_ID_ATTITUDE
            for period_us in (3.6e9, -1, 2e5) * 60:
                station.mav.command_long_send(ROVER1, 1, interval, 0, attitude, period_us, *[0] * 5)
            assert await station.command(ROVER1, interval, attitude, 2e5) == 0
            since = len(station.received)
            for _ in range(2):
                beats = len(station.received)
                await station.hears(
                    "HEARTBEAT", lambda message: message.get_srcSystem() == ROVER1, beats
                )
            attitudes = [
                each
                for each in station.received[since:]
                if each.get_type() == "ATTITUDE" and each.get_srcSystem() == ROVER1
            ]
            assert 3 <= len(attitudes) <= 15  # five in each second, between two heartbeats

    asyncio.run(main())


def test_many_senders_of_position_targets_are_few_orders(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == ROVER1)
            frame, mask = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0b110111111000
            for number in range(200):
                station.mav.srcComponent = number + 1
                x, y = round(38.1077 * 1e7), round((-77.319 + number * 1e-5) * 1e7)
                station.mav.set_position_target_global_int_send(
                    0, ROVER1, 1, frame, mask, x, y, float("nan"), *[0.0] * 8
                )
            await station.told("commands come too fast")
            await station.told("rover1 begins goto")
            assert len(await control.runs()) <= 2

    asyncio.run(main())
