"""Plans of teams, without anything that moves."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import TEAM_NEEDS
from m2pem.fleet.parameters import accepted
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point, Route, VehiclePosition
from m2pem.teams.areas import strips
from m2pem.teams.paths import MemberPath, slot
from m2pem.teams.plan import MemberPose, Plan, PlanningContext, TeamRefusedError
from m2pem.teams.restart import Reference, read_reference
from m2pem.teams.team_state import PLANS
from tests.geo.passes import lawn_mower

from .carts import FRAME
from .conftest import area, route

OFFERED = ("single_vehicle_routing", "goto", "follow")
FIELD = area((0, 0), (120, 0), (120, 60), (0, 60))


def setting(
    *domains: str, offered: tuple[str, ...] = OFFERED, yaw: float | None = 0.0, **parameters: Any
) -> PlanningContext:
    names = [ResourceId(f"v{index}") for index in range(len(domains))]
    specs = {name: SHARED[name, BehaviorType.VEHICLE] for name in offered}
    return PlanningContext(
        tuple(names),
        dict(zip(names, domains, strict=True)),
        {name: specs for name in names},  # noqa: C420
        BehaviorParameters(parameters),
        FRAME,
        {name: MemberPose((-20.0 * index, 0.0), yaw) for index, name in enumerate(names)},
    )


def waypoints(plan: Plan, member: str) -> list[tuple[float, float, float | None]]:
    leg = next(leg for leg in plan.legs if leg.member == member)
    found = leg.parameters["route"]
    assert isinstance(found, Route)
    return [(*FRAME.to_local(each[:2]), each[2]) for each in found.waypoints]


def test_every_shared_team_behavior_has_a_plan_and_says_what_it_needs() -> None:
    shared = {name for name, type_ in SHARED if type_ is BehaviorType.TEAM}
    assert set(PLANS) == shared
    assert set(TEAM_NEEDS) == shared


def test_members_in_one_lane_go_no_faster_than_their_spacing_lets_them_stop() -> None:
    road = route((50, 0), (500, 0))
    near = PLANS["road_following_formation"](
        setting("ground", "ground", route=road, spacing=5.0, speed=20.0)
    )
    abreast = PLANS["road_sweep"](setting("ground", "ground", route=road, spacing=5.0, speed=20.0))
    assert near.march
    assert abreast.march
    assert near.march.speed_m_s < 2.0
    assert abreast.march.speed_m_s == 20.0


def test_the_slowest_domain_sets_the_speed_when_nobody_does() -> None:
    plan = PLANS["road_sweep"](setting("air", "surface", route=route((50, 0), (500, 0))))
    assert plan.march
    assert plan.march.speed_m_s == 4.0
    assert {leg.parameters["speed"] for leg in plan.legs} == {4.0}


def test_altitudes_of_a_route_are_kept() -> None:
    high = Route(
        tuple((*FRAME.to_latlon((east, 0.0)), 30.0 + east / 10) for east in (50.0, 150.0)), "amsl"
    )
    plan = PLANS["road_following_formation"](setting("air", "air", route=high, spacing=50.0))
    assert waypoints(plan, "v0")[-1][2] == 45.0
    assert waypoints(plan, "v1")[-1][2] == pytest.approx(40.0, abs=0.1)
    assert [leg.parameters["route"].altitude_frame for leg in plan.legs] == ["amsl"] * 2  # type: ignore[union-attr]
    flat = PLANS["road_following_formation"](
        setting("air", "air", route=route((50, 0), (150, 0)), spacing=50.0)
    )
    assert {each[2] for name in ("v0", "v1") for each in waypoints(flat, name)} == {None}


def test_a_place_behind_the_beginning_of_a_route_is_gone_to_at_once() -> None:
    plan = PLANS["bridge_crossing"](
        setting("ground", "ground", "ground", route=route((50, 0), (80, 0)), spacing=40.0)
    )
    assert [leg.behavior for leg in plan.legs] == ["single_vehicle_routing", "goto", "goto"]
    target = plan.legs[2].parameters["target"]
    assert isinstance(target, Point)
    assert FRAME.to_local(target.position[:2]) == pytest.approx((0, 0), abs=0.01)


def test_who_has_no_goto_takes_a_route_of_two_places() -> None:
    plan = PLANS["formation"](
        setting("ground", "ground", offered=OFFERED[:1], shape="line", spacing=10.0)
    )
    assert [at[:2] for at in waypoints(plan, "v1")] == [
        pytest.approx((-20, 0), abs=0.01),
        pytest.approx((0, 10), abs=0.01),
    ]


def test_the_faster_survey_more() -> None:
    plan = PLANS["area_survey"](setting("ground", "air", area=FIELD, spacing=5.0))
    corners = {name: len(waypoints(plan, name)) + 2 for name in ("v0", "v1")}
    assert corners["v1"] == 2 * corners["v0"]
    even = PLANS["area_survey"](setting("ground", "air", area=FIELD, spacing=5.0, speed=3.0))
    assert len(waypoints(even, "v1")) == len(waypoints(even, "v0"))


MIXED = Route.of((*route((50, 0), (500, 0)).waypoints,), ("relative", "amsl"))


def test_a_route_of_different_frames_is_marched_at_the_altitude_of_the_task() -> None:
    plan = PLANS["road_sweep"](setting("air", "air", route=MIXED, altitude=30.0))
    assert {leg.parameters["altitude"] for leg in plan.legs} == {30.0}


def test_only_aircraft_are_told_an_altitude() -> None:
    plan = PLANS["area_survey"](setting("ground", "air", area=FIELD, altitude=40.0))
    assert [leg.parameters.get("altitude") for leg in plan.legs] == [None, 40.0]


@pytest.mark.parametrize(
    ("behavior", "wished", "why"),
    [
        ("formation", setting("ground", "ground", yaw=None), "the heading of v0"),
        ("escort", setting("ground", target=VehiclePosition("v0")), "v0 cannot escort itself"),
        ("area_observe", setting("ground", target=VehiclePosition("vip")), "position of vip"),
        ("area_survey", setting("ground", area=FIELD, spacing=0.001), "spacing"),
        ("road_sweep", setting("ground", route=route((0, 0), (0, 0))), "the lead is there"),
        ("road_sweep", setting("ground", route=route((0, 0), (0, 200_000))), "100 km away"),
        ("road_sweep", setting("air", route=MIXED), "count from different heights"),
    ],
)
def test_what_cannot_be_done_is_refused_by_name(
    behavior: str, wished: PlanningContext, why: str
) -> None:
    with pytest.raises(TeamRefusedError, match=why):
        PLANS[behavior](wished)


def test_the_way_back_is_told_from_the_way_there() -> None:
    path = MemberPath([(0, 0, 0), (100, 0, 0), (100, 4, 0), (0, 4, 0)], [0, 100, 104, 204])
    assert path.find((40, 2.5), None, 0, yaw_rad=0.0) == pytest.approx(40)
    back_m = path.line.length_m - 40
    assert path.find((40, 1.5), None, 0, yaw_rad=math.pi) == pytest.approx(back_m)
    assert path.find((40, 2.5), 35.0, 20.0) == pytest.approx(40), "not the nearer leg, but the next"
    assert path.find((0, 60), 10.0, 20.0) == pytest.approx(back_m + 40), (
        "one who has strayed is looked for"
    )


def test_marks_of_two_paths_are_the_same_abreast() -> None:
    inner = MemberPath([(0, 0, 0), (90, 0, 0), (90, 90, 0)], [0, 100, 200])
    assert math.dist(inner.line.at(inner.along_m(50)), (45, 0)) < 1.0
    assert math.dist(inner.line.at(inner.along_m(100)), (90, 0)) < 3.5, "a vehicle rounds corners"
    assert inner.mark_m(inner.along_m(50)) == pytest.approx(50)
    assert inner.mark_m(1000) == 200
    assert inner.mark_m(-5) == 0


@pytest.mark.parametrize("text", [None, "", "a goal of somebody", "[]", "{", '{"begun": 3}'])
def test_a_reference_that_cannot_be_read_is_an_empty_one(text: str | None) -> None:
    assert read_reference(text) == Reference()


def test_a_reference_is_read_as_it_was_written() -> None:
    written = Reference({"a": "x", "a/b": None}, ("a",), {ResourceId("b"): "FAILED: why"}, 3)
    assert read_reference(written.text()) == written


def ring_of(leg: Any) -> list[tuple[float, float]]:
    """The corners of the area that a member surveys."""
    return [FRAME.to_local(corner[:2]) for corner in leg.parameters["area"].rings[0]]


def test_who_can_survey_itself_is_given_the_area_of_its_band() -> None:
    offered = (*OFFERED, "area_survey")
    wished = setting(
        "ground", "air", offered=offered, area=FIELD, spacing=5.0, altitude=40.0, overshoot=7.0
    )
    plan = PLANS["area_survey"](wished)
    assert [leg.behavior for leg in plan.legs] == ["area_survey"] * 2
    for leg in plan.legs:
        given = {name: leg.parameters[name] for name in ("spacing", "overshoot", "heading")}
        assert given == {
            "spacing": pytest.approx(5.0, rel=0.03),  # rounding must not add a pass to a band
            "overshoot": 7.0,
            "heading": pytest.approx(math.pi / 2),
        }
    slow, fast = plan.legs
    assert "altitude" not in slow.parameters
    assert fast.parameters["altitude"] == 40.0
    assert sorted({round(north, 3) for _, north in ring_of(slow)}) == [0.0, 20.0]
    assert sorted({round(north, 3) for _, north in ring_of(fast)}) == [20.0, 60.0]
    assert plan.takes["v1"] == {*accepted(SHARED["area_survey", BehaviorType.VEHICLE])}


@pytest.mark.parametrize("offered", [OFFERED, (*OFFERED, "area_survey")])
def test_the_frame_of_an_altitude_goes_with_it(offered: tuple[str, ...]) -> None:
    high = {"altitude": 140.0, "altitude_frame": "amsl"}
    plan = PLANS["area_survey"](setting("air", "air", offered=offered, area=FIELD, **high))
    for leg in plan.legs:
        assert {name: leg.parameters[name] for name in high} == high
        assert set(high) <= plan.takes[leg.member]


def test_a_member_who_cannot_survey_itself_has_all_move_along_the_passes() -> None:
    wished = setting("ground", "air", area=FIELD, offered=(*OFFERED, "area_survey"))
    less = {name: SHARED[name, BehaviorType.VEHICLE] for name in OFFERED}
    wished = replace(wished, offered={**wished.offered, ResourceId("v1"): less})
    plan = PLANS["area_survey"](wished)
    assert {leg.behavior for leg in plan.legs} == {"single_vehicle_routing"}


def size_m2(ring: Any) -> float:
    """Of a polygon."""
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise(ring))) / 2


@given(
    st.lists(st.floats(20.0, 90.0), min_size=3, max_size=9),
    st.integers(1, 4),
    st.floats(2.0, 40.0),
    st.floats(0.0, math.tau),
)
def test_the_bands_of_an_area_are_all_of_it_and_each_is_within_reach_of_its_own_passes(
    radii: list[float], members: int, spacing: float, yaw: float
) -> None:
    angles = [math.tau * index / len(radii) for index in range(len(radii))]
    corners = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]
    rings = [[*corners, corners[0]]]
    parts = strips(rings, SurveyTracks.over(rings, spacing, yaw), [1.0] * members)
    assume(parts)  # none has several pieces
    sizes = [size_m2(part[0]) for part in parts if part]
    assert sum(sizes) == pytest.approx(size_m2(rings[0]), rel=1e-6)
    assert len(sizes) == min(members, len(sizes))
    for part in parts:
        if part:
            own = lawn_mower(part, spacing, yaw)
            across = [east * -math.sin(yaw) + north * math.cos(yaw) for east, north in own]
            for east, north in part[0]:
                off = east * -math.sin(yaw) + north * math.cos(yaw)
                assert min(abs(off - each) for each in across) <= spacing / 2 + 1e-6


@pytest.mark.parametrize(
    "shape", ["column", "line", "wedge", "vee", "diamond", "echelon_left", "echelon_right"]
)
def test_no_two_members_share_a_place(shape: str) -> None:
    slots = [slot(shape, index) for index in range(12)]
    assert len(set(slots)) == 12
    assert slots[0] == (0, 0)
