"""`check` finds where a member would leave the fleet's fence beside a team's route, as the
member's arbiter does, which refuses its part."""

import math
from dataclasses import replace
from random import Random

import pytest
import shapely

from m2pem.engine.records import BehaviorEnded
from m2pem.executive import loading
from m2pem.findings import Finding, Severity
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.mission.geometry import Area
from tests.seeds import named

from .carts import FRAME
from .conftest import area
from .test_members_apart import NAMES, SHAPES, Case, checked_in, judged

STRAIGHT = [(0.0, 0.0), (100.0, 0.0), (200.0, 0.0)]
YARD = shapely.box(-150, -12, 260, 60)
WITH_A_HOLE = shapely.box(-150, -60, 260, 60) - shapely.box(120, 15, 140, 25)


def within(yard: shapely.Polygon, case: Case) -> Fleet:
    """The team in a fence, and in its places behind the beginning of the route."""
    rings = [[(x, y) for x, y in each.coords[:-1]] for each in (yard.exterior, *yard.interiors)]
    fence = Area(tuple(area(*ring).rings[0] for ring in rings))
    fleet = case.fleet()
    return replace(fleet, fence="yard", geometries={**fleet.geometries, "yard": fence})


def by_arbiters(fleet: Fleet, case: Case) -> BehaviorEnded:
    """How the mission ends if it starts in spite of what the check of teams finds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loading, "check_turns", lambda *_: ())
        return judged(fleet, case.mission).ended


def outside(fleet: Fleet, case: Case) -> list[Finding]:
    return [each for each in checked_in(fleet, case.mission) if each.rule == "outside-fence"]


@pytest.mark.parametrize(
    ("yard", "member", "text", "farthest"),
    [
        (YARD, "c", "corner 1 of its lane, [0.0, 0.0], is 8.0 m outside", (0.0, -20.0)),
        (WITH_A_HOLE, "b", "the way between corner 2 of its lane and corner 3 of", (130.0, 20.0)),
    ],
)
def test_a_lane_that_leaves_the_fence_is_found_and_refused(
    yard: shapely.Polygon, member: str, text: str, farthest: tuple[float, float]
) -> None:
    case = Case("abc", "line", 20.0, STRAIGHT, Domain.GROUND)
    fleet = within(yard, case)
    (finding,) = outside(fleet, case)
    assert finding.severity is Severity.WARNING
    there = FRAME.to_latlon(farthest)
    said = text.replace("[0.0, 0.0]", f"[{there[0]:.6f}, {there[1]:.6f}]")
    assert f"{member}, in its place beside the route: {said}" in finding.message
    assert finding.place is not None
    assert FRAME.to_local(finding.place) == pytest.approx(farthest, abs=5.1)
    ended = by_arbiters(fleet, case)
    assert ended.code == "REJECTED"
    assert ended.reason.startswith(f"{member}: ")
    assert "the fleet's fence" in ended.reason


@pytest.mark.parametrize(
    ("yard", "shape"), [(YARD, "column"), (shapely.box(-150, -25, 260, 25), "line")]
)
def test_nothing_is_found_where_all_lanes_are_within_the_fence(
    yard: shapely.Polygon, shape: str
) -> None:
    case = Case("abc", shape, 20.0, STRAIGHT, Domain.GROUND)
    assert outside(within(yard, case), case) == []


def test_a_route_that_leaves_the_fence_is_found_as_the_route_alone() -> None:
    case = Case("abc", "line", 20.0, STRAIGHT, Domain.GROUND)
    messages = [
        each.message for each in outside(within(shapely.box(-150, -60, 150, 60), case), case)
    ]
    assert messages
    assert not any("beside the route" in each for each in messages)


def check(seed: int) -> bool:
    """What `check` finds is what the members' arbiters refuse. Return whether there is any."""
    random = Random(seed)
    spacing_m, yaw = random.uniform(8, 25), random.uniform(-1, 1)
    places = [(0.0, 0.0), (90.0, 0.0), (90 + 90 * math.cos(yaw), 90 * math.sin(yaw))]
    case = Case(
        NAMES[: random.randint(2, 5)], random.choice(SHAPES), spacing_m, places, Domain.GROUND
    )
    rooms = [random.uniform(0.3, 4) * spacing_m for _ in range(2)]
    # Wide where the members begin: only their lanes may leave it.
    yard = shapely.LineString(places).buffer(rooms[0], quad_segs=4)
    yard |= shapely.box(-200, -120, 0, 120)
    if random.random() < 0.5:
        at = random.uniform(20, 80), random.choice([-1, 1]) * (rooms[1] + 3)
        yard -= shapely.Point(at).buffer(2.5, quad_segs=2)
    if not isinstance(yard, shapely.Polygon):
        return False
    fleet = within(yard, case)
    lanes = [each for each in outside(fleet, case) if "beside the route" in each.message]
    with named(seed):
        ended = by_arbiters(fleet, case)
        by_fence = ended.code == "REJECTED" and "the fleet's fence" in ended.reason
        assert by_fence == bool(lanes), (case, lanes, ended)
        if lanes:
            name = ended.reason.partition(":")[0]
            assert any(f"{name}, in its place" in each.message for each in lanes)
    return bool(lanes)


def test_check_finds_the_lanes_that_arbiters_refuse() -> None:
    found = [check(seed) for seed in range(16)]
    assert 3 < sum(found) < 13, found
