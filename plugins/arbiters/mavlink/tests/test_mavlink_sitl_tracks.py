"""Missions on real autopilots: where the vehicles went, against what was commanded."""

import json
import math
from itertools import pairwise
from pathlib import Path

import mavlink_sitl
import pytest
from mavlink_mission_flights import Flight, fly
from mavlink_tracks import At, covered, cross_track, formation_error
from test_mavlink_demo import FLEETS

from m2pem.api import offset

MISSIONS = FLEETS.parent / "missions"
AUTO = 3
"""ArduPilot's mode in which a copter executes its mission."""
ARRIVED_M = 4.0
ORIGIN = (38.1075, -77.3192)

pytestmark = [pytest.mark.timeout(900), pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")]


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    return mavlink_sitl.programs_folder(tmp_path / "bin", "arducopter", "ardurover")


def with_patience(fleet: str, folder: Path) -> Path:
    """A fleet of the repository on a port of its own, which counts its links as lost late: tests
    share their processors, and 10 s of simulated time are soon over."""
    for name in ("geo", "routes"):
        (folder / name).symlink_to(FLEETS / name)
    text = (FLEETS / f"{fleet}.yaml").read_text(encoding="utf-8")
    text = text.replace("lost_after: 10 s", "lost_after: 60 s")
    text = text.replace("FS_GCS_TIMEOUT: 10", "FS_GCS_TIMEOUT: 60")
    file = folder / "fleet.yaml"
    file.write_text(text.replace("14550", str(mavlink_sitl.free_port())), encoding="utf-8")
    return file


def completed(flight: Flight) -> None:
    """The run came to its end."""
    assert flight.status == 0, (flight.errors, flight.records[-5:])
    assert flight.records[-1][1]["outcome"] == "completed"


def said(what: str, *figures: object) -> None:
    """For the table in the docs (pytest -s)."""
    print(f"\n{what}: {', '.join(map(str, figures))}")


def test_a_survey_leaves_nothing_out_and_keeps_to_its_lines(programs: Path, tmp_path: Path) -> None:
    fleet = with_patience("survey_pair", tmp_path)
    flight = fly(programs, fleet, MISSIONS / "survey_pair.bpmn", tmp_path / "vehicles", 5.0)
    completed(flight)
    surveys = list(flight.behaviors("area_survey"))
    assert len(surveys) == 2
    for record, begin_s, end_s in surveys:
        vehicle, wished = record["resources"][0], record["parameters"]
        samples = [s for s in flight.between(vehicle, begin_s, end_s) if s.mode == AUTO]
        (uploaded,) = flight.uploads[vehicle]
        first = next(
            number
            for number, sample in enumerate(samples)
            if cross_track([sample.place], uploaded.points[:2]).most_m < ARRIVED_M
        )
        places = [sample.place for sample in samples[first:]]
        off = cross_track(places, uploaded.points)
        width_m = float(wished["spacing"].split()[0])
        once, twice = covered(places, flight.outline(wished["area"]), width_m)
        height_m = float(wished["altitude"].split()[0])
        up = [sample.up_m for sample in samples[first:]]
        said(
            f"{vehicle} {record['element']}",
            f"covered {once:.1%}, twice {twice:.1%} by a swath of {width_m:g} m",
            f"beside its lines {off}",
            f"height {min(up):.1f} to {max(up):.1f} m of {height_m:g}",
        )
        assert once == 1.0
        assert off.rms_m < 1.0
        assert off.most_m <= ARRIVED_M
        assert max(abs(each - height_m) for each in up) < 1.0


ON_A_ROUTE = ("single_vehicle_routing", "road_following_formation", "bridge_crossing")
WEDGE: tuple[At, At] = ((1.0, 1.0), (1.0, -1.0))
"""Of the two after the lead: spacings behind it and to its left."""


@pytest.mark.parametrize(
    ("mission", "answers"),
    [
        ("vignette1", "vignette1_route"),
        ("mehds_vignette_1", "mehds_vignette_1_swept"),
        ("mehds_vignette_2", "mehds_vignette_2_rejoined"),
        ("mehds_vignette_3", "mehds_vignette_3_crossed"),
        ("mehds_vignette_4", "mehds_vignette_4_route_driven"),
    ],
)
def test_the_vehicles_of_the_field_tests_keep_to_their_routes(
    programs: Path, tmp_path: Path, mission: str, answers: str
) -> None:
    flight = fly(
        *(programs, with_patience("mehds_sitl", tmp_path), MISSIONS / f"{mission}.bpmn"),
        *(tmp_path / "vehicles", 5.0),
        *("--answers", MISSIONS / "answers" / f"{answers}.yaml"),
    )
    assert flight.status == 0, flight.errors
    driven = [each for name in ON_A_ROUTE for each in flight.behaviors(name)]
    assert driven
    for record, begin_s, end_s in driven:
        route = flight.outline(record["parameters"]["route"])
        spacing_m = float(record["parameters"].get("spacing", "0").split()[0])
        for number, vehicle in enumerate(record["resources"]):
            places = [each.place for each in flight.between(vehicle, begin_s, end_s)]
            first = next(
                at
                for at, place in enumerate(places)
                if cross_track([place], route).most_m < ARRIVED_M
            )
            off = cross_track(places[first:], route)
            left_m = abs(math.dist(places[-1], route[-1]) - number * spacing_m)
            said(
                f"{mission} {record['element']} {vehicle}",
                f"beside its route {off}",
                f"{left_m:.1f} m",
            )
            assert off.rms_m < 1.0
            assert left_m < 1.5
    for record, begin_s, end_s in flight.behaviors("formation"):
        lead, *others = record["resources"]
        spacing_m = float(record["parameters"]["spacing"].split()[0])
        for vehicle, (behind, left) in zip(others, WEDGE, strict=True):
            place = (behind * spacing_m, left * spacing_m)
            tracks = (flight.between(each, begin_s, end_s) for each in (lead, vehicle))
            kept = formation_error(*tracks, place)
            assert kept is not None, f"{vehicle} never came to its place"
            said(f"{mission} {record['element']} {vehicle}", kept[0], f"after {kept[1]:.0f} s")
            assert kept[0].rms_m < 0.6 * spacing_m  # the lead waits from half of it on
    for record, _, end_s in flight.behaviors("goto"):
        (target,) = flight.outline(record["parameters"]["target"])
        away_m = math.dist(flight.between(record["resources"][0], 0.0, end_s)[-1].place, target)
        said(f"{mission} {record['element']}", f"{away_m:.1f} m from its target")
        assert away_m < ARRIVED_M


NEAREST_M = 7.5
"""Half of the spacing."""

SIX = ("rover1", "rover2", "uav1", "uav2", "uav3", "uav4")
OFFSETS: dict[str, At] = dict(
    zip(SIX, [(0, 0), (20, 0), (10, 12), (10, -12), (30, 12), (30, -12)], strict=True)
)
"""Metres behind the lead and to its left."""
COLUMN: dict[str, At] = {name: (15.0 * number, 0.0) for number, name in enumerate(SIX)}
ROUTES = {"north": [(0, 10), (0, 180)], "east": [(10, 190), (190, 190)]}


def six_vehicles(folder: Path) -> Path:
    """A fleet of two rovers and four copters, which stand as they will march at first."""
    vehicles = {}
    port = mavlink_sitl.free_port()
    for system, (name, (behind, left)) in enumerate(OFFSETS.items(), 1):
        latitude, longitude = offset(ORIGIN, -left, -behind)
        air = name.startswith("uav")
        vehicles[name] = {
            "domain": "air" if air else "ground",
            "arbiter": "mavlink",
            "sitl": True,
            "lost_after": "60 s",
            "connection": {
                "url": f"udpin://127.0.0.1:{port}",
                "system_id": system,
                "sitl": {"home": [latitude, longitude]},
            },
        }
    for name, points in ROUTES.items():
        places = [offset(ORIGIN, *point)[::-1] for point in points]
        geometry = {"type": "LineString", "coordinates": places}
        feature = {"type": "Feature", "properties": {}, "geometry": geometry}
        (folder / f"{name}.geojson").write_text(json.dumps(feature), encoding="utf-8")
    fleet = {
        "version": 1,
        "name": "six",
        "origin": {"lat": ORIGIN[0], "lon": ORIGIN[1], "alt": 60.0},
        "vehicles": vehicles,
        "teams": {"six": {"members": list(SIX), "lead": "rover1"}},
        "routes": {name: f"{name}.geojson" for name in ROUTES},
    }
    file = folder / "fleet.yaml"
    file.write_text(json.dumps(fleet), encoding="utf-8")  # JSON is YAML
    return file


def two_formations() -> str:
    """All copters take off, the team marches twice, and the copters return."""
    copters = [name for name in SIX if name.startswith("uav")]
    offsets = [list(place) for name, place in OFFSETS.items() if name != "rover1"]
    tasks = {
        "First": ("formation", "team", "six", {"route": "north", "offsets": json.dumps(offsets)}),
        "Second": (
            *("road_following_formation", "team", "six"),
            {"route": "east", "spacing": "15 m", "shape": "column"},
        ),
    }
    for number, name in enumerate(copters):
        height = f"{20 + 10 * number} m"
        tasks[f"Up{number}"] = ("takeoff", "vehicle", name, {"altitude": height})
        tasks[f"Home{number}"] = ("return_to_launch", "vehicle", name, {})
    paths = ["Start Fork1", "Join1 First Second Fork2", "Join2 End"]
    paths += [f"Fork1 Up{number} Join1" for number in range(len(copters))]
    paths += [f"Fork2 Home{number} Join2" for number in range(len(copters))]
    flows = [pair for path in paths for pair in pairwise(path.split())]
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
        'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/tests">'
        '<process id="SIX" isExecutable="true"><startEvent id="Start"/><endEvent id="End"/>'
        + "".join(
            f'<parallelGateway id="{name}"/>' for name in ("Fork1", "Join1", "Fork2", "Join2")
        )
        + "".join(_task(name, *words) for name, words in tasks.items())
        + "".join(
            f'<sequenceFlow id="{one}_{other}" sourceRef="{one}" targetRef="{other}"/>'
            for one, other in flows
        )
        + "</process></definitions>"
    )


def _task(element: str, behavior: str, kind: str, actor: str, wished: dict[str, str]) -> str:
    properties = "".join(
        f'<m2pem:property name="{name}" value="{value}"/>' for name, value in wished.items()
    )
    return (
        f'<scriptTask id="{element}"><extensionElements><m2pem:behavior type="{kind}" '
        f'name="{behavior}"><m2pem:properties>{properties}</m2pem:properties><m2pem:resources>'
        f'<m2pem:role name="actor" {kind}="{actor}"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


def test_four_copters_and_two_rovers_march_in_two_formations(
    programs: Path, tmp_path: Path
) -> None:
    fleet = six_vehicles(tmp_path)
    mission = tmp_path / "mission.bpmn"
    mission.write_text(two_formations(), encoding="utf-8")
    flight = fly(programs, fleet, mission, tmp_path / "vehicles", 3.0)
    completed(flight)
    for name, places in (("formation", OFFSETS), ("road_following_formation", COLUMN)):
        ((_, begin_s, end_s),) = flight.behaviors(name)
        lead = flight.between("rover1", begin_s, end_s)
        for member, place in places.items():
            if member == "rover1":
                continue
            kept = formation_error(lead, flight.between(member, begin_s, end_s), place)
            assert kept is not None, f"{member} never came to its place in {name}"
            said(f"{name} {member}", kept[0], f"in its place after {kept[1]:.0f} s")
            assert kept[0].rms_m < NEAREST_M
