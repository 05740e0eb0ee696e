"""Survey patterns: everything is covered, nothing that is kept out is entered."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.geo.cameras import SurveyCamera, image_plan
from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import edges_enclose
from m2pem.geo.survey_pattern import Surveyor, SurveyPattern, SurveyRoute, survey_routes
from m2pem.mission.geometry import Area

FRAME = LocalFrame((53.0, 7.0))
ALONE = (Surveyor("uav1", 10.0),)


def area(*rings: tuple[EastNorth, ...]) -> Area:
    """An area with corners in metres of `FRAME`."""
    closed = ((*ring, ring[0]) for ring in rings)
    return Area(tuple(tuple((*FRAME.to_latlon(at), None) for at in ring) for ring in closed))


def box(west: float, south: float, east: float, north: float) -> tuple[EastNorth, ...]:
    return ((west, south), (east, south), (east, north), (west, north))


def places(found: SurveyRoute) -> list[EastNorth]:
    return [FRAME.to_local(each[:2]) for each in found.route.waypoints]


def enters(way: list[EastNorth], closed: tuple[EastNorth, ...]) -> bool:
    """Whether a way has a place that is clearly within a polygon."""
    edges = list(pairwise((*closed, closed[0])))
    for a, b in pairwise(way):
        steps = max(1, math.ceil(math.dist(a, b)))
        for step in range(steps + 1):
            at = (a[0] + (b[0] - a[0]) * step / steps, a[1] + (b[1] - a[1]) * step / steps)
            if edges_enclose(edges, at) and distance_m(at, edges) > 0.05:
                return True
    return False


def uncovered(way: list[EastNorth], place: EastNorth) -> float:
    return distance_m(place, [*pairwise(way)])


def distance_m(place: EastNorth, edges: Sequence[tuple[EastNorth, EastNorth]]) -> float:
    return float(shapely.MultiLineString(edges).distance(shapely.Point(place)))


# --- one vehicle --------------------------------------------------------------------------------


def test_a_field_is_covered_along_its_long_side() -> None:
    (found,) = survey_routes(
        SurveyPattern(area(box(0, 0, 200, 60)), 20.0, altitude_m=30.0, altitude_frame="terrain"),
        ALONE,
    )
    assert found.passes == 3
    assert found.route.altitude_frame == "terrain"
    assert {each[2] for each in found.route.waypoints} == {30.0}
    assert found.surveyed_m == pytest.approx(600, abs=0.1)
    assert found.length_m == pytest.approx(640, abs=0.1)
    assert found.time_s == pytest.approx(64, abs=0.01)
    assert places(found)[0] == pytest.approx((0, 10), abs=0.01)


def test_the_heading_of_a_tilted_field_is_found() -> None:
    cos, sin = math.cos(0.6), math.sin(0.6)
    tilted = tuple((x * cos - y * sin, x * sin + y * cos) for x, y in box(0, 0, 200, 60))
    (found,) = survey_routes(SurveyPattern(area(tilted), 20.0), ALONE)
    assert found.passes == 3


@pytest.mark.parametrize(
    ("corner", "begins"),
    [(0, (0, 10)), (1, (200, 10)), (2, (200, 50)), (3, (0, 50))],
)
def test_it_begins_at_the_corner_that_is_chosen(corner: int, begins: EastNorth) -> None:
    pattern = SurveyPattern(area(box(0, 0, 200, 60)), 20.0, heading_rad=math.pi / 2, corner=corner)
    (found,) = survey_routes(pattern, ALONE)
    assert places(found)[0] == pytest.approx(begins, abs=0.01)


def test_margins_turn_arounds_and_a_cross_hatch() -> None:
    field = area(box(0, 0, 200, 60))
    (wider,) = survey_routes(SurveyPattern(field, 20.0, margin_m=10.0), ALONE)
    assert wider.surveyed_m == pytest.approx(4 * 220, abs=0.1)
    (longer,) = survey_routes(SurveyPattern(field, 20.0, turn_around_m=15.0), ALONE)
    assert longer.length_m == pytest.approx(3 * 230 + 2 * 20, abs=0.1)
    assert longer.surveyed_m == pytest.approx(600, abs=0.1)
    (twice,) = survey_routes(SurveyPattern(field, 20.0, cross_hatch=True), ALONE)
    assert twice.passes == 3 + 10
    assert twice.surveyed_m == pytest.approx(600 + 600, abs=0.1)


def test_the_way_leads_around_a_hole_and_a_keep_out_area() -> None:
    hole, closed = box(80, 20, 120, 80), box(140, -50, 160, 50)
    pattern = SurveyPattern(
        area(box(0, 0, 200, 100), hole), 10.0, keep_out=(area(closed),), turn_around_m=5.0
    )
    (found,) = survey_routes(pattern, ALONE)
    way = places(found)
    assert not enters(way, hole)
    assert not enters(way, closed)
    for place in ((10, 10), (100, 10), (100, 90), (130, 50), (150, 70), (180, 30)):
        assert uncovered(way, place) <= 5.01


def test_a_clearance_is_kept() -> None:
    closed = box(90, 40, 110, 60)
    pattern = SurveyPattern(
        area(box(0, 0, 200, 100)), 10.0, keep_out=(area(closed),), clearance_m=8.0
    )
    (found,) = survey_routes(pattern, ALONE)
    assert not enters(places(found), box(82, 32, 118, 68))


@pytest.mark.parametrize(
    ("pattern", "says"),
    [
        (SurveyPattern(area(box(0, 0, 200, 60)), 0.0), "spacing: 0 m is not above 0"),
        (SurveyPattern(area(box(0, 0, 200, 60)), math.nan), "spacing: nan m is not above 0"),
        (SurveyPattern(area(box(0, 0, 200, 60)), 0.001), "more than 2000 passes"),
        (SurveyPattern(area(box(0, 0, 200, 60)), 9.0, margin_m=-40), "nothing of the area is left"),
        (
            SurveyPattern(
                area(box(0, 0, 100, 100), box(20, 20, 80, 80)),
                9.0,
                keep_out=(area(box(40, -10, 60, 110)), area(box(-10, -20, 110, -15))),
            ),
            "",
        ),
    ],
)
def test_what_cannot_be_surveyed_says_why(pattern: SurveyPattern, says: str) -> None:
    if not says:
        assert survey_routes(pattern, ALONE)
        return
    with pytest.raises(GeometryError, match=says):
        survey_routes(pattern, ALONE)


def test_a_part_that_cannot_be_reached_is_named() -> None:
    ring = area(box(40, 40, 60, 60), box(41, 41, 59, 59))
    with pytest.raises(GeometryError, match="cannot be reached"):
        survey_routes(SurveyPattern(area(box(0, 0, 100, 100)), 5.0, keep_out=(ring,)), ALONE)


def test_narrow_bands_beside_ponds_are_covered() -> None:
    ponds = (box(10, 9, 190, 66), box(10, 84, 190, 141))
    pattern = SurveyPattern(area(box(0, 0, 200, 150), *ponds), 40.0, heading_rad=math.pi / 2)
    (found,) = survey_routes(pattern, ALONE)
    way = shapely.LineString(places(found))
    closed = shapely.union_all([shapely.Polygon(each) for each in ponds])
    assert way.intersection(closed.buffer(-0.05)).length == 0.0
    seen = way.buffer(20.01, cap_style="flat")
    assert shapely.Polygon(box(0, 0, 200, 150)).difference(closed).difference(seen).area < 1.0


sides = st.floats(30.0, 300.0)


@settings(deadline=None, max_examples=40)
@given(
    radii=st.lists(st.floats(40.0, 150.0), min_size=3, max_size=7),
    spacing=st.floats(8.0, 30.0),
    heading=st.floats(0.0, 6.0),
    at=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    size=st.tuples(st.floats(5.0, 60.0), st.floats(5.0, 60.0)),
)
def test_random_areas_are_covered_and_what_is_kept_out_is_not_entered(
    radii: list[float], spacing: float, heading: float, at: EastNorth, size: tuple[float, float]
) -> None:
    count = len(radii)
    outline = tuple(
        (radius * math.cos(math.tau * i / count), radius * math.sin(math.tau * i / count))
        for i, radius in enumerate(radii)
    )
    closed = box(at[0], at[1], at[0] + size[0], at[1] + size[1])
    pattern = SurveyPattern(area(outline), spacing, heading, keep_out=(area(closed),))
    (found,) = survey_routes(pattern, ALONE)
    way = places(found)
    assert not enters(way, closed)
    inside, outside = list(pairwise((*outline, outline[0]))), list(pairwise((*closed, closed[0])))
    for east in range(-150, 151, 15):
        for north in range(-150, 151, 15):
            place = (float(east), float(north))
            if edges_enclose(inside, place) and not edges_enclose(outside, place):
                assert uncovered(way, place) <= spacing / 2 + 0.02


# --- several vehicles ---------------------------------------------------------------------------


def test_vehicles_share_by_their_speeds() -> None:
    pattern = SurveyPattern(area(box(0, 0, 200, 200)), 10.0)
    fast, slow = survey_routes(pattern, (Surveyor("fast", 15.0), Surveyor("slow", 5.0)))
    assert (fast.passes, slow.passes) == (15, 5)
    assert fast.time_s == pytest.approx(slow.time_s, rel=0.1)
    assert (fast.surveyor.name, slow.surveyor.name) == ("fast", "slow")


def test_vehicles_that_do_not_last_long_enough_are_named() -> None:
    pattern = SurveyPattern(area(box(0, 0, 200, 200)), 10.0)
    with pytest.raises(GeometryError, match=r"4000 m of passes.*uav1 1000 m, uav2 2000 m"):
        survey_routes(pattern, (Surveyor("uav1", 10.0, 100.0), Surveyor("uav2", 10.0, 200.0)))


# --- cameras ------------------------------------------------------------------------------------


def test_a_camera_gives_spacing_trigger_distance_and_resolution() -> None:
    # 13.2 mm x 8.8 mm behind 8.8 mm, 5472 x 3648 pixels: at 100 m an image shows 150 m x 100 m.
    camera = SurveyCamera(13.2, 8.8, 8.8, 5472, 3648)
    plan = image_plan(camera, 100.0, front_overlap=0.8, side_overlap=0.7)
    assert plan.spacing_m == pytest.approx(45.0)
    assert plan.trigger_distance_m == pytest.approx(20.0)
    assert plan.ground_resolution_m == pytest.approx(0.0274, abs=1e-4)
    with pytest.raises(ValueError, match="height above ground"):
        image_plan(camera, 0.0, 0.8, 0.7)
    with pytest.raises(ValueError, match="side_overlap 1 is not"):
        image_plan(camera, 10.0, 0.8, 1.0)


@pytest.mark.parametrize("speed_m_s", [0.0, -1.0, math.nan, math.inf])
def test_a_vehicle_without_a_speed_is_refused(speed_m_s: float) -> None:
    surveyors = (Surveyor("uav1", speed_m_s), Surveyor("uav2", 2.0))
    with pytest.raises(GeometryError, match=r"uav1: .* m/s is not above 0"):
        survey_routes(SurveyPattern(area(box(0, 0, 200, 60)), 10.0), surveyors)
