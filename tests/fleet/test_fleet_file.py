import subprocess
import sys
from pathlib import Path

import pytest

import m2pem
from m2pem.errors import FleetError
from m2pem.findings import Severity
from m2pem.fleet.fleet import Domain, LostMemberPolicy, OnConflict, SharedSpace, dump, restore
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.geometry import Area, Point, Route

from ..geo.geometry_files.test_mission_plans import item, plan
from .fleets import patrol, write_fleet, write_json

FLEETS = Path(__file__).parents[2] / "fleet_configs"

FULL = """\
version: 1
name: all-keys
origin: {lat: 38.1075, lon: -77.3192, alt: 60}
max_outage: 2 min
vehicles:
  evsg1:
    domain: ground
    arbiter: ros
    connection: {namespace: /evsg1, domain_id: 42}
    behaviors: [single_vehicle_routing, drive_stop]
    lost_after: 1500 ms
    cruise_speed: 18 km/h
    endurance: 25 min
    payloads:
      ptz: {arbiter: ptz, connection: {driver: onvif, domain_id: 43}, behaviors: [zoom]}
      gpr: {detector: true}
  uav1: {domain: air, arbiter: mavlink, failsafe: return_to_launch}
  driver: {domain: surface, arbiter: ros, manned: true}
teams:
  section: {members: [uav1, evsg1], lead: evsg1, on_lost_member: continue}
  pair: {members: [uav1, evsg1]}
routes: {alpha: alpha.geojson}
areas: {field: field.geojson}
points: {gate: gate.geojson}
fence: field
deconfliction: {vertical: 30 ft, horizontal: 25 m, time: 1 min}
"""


def test_every_key_of_a_fleet_file_arrives_in_si(tmp_path: Path) -> None:
    fleet = load_fleet(write_fleet(tmp_path, FULL))
    assert fleet.name == "all-keys"
    assert fleet.file == str(tmp_path / "fleet.yaml")
    assert fleet.origin == (38.1075, -77.3192, 60.0)
    assert fleet.max_outage_s == 120.0
    assert fleet.fence == "field"
    assert fleet.vertical_separation_m == pytest.approx(9.144)
    assert fleet.horizontal_separation_m == 25.0
    assert fleet.time_separation_s == 60.0
    evsg1 = fleet.vehicles["evsg1"]
    assert evsg1.domain is Domain.GROUND
    assert evsg1.settings == {"namespace": "/evsg1", "domain_id": 42}
    assert evsg1.behaviors == ("single_vehicle_routing", "drive_stop")
    assert evsg1.lost_after_s == 1.5
    assert (evsg1.cruise_speed_m_s, evsg1.endurance_s) == (5.0, 1500.0)
    assert evsg1.payloads == ("evsg1/ptz", "evsg1/gpr")
    assert evsg1.line == 6
    assert not evsg1.manned
    assert fleet.vehicles["driver"].manned
    assert fleet.vehicles["uav1"].failsafe == "return_to_launch"
    assert fleet.vehicles["uav1"].behaviors is None
    section = fleet.teams["section"]
    assert (section.members, section.lead) == (("uav1", "evsg1"), "evsg1")
    assert section.on_lost_member is LostMemberPolicy.CONTINUE
    assert section.line == 20
    assert fleet.detectors == ("evsg1/gpr",)


def test_a_payload_inherits_its_vehicles_connection_and_arbiter(tmp_path: Path) -> None:
    fleet = load_fleet(write_fleet(tmp_path, FULL))
    ptz, gpr = fleet.payloads["evsg1/ptz"], fleet.payloads["evsg1/gpr"]
    assert ptz.arbiter == "ptz"
    assert ptz.settings == {"namespace": "/evsg1", "domain_id": 43, "driver": "onvif"}
    assert ptz.behaviors == ("zoom",)
    assert (ptz.vehicle, ptz.line) == ("evsg1", 15)
    assert gpr.arbiter == "ros"
    assert gpr.settings == {"namespace": "/evsg1", "domain_id": 42}


def test_a_team_without_a_lead_is_led_by_its_first_member(tmp_path: Path) -> None:
    assert load_fleet(write_fleet(tmp_path, FULL)).teams["pair"].lead == "uav1"


def test_geometries_are_read_relative_to_the_fleet_file(tmp_path: Path) -> None:
    fleet = patrol(tmp_path)
    assert fleet.geometries["alpha"] == Route(((38.0, -77.0, None), (38.1, -77.1, 5.0)))
    assert isinstance(fleet.geometries["field"], Area)
    assert fleet.geometries["gate"] == Point((38.0, -77.0, None))


def test_what_is_left_out_of_a_file_is_a_warning_at_its_name(tmp_path: Path) -> None:
    items = (item(22, None, None, 20), item(16, 38.0, -77.0, 30))
    write_json(tmp_path / "north.plan", plan(*items))
    text = "version: 1\nroutes:\n  north: north.plan\n"
    fleet = load_fleet(write_fleet(tmp_path, text))
    assert fleet.geometries["north"] == Route(((38.0, -77.0, 30.0),))
    assert [(each.severity, each.line, each.element) for each in fleet.warnings] == [
        (Severity.WARNING, 3, "routes.north")
    ]
    assert "north.plan: item 1 (to 20 m): MAV_CMD_NAV_TAKEOFF is left" in fleet.warnings[0].message


def test_without_an_origin_it_is_where_the_first_geometry_begins(tmp_path: Path) -> None:
    assert patrol(tmp_path).origin == (38.0, -77.0, 0.0)


def test_the_smallest_fleet_is_a_version_and_is_named_after_its_file(tmp_path: Path) -> None:
    fleet = load_fleet(write_fleet(tmp_path, "version: 1\n"))
    assert (fleet.name, fleet.vehicles, fleet.origin) == ("fleet", {}, (0.0, 0.0, 0.0))


def refusal(path: Path) -> list[tuple[int, str, str]]:
    with pytest.raises(FleetError) as refused:
        load_fleet(path)
    assert str(path) in str(refused.value)
    assert {finding.file for finding in refused.value.findings} == {str(path)}
    return [(f.line, f.element, f.rule) for f in refused.value.findings]


def test_every_finding_comes_at_once_with_its_line(tmp_path: Path) -> None:
    write_json(tmp_path / "broken.geojson", {"type": "Point", "coordinates": [0, 99]})
    path = write_fleet(
        tmp_path,
        """\
version: 1
max_outage: 3 parsec
vehicles:
  evsg1: {domain: ground, arbitr: sim}
  evsg2: {domain: ground, arbiter: sim}
  evsg2: {domain: air, arbiter: sim}
  gate: {domain: ground, arbiter: sim}
teams:
  evsg1:
    members: [evsg2, evgs2, evsg2]
    lead: evsg1
routes:
  field: alpha.geojson
  swapped: field.geojson
areas:
  field: field.geojson
  lost: lost.geojson
points:
  gate: gate.geojson
  broken: broken.geojson
fence: feild
""",
    )
    assert refusal(path) == [
        (2, "max_outage", "bad-value"),
        (4, "vehicles.evsg1.arbiter", "missing-key"),
        (4, "vehicles.evsg1.arbitr", "unknown-key"),
        (6, "vehicles.evsg2", "duplicate-key"),
        (9, "teams.evsg1", "duplicate-name"),
        (10, "teams.evsg1.members[1]", "unknown-vehicle"),
        (10, "teams.evsg1.members[2]", "duplicate-member"),
        (11, "teams.evsg1.lead", "lead-not-member"),
        (14, "routes.swapped", "geometry"),
        (16, "areas.field", "duplicate-name"),
        (17, "areas.lost", "geometry"),
        (19, "points.gate", "duplicate-name"),
        (20, "points.broken", "geometry"),
        (21, "fence", "unknown-area"),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "version: 1\nvehicles: {evsg1: {domain: air, arbiter: s}}\n"
            "teams: {t: {members: [evsg2]}}\n",
            "teams.t.members[0]: error: no vehicle is named 'evsg2'; did you mean 'evsg1'?",
        ),
        (
            "version: 1\nroutes: {a: field.geojson}\n",
            "field.geojson: holds an area; a route is expected",
        ),
        (
            "version: 1\nroutes: {a: alpha.geojson}\nareas: {\n a: field.geojson}\n",
            "fleet.yaml:4: areas.a: error: the name 'a' is taken by routes (line 2)",
        ),
        ("# nothing\n", "is empty; a fleet begins with 'version: 1'"),
        ("- 1\n", "[1] is not a map"),
        ("version: 1\nfence: a\n", "no area is named 'a'; there are no areas"),
    ],
)
def test_a_finding_says_what_would_be_right(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FleetError) as refused:
        load_fleet(write_fleet(tmp_path, text))
    assert message in str(refused.value)


@pytest.mark.parametrize(
    "text",
    [
        "version: 1\nvehicles: 3\nteams: []\nroutes: x\nareas: {a: 1}\npoints: null\nfence: []\n",
        "version: 1\nteams: {a: 1, b: {members: 1, lead: 2}, c: {members: [[], {}, null]}}\n",
    ],
)
def test_values_of_any_wrong_type_are_findings(tmp_path: Path, text: str) -> None:
    assert refusal(write_fleet(tmp_path, text))


def test_a_missing_fleet_file_is_a_finding(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.yaml") == [(0, "", "unreadable")]


def test_the_fleet_of_vignette_1_loads() -> None:
    fleet = load_fleet(FLEETS / "vignette1.yaml")
    assert list(fleet.vehicles) == ["evsg1", "evsg2", "evsg3", "lead"]
    assert fleet.detectors == ("evsg1/gpr",)
    assert {vehicle.arbiter for vehicle in fleet.vehicles.values()} == {"sim"}
    assert fleet.vehicles["lead"].manned
    assert {"route_alpha", "route_bravo", "inspection_area"} == set(fleet.geometries)


def test_the_package_offers_load_fleet() -> None:
    assert m2pem.load_fleet is load_fleet


def test_importing_the_package_loads_no_parser_of_files() -> None:
    code = "import sys, m2pem; print(sorted({'pydantic', 'ruamel', 'lxml'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("said", "apart"),
    [
        ("", (None, 20.0, None)),
        ("deconfliction: {}\n", (10.0, 20.0, None)),
        ("deconfliction: {horizontal: 5 m}\n", (10.0, 5.0, None)),
    ],
)
def test_aircraft_are_kept_apart_only_where_the_fleet_says_so(
    tmp_path: Path, said: str, apart: tuple[float | None, float, float | None]
) -> None:
    fleet = load_fleet(write_fleet(tmp_path, f"version: 1\n{said}"))
    found = fleet.vertical_separation_m, fleet.horizontal_separation_m, fleet.time_separation_s
    assert found == apart


def test_a_distance_to_be_kept_is_more_than_none(tmp_path: Path) -> None:
    with pytest.raises(FleetError) as refused:
        load_fleet(write_fleet(tmp_path, "version: 1\ndeconfliction: {vertical: 0 m}\n"))
    assert "deconfliction.vertical" in str(refused.value)


SHARED = """\
version: 1
areas: {bridge: bridge.geojson}
routes: {ford: ford.geojson}
deconfliction: {ground: {horizontal: 3 m}, on_conflict: wait, wait: 5 min}
shared_space:
"""


def shared(folder: Path, space: str) -> Path:
    write_json(folder / "bridge.geojson", {"type": "Polygon", "coordinates": [TRIANGLE]})
    write_json(folder / "ford.geojson", {"type": "LineString", "coordinates": TRIANGLE[:2]})
    return write_fleet(folder, SHARED + space)


TRIANGLE = [[-77.0, 38.0], [-76.99, 38.0], [-76.99, 38.01], [-77.0, 38.0]]


def test_shared_space_and_distances_on_the_ground_arrive_in_si(tmp_path: Path) -> None:
    fleet = load_fleet(
        shared(
            tmp_path,
            "  bridge: 1\n"
            "  ford: {capacity: 2, width: 600 cm, domains: [ground], on_conflict: refuse}\n",
        )
    )
    assert fleet.surface_separation_m == {Domain.GROUND: 3.0}
    assert (fleet.on_conflict, fleet.conflict_wait_s) == (OnConflict.WAIT, 300.0)
    bridge, ford = fleet.shared_space.values()
    assert bridge == SharedSpace("bridge", 1, line=6)
    assert ford == SharedSpace(
        "ford", 2, (Domain.GROUND,), 6.0, OnConflict.REFUSE, wait_s=600.0, line=7
    )
    assert restore(dump(fleet)) == fleet


@pytest.mark.parametrize(
    ("space", "said"),
    [
        ("  brigde: 1\n", "no area or route is named 'brigde'; did you mean 'bridge'?"),
        ("  bridge: -1\n", "-1 is no number of vehicles; write a whole number, 0 or more"),
        ("  bridge: 1.5\n", "1.5 is no number of vehicles; write a whole number, 0 or more"),
        ("  bridge: {capacity: true}\n", "True is no number of vehicles"),
        ("  bridge: {}\n", "'capacity' is missing"),
        ("  bridge: {capcity: 1}\n", "unknown key 'capcity'; did you mean 'capacity'?"),
        ("  bridge: {capacity: 1, width: 3 m}\n", "'bridge' is an area, which has no width"),
        ("  ford: 1\n", "the width of its corridor is not said; write ford: {capacity: 1, width"),
        ("  bridge: {capacity: 1, domains: []}\n", "domains"),
    ],
)
def test_shared_space_that_makes_no_sense_says_what_would(
    tmp_path: Path, space: str, said: str
) -> None:
    with pytest.raises(FleetError) as refused:
        load_fleet(shared(tmp_path, space))
    (finding, *_) = refused.value.findings
    assert finding.line == 6
    assert any(said in str(each) for each in refused.value.findings)
