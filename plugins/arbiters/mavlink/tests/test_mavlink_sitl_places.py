"""Holes of areas and of the fleet's fence, and ways that go on, flown by real autopilots: what they
say of themselves to another ground station is judged by shapely."""

import asyncio
import json
import logging
import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import shapely
from mavlink_copters import task
from mavlink_revised_copters import (
    CRUISE,
    Copter,
    Copters,
    Place,
    drawn,
    executive,
    flies,
    flown,
    landed,
    lane,
    latlon,
    until,
)

from m2pem.api import Area, MissionControl, RunStatus
from m2pem.testing import scenarios
from tests.executive.conftest import flow, mission

BOTH = [
    pytest.param("ardupilot", marks=pytest.mark.sitl("M2PEM_ARDUCOPTER")),
    pytest.param("px4", marks=pytest.mark.sitl("M2PEM_PX4")),
]
pytestmark = [pytest.mark.timeout(900), pytest.mark.parametrize("firmware", BOTH)]

UP = ("takeoff", {"altitude": "20 m"})
HOME: tuple[str, dict[str, object]] = ("return_to_launch", {})
FIELD = shapely.box(-15, -15, 110, 110)
POND = shapely.box(35, 35, 65, 65)
AROUND_THE_POND = shapely.box(20, 20, 80, 80).difference(POND)
FLOWN_M = 1.5
"""So near to its lines a copter flies, also where it rounds corners."""


def drawn_area(shape: shapely.Polygon) -> Area:
    rings = (shape.exterior, *shape.interiors)
    return Area(tuple(tuple((*latlon(at), None) for at in ring.coords) for ring in rings))


@pytest.fixture
def fenced(firmware: str, tmp_path: Path) -> Iterator[Callable[[shapely.Polygon], Copters]]:
    """Starts copters within a fence."""
    opened: list[Copters] = []

    def start(fence: shapely.Polygon) -> Copters:
        opened.append(Copters(tmp_path / "world", firmware))
        rings = [
            [latlon(at)[::-1] for at in ring.coords] for ring in (fence.exterior, *fence.interiors)
        ]
        polygon = {"type": "Polygon", "coordinates": rings}
        file = opened[0].fleet
        file.with_name("yard.geojson").write_text(json.dumps(polygon), encoding="utf-8")
        with file.open("a", encoding="utf-8") as fleet:
            fleet.write("areas: {yard: yard.geojson}\nfence: yard\n")
        return opened[0]

    yield start
    for each in opened:
        each.close()


def track(copter: Copter, since_s: float = 0.0) -> shapely.LineString:
    return shapely.LineString([each.place for each in copter.since(since_s)])


async def run_of(control: MissionControl, *steps: object, **geometries: object) -> None:
    run = await control.start(drawn([*steps], **geometries))
    summary = await control.wait(run)
    assert summary.status is RunStatus.COMPLETED, summary


def test_a_survey_and_a_return_lead_around_holes(
    fenced: Callable[[shapely.Polygon], Copters],
) -> None:
    copters = fenced(FIELD.difference(POND))
    copter = copters.all[0]
    survey = ("area_survey", {"area": "ring", "spacing": "10 m", "speed": CRUISE})
    back_s = 0.0

    async def main() -> None:
        nonlocal back_s
        async with executive(copters) as control:
            await run_of(control, UP, survey, ring=drawn_area(AROUND_THE_POND))
            surveyed = track(copter)
            left = AROUND_THE_POND.difference(surveyed.buffer(5.0)).buffer(-FLOWN_M)
            assert left.is_empty, left
            await run_of(control, flies("lane", "20 m"), lane=lane((90, 50), (90, 90)))
            back_s = copter.now.at_s
            await run_of(control, HOME)
        await landed(copters)

    asyncio.run(main())
    copters.close()
    assert not track(copter).intersects(POND.buffer(-FLOWN_M))
    assert FIELD.covers(track(copter))
    assert not track(copter, back_s).intersects(POND.buffer(1.0)), "it returns at 3 m"
    assert shapely.Point(copter.now.place).distance(shapely.Point(0, 0)) < 3.0


LANE: list[Place] = [(0, 30), (60, 30), (60, 100), (0, 100)]
ACTOR = "vehicle='uav1'"
TASKS = [
    ("Up", "takeoff", {"altitude": "20 m"}),
    ("Fly", "single_vehicle_routing", {"route": "lane", "altitude": "20 m", "speed": CRUISE}),
    ("Look", "goto", {"target": str([*latlon((90, 60))]), "altitude": "20 m"}),
    ("Rest", "single_vehicle_routing", {"route": "${Fly.remaining}", "altitude": "20 m"}),
    ("Back", "return_to_launch", {}),
]
FLOWS = ["Start Up Fly Back E", "Away Look Rest Back"]
INTERRUPTED = mission(
    '<signal id="Seen"/><process id="P" isExecutable="true"><startEvent id="Start"/><endEvent id="E"/>'
    '<boundaryEvent id="Away" attachedToRef="Fly"><signalEventDefinition signalRef="Seen"/>'
    "</boundaryEvent>"
    + "".join(task(name, behavior, ACTOR, **given)[1] for name, behavior, given in TASKS)
    + "".join(flow(*each) for path in FLOWS for each in pairwise(path.split()))
    + "</process>"
)


def test_an_interrupted_route_goes_on_where_it_was(
    fenced: Callable[[shapely.Polygon], Copters],
) -> None:
    copters = fenced(FIELD)
    copter = copters.all[0]
    seen: list[Place] = []
    seen_s = 0.0

    async def main() -> None:
        nonlocal seen_s
        async with executive(copters) as control:
            route = lane(*LANE)
            run = await control.start(scenarios.drawn(INTERRUPTED, lane=route))
            await until(flown(copter, 60.0))
            seen.append(copter.now.place)
            seen_s = copter.now.at_s
            await control.signal("Seen", run=run)
            assert (await control.wait(run)).status is RunStatus.COMPLETED
        await landed(copters)

    asyncio.run(main())
    copters.close()
    again_s = copter.first_at_s((90, 60), 3.0, seen_s)
    auto = [each for each in copter.since(again_s) if each.mode == copter.station.auto]
    joined = next(each.place for each in auto if abs(each.place[0] - LANE[1][0]) < 3.0)
    assert math.dist(joined, seen[0]) < 20.0, "what is left is reported each 10 m"
    assert min(math.dist(each.place, LANE[1]) for each in auto) > 20.0, "it does not begin again"
    for corner in LANE[2:]:
        assert copter.nearest_m(corner, again_s) < 3.0


WALL = shapely.LineString([(94, 44), (57, 57), (-66, 46)]).buffer(2.0, cap_style="flat")
WITHIN_M = 100.0
"""Of its own fence, a circle."""

OWN_FENCE = {
    "ardupilot": {"FENCE_TYPE": 2.0, "FENCE_RADIUS": WITHIN_M, "FENCE_ENABLE": 1.0},
    "px4": {"GF_MAX_HOR_DIST": WITHIN_M},
}


def test_a_return_is_straight_where_the_vehicle_refuses_the_way_around(
    fenced: Callable[[shapely.Polygon], Copters],
    firmware: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    copters = fenced(shapely.box(-200, -200, 200, 200).difference(WALL))
    copter = copters.all[0]
    for name, value in OWN_FENCE[firmware].items():
        copter.station.set_quietly(name, value)
    back_s = 0.0

    async def main() -> None:
        nonlocal back_s
        async with executive(copters) as control:
            there = lane((-60, 10), (-76, 48), (-60, 60), (66, 66))
            await run_of(control, UP, flies("lane", "20 m"), lane=there)
            assert not track(copter).intersects(WALL)
            back_s = copter.now.at_s
            await run_of(control, HOME)
        await landed(copters)

    with caplog.at_level(logging.WARNING):
        asyncio.run(main())
    copters.close()
    assert "uav1 returns on a straight line, not around what the fence keeps out" in caplog.text
    assert track(copter, back_s).intersects(WALL)
    assert shapely.Point(copter.now.place).distance(shapely.Point(0, 0)) < 3.0
