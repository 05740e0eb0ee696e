"""Estimates of each behavior of the catalogue, beside rehearsals of the same."""

import random
from itertools import pairwise
from pathlib import Path

import pytest

from m2pem.api.estimates import MissionEstimate
from m2pem.api.runs import RunStatus
from m2pem.engine.records import BehaviorEnded, BehaviorRequested
from m2pem.fleet.behaviors import ENDING_PARAMETERS, SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import RehearsalResult, rehearse
from m2pem.scripting.checking import check
from m2pem.scripting.sources import load_mission
from m2pem.simulation.estimates import estimate_mission

FLEET = """version: 1
name: estimated
origin: {lat: 38.10, lon: -77.30, alt: 20}
vehicles:
  g1: {domain: ground, arbiter: sim, endurance: 20 min}
  g2: {domain: ground, arbiter: sim, endurance: 20 min, cruise_speed: 3 m/s}
  g3: {domain: ground, arbiter: sim, endurance: 25 min}
  g4: {domain: ground, arbiter: sim, endurance: 25 min, payloads: {mast: {connection: {kind: ptz}}}}
  a1:
    {domain: air, arbiter: sim, endurance: 15 min, connection: {altitude: 30 m},
     payloads: {eye: {connection: {kind: ptz}}}}
  a2:
    {domain: air, arbiter: sim, endurance: 15 min,
     connection: {altitude: 30 m, wind: 6 m/s, wind_from: 40 deg}}
  a3:
    {domain: air, arbiter: sim, endurance: 40 min, cruise_speed: 6 m/s,
     connection: {altitude: 30 m}}
  boat: {domain: surface, arbiter: sim, endurance: 30 min}
  sub: {domain: subsurface, arbiter: sim, endurance: 2 h}
teams:
  column: {members: [g1, g2, g3, g4]}
  pair: {members: [g3, g4]}
  flight: {members: [a1, a2, a3]}
  mixed: {members: [g1, a3]}
"""
LANE = "[[-77.300, 38.1005, 40], [-77.297, 38.101, 40], [-77.297, 38.103, 60], [-77.301, 38.103]]"
HAIRPIN = "[[-77.299, 38.1002], [-77.296, 38.1002], [-77.299, 38.1003], [-77.299, 38.1015]]"
ROAD = "[[-77.3, 38.1], [-77.2864, 38.1], [-77.2864, 38.1108]]"
FIELD = """[[[-77.300, 38.101], [-77.297, 38.101], [-77.297, 38.103], [-77.2985, 38.102],
 [-77.300, 38.103], [-77.300, 38.101]],
 [[-77.2995, 38.1015], [-77.299, 38.1015], [-77.299, 38.1018], [-77.2995, 38.1015]]]"""
HEAD = f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
 xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t"><process id="p" isExecutable="true">
 <extensionElements>
 <m2pem:geometry name="lane">{{"type": "LineString", "coordinates": {LANE}}}</m2pem:geometry>
 <m2pem:geometry name="hairpin">{{"type": "LineString", "coordinates": {HAIRPIN}}}</m2pem:geometry>
 <m2pem:geometry name="road">{{"type": "LineString", "coordinates": {ROAD}}}</m2pem:geometry>
 <m2pem:geometry name="field">{{"type": "Polygon", "coordinates": {FIELD}}}</m2pem:geometry>
 </extensionElements>"""
TAIL = "</process></definitions>"
PLACE = "[38.1015, -77.2985]"
HIGH = "[38.1015, -77.2985, 50]"

Case = tuple[str, dict[str, str]]
"""The resource or team, and the parameters."""

V, T, P = BehaviorType.VEHICLE, BehaviorType.TEAM, BehaviorType.PAYLOAD
CASES: dict[tuple[str, BehaviorType], list[Case]] = {
    ("single_vehicle_routing", V): [
        ("g1", {"route": "lane"}),
        ("g2", {"route": "hairpin", "speed": "7 m/s"}),
        ("a1", {"route": "lane"}),
        ("a2", {"route": "lane", "altitude": "55 m"}),
        ("boat", {"route": "hairpin"}),
        ("sub", {"route": "lane", "altitude": "-5 m"}),
        ("g1 g2 a1", {"route": "lane"}),
        ("g1", {"route": "lane", "loop": "true"}),
    ],
    ("goto", V): [
        ("g1", {"target": PLACE, "heading": "10 deg"}),
        ("a2", {"target": HIGH, "speed": "3 m/s"}),
        ("g1", {"target": "boat"}),
    ],
    ("hold", V): [("g1", {"duration": "90 s"}), ("a1", {})],
    ("drive_stop", V): [("g1", {})],
    ("land", V): [("a1", {})],
    ("return_to_launch", V): [("g1", {}), ("a2", {}), ("boat", {})],
    ("reverse", V): [("g1", {"distance": "40 m"}), ("sub", {})],
    ("takeoff", V): [("a1", {"altitude": "80 m"})],
    ("change_altitude", V): [("a1", {"altitude": "70 m"}), ("sub", {"altitude": "-30 m"})],
    ("area_survey", V): [
        ("g1", {"area": "field"}),
        ("a2", {"area": "field", "spacing": "35 m", "heading": "30 deg", "overshoot": "20 m"}),
    ],
    ("orbit", V): [
        ("a1", {"target": HIGH, "radius": "60 m", "turns": "2.5"}),
        ("a2", {"target": HIGH, "duration": "100 s"}),
        ("g1", {"target": PLACE}),
    ],
    ("area_observe", V): [
        ("a1", {"area": "field", "duration": "120 s"}),
        ("g1", {"target": PLACE, "duration": "60 s"}),
        ("a1", {"area": "field"}),
    ],
    ("follow", V): [("g1", {"target": "g2"}), ("a1", {"target": "g1", "altitude": "30 m"})],
    ("teleop", V): [("g1", {"timeout": "75 s"}), ("a1", {})],
    ("set_speed", V): [("g1", {"speed": "2 m/s"})],
    ("deploy", V): [("a1", {"actuator": "winch"})],
    ("area_survey", T): [
        ("flight", {"area": "field", "spacing": "15 m"}),
        ("column", {"area": "field"}),
        ("pair", {"area": "field", "spacing": "1 m"}),
    ],
    ("area_observe", T): [
        ("flight", {"area": "field", "duration": "60 s"}),
        ("pair", {"target": PLACE}),
    ],
    ("formation", T): [
        ("column", {"route": "lane"}),
        ("flight", {"route": "lane", "shape": "vee", "spacing": "30 m", "speed": "5 m/s"}),
        ("column", {"route": "lane", "offsets": "[[8, 0], [16, 0], [24, 6]]"}),
        ("pair", {}),
    ],
    ("road_following_formation", T): [
        ("column", {"route": "lane", "spacing": "10 m"}),
        ("column", {"route": "hairpin", "spacing": "25 m", "shape": "line"}),
    ],
    ("road_sweep", T): [("column", {"route": "lane", "spacing": "6 m"})],
    ("bridge_crossing", T): [
        ("column", {"route": "lane", "spacing": "10 m"}),
        ("mixed", {"route": "lane"}),
        ("pair", {}),
    ],
    ("escort", T): [("pair", {"target": "g1"}), ("flight", {"target": HIGH})],
    ("ptz_point_at", P): [
        ("a1/eye", {"target": PLACE}),
        ("g4/mast", {"bearing": "120 deg", "elevation": "-10 deg"}),
    ],
    ("ptz_scan_polygon", P): [("a1/eye", {"area": "field"})],
    ("ptz_scan_sector", P): [
        ("g4/mast", {"heading": "0 deg", "sector": "120 deg", "speed": "5 deg/s"})
    ],
    ("ptz_track", P): [
        ("a1/eye", {"target": "g1", "duration": "40 s"}),
        ("a1/eye", {"target": PLACE}),
    ],
    ("zoom", P): [("a1/eye", {"level": "4"})],
    ("take_picture", P): [("a1/eye", {"count": "12", "interval": "3 s"})],
    ("record_video", P): [("g4/mast", {"duration": "50 s"}), ("g4/mast", {})],
}


VEHICLES = ("g1", "g2", "g3", "g4", "a1", "a2", "a3", "boat", "sub")


def task(name: str, behavior: str, type_: BehaviorType, resources: str, **given: str) -> str:
    written = "".join(f'<m2pem:property name="{k}" value="{v}"/>' for k, v in given.items())
    roles = "".join(
        f'<m2pem:role name="{each}" {_kind(each)}="{each}"/>' for each in resources.split()
    )
    return (
        f'<scriptTask id="{name}"><extensionElements>'
        f'<m2pem:behavior type="{type_.value}" name="{behavior}">'
        f"<m2pem:properties>{written}</m2pem:properties><m2pem:resources>{roles}"
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )


def _kind(resource: str) -> str:
    return "payload" if "/" in resource else "vehicle" if resource in VEHICLES else "team"


def flows(*names: str) -> str:
    return "".join(
        f'<sequenceFlow id="{a}-{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in pairwise(names)
    )


def mission_of(*elements: str) -> bytes:
    return (HEAD + '<startEvent id="s"/><endEvent id="e"/>' + "".join(elements) + TAIL).encode()


def single(behavior: str, type_: BehaviorType, resources: str, given: dict[str, str]) -> bytes:
    """A mission with a behavior of what is away from home before, and goes on afterwards."""
    it = task("it", behavior, type_, resources, **given)
    vehicle = resources.split(maxsplit=1)[0].partition("/")[0]
    if vehicle not in VEHICLES:
        return mission_of(it, flows("s", "it", "e"))
    before = task("before", "goto", V, vehicle, target="[38.1008, -77.2992]")
    after = task("after", "goto", V, vehicle, target="[38.1, -77.2991]")
    if vehicle.startswith("a") and behavior in ("land", "return_to_launch"):
        after = task("after", "takeoff", V, vehicle, altitude="20 m")
    return mission_of(before, it, after, flows("s", "before", "it", "after", "e"))


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    return fleet_of(FLEET, tmp_path_factory.mktemp("fleet"))


def fleet_of(text: str, folder: Path) -> Fleet:
    path = folder / "fleet.yaml"
    path.write_text(text)
    return load_fleet(path)


def both(source: bytes, fleet: Fleet) -> tuple[MissionEstimate, RehearsalResult]:
    """The estimate and the rehearsal of a mission."""
    played = rehearse(source, fleet, plugins=PluginManager(), telemetry_every_s=60.0)
    return estimate_mission(load_mission(source), fleet), played


def completed(played: RehearsalResult) -> bool:
    return played.summary.status is RunStatus.COMPLETED


def assert_alike(found: MissionEstimate, played: RehearsalResult) -> None:
    """The judge is the rehearsal: its records and its last telemetry."""
    assert completed(played)
    requested = {
        each.record.behavior: each
        for each in played.records
        if isinstance(each.record, BehaviorRequested)
    }
    for each in played.records:
        if isinstance(each.record, BehaviorEnded):
            began = requested.pop(each.record.behavior)
            assert isinstance(began.record, BehaviorRequested)
            tasks = [task for task in found.tasks if task.element == began.record.element]
            assert {task.vehicle for task in tasks} == set(began.record.resources)
            for task in tasks:
                assert task.time_s == pytest.approx(each.t_s - began.t_s, rel=0.02, abs=0.01)
    assert not requested
    assert found.time_s == pytest.approx(played.summary.took_s, rel=0.02, abs=0.01)
    last = played.telemetry[-1].vehicles
    for vehicle in found.vehicles:
        charge = last[ResourceId(vehicle.vehicle)].battery_fraction
        assert max(0.0, vehicle.battery_left) == pytest.approx(charge, abs=0.02)
        if charge == 0:
            continue  # it comes down
        driven_m = played.vehicles[ResourceId(vehicle.vehicle)].distance_m
        assert vehicle.distance_m == pytest.approx(driven_m, rel=0.02, abs=0.01)


def test_each_behavior_of_the_catalogue_is_estimated_here() -> None:
    assert set(CASES) == set(SHARED)


@pytest.mark.parametrize(
    ("behavior", "type_", "resources", "given"),
    [(*key, *case) for key, cases in CASES.items() for case in cases],
)
def test_a_behavior_takes_what_its_rehearsal_takes_or_is_named_as_not_counted(
    behavior: str, type_: BehaviorType, resources: str, given: dict[str, str], fleet: Fleet
) -> None:
    found, played = both(single(behavior, type_, resources, given), fleet)
    if completed(played):
        assert found.left_out == ()
        assert_alike(found, played)
    else:
        assert [each.element for each in found.left_out] == ["it"]


BRANCHES = (("column", "pair", "g1", "g4/mast"), ("flight", "a1", "a2", "a1/eye"), ("boat",))
"""What is commanded at the same time: no two branches command the same vehicle."""


@pytest.mark.parametrize("seed", range(12))
def test_branches_take_what_their_rehearsal_takes(seed: int, fleet: Fleet) -> None:
    draw = random.Random(seed)
    elements = ['<parallelGateway id="fork"/><parallelGateway id="join"/>', flows("s", "fork")]
    for number, resources in enumerate(BRANCHES):
        possible = [
            (key, *case)
            for key, cases in CASES.items()
            for case in cases
            if case[0] in resources and "target" not in case[1] and not _has_no_end(key, case)
        ]
        names = []
        for behavior, resource, given in draw.choices(possible, k=3):
            names.append(f"b{number}.{len(names)}")
            elements.append(task(names[-1], *behavior, resource, **given))
        elements.append(flows("fork", *names, "join"))
    found, played = both(mission_of(*elements, flows("join", "e")), fleet)
    if completed(played):
        assert found.left_out == ()
        assert_alike(found, played)
    else:
        assert found.left_out or any(each.battery_left <= 0 for each in found.vehicles)


def _has_no_end(key: tuple[str, BehaviorType], case: Case) -> bool:
    """Whether a behavior goes on until it is interrupted, or is refused."""
    spec, (_, given) = SHARED[key], case
    return (
        given.get("spacing") == "1 m"
        or "loop" in given
        or not (spec.ends or ENDING_PARAMETERS & given.keys())
    )


SECTION = (
    "version: 1\nname: section\norigin: {lat: 38.1, lon: -77.3, alt: 20}\nvehicles:\n"
    + "".join(
        f"  v{number}: {{domain: ground, arbiter: sim, endurance: 20 min, "
        f"connection: {{home: [38.1, {-77.3 - number * 0.000171:.6f}, 20]}}}}\n"
        for number in range(4)
    )
    + "teams: {section: {members: [v0, v1, v2, v3]}}\n"
)
"""Four vehicles in a row, 15 m apart, at the beginning of the road."""


def on_the_road(behavior: str, **given: str) -> bytes:
    it = task("it", behavior, T, "section", route="road", **given)
    return mission_of(it, flows("s", "it", "e"))


def test_a_column_is_as_slow_as_its_spacing_makes_it(tmp_path: Path) -> None:
    fleet = fleet_of(SECTION.replace("20 min", "24 min"), tmp_path)
    close = on_the_road("road_following_formation", spacing="10 m")
    found, played = both(close, fleet)
    assert found.left_out == ()
    assert_alike(found, played)
    assert found.time_s > 1_200
    (tmp_path / "m.bpmn").write_bytes(close)
    findings = check(tmp_path / "m.bpmn", tmp_path / "fleet.yaml")
    assert [each.rule for each in findings] == ["endurance"] * 4
    wide = estimate_mission(load_mission(on_the_road("formation", spacing="40 m")), fleet)
    assert 450 < wide.time_s < 600


def test_a_bridge_takes_as_long_as_all_members_one_after_the_other(tmp_path: Path) -> None:
    fleet = fleet_of(SECTION, tmp_path)
    found, played = both(on_the_road("bridge_crossing", spacing="10 m"), fleet)
    assert found.left_out == ()
    assert_alike(found, played)
    assert found.time_s > 1_900
    assert [round(each.time_s) for each in found.tasks] == [round(found.time_s)] * 4


def test_a_march_for_which_the_battery_does_not_last_says_what_lacks(tmp_path: Path) -> None:
    fleet = fleet_of(SECTION.replace("20 min", "12 min"), tmp_path)
    found, played = both(on_the_road("road_following_formation", spacing="10 m"), fleet)
    assert not completed(played)
    assert all(-0.8 < each.battery_left < -0.6 for each in found.vehicles)


def test_what_is_asked_again_is_not_simulated_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fleet = fleet_of(SECTION.replace("[38.1,", "[38.10001,"), tmp_path)
    road = on_the_road("bridge_crossing", spacing="11 m")
    first = estimate_mission(load_mission(road), fleet)

    def simulate(*_: object) -> None:
        raise AssertionError("it is known already")

    monkeypatch.setattr("m2pem.simulation.single_behavior.run_virtual", simulate)
    assert estimate_mission(load_mission(road), fleet) == first
    with pytest.raises(AssertionError):
        estimate_mission(load_mission(road.replace(b"11 m", b"12 m")), fleet)


def test_a_march_that_would_take_long_to_simulate_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem.simulation.single_behavior.MOST_STEPS", 1_000)
    road = on_the_road("formation", spacing="13 m")
    found = estimate_mission(load_mission(road), fleet_of(SECTION, tmp_path))
    [named] = found.left_out
    assert named.element == "it"
    assert "rehearse it" in named.reason


def test_what_depends_on_a_vehicle_that_another_branch_moves_is_named(fleet: Fleet) -> None:
    there = task("there", "single_vehicle_routing", V, "boat", route="lane")
    look = task("look", "ptz_point_at", P, "a1/eye", target="boat")
    gates = '<parallelGateway id="fork"/><parallelGateway id="join"/>'
    ways = [flows("s", "fork", "there", "join", "e"), flows("fork", "look", "join")]
    found = estimate_mission(load_mission(mission_of(there, look, gates, *ways)), fleet)
    assert [(each.element, each.reason) for each in found.left_out] == [
        ("look", "it depends on where boat is, which another branch moves")
    ]
    in_a_row = estimate_mission(
        load_mission(mission_of(there, look, flows("s", "there", "look", "e"))), fleet
    )
    assert in_a_row.left_out == ()


def test_what_may_be_interrupted_is_named(fleet: Fleet) -> None:
    def with_timer(duration: str, activity: str = "true") -> MissionEstimate:
        there = task("there", "single_vehicle_routing", V, "boat", route="lane")
        timer = (
            f'<boundaryEvent id="late" attachedToRef="there" cancelActivity="{activity}">'
            f"<timerEventDefinition><timeDuration>{duration}</timeDuration></timerEventDefinition>"
            "</boundaryEvent>"
        )
        ways = flows("s", "there", "e"), flows("late", "e")
        return estimate_mission(load_mission(mission_of(there, timer, *ways)), fleet)

    assert [each.element for each in with_timer("PT20S").left_out] == ["late"]
    assert with_timer("PT20S", "false").left_out == ()
    assert with_timer("PT2H").left_out == ()


def test_a_hold_of_no_vehicle_takes_its_duration(fleet: Fleet) -> None:
    wait = task("wait", "hold", V, "", duration="42 s")
    found, played = both(mission_of(wait, flows("s", "wait", "e")), fleet)
    assert found.left_out == ()
    assert found.time_s == played.summary.took_s == 42


def test_tasks_that_may_wait_for_space_are_named(tmp_path: Path) -> None:
    spaced = FLEET + "deconfliction: {ground: {horizontal: 3 m}, on_conflict: wait}\n"
    source = mission_of(task("it", "goto", V, "g1", target=PLACE), flows("s", "it", "e"))
    found = estimate_mission(load_mission(source), fleet_of(spaced, tmp_path))
    assert [each.reason for each in found.left_out] == [
        "how long it waits for space is not counted"
    ]
    assert found.time_s > 30


def test_an_estimate_leaves_state_files_alone(tmp_path: Path) -> None:
    state = tmp_path / "state"
    kept = SECTION.replace("connection: {", f"connection: {{state: '{state}', ")
    found = estimate_mission(load_mission(on_the_road("bridge_crossing")), fleet_of(kept, tmp_path))
    assert found.time_s > 1_900
    assert not state.exists()
