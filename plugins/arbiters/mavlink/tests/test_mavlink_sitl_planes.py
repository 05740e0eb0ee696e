"""A real ArduPlane takes off, flies a route, circles, and lands by its stored landing."""

import asyncio
from pathlib import Path

import mavlink_sitl as sitl
import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from mavlink_sitl import HOME
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Connection, ResourceId, Route, distance_m, offset
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

PLANE = ResourceId("plane")
RELATIVE = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
READY_WITHIN_S = 120.0
WITHIN_S = 600.0
NEAR_M = 150.0
"""A plane rolls out behind the place where it touches down."""


def item(command: int, east: float, north: float, up: float) -> MissionItem:
    return MissionItem(command, RELATIVE, (0.0,) * 4, *offset(HOME[:2], east, north), up)


LANDING = (
    MissionItem(dialect.MAV_CMD_DO_LAND_START, dialect.MAV_FRAME_MISSION),
    item(dialect.MAV_CMD_NAV_WAYPOINT, 600.0, 0.0, 50.0),
    item(dialect.MAV_CMD_NAV_WAYPOINT, 300.0, 0.0, 25.0),
    item(dialect.MAV_CMD_NAV_LAND, 0.0, 0.0, 0.0),
)
ROUTE = Route(tuple((*offset(HOME[:2], *at), 60.0) for at in ((300.0, 300.0), (-300.0, 300.0))))


class Flown(ArbiterHarness):
    async def do(self, number: int, behavior: str, **parameters: object) -> None:
        await self.start(f"r1.b{number}", behavior, PLANE, **parameters)
        end = await self.ended(f"r1.b{number}", WITHIN_S)
        assert end.state == "SUCCEEDED", end


@pytest.mark.timeout(400)
@pytest.mark.sitl("M2PEM_ARDUPLANE")
@pytest.mark.parametrize("driver", ["pymavlink", "mavsdk"])
def test_a_plane_flies_a_route_circles_and_lands(tmp_path: Path, driver: str) -> None:
    binary = sitl.program("M2PEM_ARDUPLANE")
    assert binary is not None
    port = sitl.free_port()
    settings = {"url": f"udpin://127.0.0.1:{port}", "system_id": 1, "driver": driver}
    connection = Connection(PLANE, "air", settings, lost_after_s=60.0)

    async def fly() -> None:
        clock = SystemClock(float(sitl.SPEED))
        arbiter = MavlinkArbiter({PLANE: connection}, context(clock))
        async with Flown(arbiter, clock) as bench:
            vehicle = arbiter._units[PLANE].vehicle
            assert await vehicle.identified(READY_WITHIN_S)
            await vehicle.driver.upload(LANDING)
            await bench.do(1, "takeoff", altitude=60.0)
            await bench.do(2, "single_vehicle_routing", route=ROUTE)
            await bench.do(3, "hold", duration=30.0)
            assert vehicle.state.armed
            await bench.do(4, "land")
            assert vehicle.state.armed is False
            position = vehicle.state.position
            assert position is not None
            assert distance_m((position.latitude_deg, position.longitude_deg), HOME[:2]) < NEAR_M

    launch = sitl.ardupilot(binary, "plane", 60, port, 1, {"RTL_AUTOLAND": 3})
    with sitl.running([launch], tmp_path):
        asyncio.run(fly())
