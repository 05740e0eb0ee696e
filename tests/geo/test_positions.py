"""Positions too far from the fleet's origin, which are most often swapped, and local ones."""

from pathlib import Path

import pymap3d
import pytest

from m2pem.errors import FleetError
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet_file import load_fleet
from m2pem.fleet.parameters import ParameterError, examine, resolve
from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import distance_m
from m2pem.geo.positions import is_local, local_point, out_of_reach
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.geometry import Point

from ..fleet.fleets import LINE, write_fleet, write_json

ORIGIN = (38.0, -77.0, 0.0)


def test_a_degree_is_as_long_as_on_the_ellipsoid() -> None:
    assert distance_m((38.0, -77.0), (39.0, -77.0)) == pytest.approx(111_006, abs=1)
    assert distance_m((0.0, 179.5), (0.0, -179.5)) == pytest.approx(111_319.5, abs=1)


@pytest.mark.parametrize(
    ("place", "hint"),
    [
        ((38.1, -77.1, None), None),
        ((41.0, -77.0, 10.0), None),
        ((-77.0, 38.0, None), "latitude and longitude swapped"),
        ((9.97, 153.54, None), "set the fleet's `origin`"),
    ],
)
def test_a_place_far_from_the_origin_is_named_with_what_may_be_wrong(
    place: tuple[float, float, float | None], hint: str | None
) -> None:
    wrong = out_of_reach(place, ORIGIN)
    assert (wrong is None) == (hint is None)
    if wrong is not None and hint is not None:
        assert hint in wrong[1]
        assert "from the fleet's origin [38, -77]" in wrong[0]


def test_a_swap_shows_also_where_both_places_are_near() -> None:
    wrong = out_of_reach((11.0, 10.0, None), (10.0, 11.0, 0.0))
    assert wrong is not None
    assert "swapped" in wrong[1]
    assert out_of_reach((10.0, 10.1, None), (10.1, 10.0, 0.0)) is not None
    assert out_of_reach((10.0, 10.02, None), (10.02, 10.0, 0.0)) is None


def test_a_swapped_route_is_refused_when_the_fleet_is_loaded(tmp_path: Path) -> None:
    text = "version: 1\norigin: {lat: 38, lon: -77}\nvehicles: {}\nroutes: {a: alpha.geojson}\n"
    path = write_fleet(tmp_path, text)
    assert load_fleet(path).geometries
    swapped = {**LINE, "coordinates": [[-77.0, 38.0], [38.1, -77.1]]}
    write_json(tmp_path / "alpha.geojson", swapped)
    with pytest.raises(FleetError) as caught:
        load_fleet(path)
    [finding] = caught.value.findings
    assert (finding.line, finding.element, finding.rule) == (4, "routes.a", "out-of-reach")
    assert "alpha.geojson: waypoint 2: latitude -77.1, longitude 38.1" in finding.message
    assert "swapped" in finding.remedy


def test_a_swapped_position_in_a_mission_is_a_finding() -> None:
    spec = SHARED["goto", BehaviorType.VEHICLE]
    none = dict[str, None]().get
    for value, rules in (("[38.1, -77.1]", []), ("[-77.1, 38.1]", ["out-of-reach"])):
        _, problems = examine(spec, {"target": value}, none, (), origin=ORIGIN)
        assert [each.rule for each in problems] == rules


# --- positions in metres from the origin ----------------------------------------------------------

SITE = (38.1075, -77.3192, 60.0)
GOTO = SHARED["goto", BehaviorType.VEHICLE]


def test_east_north_and_up_of_the_origin_are_metres() -> None:
    point = local_point("enu [300, -400.5, 25]", SITE)
    latitude, longitude, altitude = point.position
    assert altitude is not None
    back = pymap3d.geodetic2enu(latitude, longitude, altitude, *SITE)
    assert back == pytest.approx((300.0, -400.5, 25.0), abs=1e-6)
    assert point.altitude_frame == "amsl"


def test_without_up_no_altitude_is_given() -> None:
    latitude, longitude, altitude = local_point(" enu [0, 1000]", SITE).position
    assert (latitude, longitude) == pytest.approx((38.11651, -77.3192), abs=1e-5)
    assert altitude is None


@pytest.mark.parametrize("text", ["enu [1, 2]", "enu[1,2,3]", "  enu  [1"])
def test_what_is_meant_as_local_is_told_from_names(text: str) -> None:
    assert is_local(text)


@pytest.mark.parametrize("text", ["enu", "enugu", "[1, 2]", "menu [1, 2]"])
def test_names_and_other_positions_are_not_local(text: str) -> None:
    assert not is_local(text)


@pytest.mark.parametrize(
    "text",
    ["enu [1", "enu [1]", "enu [1, 2, 3, 4]", "enu [1, true]", "enu [1, NaN]", "enu [1, 2e6]"],
)
def test_what_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(GeometryError):
        local_point(text, SITE)


def test_a_behavior_takes_it_as_a_position() -> None:
    values = resolve(GOTO, {"target": "enu [10, 20]"}, lambda _: None, (), SITE)
    assert isinstance(values["target"], Point)


@pytest.mark.parametrize("origin", [None, (0.0, 0.0, 0.0)])
def test_a_fleet_without_an_origin_is_told_so(origin: tuple[float, float, float] | None) -> None:
    with pytest.raises(ParameterError, match="give the fleet an `origin`"):
        resolve(GOTO, {"target": "enu [10, 20]"}, lambda _: None, (), origin)


def test_a_wrong_one_is_told_with_what_would_be_right() -> None:
    with pytest.raises(ParameterError, match=r"write enu \[east, north, up\]"):
        resolve(GOTO, {"target": "enu [10]"}, lambda _: None, (), SITE)
