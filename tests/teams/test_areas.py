"""Who surveys how much: the faster more, and nobody more than its endurance lets it."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.geo.work_shares import owners, split
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.teams.plan import Plan, TeamRefusedError
from m2pem.teams.restart import Reference, read_reference
from m2pem.teams.team_state import PLANS

from .test_planning import FIELD, setting

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
