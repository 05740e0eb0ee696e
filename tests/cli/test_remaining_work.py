"""Tasks that do what is left of others: routes and surveys that a signal or an error has ended."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from shapely.geometry import LineString, Polygon, shape
from shapely.ops import unary_union

from m2pem.geo.local_frame import LocalFrame
from tests.cli.conftest import Invoke
from tests.command_line import CommandLine

HOME = (38.1075, -77.3192)
FRAME = LocalFrame(HOME)
LANE = [(0.0, 50.0), (800.0, 50.0), (800.0, 450.0)]
FIELD = [(0.0, 0.0), (300.0, 0.0), (300.0, 200.0), (0.0, 200.0), (0.0, 0.0)]


def lonlat(place: tuple[float, float]) -> list[float]:
    latitude, longitude = FRAME.to_latlon(place)
    return [longitude, latitude]


FLEET = f"""
version: 1
origin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: 60.0}}
vehicles:
  uav:
    domain: air
    arbiter: sim
    connection: {{home: [{HOME[0]}, {HOME[1]}], altitude: 40 m STATE}}
routes: {{lane: lane.geojson}}
areas: {{field: field.geojson}}
"""

HEAD = """
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"
             xmlns:m2pem="https://m2pem.org/schema/1">
  <signal id="Look" m2pem:from="operator"/>
  <error id="Blocked" errorCode="ROUTE_BLOCKED"/>
"""
FLY, SURVEY = ("single_vehicle_routing", {"route": "lane"}), ("area_survey", {"area": "field"})


def task(name: str, behavior: str, **parameters: str) -> str:
    given = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return (
        f'<scriptTask id="{name}"><extensionElements><m2pem:behavior type="vehicle" '
        f'name="{behavior}"><m2pem:properties>{given}</m2pem:properties><m2pem:resources>'
        '<m2pem:role name="pilot" vehicle="uav"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


def flows(*chains: str) -> str:
    pairs = [pair for chain in chains for pair in pairwise(chain.split())]
    return "".join(
        f'<sequenceFlow id="{a}-{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in pairs
    )


def boundary(
    name: str, host: str, definition: str = 'signalEventDefinition signalRef="Look"'
) -> str:
    return f'<boundaryEvent id="{name}" attachedToRef="{host}"><{definition}/></boundaryEvent>'


ENDS = '<startEvent id="S"/><endEvent id="E"/>'
DETOUR = task("Detour", "goto", target="[38.1060, -77.3150]")


def process(*parts: str) -> str:
    return f'<process id="P" isExecutable="true">{"".join(parts)}</process>'


def detour_and_rest(work: tuple[str, dict[str, str]], **rest: str) -> str:
    """Look away from the work, and from its rest, as often as a signal comes; then do the rest."""
    behavior, parameters = work
    return process(
        ENDS,
        task("Work", behavior, **parameters),
        boundary("Away", "Work"),
        '<exclusiveGateway id="M"/>',
        DETOUR,
        task("Rest", behavior, **rest),
        boundary("Again", "Rest"),
        flows("S Work E", "Away M Detour Rest E", "Again M"),
    )


def write(folder: Path, mission: str, answers: str = "", state: str = "") -> tuple[Path, ...]:
    files = [folder / name for name in ("m.bpmn", "fleet.yaml", "answers.yaml")]
    files[0].write_text(f"{HEAD}{mission}</definitions>")
    files[1].write_text(FLEET.replace("STATE", f", state: {state}" if state else ""))
    files[2].write_text(answers or "{}")
    line = {"type": "LineString", "coordinates": [*map(lonlat, LANE)]}
    (folder / "lane.geojson").write_text(json.dumps(line))
    area = {"type": "Polygon", "coordinates": [[*map(lonlat, FIELD)]]}
    (folder / "field.geojson").write_text(json.dumps(area))
    return tuple(files)


def simulate(
    invoke: Invoke, folder: Path, mission: str, answers: str = "", status: int = 0
) -> list[dict[str, Any]]:
    file, fleet, script = write(folder, mission, answers)
    words = ("simulate", file, "--fleet", fleet, "--answers", script, "--format", "json")
    ended, out, err = invoke(*words)
    assert ended == status, err
    return [json.loads(line) for line in out.splitlines()]


def requested(records: list[dict[str, Any]], element: str) -> list[dict[str, Any]]:
    return [
        each
        for each in records
        if each["record"] == "BehaviorRequested" and each["element"] == element
    ]


def geometry(record: dict[str, Any], parameter: str) -> Any:
    """The route or area of a request, in metres east and north of home."""
    found = json.loads(record["parameters"][parameter])
    found = shape(found.get("geometry", found))
    rings = [found.coords] if parameter == "route" else [found.exterior.coords]
    points = [FRAME.to_local((latitude, longitude)) for longitude, latitude, *_ in rings[0]]
    return LineString(points) if parameter == "route" else Polygon(points)


def signals(*at_s: int) -> str:
    return "signals: [" + ", ".join(f"{{at: {each} s, id: Look}}" for each in at_s) + "]"


def test_a_route_goes_on_where_it_was_interrupted_as_often_as_that_happens(
    invoke: Invoke, tmp_path: Path
) -> None:
    mission = detour_and_rest(FLY, route="${Work.remaining}")
    records = simulate(invoke, tmp_path, mission, signals(40, 90))
    whole = LineString(LANE)
    lengths = [whole.length]
    for each in requested(records, "Rest"):
        rest = geometry(each, "route")
        assert whole.buffer(0.5).contains(rest)
        assert rest.coords[-1] == pytest.approx(LANE[-1], abs=0.1)
        lengths.append(rest.length)
    assert len(lengths) == 3
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[1] == pytest.approx(whole.length - (40 * 10 - 50), abs=60)
    assert records[-1]["outcome"] == "completed"


def test_a_survey_goes_on_where_it_was_interrupted_and_leaves_nothing_out(
    invoke: Invoke, tmp_path: Path
) -> None:
    rest = {name: f"${{Work.remaining.{name}}}" for name in ("heading", "spacing")}
    mission = detour_and_rest(SURVEY, area="${Work.remaining}", **rest)
    records = simulate(invoke, tmp_path, mission, signals(60))
    (again,) = requested(records, "Rest")
    left, field = geometry(again, "area"), Polygon(FIELD)
    assert 0.2 * field.area < left.area < 0.95 * field.area
    assert left.difference(field.buffer(0.5)).area < 1.0
    assert again["parameters"]["spacing"]
    assert again["parameters"]["heading"].endswith("rad")
    done = field.difference(left)
    assert unary_union([done, left]).symmetric_difference(field).area < 1.0


def test_what_is_left_of_the_same_task_is_its_own_next_route(
    invoke: Invoke, tmp_path: Path
) -> None:
    own = "${is_empty(Work.remaining) ? 'lane' : Work.remaining}"
    mission = process(
        ENDS,
        '<exclusiveGateway id="M"/>',
        task("Work", "single_vehicle_routing", route=own),
        boundary("Away", "Work"),
        DETOUR,
        flows("S M Work E", "Away Detour M"),
    )
    first, second = requested(simulate(invoke, tmp_path, mission, signals(40)), "Work")
    assert first["parameters"]["route"] == "lane"
    assert geometry(second, "route").length < LineString(LANE).length - 250


@pytest.mark.parametrize("code", ["ROUTE_BLOCKED", "FAILED"])
def test_a_failed_route_leaves_what_it_has_not_done(
    invoke: Invoke, tmp_path: Path, code: str
) -> None:
    mission = process(
        ENDS,
        task("Work", *FLY[:1], **FLY[1]),
        boundary("Away", "Work", "errorEventDefinition"),
        task("Rest", "single_vehicle_routing", route="${Work.remaining}"),
        flows("S Work E", "Away Rest E"),
    )
    answers = f"behaviors: {{Work: [{{after: 40 s, end: failed, error: {code}}}]}}"
    (rest,) = requested(simulate(invoke, tmp_path, mission, answers), "Rest")
    assert geometry(rest, "route").length < LineString(LANE).length - 250


def test_an_event_subprocess_and_a_boundary_of_a_subprocess_leave_the_rest(
    invoke: Invoke, tmp_path: Path
) -> None:
    inside = f'<startEvent id="IS"/><endEvent id="IE"/>{task("Work", FLY[0], **FLY[1])}'
    sub = f'<subProcess id="Sub">{inside}{flows("IS Work IE")}</subProcess>'
    rest = task("Rest", "single_vehicle_routing", route="${Work.remaining}")
    outside = process(
        ENDS, sub, boundary("Away", "Sub"), DETOUR, rest, flows("S Sub E", "Away Detour Rest E")
    )
    (request,) = requested(simulate(invoke, tmp_path, outside, signals(40)), "Rest")
    assert geometry(request, "route").length < LineString(LANE).length - 250
    handler = (
        '<subProcess id="H" triggeredByEvent="true"><startEvent id="HS">'
        '<signalEventDefinition signalRef="Look"/></startEvent><endEvent id="HE"/>'
        f"{DETOUR}{rest}{flows('HS Detour Rest HE')}</subProcess>"
    )
    inner = process(ENDS, task("Work", FLY[0], **FLY[1]), handler, flows("S Work E"))
    (request,) = requested(simulate(invoke, tmp_path, inner, signals(40)), "Rest")
    assert geometry(request, "route").length < LineString(LANE).length - 250


def test_of_a_task_that_is_done_nothing_is_left_and_the_next_one_is_done_at_once(
    invoke: Invoke, tmp_path: Path
) -> None:
    rest = task("Rest", "single_vehicle_routing", route="${Work.remaining}")
    mission = process(ENDS, task("Work", FLY[0], **FLY[1]), rest, flows("S Work Rest E"))
    records = simulate(invoke, tmp_path, mission)
    assert requested(records, "Rest") == []
    assert records[-1]["outcome"] == "completed"


def test_of_a_task_that_has_not_begun_there_is_no_rest(invoke: Invoke, tmp_path: Path) -> None:
    rest = task("Rest", "single_vehicle_routing", route="${Work.remaining}")
    mission = process(ENDS, rest, task("Work", FLY[0], **FLY[1]), flows("S Rest Work E"))
    records = simulate(invoke, tmp_path, mission, status=1)
    (ended,) = [each for each in records if each["record"] == "BehaviorEnded"]
    assert (ended["state"], ended["element"]) == ("REJECTED", "Rest")
    assert "needs the parameter 'route'" in ended["reason"]


def test_nothing_is_written_that_the_mission_does_not_read(invoke: Invoke, tmp_path: Path) -> None:
    mission = detour_and_rest(FLY, route="lane")
    records = simulate(invoke, tmp_path, mission, signals(40))
    assert [each for each in records if each["record"] == "DataWritten"] == []


def test_a_mistyped_task_is_found(invoke: Invoke, tmp_path: Path) -> None:
    file, fleet, _ = write(tmp_path, detour_and_rest(FLY, route="${Wrk.remaining}"))
    _, out, _ = invoke("check", file, "--fleet", fleet)
    assert "'Wrk.remaining' is read" in out
    assert "did you mean 'Work.remaining'?" in out
    file, fleet, _ = write(tmp_path, detour_and_rest(FLY, route="${Work.remaining}"))
    assert invoke("check", file, "--fleet", fleet, "--strict")[0] == 0


def test_what_is_left_is_known_after_a_kill(m2pem: CommandLine, tmp_path: Path) -> None:
    mission = detour_and_rest(FLY, route="${Work.remaining}")
    state = str(tmp_path / "vehicles.sqlite")
    file, fleet, script = write(tmp_path, mission, signals(40), state)
    words = ("--answers", script, "--ocu", "none", "--format", "json", "--speed", "50")
    first = m2pem.start("run", file, "--fleet", fleet, *words)
    first.until_record("BehaviorRequested", element="Detour")
    first.kill()
    again = m2pem.start("resume", "r1", *words[:-2])
    status, errors = again.rest()
    assert status == 0, errors
    _, journaled, _ = m2pem.run("replay", "r1", "--format", "json")
    (rest,) = requested([json.loads(line) for line in journaled.splitlines()], "Rest")
    assert geometry(rest, "route").length < LineString(LANE).length - 200
