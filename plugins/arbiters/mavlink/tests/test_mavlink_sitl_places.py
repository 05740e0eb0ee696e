"""Holes of areas and of the fleet's fence, and ways that go on, flown by real autopilots: what they
say of themselves to another ground station is judged by shapely."""

import asyncio
import json
import logging
import math
from collections.abc import Awaitable, Callable
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import mavlink_revised_copters as revised
import pytest
import shapely
from mavlink_copters import task

from m2pem.api import MissionControl, RunStatus
from m2pem.geo.geojson import parse_geojson
from m2pem.testing import scenarios
from tests.executive.conftest import flow, mission

PROGRAMS = {"ardupilot": "M2PEM_ARDUCOPTER", "px4": "M2PEM_PX4"}
BOTH = [pytest.param(name, marks=pytest.mark.sitl(each)) for name, each in PROGRAMS.items()]
pytestmark = [pytest.mark.timeout(900), pytest.mark.parametrize("firmware", BOTH)]

UP, HOME = ("takeoff", {"altitude": "20 m"}), ("return_to_launch", {})
FLOWN_M = 1.5
"""So near to its lines a copter flies, also where it rounds corners."""


def geojson(shape: shapely.Polygon) -> dict[str, object]:
    rings = [ring.coords for ring in (shape.exterior, *shape.interiors)]
    places = [[revised.latlon(at)[::-1] for at in ring] for ring in rings]
    return {"type": "Polygon", "coordinates": places}


def track(copter: revised.Copter, since_s: float = 0.0) -> shapely.LineString:
    return shapely.LineString([each.place for each in copter.since(since_s)])


Story = Callable[[MissionControl, revised.Copter], Awaitable[float]]


def fly(
    folder: Path, firmware: str, fence: shapely.Polygon, story: Story, **parameters: float
) -> tuple[revised.Copter, float]:
    """Command the story to the first copter, within a fence; return it, when it has landed at home,
    and the time that the story has returned."""

    async def main() -> float:
        async with revised.executive(copters) as control:
            at_s = await story(control, copters.all[0])
        await revised.landed(copters)
        return at_s

    with closing(revised.Copters(folder / "world", firmware)) as copters:
        for each in parameters.items():
            copters.all[0].station.set_quietly(*each)
        (copters.fleet.parent / "yard.geojson").write_text(json.dumps(geojson(fence)))
        with copters.fleet.open("a", encoding="utf-8") as fleet:
            fleet.write("areas: {yard: yard.geojson}\nfence: yard\n")
        at_s = asyncio.run(main())
    assert math.hypot(*copters.all[0].now.place) < 3.0
    return copters.all[0], at_s


async def done(control: MissionControl, text: bytes) -> None:
    assert (await control.wait(await control.start(text))).status is RunStatus.COMPLETED


def test_a_survey_and_a_return_lead_around_holes(tmp_path: Path, firmware: str) -> None:
    field, pond = shapely.box(-15, -15, 110, 110), shapely.box(35, 35, 65, 65)
    ring = shapely.box(20, 20, 80, 80).difference(pond)
    survey = ("area_survey", {"area": "ring", "spacing": "10 m", "speed": revised.CRUISE})

    async def story(control: MissionControl, copter: revised.Copter) -> float:
        await done(control, revised.drawn([UP, survey], ring=parse_geojson(geojson(ring))))
        left = ring.difference(track(copter).buffer(5.0)).buffer(-FLOWN_M)
        assert left.is_empty, left
        there = revised.lane((90, 50), (90, 90))
        await done(control, revised.drawn([revised.flies("lane", "20 m")], lane=there))
        back_s = copter.now.at_s
        await done(control, revised.drawn([HOME]))
        return back_s

    copter, back_s = fly(tmp_path, firmware, field.difference(pond), story)
    assert not track(copter).intersects(pond.buffer(-FLOWN_M))
    assert field.covers(track(copter))
    assert not track(copter, back_s).intersects(pond.buffer(1.0)), "it returns at 3 m"


AROUND, ASIDE = [(0, 30), (60, 30), (60, 100), (0, 100)], (90, 60)
TASKS = [
    ("Up", *UP),
    ("Fly", *revised.flies("lane", "20 m")),
    ("Look", "goto", {"target": str([*revised.latlon(ASIDE)]), "altitude": "20 m"}),
    ("Rest", *revised.flies("${Fly.remaining}", "20 m")),
    ("Back", *HOME),
]
PATHS = ("Start Up Fly Back E", "Away Look Rest Back")
INTERRUPTED = mission(
    '<signal id="Seen"/><process id="P" isExecutable="true"><startEvent id="Start"/><endEvent id='
    '"E"/><boundaryEvent id="Away" attachedToRef="Fly"><signalEventDefinition signalRef="Seen"/>'
    "</boundaryEvent>"
    + "".join(task(name, does, "vehicle='uav1'", **given)[1] for name, does, given in TASKS)
    + "".join(flow(*each) for path in PATHS for each in pairwise(path.split()))
    + "</process>"
)


def test_an_interrupted_route_goes_on_where_it_was(tmp_path: Path, firmware: str) -> None:
    async def story(control: MissionControl, copter: revised.Copter) -> float:
        run = await control.start(scenarios.drawn(INTERRUPTED, lane=revised.lane(*AROUND)))
        await revised.until(revised.flown(copter, 60.0))
        seen_s = copter.now.at_s
        await control.signal("Seen", run=run)
        assert (await control.wait(run)).status is RunStatus.COMPLETED
        return seen_s

    copter, seen_s = fly(tmp_path, firmware, shapely.box(-15, -15, 110, 110), story)
    again_s = copter.first_at_s(ASIDE, 3.0, seen_s)
    rest = [each.place for each in copter.since(again_s) if each.mode == copter.station.auto]
    joined = next(at for at in rest if abs(at[0] - 60.0) < 3.0)
    assert math.dist(joined, copter.since(seen_s)[0].place) < 20.0, "it is reported each 10 m"
    assert min(math.dist(at, AROUND[1]) for at in rest) > 20.0, "it does not begin again"
    assert max(copter.nearest_m(corner, again_s) for corner in AROUND[2:]) < 3.0


WALL = shapely.LineString([(94, 44), (57, 57), (-66, 46)]).buffer(2.0, cap_style="flat")
OWN_FENCE = {"FENCE_TYPE": 2, "FENCE_RADIUS": 100, "FENCE_ENABLE": 1, "GF_MAX_HOR_DIST": 100}
"""Of ArduPilot and of PX4: a circle around home."""


def test_a_return_is_straight_where_the_vehicle_refuses_the_way_around(
    tmp_path: Path, firmware: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def story(control: MissionControl, copter: revised.Copter) -> float:
        there = revised.lane((-60, 10), (-76, 48), (-60, 60), (66, 66))
        await done(control, revised.drawn([UP, revised.flies("lane", "20 m")], lane=there))
        assert not track(copter).intersects(WALL)
        back_s = copter.now.at_s
        await done(control, revised.drawn([HOME]))
        return back_s

    fence = shapely.box(-200, -200, 200, 200).difference(WALL)
    with caplog.at_level(logging.WARNING):
        copter, back_s = fly(tmp_path, firmware, fence, story, **OWN_FENCE)
    assert "uav1 returns on a straight line, not around what the fence keeps out" in caplog.text
    assert track(copter, back_s).intersects(WALL)
