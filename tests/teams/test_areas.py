"""Who surveys how much: the faster more, and nobody more than its endurance lets it."""

import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.fleet.behaviors import SHARED
from m2pem.geo.geojson import as_geojson, parse_geojson
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.geo.work_shares import owners, split
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Route
from m2pem.teams.plan import Plan, TeamRefusedError
from m2pem.teams.restart import Reference, read_reference
from m2pem.teams.team_state import PLANS

from .conftest import area, one_task
from .rehearsed import sim_fleet
from .test_members_apart import judged
from .test_planning import FIELD, OFFERED, setting

LENGTHS = st.lists(st.floats(1.0, 500.0), min_size=1, max_size=30)


def way_m(plan: Plan, member: str) -> float:
    """Of a member's passes, without the ways from one to the next."""
    legs = [leg for leg in plan.legs if leg.member == member]
    if not legs:
        return 0.0
    route = legs[0].parameters["route"]
    assert isinstance(route, Route)
    places = [setting("ground").frame.to_local(each[:2]) for each in route.waypoints]
    # Each end of a pass has a place beside it on both sides, but for the first and the last.
    return sum(math.dist(places[at], places[at + 3]) for at in range(0, len(places), 6))


@given(
    LENGTHS,
    st.lists(
        st.tuples(st.floats(0.1, 20.0), st.one_of(st.just(math.inf), st.floats(0.0, 9000.0))),
        min_size=1,
        max_size=6,
    ),
)
def test_all_is_shared_out_and_nobody_has_more_than_it_can_do(
    lengths: list[float], members: list[tuple[float, float]]
) -> None:
    weights, reaches = zip(*members, strict=True)
    whole = sum(lengths)
    shares = split(whole, weights, reaches)
    if shares is None:
        assert sum(reaches) < whole
        return
    assert sum(shares) == pytest.approx(whole)
    for share, reach in zip(shares, reaches, strict=True):
        assert 0 <= share <= reach * (1 + 1e-9) + 1e-6
    whose = owners(lengths, shares)
    assert whose == sorted(whose)
    for index, share in enumerate(shares):
        done = sum(length for length, owner in zip(lengths, whose, strict=True) if owner == index)
        assert done <= share + max(lengths) + 1e-6


@given(st.lists(st.floats(0.1, 20.0), min_size=1, max_size=6))
def test_who_all_last_share_as_they_are_fast(weights: list[float]) -> None:
    shares = split(1000.0, weights, [math.inf] * len(weights))
    assert shares == pytest.approx([1000.0 * each / sum(weights) for each in weights])


def test_what_the_fleet_says_of_a_members_speed_counts() -> None:
    wished = setting("ground", "ground", area=FIELD, spacing=5.0)
    quick = replace(wished, cruises_m_s={ResourceId("v1"): 15.0})
    plan = PLANS["area_survey"](quick)
    assert way_m(plan, "v1") == pytest.approx(3 * way_m(plan, "v0"))


def test_a_member_that_does_not_last_surveys_less_and_the_others_more() -> None:
    wished = setting("air", "air", area=FIELD, spacing=5.0)
    even = PLANS["area_survey"](wished)
    tired = replace(wished, lasts_s={ResourceId("v0"): 60.0})
    plan = PLANS["area_survey"](tired)
    there_and_back_m = 2 * math.hypot(60.0, 30.0)
    assert 0 < way_m(plan, "v0") <= 60.0 * 10.0 - there_and_back_m
    assert way_m(plan, "v0") < way_m(even, "v0")
    whole = way_m(even, "v0") + way_m(even, "v1")
    assert way_m(plan, "v0") + way_m(plan, "v1") == pytest.approx(whole)


def test_members_that_do_not_last_long_enough_are_not_sent() -> None:
    wished = setting("air", "air", area=FIELD, spacing=5.0)
    tired = replace(wished, lasts_s={ResourceId("v0"): 40.0, ResourceId("v1"): 50.0})
    with pytest.raises(TeamRefusedError, match=r"1440 m of passes.*v0 \d+ m, v1 \d+ m; take more"):
        PLANS["area_survey"](tired)


def test_after_a_restart_the_split_is_what_it_was() -> None:
    wished = setting("air", "air", area=FIELD, spacing=5.0)
    tired = PLANS["area_survey"](replace(wished, lasts_s={ResourceId("v0"): 60.0}))
    kept = read_reference(Reference(split=tired.split).text())
    assert kept.split == tired.split
    again = PLANS["area_survey"](replace(wished, begun=True, split=kept.split))
    assert [leg.parameters for leg in again.legs] == [leg.parameters for leg in tired.legs]


HOLED = Area((*FIELD.rings, area((50, 5), (70, 5), (70, 20), (50, 20)).rings[0]))
ACROSS = Area((*FIELD.rings, area((50, 15), (70, 15), (70, 45), (50, 45)).rings[0]))
"""Of two bands: a hole in the one, and a hole in both."""

SURVEYS = ("area_survey",)


def polygon(surveyed: Area) -> shapely.Polygon:
    frame = setting("ground").frame
    rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in surveyed.rings]
    return shapely.Polygon(rings[0], rings[1:])


@pytest.mark.parametrize("domain", ["air", "ground"])
def test_members_that_only_survey_survey_bands_with_holes_themselves(domain: str) -> None:
    plan = PLANS["area_survey"](
        setting(domain, domain, offered=SURVEYS, area=HOLED, spacing=10.0, heading=math.pi / 2)
    )
    bands = [leg.parameters["area"] for leg in plan.legs]
    assert {leg.behavior for leg in plan.legs} == {"area_survey"}
    assert all(isinstance(band, Area) and parse_geojson(as_geojson(band)) for band in bands)
    covered = shapely.union_all([polygon(band) for band in bands])
    assert covered.symmetric_difference(polygon(HOLED)).buffer(-0.02).is_empty
    swaths = []
    for leg, band in zip(plan.legs, bands, strict=True):
        given = BehaviorParameters(leg.parameters)
        rings = [list(ring.coords) for ring in (polygon(band).exterior, *polygon(band).interiors)]
        own = SurveyTracks.over(rings, given.spacing_m, given.yaw_rad)
        line = shapely.LineString(own.line.points)
        assert not line.intersects(polygon(HOLED).interiors[0].convex_hull.buffer(-0.05))
        swaths.append(line.buffer(5.1))
    assert polygon(HOLED).difference(shapely.union_all(swaths)).is_empty


def test_who_only_surveys_is_refused_where_a_hole_lies_across_bands() -> None:
    only = setting(
        "ground", "ground", offered=SURVEYS, area=ACROSS, spacing=10.0, heading=math.pi / 2
    )
    with pytest.raises(TeamRefusedError, match="v0, v1 needs single_vehicle_routing: a band would"):
        PLANS["area_survey"](only)
    v0, v1 = only.members
    specs = {name: SHARED[name, BehaviorType.VEHICLE] for name in OFFERED}
    mixed = replace(only, offered={v0: only.offered[v0], v1: specs})
    with pytest.raises(TeamRefusedError, match="v0 needs single_vehicle_routing: v1 does not"):
        PLANS["area_survey"](mixed)


def test_a_team_that_only_surveys_covers_an_area_with_a_hole() -> None:
    fleet = sim_fleet({"a": (-10.0, 0.0), "b": (-10.0, 40.0)}, {"field": HOLED})
    vehicles = {name: replace(each, behaviors=SURVEYS) for name, each in fleet.vehicles.items()}
    mission = one_task("area_survey", area="field", spacing="10 m", heading="90 deg")
    found = judged(replace(fleet, vehicles=vehicles), mission)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    tracks = [shapely.LineString(each) for each in found.tracks.values()]
    hole = shapely.Polygon(polygon(HOLED).interiors[0])
    assert not any(track.intersects(hole.buffer(-0.1)) for track in tracks)
    swaths = shapely.union_all([track.buffer(5.1) for track in tracks])
    assert polygon(HOLED).difference(swaths).is_empty
