"""Random places on simulated vehicles: whole missions, checked and rehearsed, judged by shapely."""

import json
import logging
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from m2pem.api.runs import StampedRecord
from m2pem.engine import records as r
from m2pem.fleet.fleet_file import load_fleet
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.plugins import PluginManager
from m2pem.rehearsal import rehearsal
from m2pem.scripting.checking import check
from m2pem.testing.contracts.arbiter_harness import ORIGIN
from tests.executive.conftest import flow, mission

from .random_places import (
    Done,
    Geojson,
    Task,
    Track,
    Trial,
    longitude_latitude,
    metres,
    mistakes,
    trial,
)

Data = dict[str, str]


def write(trial: Trial, folder: Path) -> Path:
    """Write the fleet and its geometries; return the fleet's file."""
    geometries = {"fence": trial.fence, **_geometries(trial)}
    for name, geometry in geometries.items():
        (folder / f"{name}.geojson").write_text(json.dumps(geometry), encoding="utf-8")
    vehicles = {}
    for name, home in trial.homes.items():
        longitude, latitude = longitude_latitude(home)
        settings = {"home": [latitude, longitude, ORIGIN[2]]}
        vehicles[name] = {"domain": trial.domain, "arbiter": "sim", "connection": settings}
    kinds = {name: each["type"] for name, each in geometries.items()}
    fleet = {
        "version": 1,
        "origin": dict(zip(("lat", "lon", "alt"), ORIGIN, strict=True)),
        "vehicles": vehicles,
        "teams": {"crew": {"members": [*vehicles], "lead": "v0"}},
        "areas": {name: f"{name}.geojson" for name, kind in kinds.items() if kind == "Polygon"},
        "routes": {name: f"{name}.geojson" for name, kind in kinds.items() if kind != "Polygon"},
        "fence": "fence",
    }
    file = folder / "fleet.yaml"
    file.write_text(json.dumps(fleet), encoding="utf-8")  # JSON is YAML
    return file


def _geometries(trial: Trial) -> dict[str, Geojson]:
    return {
        f"g{number}": task.given[name]
        for number, task in enumerate(trial.tasks)
        for name in ("area", "route")
        if name in task.given
    }


def drawn_mission(trial: Trial, *, known: bool) -> tuple[bytes, Data]:
    """Return the mission, and its data. `known`: before it starts where its tasks lead; else it
    goes on where one fails."""
    elements = []
    data: Data = {}
    for number, task in enumerate(trial.tasks):
        given = dict(task.given)
        for name in ("area", "route", "target"):
            if name not in given:
                continue
            if name != "target" and known:
                given[name] = f"g{number}"
            elif not known and given[name] != trial.leader:
                text = given[name] if name == "target" else json.dumps(given[name])
                given[name], data[f"d{number}"] = f"${{d{number}}}", text
        elements.append(_task(f"T{number}", task, given))
    return mission(_process(trial, elements, known=known)), data


def _task(element: str, task: Task, given: dict[str, str]) -> str:
    kind = "team" if task.actor == "crew" else "vehicle"
    properties = "".join(
        f'<m2pem:property name="{name}" value="{value}"/>' for name, value in given.items()
    )
    return (
        f'<scriptTask id="{element}"><extensionElements><m2pem:behavior type="{kind}" '
        f'name="{task.behavior}"><m2pem:properties>{properties}</m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="r" {kind}="{task.actor}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def _process(trial: Trial, tasks: list[str], *, known: bool) -> str:
    """One task after the other, or beside the leader's."""
    count = len(tasks)
    names = ["S", *(f"T{number}" for number in range(count)), "E"]
    nodes = ""
    flows = [*pairwise(names)]
    caught = [(f"B{n}", names[n + 2]) for n in range(count)]
    if trial.leader:
        nodes = '<parallelGateway id="F"/><endEvent id="X"><terminateEventDefinition/></endEvent>'
        lead, behind = names[-3:-1]
        ways = [("F", lead), ("F", behind), (lead, "X"), (behind, "E")]
        flows = [*pairwise([*names[:-3], "F"]), *ways]
        caught[-2:] = [(f"B{count - 2}", "X"), (f"B{count - 1}", "E")]
        caught = [(a, "F" if b == lead else b) for a, b in caught]
    if known:
        caught = []
    nodes += "".join(
        f'<boundaryEvent id="B{n}" attachedToRef="T{n}"><errorEventDefinition/></boundaryEvent>'
        for n in range(len(tasks))
        if not known
    )
    return (
        '<process id="P" isExecutable="true"><startEvent id="S"/><endEvent id="E"/>'
        + "".join(tasks)
        + nodes
        + "".join(flow(*each) for each in [*flows, *caught])
        + "</process>"
    )


def outcome(
    trial: Trial, file: Path, caplog: pytest.LogCaptureFixture
) -> tuple[list[Done], dict[str, Track], list[str]]:
    """Rehearse a mission; return what became of its tasks, where vehicles were, and warnings."""
    text, data = drawn_mission(trial, known=False)
    with caplog.at_level(logging.WARNING):
        result = rehearsal.rehearse(
            text,
            load_fleet(file),
            plugins=PluginManager(block=("all",)),
            data=data,
            telemetry_every_s=0.1,
        )
    tracks: dict[str, Track] = {name: [] for name in trial.homes}
    for sample in result.telemetry:
        for name, state in sample.vehicles.items():
            tracks[name].append((sample.t_s, *metres(*state.position.latlon)))
    said = [each.getMessage() for each in caplog.records]
    return _done(trial, result.records), tracks, said


def _done(trial: Trial, records: tuple[StampedRecord, ...]) -> list[Done]:
    begun = {}
    done = []
    for stamped in records:
        record = stamped.record
        if isinstance(record, r.BehaviorRequested):
            begun[record.behavior] = stamped.t_s, record.resources
        elif isinstance(record, r.BehaviorEnded):
            begin_s, resources = begun[record.behavior]
            task = trial.tasks[int(record.element[1:])]
            state = record.code if record.code == "REJECTED" else record.state.name
            done.append(Done(task, resources, state, record.reason, begin_s, stamped.t_s))
    return done


def run(seed: int, folder: Path, caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return what is wrong."""
    drawn = trial(seed)
    for polygon in drawn.unclear:
        with pytest.raises(GeometryError):
            parse_geojson(polygon)
    file = write(drawn, folder)
    done, tracks, said = outcome(drawn, file, caplog)
    return [*mistakes(drawn, done, tracks, said), *_unlike(drawn, done, file)]


def _unlike(trial: Trial, done: list[Done], file: Path) -> Iterator[str]:
    """Yield where what `check` says before is not what happens."""
    found = check(drawn_mission(trial, known=True)[0], file)
    errors = {each.element for each in found.errors if each.rule == "outside-fence"}
    others = [each for each in found.errors if each.rule != "outside-fence"]
    if others:
        yield str(others)
    named = {each.element for each in found if each.rule == "outside-fence"}
    for each in done:
        element = f"T{trial.tasks.index(each.task)}"
        if element in errors and each.state == "SUCCEEDED":
            yield f"{element}: {each.task.behavior} has an error before: {found}"
        if each.task.behavior == "follow" or each.task.actor == "crew":
            continue  # where its target, and where members beside the route will be is not known
        if each.state == "REJECTED" and "fence" in each.reason and element not in named:
            yield f"{element}: {each.task.behavior} of {each.vehicles}: {each.reason}; not before"
        if each.state != "SUCCEEDED":
            return


@pytest.fixture
def judged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> Callable[[int], list[str]]:
    monkeypatch.setattr(rehearsal, "MOST_SAMPLES", 10**7)
    return lambda seed: run(seed, tmp_path, caplog)


FOUND = (125, 849, 3907)
"""What went wrong once: a hole that bands share, a band in several pieces, and a way behind a
target that turned within a second."""


@pytest.mark.parametrize("seed", [*range(20), *FOUND])
def test_on_random_places_no_metre_is_inside_what_is_kept_out(
    seed: int, judged: Callable[[int], list[str]]
) -> None:
    assert judged(seed) == []


@pytest.mark.long
@pytest.mark.parametrize("seed", range(20, 1500))
def test_on_many_random_places_no_metre_is_inside_what_is_kept_out(
    seed: int, judged: Callable[[int], list[str]]
) -> None:
    assert judged(seed) == []
