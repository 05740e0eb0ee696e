"""What MAVROS 2.12.0 (commit f8f462d) sends to a vehicle, frame by frame, and what it waits for.

Its sources were read; here pymavlink sends the same frames. MAVROS takes the system id of its
vehicle, and component 191.
"""

import asyncio
import math
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from mavlink_gcs import GroundStation, gateway, ground_station
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import distance_m

ROVER1, UAV1 = 1, 2
COMPANION: int = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
ACK_TIMEOUT_S = 5.0


class Mavros:
    """The plugins of MAVROS that its first examples use."""

    def __init__(self, station: GroundStation, vehicle: int) -> None:
        self.station = station
        self.mav = station.mav
        self.vehicle = vehicle

    async def repeat(self) -> None:
        """sys_status: HEARTBEAT; sys_time: SYSTEM_TIME, and TIMESYNC ten times in a second."""
        manual_armed, active = 192, dialect.MAV_STATE_ACTIVE
        for number in range(10_000):
            if number % 10 == 0:
                self.mav.heartbeat_send(
                    dialect.MAV_TYPE_ONBOARD_CONTROLLER,
                    dialect.MAV_AUTOPILOT_INVALID,
                    manual_armed,
                    0,
                    active,
                )
                self.mav.system_time_send(time.time_ns() // 1000, 0)
            self.mav.timesync_send(0, time.time_ns())
            await asyncio.sleep(0.1)

    def own(self, message: Any) -> bool:
        return (message.get_srcSystem(), message.get_srcComponent()) == (self.vehicle, 1)

    async def hears(self, name: str, since: int = 0) -> Any:
        return await self.station.hears(name, self.own, since)

    async def command(self, command: int, *params: float, confirmation: int = 1) -> int:
        """command.cpp, `send_command_long_and_wait`: the first acknowledgement is the result."""
        since = len(self.station.received)
        padded = [*params, *[0.0] * (7 - len(params))]
        self.mav.command_long_send(self.vehicle, 1, command, confirmation, *padded)
        async with asyncio.timeout(ACK_TIMEOUT_S):
            answer = await self.station.hears(
                "COMMAND_ACK", lambda each: self.own(each) and each.command == command, since
            )
        assert (answer.target_system, answer.target_component) == (self.vehicle, COMPANION)
        return int(answer.result)

    async def pull(self, type_: int) -> list[Any]:
        """mission_protocol_base.cpp: a plan is asked for item by item, and acknowledged, even if it
        is empty."""
        since = len(self.station.received)
        self.mav.mission_request_list_send(self.vehicle, 1, type_)
        count = (await self.hears("MISSION_COUNT", since)).count
        items = []
        for number in range(count):
            since = len(self.station.received)
            self.mav.mission_request_int_send(self.vehicle, 1, number, type_)
            items.append(await self.hears("MISSION_ITEM_INT", since))
        self.mav.mission_ack_send(self.vehicle, 1, dialect.MAV_MISSION_ACCEPTED, type_)
        return items

    async def push(self, items: list[tuple[Any, ...]], as_int: bool) -> int:
        """waypoint.cpp, `push_cb`."""
        since = len(self.station.received)
        self.mav.mission_count_send(self.vehicle, 1, len(items), 0)
        while True:
            answer = await self.station.hears(
                ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"), self.own, since
            )
            since = self.station.received.index(answer, since) + 1
            if answer.get_type() == "MISSION_ACK":
                return int(answer.type)
            number, (frame, command, x, y, z) = answer.seq, items[answer.seq]
            head = self.vehicle, 1, number, frame, command, number == 0, 1, 0, 0, 0, math.nan
            if as_int:
                place = round(x * 1e7), round(y * 1e7), z
                self.mav.mission_item_int_send(*head, *place, 0)
            else:
                self.mav.mission_item_send(*head, x, y, z, 0)


@asynccontextmanager
async def mavros(port: int, vehicle: int) -> AsyncIterator[Mavros]:
    """MAVROS with `tgt_system:=vehicle` and all else by default."""
    async with ground_station(port, system=vehicle, component=COMPANION) as station:
        made = Mavros(station, vehicle)
        repeating = asyncio.create_task(made.repeat())
        try:
            await made.hears("HEARTBEAT")
            yield made
        finally:
            repeating.cancel()


def test_mavros_connects_and_reads_what_it_asks_for(tmp_path: Path) -> None:
    async def main() -> None:
        async with gateway(tmp_path) as (_, port), mavros(port, UAV1) as node:
            # The first requests of the version go to all.
            capabilities = dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
            node.mav.command_long_send(0, 0, capabilities, 0, 1, *[0.0] * 6)
            version = await node.hears("AUTOPILOT_VERSION")
            assert version.capabilities & dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
            asked = await node.station.hears(
                "AUTOPILOT_VERSION", lambda each: each.get_srcSystem() == ROVER1
            )
            assert asked.get_srcComponent() == 1
            assert await node.command(capabilities, 1.0, confirmation=0) == 0
            node.mav.param_request_list_send(UAV1, 1)
            count = (await node.hears("PARAM_VALUE")).param_count
            for index in range(count):
                await node.station.hears(
                    "PARAM_VALUE",
                    lambda each: node.own(each) and each.param_index == index,  # noqa: B023
                )
            assert await node.command(dialect.MAV_CMD_GET_HOME_POSITION, confirmation=0) == 0
            await node.hears("HOME_POSITION")
            assert [len(await node.pull(type_)) for type_ in range(3)] == [0, 4, 0]
            answer = await node.station.hears(
                "TIMESYNC", lambda each: node.own(each) and each.tc1 > 0
            )
            assert abs(time.time_ns() - answer.ts1) < 60e9
            node.mav.request_data_stream_send(UAV1, 1, dialect.MAV_DATA_STREAM_ALL, 10, 1)
            interval = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
            assert await node.command(interval, 30, 100_000, confirmation=0) == 0
            await node.hears("ATTITUDE", len(node.station.received))

    asyncio.run(main())


def test_mavros_flies_a_copter(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            mavros(port, UAV1) as node,
        ):
            await node.hears("HOME_POSITION")
            denied, unsupported = dialect.MAV_RESULT_DENIED, dialect.MAV_RESULT_UNSUPPORTED
            assert await node.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0
            takeoff_local = dialect.MAV_CMD_NAV_TAKEOFF_LOCAL
            assert await node.command(takeoff_local, 0, 0, 1.0, 0, 0, 0, 5.0) == unsupported
            await node.station.told("NAV_TAKEOFF_LOCAL is not carried out")
            takeoff = dialect.MAV_CMD_NAV_TAKEOFF
            assert await node.command(takeoff, 0, 0, 0, 0, 0, 0, 5.0) == 0
            await node.station.told("uav1 ends takeoff: succeeded")
            local, all_but_position = dialect.MAV_FRAME_LOCAL_NED, 1 << 11 | 7 << 6 | 7 << 3
            for _ in range(5):  # setpoint_position.cpp
                node.mav.set_position_target_local_ned_send(
                    0, UAV1, 1, local, all_but_position, 0, 0, -5, *[0.0] * 8
                )
            await node.station.told(
                "SET_POSITION_TARGET_LOCAL_NED is not carried out: send SET_POSITION_TARGET_GLOBAL"
            )
            place = 38.1082, -77.3190
            for _ in range(5):
                node.mav.set_position_target_global_int_send(
                    0,
                    *(UAV1, 1, dialect.MAV_FRAME_GLOBAL_INT, 7 << 6 | 7 << 3),
                    *(round(each * 1e7) for each in place),
                    *(68.0, *[0.0] * 8),
                )
            await node.station.told("uav1 ends goto: succeeded")
            last = [each for each in node.station.received if node.own(each)]
            position = next(
                each for each in reversed(last) if each.get_type() == "GLOBAL_POSITION_INT"
            )
            assert distance_m((position.lat / 1e7, position.lon / 1e7), place) < 2.0
            # sys_status.cpp: the armed flag of the last HEARTBEAT is added, and no answer read.
            since = len(node.station.received)
            rtl = dialect.COPTER_MODE_RTL
            node.mav.set_mode_send(UAV1, 128 | 1, rtl)
            await node.station.told("uav1 begins return_to_launch")
            result = (await node.hears("COMMAND_ACK", since)).result
            assert result == 0
            assert await node.command(dialect.MAV_CMD_NAV_LAND) == 0
            await node.station.told("uav1 begins land")
            arms = dialect.MAV_CMD_COMPONENT_ARM_DISARM
            assert await node.command(arms, 0.0) == denied
            (landing,) = [each.run for each in await control.runs() if "land" in each.mission]
            records = [str(each.record) for each in await control.records(landing)]
            assert any("mavlink 2/191 at 127.0.0.1:" in each for each in records)

    asyncio.run(main())


@pytest.mark.parametrize("as_int", [True, False])
def test_mavros_loads_a_mission_and_flies_it(tmp_path: Path, as_int: bool) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            mavros(port, UAV1) as node,
        ):
            await node.hears("HOME_POSITION")
            relative = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
            places = [(38.1082, -77.3190, 10.0), (38.1082, -77.3186, 12.0)]
            takeoff, waypoint = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_WAYPOINT
            items = [(relative, takeoff, *places[0])]
            items += [(relative, waypoint, *place) for place in places]
            assert await node.push(items, as_int) == dialect.MAV_MISSION_ACCEPTED
            pulled = await node.pull(0)
            for each, (_, command, x, y, z) in zip(pulled, items, strict=True):
                assert (each.command, each.z) == (command, z)
                # A float of MISSION_ITEM keeps a place to a metre.
                assert distance_m((each.x / 1e7, each.y / 1e7), (x, y)) < 1.0
            assert await node.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0
            node.mav.set_mode_send(UAV1, 128 | 1, dialect.COPTER_MODE_AUTO)
            for number in range(3):
                await node.station.hears(
                    "MISSION_ITEM_REACHED",
                    lambda each: node.own(each) and each.seq == number,  # noqa: B023
                )
            node.mav.mission_clear_all_send(UAV1, 1, 0)
            assert (await node.hears("MISSION_ACK", len(node.station.received) - 1)).type == 0
            (run,) = await control.runs()
            assert (await control.wait(run.run)).status == "completed"

    asyncio.run(main())


def test_only_companions_may_have_the_system_id_of_a_vehicle(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port, system=UAV1, component=190) as liar,
            mavros(port, UAV1) as node,
        ):
            liar.mav.command_long_send(UAV1, 1, 400, 0, 1, *[0.0] * 6)
            assert await node.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0
            assert not liar.received
            assert not await control.runs()

    asyncio.run(main())
