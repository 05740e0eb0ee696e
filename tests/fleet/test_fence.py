"""Shared space with no place is kept out by the fence, for the domains that it is closed to."""

import json
import math
from pathlib import Path

import pytest
import shapely

from m2pem.deconfliction.reservations import Reservations
from m2pem.findings import Severity
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.geometry import Point, Route
from m2pem.scripting.sources import load_mission
from m2pem.simulation.fencing import fence_findings
from m2pem.testing import scenarios
from tests.simulation.conftest import place
from tests.simulation.test_fencing import entered_m, play

POND = shapely.box(80, 60, 120, 140)
FORD = shapely.LineString([(100, 160), (100, 300), (200, 300)])
FORD_M = FORD.buffer(5)
FLEET = """version: 1
origin: {{lat: {0}, lon: {1}, alt: 0}}
vehicles:
  v: {{domain: ground, arbiter: sim, connection: {{home: [{2}, {3}, 0]}}}}
  u: {{domain: air, arbiter: sim, connection: {{home: [{2}, {3}, 0], altitude: 20 m}}}}
areas: {{pond: pond.geojson, bridge: pond.geojson}}
routes: {{ford: ford.geojson}}
shared_space:
  pond: 0
  bridge: {{capacity: 1, domains: [air]}}
  ford: {{capacity: 0, width: 10 m, domains: [ground, surface]}}
"""


def degrees(line: shapely.LineString) -> list[list[float]]:
    return [list(place(x, y)[1::-1]) for x, y in line.coords]


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    pond = {"type": "Polygon", "coordinates": [degrees(POND.exterior)]}
    (tmp_path / "pond.geojson").write_text(json.dumps(pond))
    ford = {"type": "LineString", "coordinates": degrees(FORD)}
    (tmp_path / "ford.geojson").write_text(json.dumps(ford))
    path = tmp_path / "fleet.yaml"
    path.write_text(FLEET.format(*place(0, 0)[:2], *place(20, 100)[:2]))
    return load_fleet(path)


def test_it_is_closed_to_its_domains_and_counts_no_vehicles(fleet: Fleet) -> None:
    assert [*fleet.shared_space] == ["bridge"]
    assert Reservations(fleet).participants == ("u",)
    assert fence_of(fleet, Domain.AIR) is None
    fence = fence_of(fleet, Domain.GROUND)
    assert fence is fence_of(fleet, Domain.GROUND)
    assert fence is not None
    for area, name in ((POND, "pond"), (FORD_M, "ford")):
        inside = shapely.maximum_inscribed_circle(area)
        at = tuple(inside.coords[0])
        assert fence.outside_m(place(*at)[:2]) == pytest.approx(inside.length, abs=0.1)
        said = fence.breach([place(*at)[:2]])
        assert f"m inside '{name}', which is closed" in said


@pytest.mark.parametrize(
    ("vehicle", "target", "said", "severity"),
    [
        ("v", (100, 100), "is 20 m inside 'pond', which is closed;", Severity.ERROR),
        ("v", (180, 100), "enters 'pond', which is closed, by 20 m at [", Severity.WARNING),
        ("v", (180, 299), "is 4.0 m inside 'ford', which is closed;", Severity.ERROR),
        ("u", (100, 100), "", None),
    ],
)
def test_check_finds_what_enters_it(
    fleet: Fleet, vehicle: str, target: tuple[float, float], said: str, severity: Severity | None
) -> None:
    latitude, longitude, _ = place(*target)
    mission = scenarios.one_behavior("goto", vehicle, target=f"[{latitude}, {longitude}]")
    found = fence_findings(load_mission(mission), fleet)
    assert [each.severity for each in found] == ([severity] if severity else [])
    assert all(said in str(each) for each in found), found


def test_ways_into_it_are_rejected_and_a_return_leads_around(fleet: Fleet) -> None:
    across = Route((place(20, 100), place(180, 100)))
    around = Route((place(20, 50), place(180, 50), place(180, 100)))
    outside = shapely.box(-500, -500, 500, 500).difference(shapely.union(POND, FORD_M))
    done = play(
        fence_of(fleet, Domain.GROUND),
        (20.0, 100.0),
        [
            ("single_vehicle_routing", {"route": across}),
            ("goto", {"target": Point(place(150, 302))}),
            ("single_vehicle_routing", {"route": around}),
            ("return_to_launch", {}),
        ],
    )
    states = [state for state, *_ in done]
    rejected, succeeded = BehaviorState.REJECTED, BehaviorState.SUCCEEDED
    assert states == [rejected, rejected, succeeded, succeeded]
    assert "enters 'pond', which is closed, by 20 m at [" in done[0][1]
    assert "m inside 'ford', which is closed" in done[1][1]
    for *_, way in done[2:]:
        assert entered_m(outside, POND, way) == 0.0
    assert math.dist(done[-1][-1][-1], (20.0, 100.0)) < 0.1
