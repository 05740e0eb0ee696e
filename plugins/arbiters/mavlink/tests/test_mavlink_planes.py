"""Planes never stand still. Simulated ones, over real UDP, judged by where they really are."""

import asyncio
import math
from itertools import pairwise

import pytest
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.microservices.missions import SetCurrentItem
from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.vehicle.fixed_wing import landing_start
from mavlink_simulated import AMPLE_S, at, fly, ground_station

from m2pem.api import Area, BehaviorState, Point, Route

CIRCLE_M = 60.0
RELATIVE = 3
DO_LAND_START, WAYPOINT, LAND, TAKEOFF = 189, 16, 21, 22


def point(east: float, north: float, altitude: float | None = None) -> Point:
    return Point((*at(east, north), altitude))


def with_a_plane(main) -> None:
    async def flying(bench) -> None:
        await bench.do("r1.up", "takeoff", altitude=60.0)
        await main(bench)

    fly(flying, Kind.PLANE)


async def circles(bench, place: tuple[float, float], radius_m: float = CIRCLE_M) -> None:
    """It goes all the way round the place, at the radius, and does nothing else."""
    flown = bench.truth().autopilot
    begun_s = flown.now_s  # by its own time: a busy computer gives it less than the clock says
    await bench.simulator.until(lambda: flown.now_s > begun_s + 30)  # it comes onto its circle
    bearings: list[float] = []
    turned = 0.0
    async with asyncio.timeout(AMPLE_S / 20):
        while turned < math.tau or len(bearings) < 60:
            east, north = bench.level()
            away = (east - place[0], north - place[1])
            assert math.hypot(*away) == pytest.approx(radius_m, abs=15)
            bearings.append(math.atan2(away[1], away[0]))
            turned = sum(abs(math.remainder(b - a, math.tau)) for a, b in pairwise(bearings))
            looked_s = flown.now_s
            await bench.simulator.until(lambda: flown.now_s > looked_s + 0.5)  # noqa: B023


def test_a_plane_takes_off_and_circles_at_its_height() -> None:
    async def main(bench) -> None:
        assert bench.truth().takeoffs == 1
        assert bench.truth().up_m == pytest.approx(60, abs=6)
        await circles(bench, (0, 0))
        assert bench.truth().up_m == pytest.approx(60, abs=3)

    with_a_plane(main)


def test_a_plane_goes_to_a_place_and_circles_there() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "goto", target=point(400, 300, 80.0), heading=1.0, tolerance=2.0)
        assert math.dist(bench.level(), (400, 300)) < CIRCLE_M + 20
        assert bench.truth().up_m == pytest.approx(80, abs=6)
        await circles(bench, (400, 300))
        await bench.do("r1.b2", "change_altitude", altitude=100.0)
        assert bench.truth().up_m == pytest.approx(100, abs=6)

    with_a_plane(main)


def test_a_hold_ends_while_it_circles_where_it_was() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "goto", "v1", target=point(3000, 0))
        assert await bench.until(lambda: bench.level()[0] > 300, AMPLE_S)
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED
        began_us = bench.clock.now_us()
        await bench.do("r1.b2", "hold", duration=20.0)
        assert (bench.clock.now_us() - began_us) / 1e6 < 400
        assert bench.truth().mode == "LOITER"
        await bench.do("r1.b3", "hold")

    with_a_plane(main)


def test_held_it_circles_and_goes_on_when_resumed() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "goto", "v1", target=point(900, 0))
        assert await bench.until(lambda: bench.level()[0] > 200, AMPLE_S)
        held = bench.level()
        await bench.arbiter.hold("v1")
        assert await bench.until(lambda: bench.truth().mode == "LOITER", AMPLE_S)
        await bench.clock.sleep(60)
        assert math.dist(bench.level(), held) < 2 * CIRCLE_M + 30
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING
        await bench.arbiter.resume("v1")
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.SUCCEEDED
        assert math.dist(bench.level(), (900, 0)) < CIRCLE_M + 20

    with_a_plane(main)


def test_a_plane_comes_home_and_circles_there() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "goto", target=point(500, 0))
        await bench.do("r1.b2", "return_to_launch")
        assert math.dist(bench.level(), (0, 0)) < CIRCLE_M + 20
        await circles(bench, (0, 0))

    with_a_plane(main)


def test_a_plane_flies_a_route_and_circles_at_its_end() -> None:
    async def main(bench) -> None:
        way = [(400.0, 0.0), (400.0, 400.0), (0.0, 400.0)]
        places = tuple((*at(*place), 80.0) for place in way)
        passed: list[tuple[float, float]] = []

        async def look() -> None:
            while True:
                passed.append(bench.level())
                await bench.clock.sleep(0.5)

        looking = asyncio.create_task(look())
        await bench.do("r1.b1", "single_vehicle_routing", route=Route(places), speed=25.0)
        looking.cancel()
        for place in way:
            assert min(math.dist(place, each) for each in passed) < 95  # WP_RADIUS is 90
        assert bench.truth().mode == "AUTO"
        await circles(bench, way[-1])

    with_a_plane(main)


def test_a_plane_surveys_an_area() -> None:
    async def main(bench) -> None:
        corners = [(0, 200), (600, 200), (600, 700), (0, 700), (0, 200)]
        area = Area((tuple((*at(*corner), None) for corner in corners),))
        await bench.do("r1.b1", "area_survey", area=area, spacing=250.0, altitude=80.0)
        assert bench.truth().up_m == pytest.approx(80, abs=6)

    with_a_plane(main)


@pytest.mark.parametrize(("asked", "flown", "turns"), [(100.0, 100.0, 3.0), (20.0, 49.0, 6.0)])
def test_an_orbit_goes_round_as_tightly_as_it_can(asked: float, flown: float, turns: float) -> None:
    async def main(bench) -> None:
        center = point(400, 0, 80.0)
        await bench.start("r1.b1", "orbit", "v1", target=center, radius=asked, turns=turns)
        await bench.running("r1.b1")
        near = lambda: math.dist(bench.level(), (400, 0)) < flown + 10  # noqa: E731
        assert await bench.until(near, AMPLE_S)
        await circles(bench, (400, 0), flown)
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.SUCCEEDED
        await bench.do("r1.b2", "goto", target=point(400, 0))
        await circles(bench, (400, 0))

    with_a_plane(main)


def test_a_place_is_watched_for_a_time() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "area_observe", target=point(300, 0, 80.0), duration=20.0)
        assert math.dist(bench.level(), (300, 0)) < CIRCLE_M + 20

    with_a_plane(main)


# --- landing ------------------------------------------------------------------------------------


def stored(command: int, east: float, north: float, up: float) -> MissionItem:
    return MissionItem(command, RELATIVE, (0.0,) * 4, *at(east, north), up)


LANDING = [
    MissionItem(DO_LAND_START, 2),
    stored(WAYPOINT, 600, 0, 40),
    stored(WAYPOINT, 300, 0, 20),
    stored(LAND, 0, 0, 0),
]


async def store_landing(bench) -> None:
    """Upload a mission with a landing, as an operator does with another ground station."""
    assert await bench.until(lambda: bench.latest("v1") is not None, AMPLE_S)
    home = stored(WAYPOINT, 0, 0, 0)  # ArduPilot has it as item 0
    async with ground_station(bench.simulator, bench.clock) as link:
        items = [home, stored(WAYPOINT, 0, 900, 50), *LANDING]
        await link.perform(UploadMission(link.address, items))


def test_without_a_landing_stored_it_says_what_it_needs() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "land", "v1")
        end = await bench.ended("r1.b1", AMPLE_S)
        assert end.state is BehaviorState.FAILED
        assert "DO_LAND_START" in end.reason
        assert bench.truth().mode == "LOITER"

    with_a_plane(main)


def test_a_plane_lands_by_the_landing_it_had_stored_before_it_flew_something_else() -> None:
    async def main(bench) -> None:
        await store_landing(bench)
        await bench.do("r1.b1", "takeoff", altitude=60.0)
        await bench.do("r1.b2", "single_vehicle_routing", route=Route(((*at(300, 300), 60.0),)))
        await circles(bench, (300, 300))
        await bench.do("r1.b3", "land")
        assert not bench.truth().armed
        assert bench.truth().up_m == pytest.approx(0, abs=0.3)
        assert math.dist(bench.level(), (0, 0)) < 150

    fly(main, Kind.PLANE)


def test_a_survey_that_goes_on_with_the_stored_landing_has_not_succeeded() -> None:
    """As a battery failsafe of ArduPlane does it: in AUTO, without a change of mode."""

    async def main(bench) -> None:
        await store_landing(bench)
        await bench.do("r1.b1", "takeoff", altitude=60.0)
        route = Route(tuple((*at(east, 900), 60.0) for east in (0, 900, 1800)))
        await bench.start("r1.b2", "single_vehicle_routing", "v1", route=route)
        await bench.running("r1.b2", AMPLE_S)
        async with ground_station(bench.simulator, bench.clock) as link:
            begins = landing_start(await link.perform(DownloadMission(link.address)))
            assert begins is not None
            await link.perform(SetCurrentItem(link.address, begins))
        end = await bench.ended("r1.b2", AMPLE_S)
        assert end.state is BehaviorState.FAILED
        assert "has started its landing" in end.reason
        # Nothing interrupts it: it lands.
        assert bench.truth().mode == "AUTO"

    fly(main, Kind.PLANE)
