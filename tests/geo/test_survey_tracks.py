"""Parts of a survey: the area of a part gives the same tracks again, also in another frame."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest

from m2pem.geo.lawn_mower import lawn_mower, strip_width_m
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.survey_tracks import SurveyTracks

SQUARE = [(0.0, 0.0), (100.0, 0.0), (100.0, 95.0), (0.0, 95.0), (0.0, 0.0)]
SLANTED = [(0.0, 0.0), (200.0, 10.0), (180.0, 120.0), (20.0, 100.0), (0.0, 0.0)]
HOLE = [(40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0), (40.0, 40.0)]
SPACING_M, YAW = 20.0, 0.3


def tracks_over(rings: Sequence[Sequence[EastNorth]], overshoot_m: float = 0.0) -> SurveyTracks:
    points = lawn_mower(rings, SPACING_M, YAW, overshoot_m)
    return SurveyTracks(points, strip_width_m(rings[0], SPACING_M, YAW), overshoot_m)


def passes_m(points: Sequence[EastNorth]) -> float:
    return sum(math.dist(*points[index : index + 2]) for index in range(0, len(points), 2))


def passed_m(tracks: SurveyTracks, from_m: float, to_m: float) -> float:
    marks = tracks.line.marks_m
    return sum(
        max(0.0, min(to_m, marks[index + 1]) - max(from_m, marks[index]))
        for index in range(0, len(marks), 2)
    )


@pytest.mark.parametrize("rings", [[SQUARE], [SLANTED], [SQUARE, HOLE]])
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
    points = lawn_mower(rings, 15.0, 0.0)
    tracks = SurveyTracks(points, strip_width_m(rings[0], 15.0, 0.0))
    assert len(tracks.part(0.0)) == 1
    assert tracks.part(0.6 * tracks.line.length_m) == []
