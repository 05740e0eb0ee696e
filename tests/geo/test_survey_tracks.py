"""Parts of a survey: the area of a part gives the same tracks again, also in another frame."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest
from shapely import LineString, Polygon, union_all
from shapely.geometry.base import BaseGeometry

from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.survey_tracks import SurveyTracks
from tests.geo.passes import lawn_mower

SQUARE = [(0.0, 0.0), (100.0, 0.0), (100.0, 95.0), (0.0, 95.0), (0.0, 0.0)]
SLANTED = [(0.0, 0.0), (200.0, 10.0), (180.0, 120.0), (20.0, 100.0), (0.0, 0.0)]
HOLE = [(40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0), (40.0, 40.0)]
SPACING_M, YAW = 20.0, 0.3


def tracks_over(rings: Sequence[Sequence[EastNorth]], overshoot_m: float = 0.0) -> SurveyTracks:
    return SurveyTracks.over(rings, SPACING_M, YAW, overshoot_m)


def passes_m(points: Sequence[EastNorth]) -> float:
    return sum(math.dist(*points[index : index + 2]) for index in range(0, len(points), 2))


def passed_m(tracks: SurveyTracks, from_m: float, to_m: float) -> float:
    marks = tracks.line.marks_m
    return sum(
        max(0.0, min(to_m, marks[index + 1]) - max(from_m, marks[index]))
        for index in range(0, len(marks), 2)
    )


@pytest.mark.parametrize("rings", [[SQUARE], [SLANTED]])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.33, 0.5, 0.77, 0.97])
def test_tracks_over_what_is_left_are_the_tracks_that_are_left(
    rings: Sequence[Sequence[EastNorth]], share: float
) -> None:
    tracks = tracks_over(rings)
    from_m = share * tracks.line.length_m
    left = tracks.part(from_m)
    again = lawn_mower(left, tracks.spacing_m(left), tracks.yaw_rad)
    assert passes_m(again) == pytest.approx(passed_m(tracks, from_m, math.inf), abs=0.1)


def test_a_frame_some_kilometres_away_gives_the_same_tracks() -> None:
    """Its north is another one: the strips are not quite level in it."""
    near, far = LocalFrame((38.0, -77.0)), LocalFrame((38.05, -77.05))
    tracks = tracks_over([SLANTED])
    for share in (0.1, 0.33, 0.5, 0.77):
        from_m = share * tracks.line.length_m
        left = tracks.part(from_m)
        there = [[far.to_local(near.to_latlon(corner)) for corner in ring] for ring in left]
        again = lawn_mower(there, tracks.spacing_m(left), tracks.yaw_rad)
        assert passes_m(again) == pytest.approx(passed_m(tracks, from_m, math.inf), rel=0.01)


def test_parts_between_distances_add_up_to_the_whole() -> None:
    tracks = tracks_over([SLANTED])
    bounds = [0.0, 210.0, 555.5, tracks.line.length_m]
    total = 0.0
    for from_m, to_m in pairwise(bounds):
        part = tracks.part(from_m, to_m)
        total += passes_m(lawn_mower(part, tracks.spacing_m(part), tracks.yaw_rad))
    assert total == pytest.approx(passes_m(tracks.line.points), abs=0.2)


def test_the_overshoot_of_a_pass_is_no_part_of_the_area() -> None:
    tracks = tracks_over([SQUARE], overshoot_m=7.0)
    left = tracks.part(0.0)
    again = lawn_mower(left, tracks.spacing_m(left), tracks.yaw_rad, 7.0)
    assert passes_m(again) == pytest.approx(passes_m(tracks.line.points), abs=0.1)


def test_what_is_left_of_a_done_survey_is_nothing() -> None:
    tracks = tracks_over([SQUARE])
    assert tracks.part(tracks.line.length_m) == []


def test_two_pieces_that_do_not_meet_are_no_area() -> None:
    """The prongs of a U: what is left of it above its base are two areas."""
    prongs = [(0, 0), (100, 0), (100, 90), (70, 90), (70, 30), (30, 30), (30, 90), (0, 90), (0, 0)]
    rings = [[(float(east), float(north)) for east, north in prongs]]
    tracks = SurveyTracks.over(rings, 15.0, 0.0)
    assert len(tracks.part(0.0)) == 1
    assert tracks.part(0.6 * tracks.line.length_m) == []


POND = [(20.0, 12.0), (80.0, 12.0), (80.0, 34.0), (20.0, 34.0), (20.0, 12.0)]
SPIKED = [(30.0, 50.0), (70.0, 50.0), (50.0, 80.0), (50.0, 94.9), (50.0, 80.0), (30.0, 50.0)]


def covered(tracks: SurveyTracks, from_m: float = 0.0, to_m: float = math.inf) -> BaseGeometry:
    """What a vehicle sees within half a strip beside its passes."""
    strips = []
    for index, before_m, after_m, _ in tracks.passes:
        begin_m, end_m = tracks.line.marks_m[index], tracks.line.marks_m[index + 1]
        low_m, high_m = max(from_m, begin_m + before_m), min(to_m, end_m - after_m)
        if low_m < high_m:
            line = LineString([tracks.line.at(low_m), tracks.line.at(high_m)])
            strips.append(line.buffer(tracks.width_m / 2 + 1e-3, cap_style="flat"))
    return union_all(strips)


@pytest.mark.parametrize("holes", [[HOLE], [POND, SPIKED], [SPIKED]])
@pytest.mark.parametrize("overshoot_m", [0.0, 7.0])
@pytest.mark.parametrize("yaw", [0.0, YAW, 2.0])
@pytest.mark.parametrize("spacing_m", [9.0, 20.0, 45.0])
def test_an_area_with_holes_is_covered_and_the_way_leads_around_them(
    holes: list[list[EastNorth]], overshoot_m: float, yaw: float, spacing_m: float
) -> None:
    tracks = SurveyTracks.over([SQUARE, *holes], spacing_m, yaw, overshoot_m)
    closed = union_all([Polygon(ring).buffer(0) for ring in holes])
    area = Polygon(SQUARE).difference(closed)
    assert LineString(tracks.line.points).intersection(closed.buffer(-0.02)).length == 0.0
    assert area.difference(covered(tracks)).buffer(-0.05).is_empty
    for way in (tracks, tracks.reversed()):
        for share in (0.2, 0.5, 0.8):
            from_m = share * way.line.length_m
            left = way.part(from_m)
            if not left:
                continue  # in several pieces
            rest = Polygon(left[0], left[1:])
            assert rest.intersection(closed).area < 0.1
            again = SurveyTracks.over(left, way.spacing_m(left), way.yaw_rad, overshoot_m)
            both = union_all([covered(way, 0.0, from_m), covered(again)])
            assert area.difference(both).buffer(-0.05).is_empty


def test_a_hole_that_leaves_nothing_is_refused() -> None:
    moat = [(30.0, 30.0), (70.0, 30.0), (70.0, 70.0), (30.0, 70.0), (30.0, 30.0)]
    with pytest.raises(ValueError, match="area: nothing is left"):
        SurveyTracks.over([moat, [*moat]], SPACING_M, 0.0)
