"""The geoid, against PROJ and the package egm96 at 1,000 random places.

`egm96_undulations.csv`: `proj_m` is what PROJ 9.5.1 (pyproj 3.7.1) gives with `egm96_15.gtx` of
Debian's proj-data 9.1.1, `egm96_m` what egm96 0.3.0 gives, which has the grid of 5 minutes of arc
and another interpolation.
"""

import csv
import math
from pathlib import Path

import pytest

from m2pem.geo.geoid import ellipsoidal_m, mean_sea_level_m, undulation_m

VIRGINIA = 38.1075, -77.3192


def _references() -> list[tuple[float, float, float, float]]:
    with Path(__file__).with_name("egm96_undulations.csv").open(encoding="utf-8") as file:
        return [
            (float(lat), float(lon), float(proj_m), float(egm96_m))
            for lat, lon, proj_m, egm96_m in list(csv.reader(file))[1:]
        ]


@pytest.mark.tried_with(
    "PROJ",
    "heights of the geoid EGM96 at 1,000 places",
    kind="Maps and geodesy",
    result="within 1 cm",
    note="PROJ's wheel has no geoid",
    package="pyproj",
)
def test_undulations_are_those_of_proj_at_1000_places() -> None:
    references = _references()
    assert len(references) == 1000
    for latitude, longitude, proj_m, _ in references:
        assert undulation_m(latitude, longitude) == pytest.approx(proj_m, abs=0.01)


def test_undulations_are_those_of_the_finer_grid_within_a_metre() -> None:
    for latitude, longitude, _, egm96_m in _references():
        assert undulation_m(latitude, longitude) == pytest.approx(egm96_m, abs=0.7)


@pytest.mark.parametrize(
    ("latitude", "longitude", "nga_m"),
    [
        (38.6281550, 269.7791550, -31.628),
        (-14.6212170, 305.0211140, -2.969),
        (46.8743190, 102.4487290, -43.575),
        (-23.6174460, 133.8747120, 15.871),
        (38.6254730, 359.9995000, 50.066),
        (-0.4667440, 0.0023000, 17.329),
    ],
)
def test_undulations_are_those_that_the_nga_publishes_for_egm96(
    latitude: float, longitude: float, nga_m: float
) -> None:
    # The test points of the NGA's program F477.
    assert undulation_m(latitude, longitude) == pytest.approx(nga_m, abs=0.1)


def test_the_undulation_is_the_same_on_both_sides_of_the_date_line_and_at_a_pole() -> None:
    assert undulation_m(-16.9, 180) == undulation_m(-16.9, -180) == undulation_m(-16.9, 540)
    assert undulation_m(-16.9, 179.9999) == pytest.approx(undulation_m(-16.9, -179.9999), abs=0.01)
    assert undulation_m(10, -180.00000000000003) == pytest.approx(undulation_m(10, 180))
    for pole in (90, -90):
        assert undulation_m(pole, -77) == pytest.approx(undulation_m(pole, 103))


def test_a_height_goes_to_mean_sea_level_and_back() -> None:
    # 60 m above the ellipsoid in Virginia.
    assert mean_sea_level_m(*VIRGINIA, 60.0) == pytest.approx(93.97, abs=0.01)
    assert ellipsoidal_m(*VIRGINIA, 93.97) == pytest.approx(60.0, abs=0.01)


@pytest.mark.parametrize("place", [(math.nan, 0), (0, math.nan), (0, math.inf), (90.001, 0)])
def test_what_is_no_place_has_no_undulation(place: tuple[float, float]) -> None:
    assert math.isnan(undulation_m(*place))
