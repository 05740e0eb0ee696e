"""What `m2pem check` says of wrong roles by need, and of what a fleet file says about them."""

from pathlib import Path

from tests.cli.conftest import Invoke
from tests.each_case import failures

FLEET = """version: 1
origin: {lat: 38.1, lon: -77.3, alt: 60.0}
vehicles:
  uav1: {domain: air, arbiter: sim, tags: [fast]}
  uav2: {domain: air, arbiter: sim}
  rover: {domain: ground, arbiter: sim}
areas: {field: field.geojson}
routes: {road: road.geojson}
"""
CORNERS = "[-77.3, 38.1], [-77.2, 38.1], [-77.2, 38.2], [-77.3, 38.1]"
FIELD = f'{{"type": "Polygon", "coordinates": [[{CORNERS}]]}}'
ROAD = '{"type": "LineString", "coordinates": [[-77.3, 38.1], [-77.2, 38.1]]}'

MISSION = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">
  <process id="P" isExecutable="true" PROCESS>
    <startEvent id="S"/><sequenceFlow id="F1" sourceRef="S" targetRef="T"/>
    <scriptTask id="T" TASK><extensionElements><m2pem:behavior BEHAVIOR><m2pem:resources>
      ROLES
    </m2pem:resources></m2pem:behavior></extensionElements></scriptTask>
    <sequenceFlow id="F2" sourceRef="T" targetRef="E"/><endEvent id="E"/>
  </process>
</definitions>
"""
STOP = 'type="vehicle" name="drive_stop"'

ROLES = [
    ("requires=\"vehicle.domain == 'space'\"", 'vehicle.domain = "air"', "ask for less, or give"),
    ("requires=\"'slow' in vehicle.tags\"", "has the tag 'slow'", "there are: fast"),
    ("requires=\"'fats' in vehicle.tags\"", "has the tag 'fats'", "did you mean 'fast'?"),
    ('requires="vehicle.batery &gt; 0.4"', "'vehicle.batery' is no fact", "'vehicle.battery'"),
    ("requires=\"vehicle.battery &gt; 'full'\"", "is a number, and never the text", "write for"),
    ('requires="3 &lt; vehicle.domain"', "is a text, and never the number 3", "write for example"),
    ("requires=\"vehicle.armed == 'yes'\"", "is true or false, and never the text", "write for"),
    ('requires="vehicle.tags == 3"', "is a list, and never the number 3", "write for example"),
    ('requires="vehicle.battery == true"', "is a number, and never true", "write for example"),
    ('requires="vehicle.tags + 1 == 2"', "'+' takes two numbers or two texts", "write for example"),
    ('requires="vehicle.domain"', "a condition takes true or false", 'requires="vehicle.domain =='),
    ('requires="3"', "a condition takes true or false, not the number 3", "write for example"),
    ('requires=""', "an expression is missing", "write for example"),
    ('requires="no.such == 1"', "nothing in process 'P' writes it", "write it in a task before"),
    (
        "prefer=\"'much'\"",
        "prefer gives the text 'much', not a number",
        "write for example prefer=",
    ),
    ('prefer="1 / 0"', "divides the number 1 by zero", "write for example prefer="),
    ('prefer="1e308 * 10"', "is not finite", "write for example prefer="),
    ('prefer="1e999"', "the number is too large", "write for example"),
    ('prefer="vehicle.tags"', "prefer gives a list of 1", "write for example prefer="),
    ('prefer="true"', "prefer gives true, not a number of seconds", "write for example prefer="),
    ('prefer="infinity"', "'infinity' is read, but nothing", "write it in a task before"),
    ('prefer="nan"', "'nan' is read, but nothing", "write it in a task before"),
    ('prefer="vehicle.spede"', "'vehicle.spede' is no fact", "did you mean"),
    ('prefer=""', "an expression is missing", "write for example"),
    ('count="0"', "count='0' is no number", "write for example count='2'"),
    ('count="1000000"', "no range of numbers from 1 to 1000", "write for example count='2'"),
    ('count="3..1"', "count='3..1' is no number", "count='1..3' for as many as are free"),
    ('count="two"', "count='two' is no number", "write for example count='2'"),
    ('count=""', "count='' is no number", "write for example count='2'"),
    ('count="2"', "has one vehicle in each role, not 2", "or delete count="),
    ('wait="ten minutes"', "wait='ten minutes': expected a duration", "wait='PT10M'"),
    ('wait="-PT5M"', "a duration cannot be negative", "or wait='unlimited'"),
    ('wait="${true}"', "wait='${true}': expected a duration", "wait='PT10M'"),
    ('wait="${1+}"', "expected a value, found the end", "write for example"),
    ('wait=""', "wait='': expected a duration", "wait='PT10M'"),
    ('priority="1.5"', "priority='1.5' is no whole number", "write for example priority='1'"),
    ('priority="high"', "priority='high' is no whole number", "write for example priority='1'"),
    ('priority="1000000"', "no whole number from -999999 to 999999", "write for example"),
    ('store="1x"', "store='1x' is no name of data", "write for example store='surveyor'"),
    ('same=""', "same='' is no name of data", "write for example same='surveyor'"),
    ('onLoss="retry"', "onLoss='retry' is none of fail, reassign, ask", "write onLoss='reassign'"),
    ('onLoss=""', "onLoss='' is none of fail, reassign, ask", "write onLoss='reassign'"),
    (
        'requires="vehicle.domain == \'ground\'" onLoss="reassign"',
        "only rover can fill it",
        "give the fleet another, or delete onLoss",
    ),
]
"""Attributes of a role, what is wrong, and what would be right. `requires="true"` if not given."""

PLACES = [
    ("TASK", 'm2pem:onLoss="ask"', 5, "no attribute 'm2pem:onLoss' for a script task; delete it"),
    ("TASK", 'm2pem:onError="end"', 5, "no effect on a script task; it is for: process"),
    ("PROCESS", 'm2pem:onError="retry"', 3, 'write m2pem:onError="incident" or'),
    ("PROCESS", 'm2pem:onError=""', 3, "m2pem:onError='' says nothing that m2pem knows; write"),
    ("PROCESS", 'm2pem:onErorr="end"', 3, "no attribute 'm2pem:onErorr' for a process; did you"),
    ("PROCESS", 'm2pem:onLoss="ask"', 3, "no attribute 'm2pem:onLoss' for a process; delete it"),
]
"""Attributes in wrong places or with wrong words, with the line, and what is said of them."""

FLEETS = [
    ("shared_space: {field: many}", "'many' is no number of vehicles; write a whole number"),
    ("shared_space: {field: true}", "True is no number of vehicles; write a whole number"),
    ("shared_space: {field: -1}", "-1 is no number of vehicles; write a whole number, 0 or more"),
    ("shared_space: {feild: 1}", "no area or route is named 'feild'; did you mean 'field'?"),
    ("shared_space: {road: {capacity: 1, width: wide}}", "'wide' is not a number with a unit"),
    ("shared_space: {road: {capacity: 1, width: 0 m}}", "'0 m' is not above 0"),
    ("shared_space: {field: {capacity: 1, on_conflict: queue}}", "not one of 'refuse' or 'wait'"),
    ("shared_space: {field: {capacity: 1, domains: [space]}}", "did you mean 'surface'?"),
    ("shared_space: [field]", "is not a map; write 'key: value' lines below it"),
    ("deconfliction: {on_conflict: queue}", "'queue' is not one of 'refuse' or 'wait'"),
    ("deconfliction: {on_conflict: wait, wait: soon}", "a duration is written with s, ms, min, h"),
    ("deconfliction: {on_conflict: wait, wait: -5 s}", "'-5 s' is not above 0"),
    ("deconfliction: {ground: {vertical: 3 m}}", "'horizontal' is missing"),
    ("deconfliction: {gruond: {horizontal: 3 m}}", "did you mean 'ground'?"),
    ("deconfliction: refuse", "is not a map; write 'key: value' lines below it"),
    ("allocation: {battery: full}", "a duration is written with s, ms, min, h"),
    ("allocation: {battery: -60 s}", "'-60 s' is less than 0"),
    ("allocation: {battery: .inf}", ".inf is not a finite 64-bit number"),
    ("allocation: {switching: 10 m}", "'10 m' is a distance, not a duration"),
    ("allocation: {batery: 60 s}", "did you mean 'battery'?"),
    ("allocation: greedy", "is not a map; write 'key: value' lines below it"),
    ("schedule: {unattended: sometimes}", "neither true nor false; YAML 1.2 reads only true"),
    ("schedule: {warning: soon}", "a duration is written with s, ms, min, h"),
    ("schedule: {warning: -1 s}", "'-1 s' is less than 0"),
    ("schedule: {warnin: 30 s}", "did you mean 'warning'?"),
    ("schedule: at night", "is not a map; write 'key: value' lines below it"),
]
"""The ninth line of a fleet file, and what is said of it."""


def mission(role: str = 'requires="true"', behavior: str = STOP, **attributes: str) -> str:
    text = MISSION.replace("ROLES", f'<m2pem:role name="d" {role}/>').replace("BEHAVIOR", behavior)
    for place in ("TASK", "PROCESS"):
        text = text.replace(place, attributes.get(place, ""))
    return text


def write(folder: Path, text: str, more: str = "") -> tuple[Path, Path]:
    path, fleet = folder / "mission.bpmn", folder / "fleet.yaml"
    path.write_text(text, encoding="utf-8")
    fleet.write_text(f"{FLEET}{more}\n", encoding="utf-8")
    (folder / "field.geojson").write_text(FIELD, encoding="utf-8")
    (folder / "road.geojson").write_text(ROAD, encoding="utf-8")
    return path, fleet


def test_the_mission_of_the_table_is_right_where_nothing_is_made_wrong(
    invoke: Invoke, tmp_path: Path
) -> None:
    path, fleet = write(tmp_path, mission())
    assert invoke("check", path, "--fleet", fleet, "--strict")[:2] == (
        0,
        f"{path}: nothing found\n",
    )


def test_each_wrong_attribute_of_a_role_is_said_with_its_line_and_what_is_right(
    invoke: Invoke, tmp_path: Path
) -> None:
    def is_said(case: tuple[str, str, str]) -> None:
        role, wrong, right = case
        needs = "" if "requires=" in role else 'requires="true" '
        path, fleet = write(tmp_path, mission(needs + role))
        status, printed, _ = invoke("check", path, "--fleet", fleet, "--strict")
        first = printed.splitlines()[0]
        assert (status, first.startswith(f"{path}:6: T: ")) == (1, True), first
        assert wrong in first, first
        assert right in first.partition(wrong)[2], first

    assert failures(is_said, ROLES) == []


def test_each_attribute_in_a_wrong_place_is_said_with_its_line(
    invoke: Invoke, tmp_path: Path
) -> None:
    def is_said(case: tuple[str, str, int, str]) -> None:
        place, attribute, line, said = case
        path, fleet = write(tmp_path, mission(**{place: attribute}))
        status, printed, _ = invoke("check", path, "--fleet", fleet, "--strict")
        (first, _) = printed.splitlines()
        assert (status, first.startswith(f"{path}:{line}: ")) == (1, True), first
        assert said in first, first

    assert failures(is_said, PLACES) == []


def test_each_wrong_word_of_a_fleet_file_is_said_with_its_line(
    invoke: Invoke, tmp_path: Path
) -> None:
    def is_said(case: tuple[str, str]) -> None:
        line, said = case
        path, fleet = write(tmp_path, mission(), line)
        status, printed, errors = invoke("check", path, "--fleet", fleet)
        first = (printed + errors).splitlines()[0]
        key = line.partition(":")[0]
        assert (status, first.startswith(f"{fleet}:9: {key}")) == (2, True), first
        assert said in first, first

    assert failures(is_said, FLEETS) == []
