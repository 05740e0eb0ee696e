"""Missions that MAVSDK uploads for the arbiter, to simulated autopilots over real UDP."""

import asyncio
import math
from contextlib import asynccontextmanager

import pytest
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec
from mavlink_mavsdk_world import ONE, free_port, linked, until
from pymavlink.dialects.v20 import ardupilotmega as dialect

WAYPOINT, RELATIVE = dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
MISSION = tuple(
    MissionItem(
        WAYPOINT,
        RELATIVE,
        (0.0, 0.0, 0.0, math.nan),
        47.4 + number * 1e-4,
        8.5 - number * 1e-4,
        10.0,
    )
    for number in range(5)
)


@asynccontextmanager
async def world():
    port = free_port()
    async with (
        linked(f"udpin://127.0.0.1:{port}") as (link,),
        Simulator([VehicleSpec(estimator_s=6.0)], to=("127.0.0.1", port)) as simulator,
    ):
        await until(lambda: link.attached)
        yield link, simulator[1]


async def test_a_mission_is_stored_as_it_was_meant():
    async with world() as (link, vehicle):
        await link.perform(UploadMission(ONE, MISSION))
        stored = await link.perform(DownloadMission(ONE))
        assert len(vehicle.autopilot.plans[0]) == len(MISSION)
    assert len(stored) == len(MISSION)
    # ArduPilot puts its own home in the place of the first one.
    assert all(came.same_as(went) for came, went in zip(stored[1:], MISSION[1:], strict=True))


async def test_a_fence_is_stored_too():
    vertex = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    fence = [
        MissionItem(vertex, dialect.MAV_FRAME_GLOBAL, (3.0, 0.0, 0.0, 0.0), 47.0 + x, 8.0 + y)
        for x, y in ((0, 0), (1, 0), (0, 1))
    ]
    async with world() as (link, vehicle):
        await link.perform(UploadMission(ONE, fence, MissionType.FENCE))
        assert len(vehicle.autopilot.plans[1]) == 3


async def test_a_mission_that_the_vehicle_does_not_want_is_refused():
    unknown = MissionItem(31000, RELATIVE)
    async with world() as (link, _):
        with pytest.raises(RefusedError, match="mission refused: not supported") as refused:
            await link.perform(UploadMission(ONE, (*MISSION, unknown)))
    assert refused.value.result == dialect.MAV_MISSION_UNSUPPORTED
    assert not refused.value.temporary


async def test_an_item_that_cannot_be_sent_is_not_sent():
    nowhere = MissionItem(WAYPOINT, RELATIVE, latitude_deg=math.nan)
    async with world() as (link, vehicle):
        with pytest.raises(ExchangeError, match="nan"):
            await link.perform(UploadMission(ONE, (nowhere,)))
        assert not vehicle.autopilot.plans[0]


async def test_a_silent_vehicle_is_no_answer():
    async with world() as (link, vehicle):
        vehicle.port.inward.carry = lambda *_: None
        with pytest.raises(NoAnswerError, match="upload of the mission: MAVSDK: timeout"):
            await link.perform(UploadMission(ONE, MISSION))


async def test_an_upload_that_is_cancelled_ends_and_leaves_the_way_for_another():
    async with world() as (link, vehicle):
        carry, vehicle.port.inward.carry = vehicle.port.inward.carry, lambda *_: None
        upload = asyncio.create_task(link.perform(UploadMission(ONE, MISSION)))
        await until(lambda: link.calls.pending)
        upload.cancel()
        with pytest.raises(asyncio.CancelledError):
            await upload
        vehicle.port.inward.carry = carry
        await link.calls.finish()
        await link.perform(UploadMission(ONE, MISSION[:2]))
        assert len(vehicle.autopilot.plans[0]) == 2


async def test_closing_in_the_middle_of_an_upload_is_soon_done():
    async with world() as (link, vehicle):
        vehicle.port.inward.carry = lambda *_: None
        upload = asyncio.create_task(link.perform(UploadMission(ONE, MISSION)))
        await until(lambda: link.calls.pending)
        async with asyncio.timeout(2.0):
            await link.close()
        with pytest.raises(ExchangeError):
            await upload
