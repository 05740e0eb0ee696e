"""Whatever two aircraft were both allowed to do, they come nearer than both bounds nowhere."""

import math
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api.arbiter import BehaviorRequest
from m2pem.geo.lawn_mower import longest_edge_yaw
from tests.geo.passes import lawn_mower
from tests.seeds import examples

from .sky import FRAME, NOW_US, airspace, area, claim, point, request, route, state

VERTICAL_M, HORIZONTAL_M = 10.0, 20.0
STEP_M = 2.0
Where = tuple[float, float, float]

metres = st.integers(-6, 6).map(lambda tens: 10.0 * tens)
"""So few that two often meet."""

heights = st.sampled_from([5.0, 12.0, 20.0, 30.0, 32.0, 45.0])
speeds = st.sampled_from([2.0, 5.0, 10.0])


@st.composite
def tasks(draw: st.DrawFn) -> tuple[str, dict[str, Any], Where]:
    """A behavior, its parameters, and where its aircraft is."""
    begin = (draw(metres), draw(metres), draw(st.sampled_from([0.0, 12.0, 20.0, 30.0, 45.0])))
    height = draw(heights)
    places = draw(st.lists(st.tuples(metres, metres), min_size=1, max_size=4))
    east, north = places[0]
    hilly = [(*each, draw(heights)) for each in places]
    size = draw(st.integers(20, 60))
    field = area((east, north), (east + size, north), (east + 2 * size, north + size))
    behavior, parameters = draw(
        st.sampled_from(
            [
                ("goto", {"target": point(east, north), "altitude": height}),
                ("goto", {"target": point(east, north, height)}),
                ("single_vehicle_routing", {"route": route(*places), "altitude": height}),
                ("single_vehicle_routing", {"route": route(*hilly)}),
                ("single_vehicle_routing", {"route": route(*hilly), "loop": True}),
                ("orbit", {"target": point(east, north), "radius": 25.0, "altitude": height}),
                ("area_survey", {"area": field, "altitude": height, "spacing": 10.0}),
                ("area_observe", {"target": point(east, north), "altitude": height}),
                ("takeoff", {"altitude": height}),
                ("land", {}),
                ("return_to_launch", {}),
                ("hold", {}),
            ]
        )
    )
    return behavior, parameters, begin


def flight(task: tuple[str, dict[str, Any], Where], home: Where, steep: bool) -> list[Where]:
    """Corners of the way that an aircraft flies for it. `steep`: it changes height before it moves;
    else on its way."""
    behavior, parameters, (east, north, up) = task
    height = parameters.get("altitude", up)
    way: list[Where] = [(east, north, up)]

    def to(e: float, n: float, u: float) -> None:
        if steep or up == 0.0 == way[-1][2]:
            way.append((way[-1][0], way[-1][1], u))
        way.append((e, n, u))

    if behavior == "takeoff":
        to(east, north, height)
    elif behavior == "land":
        to(east, north, 0.0)
    elif behavior == "return_to_launch" and (up > 0 or math.dist(home[:2], (east, north)) > 5):
        if math.dist(home[:2], (east, north)) > 5:
            way.append((east, north, max(up, 30.0)))
            to(home[0], home[1], max(up, 30.0))
        to(way[-1][0], way[-1][1], 0.0)
    elif behavior == "single_vehicle_routing":
        points = [(*FRAME.to_local(each[:2]), each[2]) for each in parameters["route"].waypoints]
        for e, n, u in [*points, points[0]] if parameters.get("loop") else points:
            to(e, n, height if u is None else u)
    elif behavior == "area_survey":
        ring = [FRAME.to_local(corner[:2]) for corner in parameters["area"].rings[0]]
        for e, n in lawn_mower([ring], parameters["spacing"], longest_edge_yaw(ring)):
            to(e, n, height)
    elif behavior in ("orbit", "area_observe", "goto"):
        target = parameters["target"].position
        e, n = FRAME.to_local(target[:2])
        height = height if target[2] is None or "altitude" in parameters else target[2]
        if behavior == "goto":
            to(e, n, height)
        else:
            radius = parameters.get("radius", 30.0)
            angle = math.atan2(north - n, east - e)
            for turn in range(37):
                at = angle + math.tau * turn / 36
                to(e + radius * math.cos(at), n + radius * math.sin(at), height)
    return way


def sampled(way: list[Where]) -> list[Where]:
    """Places on the way, no farther apart than a step."""
    found = [way[0]]
    for a, b in pairwise(way):
        steps = max(1, math.ceil(math.dist(a, b) / STEP_M))
        found += [
            tuple(x + (y - x) * step / steps for x, y in zip(a, b, strict=True))  # type: ignore[misc]
            for step in range(1, steps + 1)
        ]
    return found


def nearer_than_both(a: Where, b: Where) -> bool:
    return math.dist(a[:2], b[:2]) < HORIZONTAL_M - 0.1 and abs(a[2] - b[2]) < VERTICAL_M - 0.1


def requests(task: tuple[str, dict[str, Any], Where], name: str) -> BehaviorRequest:
    return request(task[0], name, **task[1])


@settings(deadline=None, max_examples=examples(50, 200))
@given(tasks(), tasks(), st.booleans(), st.booleans())
def test_two_that_may_both_go_meet_at_no_speed_whatever(
    first: tuple[str, dict[str, Any], Where],
    second: tuple[str, dict[str, Any], Where],
    steep: bool,
    steep_too: bool,
) -> None:
    sky = airspace("one", "two", vertical=VERTICAL_M, horizontal=HORIZONTAL_M)
    homes = {"one": (-30.0, 0.0, 0.0), "two": (30.0, 0.0, 0.0)}
    for name, task in (("one", first), ("two", second)):
        sky.received(state(name, *homes[name]))
        sky.received(state(name, *task[2]))
    if claim(sky, requests(first, "one")) or claim(sky, requests(second, "two")):
        return
    if min(first[2][2], second[2][2]) > 0 and nearer_than_both(first[2], second[2]):
        return  # they were too near before
    # One that stands on the ground is where it last was on the ground: a home, too.
    for a in sampled(flight(first, homes["one"], steep)):
        for b in sampled(flight(second, homes["two"], steep_too)):
            if first[0] in ("hold", "land", "return_to_launch") and a[2] == 0.0:
                continue  # on the ground nobody is in the way
            if second[0] in ("hold", "land", "return_to_launch") and b[2] == 0.0:
                continue
            assert not nearer_than_both(a, b), (a, b)


@settings(deadline=None, max_examples=examples(100, 400))
@given(
    st.lists(st.tuples(metres, metres), min_size=2, max_size=4),
    st.lists(st.tuples(metres, metres), min_size=2, max_size=4),
    st.tuples(speeds, speeds),
    st.integers(0, 40),
    st.sampled_from([0.0001, 5.0, 15.0]),
)
def test_two_on_crossing_routes_keep_apart_at_the_speeds_that_were_planned(
    one: list[tuple[float, float]],
    two: list[tuple[float, float]],
    speed: tuple[float, float],
    later_s: int,
    apart_s: float,
) -> None:
    sky = airspace("one", "two", vertical=VERTICAL_M, horizontal=HORIZONTAL_M, time=apart_s)
    for name, (begin, *_) in (("one", one), ("two", two)):
        sky.received(state(name, *begin, 30.0))
    if math.dist(one[0], two[0]) < HORIZONTAL_M:
        return  # they were too near before
    ways = {}
    for name, places, start_s, v in (("one", one, 0, speed[0]), ("two", two, later_s, speed[1])):
        wished = request("single_vehicle_routing", name, route=route(*places), speed=v)
        if name == "two":
            seen = along(one, speed[0] * later_s)
            sky.received(state("one", *seen, 30.0, NOW_US + later_s * 1_000_000))
        if claim(sky, wished, now_us=NOW_US + start_s * 1_000_000):
            return
        ways[name] = (places, start_s, v)
    for tenth in range(later_s * 10, 2000):
        at = [
            along(places, max(0.0, tenth / 10 - start_s) * v)
            for places, start_s, v in ways.values()
        ]
        assert math.dist(*at) >= HORIZONTAL_M - 0.1, tenth


def along(places: list[tuple[float, float]], way_m: float) -> tuple[float, float]:
    """The place so far along a way; its end, if it is not so long."""
    for a, b in pairwise(places):
        length = math.dist(a, b)
        if way_m < length:
            return a[0] + (b[0] - a[0]) * way_m / length, a[1] + (b[1] - a[1]) * way_m / length
        way_m -= length
    return places[-1]


@pytest.mark.parametrize("time", [None, 20.0])
def test_with_a_time_routes_may_cross_at_one_height(time: float | None) -> None:
    sky = airspace("one", "two", time=time)
    sky.received(state("one", -100, 0, 30))
    sky.received(state("two", 0, -400, 30))
    east = route((-100, 0), (100, 0))
    north = route((0, -400), (0, 400))
    assert not claim(sky, request("single_vehicle_routing", "one", route=east, speed=5.0))
    said = claim(sky, request("single_vehicle_routing", "two", route=north, speed=5.0))
    assert (not said) is (time is not None), said
