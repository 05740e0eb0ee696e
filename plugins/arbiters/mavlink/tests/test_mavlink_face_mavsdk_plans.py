"""The calls of MAVSDK's own examples that fly missions, orbits and fences, on a mixed fleet."""

import math
from pathlib import Path
from typing import Any

import pytest
from mavlink_mavsdk_client import ROVER1, UAV1, Client, at, first, fleet_on
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.geofence import GeofenceAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import OrbitYawBehavior
from mavsdk.plugins.geofence import FenceType, GeofenceData, Point, Polygon
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.telemetry import FlightMode

from m2pem.api import distance_m

PLACES = ((38.1081, -77.3192), (38.1082, -77.3191), (38.1081, -77.3190))


def mission_item(place: tuple[float, float]) -> MissionItem:
    """As the example `mission` makes it: 25 m high, 10 m/s, without a stop."""
    none, no_action = math.nan, 0
    return MissionItem(
        *place, 25.0, 10.0, True, none, none, no_action, none, none, none, none, none, no_action
    )


@pytest.mark.tried_with(
    "MAVSDK",
    "uploads a mission on the MAVLink face and flies it, as its example `mission` does",
    kind="MAVLink clients",
    result="flown, and returned",
    package="mavsdk",
)
def test_mavsdk_flies_a_mission_with_a_pause(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        mission, action = sdk.plugin(MissionAsync, UAV1), sdk.plugin(ActionAsync, UAV1)
        telemetry = sdk.plugin(TelemetryAsync, UAV1)
        await mission.set_return_to_launch_after_mission(True)
        await mission.upload_mission(MissionPlan([mission_item(each) for each in PLACES]))
        await action.arm()
        await mission.start_mission()
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.MISSION)
        await first(mission.subscribe_mission_progress(), lambda each: each.current >= 1)
        await mission.pause_mission()
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.HOLD)
        (run,) = await control.runs()
        assert run.status == "paused"
        await mission.start_mission()
        await first(mission.subscribe_mission_progress(), lambda each: each.current == each.total)
        assert await mission.is_mission_finished()
        await first(telemetry.subscribe_in_air(), lambda each: not each)
        assert (await control.wait(run.run)).status == "completed"
        back = await mission.download_mission()
        places = [(each.latitude_deg, each.longitude_deg) for each in back.mission_items]
        assert [distance_m(a, b) < 0.1 for a, b in zip(places, PLACES, strict=True)] == [True] * 3

    fleet_on(tmp_path, main, commands="all")


def test_mavsdks_raw_mission_is_driven_by_a_rover(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        raw, telemetry = sdk.plugin(MissionRawAsync, ROVER1), sdk.plugin(TelemetryAsync, ROVER1)
        places = ((38.1076, -77.3192), (38.1077, -77.3191))
        items = [
            RawItem(
                *(number, 3, 16, number == 0, 1, 0.0, 10.0, 0.0, math.nan),
                *(round(each * 1e7) for each in place),
                *(30.0, 0),
            )
            for number, place in enumerate(places)
        ]
        await raw.upload_mission(items)
        assert [(each.x, each.y, each.z) for each in await raw.download_mission()] == [
            (each.x, each.y, each.z) for each in items
        ]
        await raw.start_mission()
        await first(raw.subscribe_mission_progress(), lambda each: each.current == each.total)
        await first(telemetry.subscribe_position(), at(places[1], 2.0))
        (run,) = await control.runs()
        assert run.mission == "plan of rover1"
        await raw.clear_mission()
        assert await raw.download_mission() == []

    fleet_on(tmp_path, main, commands="all")


def test_mavsdk_circles_a_place_within_a_fence(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        action, telemetry = sdk.plugin(ActionAsync, UAV1), sdk.plugin(TelemetryAsync, UAV1)
        fence = sdk.plugin(GeofenceAsync, UAV1)
        home = await first(telemetry.subscribe_home(), lambda _: True)
        latitude, longitude = home.latitude_deg, home.longitude_deg
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        points = [Point(latitude + 0.0004 * y, longitude + 0.0004 * x) for y, x in corners]
        inside = Polygon(points, FenceType.INCLUSION)
        await fence.upload_geofence(GeofenceData([inside], []))
        await action.arm()
        await action.takeoff()
        await first(telemetry.subscribe_in_air(), bool)
        front, high_m = OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, home.absolute_altitude_m + 10
        with pytest.raises(Exception, match="FAILED"):
            await action.do_orbit(90.0, 2.0, front, latitude, longitude, high_m)
        await action.do_orbit(10.0, 2.0, front, latitude, longitude, high_m)
        away = lambda each: distance_m(  # noqa: E731
            (each.latitude_deg, each.longitude_deg), (latitude, longitude)
        )
        await first(telemetry.subscribe_position(), lambda each: abs(away(each) - 10.0) < 2.0)
        # MAVSDK 4.1 sends the altitude above sea level in a frame that is above home.
        on_circle = lambda each: each.relative_altitude_m > 9.5  # noqa: E731
        await first(telemetry.subscribe_position(), on_circle)
        await first(telemetry.subscribe_velocity_ned(), lambda each: abs(each.down_m_s) < 0.1)
        position = await first(telemetry.subscribe_position(), lambda _: True)
        assert position.relative_altitude_m == pytest.approx(10.0, abs=0.5)
        await action.return_to_launch()
        await first(telemetry.subscribe_position(), lambda each: away(each) < 2.0)

    fleet_on(tmp_path, main, commands="all")
