"""The microservices over real UDP, against a simulated autopilot that speaks by pymavlink."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.microservices.commands import Command
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage, SetMessageInterval
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.microservices.missions import ClearMission, SetCurrentItem
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding, ReadParameter
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError, RefusedError
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api.clock import SystemClock

SPEED = 10.0
VEHICLE = Address(1, 1)
ITEMS = tuple(
    MissionItem(
        dialect.MAV_CMD_NAV_WAYPOINT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        latitude_deg=47.3977 + n / 1e4,
        longitude_deg=8.5456,
        altitude_m=20.0 + n,
    )
    for n in range(30)
)


@asynccontextmanager
async def linked(*sources: int) -> AsyncIterator[list[RoutedLink]]:
    """One link to a vehicle for each ground station, and it has been heard."""
    async with Simulator(
        [VehicleSpec(Kind.COPTER, estimator_s=6.0)], speed=SPEED, to=None
    ) as simulator:
        host, port = simulator[1].address
        links = []
        for source in sources or (245,):
            url = f"udpout://{host}:{port}"
            link = await open_link(VEHICLE, [url], SystemClock(SPEED), Address(source, 190))
            links.append(link)
            heard = asyncio.Event()
            stop = link.listen([0], lambda message, sender, heard=heard: heard.set())
            await heard.wait()
            stop()
        try:
            yield links
        finally:
            for link in links:
                await link.close()


async def test_missions_are_stored_read_chosen_from_and_cleared() -> None:
    async with linked() as (link,):
        await link.perform(UploadMission(VEHICLE, ITEMS))
        stored = await link.perform(DownloadMission(VEHICLE))
        assert len(stored) == len(ITEMS)
        assert all(map(MissionItem.same_as, stored[1:], ITEMS[1:]))  # item 0 is home
        await link.perform(SetCurrentItem(VEHICLE, 7))
        with pytest.raises(RefusedError):
            await link.perform(SetCurrentItem(VEHICLE, 99))
        await link.perform(ClearMission(VEHICLE))
        assert len(await link.perform(DownloadMission(VEHICLE))) <= 1


async def test_fences_are_stored_apart() -> None:
    vertex = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    fence = tuple(replace(each, command=vertex, params=(4.0, 0, 0, 0)) for each in ITEMS[:4])
    async with linked() as (link,):
        await link.perform(UploadMission(VEHICLE, fence, MissionType.FENCE))
        stored = await link.perform(DownloadMission(VEHICLE, MissionType.FENCE))
        assert [each.command for each in stored] == [vertex] * 4


async def test_two_ground_stations_do_not_take_each_others_answers() -> None:
    async with linked(245, 246) as (one, other):
        long, short = UploadMission(VEHICLE, ITEMS), UploadMission(VEHICLE, ITEMS[:3])
        ends = await asyncio.gather(one.perform(long), other.perform(short), return_exceptions=True)
        stored = await one.perform(DownloadMission(VEHICLE))
        assert len(stored) in (len(ITEMS), 3)
        for end, items in zip(ends, (ITEMS, ITEMS[:3]), strict=True):
            if end is not None:
                assert isinstance(end, RefusedError)
                assert end.temporary
                assert len(stored) != len(items)
        assert None in ends


async def test_a_parameter_is_read_and_an_unknown_one_is_not_answered() -> None:
    encoding = ParameterEncoding.C_CAST
    async with linked() as (link,):
        assert await link.perform(ReadParameter(VEHICLE, "RTL_ALT", encoding)) == 1500.0
        with pytest.raises(NoAnswerError, match="perhaps it has no such parameter"):
            await link.perform(ReadParameter(VEHICLE, "NO_SUCH_ONE", encoding))


async def test_a_refused_command_says_why() -> None:
    async with linked() as (link,):
        arm = Command(VEHICLE, dialect.MAV_CMD_COMPONENT_ARM_DISARM, (1,))
        guided = Command(VEHICLE, dialect.MAV_CMD_DO_SET_MODE, (1, 4))
        with pytest.raises(RefusedError) as refused:
            await link.perform(guided)
            await link.perform(arm)
        assert refused.value.reason.endswith(")")
        with pytest.raises(RefusedError, match="SET_MESSAGE_INTERVAL of message 60000: denied"):
            await link.perform(SetMessageInterval(VEHICLE, 60000, 1.0))


async def test_messages_are_had_once_and_regularly() -> None:
    async with linked() as (link,):
        attitude = message_type("ATTITUDE").id
        came = asyncio.Event()
        link.listen([attitude], lambda message, sender: came.set())
        assert await link.perform(SetMessageInterval(VEHICLE, attitude, 0.25)) == 0.25
        await came.wait()
        while True:  # it has no home before it has a position
            try:
                home = await link.perform(RequestMessage(VEHICLE, "HOME_POSITION", lambda m: m))
                break
            except NoAnswerError:
                continue
        assert (round(home.latitude / 1e7), round(home.longitude / 1e7)) == (47, 9)
