"""Simulated vehicles and the fleet's fence, judged by shapely and by samples every 0.1 m."""

import logging
import math
from dataclasses import replace
from typing import Any

import pytest
import shapely

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock, run_virtual
from m2pem.geo.fence import Fence
from m2pem.geo.geojson import parse_geojson
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Point, VehiclePosition
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context
from tests.simulation.conftest import JOURNAL, START_US, local, place, route

V = ResourceId("v")
TOLERANCE_M = 0.12
"""The fence's own margin, and rounding."""


def area(polygon: shapely.Polygon, *spikes: Any) -> Area:
    """As a drawing program writes it, through the door."""
    rings = []
    for ring in (polygon.exterior, *polygon.interiors):
        corners = [(x, y) for x, y, *_ in ring.coords]
        for spike in spikes:
            corners = spike(corners)
        rings.append([place(*corner)[1::-1] for corner in corners])
    read = parse_geojson({"type": "Polygon", "coordinates": rings})
    assert isinstance(read, Area)
    return read


def play(
    fence: Area | Fence | None,
    home: tuple[float, float],
    behaviors: list[tuple[str, dict[str, Any]]],
    domain: str = "ground",
    others: dict[str, tuple[float, float]] | None = None,
) -> list[tuple[BehaviorState, str, list[tuple[float, float]]]]:
    """Do one behavior after the other; return how each ended, why, and its way every 0.1 m."""
    done = []

    async def run(clock: Clock) -> None:
        homes = {V: home, **{ResourceId(k): at for k, at in (others or {}).items()}}
        kept = Fence(fence) if isinstance(fence, Area) else fence
        connections = {
            each: Connection(each, domain, {"home": place(*at, 0.0)}, fence=kept)
            for each, at in homes.items()
        }
        arbiter = SimArbiter(connections, replace(context(clock), journal=JOURNAL))
        async with ArbiterHarness(arbiter, clock) as bench:
            vehicle = next(each for each in arbiter.vehicles if each.id == V)
            for number, (behavior, parameters) in enumerate(behaviors):
                id_ = f"r1.b{number}"
                await bench.start(id_, behavior, V, **parameters)
                plan = vehicle.track.plan
                end = await bench.ended(id_, 50_000)
                way = []
                if end.state is BehaviorState.SUCCEEDED:
                    count = math.ceil(plan.duration_s * vehicle.cruise_m_s / 0.1) + 1
                    times = (plan.duration_s * each / count for each in range(count + 1))
                    way = [plan.at(time_s).place[:2] for time_s in times]
                done.append((end.state, end.reason, way))

    run_virtual(run, START_US)
    return done


def depth_m(free: shapely.Geometry, at: tuple[float, float]) -> float:
    return float(free.distance(shapely.Point(at)))


def entered_m(free: shapely.Geometry, holes: shapely.Geometry, way: list[Any]) -> float:
    """How many metres of a way are in what is kept out, but for the way in from outside."""
    if not way:
        return 0.0
    first = depth_m(free, way[0])
    inside = next((at for at, each in enumerate(way) if depth_m(free, each) <= TOLERANCE_M), None)
    if first > TOLERANCE_M and inside is not None:
        lead = way[: inside + 1]
        assert max(depth_m(free, each) for each in lead) <= first + TOLERANCE_M
        if holes.distance(shapely.Point(way[0])) <= TOLERANCE_M:
            assert math.dist(lead[0], lead[-1]) <= 3 * first + 1.5
        else:
            assert shapely.LineString([*lead, lead[-1]]).intersection(holes).length < 0.2
        way = way[inside:]
    return 0.1 * sum(depth_m(free, each) > TOLERANCE_M for each in way)


SQUARE = shapely.box(0, 0, 200, 200)
POND = shapely.box(80, 60, 120, 140)
YARD = SQUARE.difference(POND)


@pytest.mark.parametrize(
    ("behavior", "parameters", "said"),
    [
        ("goto", {"target": Point(place(450, 20))}, "the target, ["),
        ("goto", {"target": Point(place(450, 20))}, "is 250 m outside the fleet's fence"),
        ("goto", {"target": Point(place(180, 100))}, "the way to the target leaves"),
        (
            "single_vehicle_routing",
            {"route": route((20, 20), (180, 180))},
            "the way between waypoint 1 of the route and waypoint 2 of the route leaves",
        ),
        (
            "single_vehicle_routing",
            {"route": route((20, 180), (150, 180), (180, 20)), "loop": True},
            "between waypoint 3 of the route and waypoint 1 of the route",
        ),
        ("orbit", {"target": Point(place(30, 100)), "radius": 40.0}, "its way leaves"),
        (
            "orbit",
            {"target": Point(place(30, 100)), "radius": 40.0, "turns": 10_000.5},
            "its way leaves",
        ),
        ("area_survey", {"area": area(shapely.box(20, 20, 195, 50)), "overshoot": 20.0}, "its way"),
        ("area_observe", {"area": area(shapely.box(190, 90, 199, 110)), "duration": 60.0}, "way"),
        ("reverse", {"distance": 120.0}, "the place behind it, ["),
    ],
)
def test_what_leaves_the_fence_is_rejected_in_the_words_of_arbiters(
    behavior: str, parameters: dict[str, Any], said: str
) -> None:
    home = (20.0, 100.0) if behavior != "area_observe" else (150.0, 100.0)
    domain = "ground" if behavior == "reverse" else "air"
    up = [("takeoff", {"altitude": 20.0})] if domain == "air" else []
    *_, (state, reason, _) = play(area(YARD), home, [*up, (behavior, parameters)], domain)
    assert state is BehaviorState.REJECTED
    assert said in reason
    assert "fleet's fence" in reason


def test_a_vehicle_that_follows_stops_where_its_station_leaves_the_fence() -> None:
    async def run(clock: Clock) -> None:
        homes = {"v": (20.0, 20.0), "lead": (60.0, 20.0)}
        connections = {
            ResourceId(name): Connection(
                ResourceId(name),
                "ground",
                {"home": place(*at, 0.0)},
                fence=Fence(area(YARD)) if name == "v" else None,
            )
            for name, at in homes.items()
        }
        arbiter = SimArbiter(connections, replace(context(clock), journal=JOURNAL))
        async with ArbiterHarness(arbiter, clock) as bench:
            await bench.start("r1.b1", "follow", V, target=VehiclePosition("lead"))
            await bench.start("r1.b2", "goto", "lead", target=Point(place(400, 20)))
            end = await bench.ended("r1.b1", 500)
            assert end.state is BehaviorState.FAILED
            assert "fleet's fence" in end.reason
            await clock.sleep(30)
            state = bench.latest(V)
            east, _ = local(state.position)
            assert 150 < east < 200.5

    run_virtual(run, START_US)


@pytest.mark.parametrize("domain", ["air", "ground"])
def test_a_return_leads_around_what_is_kept_out(domain: str) -> None:
    up = [("takeoff", {"altitude": 20.0})] if domain == "air" else []
    fly = [
        ("single_vehicle_routing", {"route": route((20, 180), (180, 180), (180, 100))}),
        ("return_to_launch", {}),
    ]
    done = play(area(YARD), (20.0, 100.0), [*up, *fly], domain)
    assert all(state is BehaviorState.SUCCEEDED for state, *_ in done)
    way = done[-1][2]
    assert way[-1] == pytest.approx((20.0, 100.0), abs=0.01)
    assert entered_m(YARD, POND, way) == 0
    assert shapely.LineString(way).length < 260


def test_a_return_without_a_way_around_is_done_and_said(caplog: pytest.LogCaptureFixture) -> None:
    wall = shapely.box(-10, 90, 210, 110)
    halves = SQUARE.union(wall).difference(wall.buffer(-1))
    with caplog.at_level(logging.WARNING):
        done = play(
            area(halves),
            (20.0, 50.0),
            [("single_vehicle_routing", {"route": route((30, 50))}), ("return_to_launch", {})],
        )
        assert done[-1][0] is BehaviorState.SUCCEEDED
        assert caplog.text == ""
        done = play(
            area(SQUARE),
            (20.0, -30.0),
            [("goto", {"target": Point(place(30, 50))}), ("return_to_launch", {})],
        )
    assert done[-1][0] is BehaviorState.SUCCEEDED
    assert "v returns: its home, [" in caplog.text
    assert "30 m outside" in caplog.text


def test_a_bend_does_not_cut_into_what_is_kept_out() -> None:
    lane = route((60, 59.9), (79.8, 59.9), (79.8, 150))
    fence = SQUARE.difference(shapely.box(80, 60, 120, 140))
    ((state, reason, way),) = play(
        area(fence), (20.0, 59.9), [("single_vehicle_routing", {"route": lane})]
    )
    assert state is BehaviorState.SUCCEEDED, reason
    assert entered_m(fence, POND, way) == 0
    inner = route((20, 50), (70, 150), (79.8, 150), (79.8, 30))
    ((state, reason, way),) = play(
        area(fence), (20.0, 20.0), [("single_vehicle_routing", {"route": inner})]
    )
    assert state is BehaviorState.SUCCEEDED, reason
    assert entered_m(fence, POND, way) == 0
