"""A ground station uploads a plan to the face, and a real autopilot behind m2pem flies it."""

import asyncio
from pathlib import Path

import mavlink_sitl as sitl
import pytest
from mavlink_gcs import gateway, ground_station
from mavlink_mavsdk_world import free_port
from mavlink_plan_upload import RETURN, TAKEOFF, WAYPOINT, Item, upload
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import RunStatus

FLEET = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
"""


@pytest.mark.sitl("M2PEM_ARDUCOPTER")
def test_arducopter_flies_an_uploaded_plan(tmp_path: Path) -> None:
    async def main() -> None:
        binary = sitl.program("M2PEM_ARDUCOPTER")
        assert binary is not None
        own = free_port()
        fleet = FLEET.format(port=own)
        with sitl.running([sitl.ardupilot(binary, "quad", 0, own)], tmp_path):
            async with (
                gateway(tmp_path, speed=sitl.SPEED, fleet=fleet, commands="all") as (control, port),
                ground_station(port) as station,
            ):
                async for state in control.telemetry():
                    if getattr(state, "ready", None):
                        break
                places = [(47.39795, 8.545594, 12.0), (47.39795, 8.5459, 15.0)]
                items = [Item(TAKEOFF, places[0]), *(Item(WAYPOINT, each) for each in places)]
                items.append(Item(RETURN, frame=dialect.MAV_FRAME_MISSION))
                assert await upload(station, 1, items) == dialect.MAV_MISSION_ACCEPTED
                arm, start = dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_MISSION_START
                for command, *params in ((arm, 1.0), (start,)):
                    result = await station.command(1, command, *params)
                    assert result == dialect.MAV_RESULT_ACCEPTED
                for number in range(4):
                    await station.hears("MISSION_ITEM_REACHED", lambda each: each.seq == number)  # noqa: B023
                (run,) = await control.runs()
                assert (await control.wait(run.run)).status is RunStatus.COMPLETED

    asyncio.run(main())
