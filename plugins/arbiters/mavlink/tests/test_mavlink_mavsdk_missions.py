"""MAVSDK 4 stores missions in simulated autopilots, and has them carried out."""

import asyncio
from contextlib import aclosing

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_mavsdk_flying import first, flying, really
from mavsdk.plugins.mission_raw import MissionItem, MissionRawError
from mavsdk.plugins.telemetry import FlightMode
from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = Location(47.397742, 8.545594, 488.0)
WAYPOINT, TAKEOFF = dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_NAV_TAKEOFF
RETURN = dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH
RELATIVE = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT


def mission(*legs):
    """A mission as ArduPilot has it: item 0 is home. Legs: command, north, east, up, in metres."""
    items = [MissionItem(0, 0, WAYPOINT, 1, 1, x=473977420, y=85455940, z=488.0)]
    for seq, (command, north_m, east_m, up_m) in enumerate(legs, 1):
        x, y = 473977420 + round(north_m * 90), 85455940 + round(east_m * 133)
        place = {"x": x, "y": y} if command == WAYPOINT else {}
        items.append(MissionItem(seq, RELATIVE, command, 0, 1, z=up_m, **place))
    return items


SURVEY = mission(
    (TAKEOFF, 0, 0, 10), (WAYPOINT, 20, 0, 12), (WAYPOINT, 20, 20, 12), (RETURN, 0, 0, 0)
)
PATROL = mission((WAYPOINT, 10, 0, 0), (WAYPOINT, 10, 10, 0))


@pytest.fixture
async def copter():
    async with flying(VehicleSpec(home=HOME, estimator_s=6.0)) as found:
        yield found[1]


@pytest.fixture
async def rover():
    async with flying(VehicleSpec(Kind.ROVER, home=HOME, estimator_s=6.0)) as found:
        yield found[1]


async def test_a_mission_comes_back_as_it_was_stored(copter):
    await copter.missions.upload_mission(SURVEY)
    stored = await copter.missions.download_mission()
    assert [each.seq for each in stored] == [0, 1, 2, 3, 4]
    assert [each.command for each in stored[1:]] == [each.command for each in SURVEY[1:]]
    for came, went in zip(stored[2:4], SURVEY[2:4], strict=True):
        assert (came.x, came.y) == pytest.approx((went.x, went.y), abs=1)
        assert came.z == pytest.approx(went.z, abs=0.01)
        assert came.frame in (RELATIVE, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT)


async def test_the_progress_of_an_upload_is_told(copter):
    from mavsdk.plugins.mission_raw import MissionPlan, MissionRawResult

    upload = copter.missions.upload_mission_with_progress(MissionPlan(SURVEY))
    told = [result async for result, _ in upload]
    assert told[-1] is MissionRawResult.SUCCESS
    assert len(told) > 1


async def test_a_mission_of_many_items_is_stored(copter):
    many = mission(*((WAYPOINT, number, number, 10) for number in range(300)))
    await copter.missions.upload_mission(many)
    assert len(await copter.missions.download_mission()) == 301


async def test_an_item_that_it_does_not_know_is_refused(copter):
    unknown = mission((TAKEOFF, 0, 0, 10), (31000, 0, 0, 0))
    with pytest.raises(MissionRawError, match="UNSUPPORTED"):
        await copter.missions.upload_mission(unknown)


async def test_a_cleared_mission_leaves_home(copter):
    await copter.missions.upload_mission(SURVEY)
    await copter.missions.clear_mission()
    left = await copter.missions.download_mission()  # MAVSDK clears it with a home alone
    assert [each.seq for each in left] == [0]


async def test_a_fence_and_rally_points_are_stored_beside_the_mission(copter):
    corners = ((-50, -50), (50, -50), (50, 50), (-50, 50))
    fence = [
        MissionItem(
            seq,
            dialect.MAV_FRAME_GLOBAL,
            dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
            int(seq == 0),
            1,
            param1=len(corners),
            x=473977420 + north * 90,
            y=85455940 + east * 133,
            mission_type=dialect.MAV_MISSION_TYPE_FENCE,
        )
        for seq, (north, east) in enumerate(corners)
    ]
    await copter.missions.upload_mission(SURVEY)
    await copter.missions.upload_geofence(fence)
    stored = await copter.missions.download_geofence()
    assert [(each.x, each.y) for each in stored] == [(each.x, each.y) for each in fence]
    assert len(await copter.missions.download_mission()) == len(SURVEY)


async def told(flown, into):
    async with aclosing(flown.missions.subscribe_mission_progress()) as told:
        async for each in told:
            into.append((each.current, each.total))


async def test_a_mission_is_flown_from_the_ground_home_again(copter):
    progress = []
    telling = asyncio.create_task(told(copter, progress))
    await copter.ready()
    await copter.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 42, 200_000)
    await copter.missions.upload_mission(SURVEY)
    await copter.guided()
    await copter.action.arm()
    await copter.missions.start_mission()
    await first(copter.telemetry.subscribe_flight_mode(), lambda mode: mode is FlightMode.MISSION)
    # ArduCopter leaves the ground in AUTO for a throttle or for MISSION_START.
    assert await copter.command(dialect.MAV_CMD_MISSION_START) == 0
    await really(lambda: copter.real.up_m > 9.0)
    await really(lambda: not copter.real.armed, 40.0)
    telling.cancel()
    await asyncio.gather(telling, return_exceptions=True)
    currents = [current for current, total in progress if total == len(SURVEY) and current > 0]
    assert currents == sorted(currents)
    assert {2, 3, 4} <= set(currents)
    events = copter.real.autopilot.log.events
    reached = [int(each.detail) for each in events if each.kind == "reached"]
    assert reached == [1, 2, 3, 4]


async def test_a_mission_is_paused_and_goes_on_where_it_was(copter):
    await copter.up(10.0)
    await copter.missions.upload_mission(mission((WAYPOINT, 20, 0, 10), (WAYPOINT, 400, 0, 10)))
    await copter.missions.start_mission()
    await really(lambda: copter.real.autopilot.mission.current == 2)
    await copter.missions.pause_mission()
    assert copter.real.mode != "AUTO"
    await copter.missions.start_mission()
    await really(lambda: copter.real.mode == "AUTO")
    assert copter.real.autopilot.mission.current == 2
    assert copter.real.missions_begun == 1


async def test_a_mission_is_entered_at_an_item(copter):
    await copter.up(10.0)
    await copter.missions.upload_mission(mission((WAYPOINT, 300, 0, 10), (WAYPOINT, 0, 20, 10)))
    await copter.missions.set_current_mission_item(2)
    await copter.missions.start_mission()
    await really(lambda: copter.real.autopilot.mission.complete)
    assert copter.real.location.latitude_deg == pytest.approx(HOME.latitude_deg, abs=5e-5)


async def test_a_rover_drives_a_mission(rover):
    await rover.ready()
    await rover.missions.upload_mission(PATROL)
    await rover.guided()
    await rover.action.arm()
    await rover.missions.start_mission()
    await really(lambda: rover.real.autopilot.mission.complete)
    assert rover.real.mode == "AUTO"
    place = rover.real.location
    assert place.latitude_deg == pytest.approx(HOME.latitude_deg + 90e-6, abs=3e-5)
    assert place.longitude_deg == pytest.approx(HOME.longitude_deg + 133e-6, abs=4e-5)
