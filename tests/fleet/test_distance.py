"""Positions too far from the fleet's origin, which are most often swapped."""

from pathlib import Path

import pytest

from m2pem.errors import FleetError
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.distance import distance_m, out_of_reach
from m2pem.fleet.fleet_file import load_fleet
from m2pem.fleet.parameters import examine
from m2pem.mission.behavior import BehaviorType

from .fleets import LINE, write_fleet, write_json

ORIGIN = (38.0, -77.0, 0.0)


def test_a_degree_of_latitude_is_111_km() -> None:
    assert distance_m((38.0, -77.0), (39.0, -77.0)) == pytest.approx(111_195, abs=10)
    assert distance_m((0.0, 179.5), (0.0, -179.5)) == pytest.approx(111_195, abs=10)


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
