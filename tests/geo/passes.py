"""The ends of passes over an area, one after the other."""

from collections.abc import Sequence

from m2pem.geo.lawn_mower import Ring
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.survey_tracks import SurveyTracks


def lawn_mower(
    rings: Sequence[Ring], spacing_m: float, yaw_rad: float, overshoot_m: float = 0.0
) -> list[EastNorth]:
    tracks = SurveyTracks.over(rings, spacing_m, yaw_rad, overshoot_m)
    return [tracks.line.points[index + end] for index, *_ in tracks.passes for end in (0, 1)]
