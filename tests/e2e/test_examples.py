"""The examples: each has its parts, does what its README shows, and passes the strict check."""

import json
import logging
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from m2pem.cli.group import run_command_line
from tests.console import (
    REPOSITORY,
    Command,
    assert_does_what_is_shown,
    blocks,
    environment,
    make_workspace,
)

EXAMPLES = sorted(path for path in (REPOSITORY / "examples").glob("t[0-9]*") if path.is_dir())
NEEDS_A_PLUGIN = "t13_own_service"
NOT_INSTALLED = {"M2PEM_BLOCK_PLUGINS": "wind_gauge"}
"""As if that plugin was not there, in an environment where somebody has followed the README."""

Record = dict[str, Any]

every_example = pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)

WITHOUT_MISSION = {"t24_gateway"}
"""What they show needs no mission."""

every_mission = pytest.mark.parametrize(
    "example",
    [path for path in EXAMPLES if path.name not in WITHOUT_MISSION],
    ids=lambda path: path.name,
)


def commands(example: Path) -> list[Command]:
    return [command for _, block in blocks(example / "README.md") for command in block]


def words(command: Command) -> list[str]:
    """Of the program alone, without what it is piped into."""
    return shlex.split(command.text.partition(" | ")[0], comments=True)


def without(options: list[str], *names: str) -> list[str]:
    """Without some options that have a value."""
    left = list(options)
    for name in names:
        if name in left:
            place = left.index(name)
            del left[place : place + 2]
    return left


def rehearsals(example: Path) -> list[list[str]]:
    """The different `m2pem simulate` commands of an example, in order, as words."""
    found: list[list[str]] = []
    for command in commands(example):
        called = without(words(command), "--format", "--gantt")
        if called[:2] == ["m2pem", "simulate"] and called not in found:
            found.append(called)
    return found


# --- the parts --------------------------------------------------------------------------------


def test_the_examples_are_numbered_and_listed_in_order() -> None:
    assert len(EXAMPLES) >= 12
    numbers = [path.name.partition("_")[0] for path in EXAMPLES]
    assert numbers == [f"t{number:02}" for number in range(1, len(EXAMPLES) + 1)]
    index = (REPOSITORY / "examples" / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| \[(t\d\d)\]\((\w+)/README\.md\) \|", index, re.M) == [
        (path.name.partition("_")[0], path.name) for path in EXAMPLES
    ]


@every_example
def test_an_example_has_its_parts(example: Path) -> None:
    readme = (example / "README.md").read_text(encoding="utf-8")
    assert readme.startswith(f"# {example.name.partition('_')[0]}: ")
    assert "\nLook at: " in readme
    if example.name not in WITHOUT_MISSION:
        assert (example / "mission.bpmn").exists()
        assert "--fleet sim" in readme or list(example.glob("fleet*.yaml"))


@every_example
def test_every_file_of_an_example_is_used(example: Path) -> None:
    texts = [(example / "README.md").read_text(encoding="utf-8")]
    scenarios = {f"{path.stem}.test.yaml" for path in example.glob("*.bpmn")}  # of `m2pem test`
    files = [path for path in example.glob("*.yaml") if path.name not in scenarios]
    texts += [path.read_text(encoding="utf-8") for path in files]
    texts += [path.read_text(encoding="utf-8") for path in example.glob("*.py")]
    used = "\n".join(texts)
    parts = {path.name for path in example.iterdir()} - {"README.md", "__pycache__"} - scenarios
    assert {part for part in parts if part not in used} == set()


@every_example
def test_a_copied_example_needs_no_file_of_another_folder(example: Path) -> None:
    files = [
        Path(word)
        for command in commands(example)
        for word in words(command)
        if "/" in word and (REPOSITORY / word).exists()
    ]
    assert [file for file in files if not (REPOSITORY / file).is_relative_to(example)] == []


# --- what the README shows --------------------------------------------------------------------


def install(command: Command, workspace: Path, site: Path) -> None:
    """What `pip install` does, without asking any package index, and into a folder."""
    options = ["--no-deps", "--no-index", "--no-build-isolation", "--target", str(site)]
    subprocess.run(
        [sys.executable, "-m", *words(command), "--quiet", *options],
        cwd=workspace,
        check=True,
    )


def only_rehearsed(example: Path) -> bool:
    """Whether its README shows no more than checks and rehearsals, which tests below do as well."""
    return all(
        command.text.startswith(("m2pem check ", "m2pem simulate ", "m2pem fleet "))
        for command in commands(example)
    )


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(
            example,
            marks=pytest.mark.long if only_rehearsed(example) and example != EXAMPLES[0] else (),
            id=example.name,
        )
        for example in EXAMPLES
    ],
)
def test_the_commands_do_what_the_readme_shows(example: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path / "workspace")
    shell = environment(tmp_path / "home") | NOT_INSTALLED
    site = tmp_path / "site"
    for command in commands(example):
        assert command.program in ("m2pem", "python", "pip")
        if command.program == "pip":
            install(command, workspace, site)
            shell["PYTHONPATH"] += f":{site}"
            del shell["M2PEM_BLOCK_PLUGINS"]
        else:
            assert_does_what_is_shown(command, workspace, shell)


@pytest.fixture
def m2pem(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Callable[[list[str]], tuple[int, str]]]:
    """Runs a command line of an example in this process; returns status and standard output."""
    monkeypatch.chdir(REPOSITORY)
    for name, value in NOT_INSTALLED.items():
        monkeypatch.setenv(name, value)
    logger = logging.getLogger("m2pem")
    before = (logger.handlers[:], logger.propagate, logger.level)

    def run(line: list[str]) -> tuple[int, str]:
        status = run_command_line(line[1:])
        return status, capsys.readouterr().out

    yield run
    logger.handlers[:], logger.propagate, logger.level = before


@every_mission
def test_the_strict_check_finds_nothing(
    example: Path, m2pem: Callable[[list[str]], tuple[int, str]]
) -> None:
    data = [word for line in rehearsals(example) for word in line if word.startswith("mission.")]
    fleets = [str(path) for path in sorted(example.glob("fleet*.yaml"))] or ["sim"]
    for fleet in fleets:
        line = ["m2pem", "check", str(example / "mission.bpmn"), "--fleet", fleet, "--strict"]
        line += [option for value in data[:1] for option in ("--data", value)]
        status, out = m2pem([*line, "--format", "json"])
        rules = [finding["rule"] for finding in json.loads(out)]
        if example.name == NEEDS_A_PLUGIN:
            assert (status, rules) == (1, ["unknown-service"])
        else:
            assert (status, rules) == (0, [])


# --- what happens in the rehearsals -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Course:
    """What is to happen in a rehearsal, in this order among other things, and what never."""

    happens: list[str]
    never: set[str] = field(default_factory=set)


def happening(record: Record) -> str:
    """A record in a few words; "" for those that no expectation is about."""
    element = record.get("element", "")
    match record["record"]:
        case "TokenEntered":
            return f"at {element}"
        case "TokenLeft" if record["outcome"] == "interrupted":
            return f"{element} interrupted"
        case "BehaviorRequested":
            return f"{element}: {' '.join(record['resources'])} {record['name']}"
        case "BehaviorEnded":
            return f"{element}: {record['state']} {record['code']}".strip()
        case "PromptAnswered":
            return f"{element}: {record['decision']} by {record['by']}"
        case "SignalThrown":
            return f"signal {record['signal']}"
        case "EscalationThrown":
            return f"escalation {record['code']} to {record['caught_by']}"
        case "ErrorThrown":
            return f"error {record['code']} to {record['caught_by']}"
        case "DataWritten":
            return f"{record['key']} = {record['value']}"
        case "RunEnded":
            return str(record["outcome"])
        case _:
            return ""


ONE_LAP = ["DriveLap: rover single_vehicle_routing", "DriveLap: SUCCEEDED", "at Count"]
VISIT = ["FlyToSite: uav1 goto", "CircleSite: uav1 orbit", "at CountVisit", "at EndInspect"]
INSPECTED = ["inspection:FlyToSite: uav1 goto", "inspection:CircleSite: uav1 orbit"]
PICTURE = ["at EveryMinute", "TakePicture: uav1/camera take_picture", "at PictureTaken"]
SECTION = "rover1 rover2 rover3"

EXPECTED = {
    "t01": [
        Course(
            [
                *("at Start", "at DriveRoute", "DriveRoute: rover single_vehicle_routing"),
                *("DriveRoute: SUCCEEDED", "at End", "completed"),
            ]
        )
    ],
    "t02": [
        Course(
            [
                *("AskOperator: look by answers file", "user.decision = look"),
                *("LookAtField: uav1 area_observe", "at Decided", "at End", "completed"),
            ],
            never={"at SurveyField"},
        ),
        Course(
            [
                *("AskOperator: survey by default", "SurveyField: uav1 area_survey"),
                *("SurveyField: SUCCEEDED", "at End", "completed"),
            ],
            never={"at LookAtField"},
        ),
    ],
    "t03": [
        Course(
            [
                *("DriveRoad: rover single_vehicle_routing", "SurveyField: uav1 area_survey"),
                *("DriveRoad: SUCCEEDED", "at Join", "SurveyField: SUCCEEDED", "at Join"),
                *("DriveHome: rover return_to_launch", "at End", "completed"),
            ]
        )
    ],
    "t04": [
        Course(
            [
                *("Survey: uav1 area_survey", "Survey: FAILED BATTERY_LOW"),
                *("error BATTERY_LOW to LowBattery", "at LowBattery"),
                *("FlyHome: uav1 return_to_launch", "FlyHome: SUCCEEDED"),
                *("SurveyAgain: uav2 area_survey", "SurveyAgain: SUCCEEDED", "completed"),
            ]
        )
    ],
    "t05": [
        Course(
            [
                *("Patrol: rover single_vehicle_routing", "signal ComeHome"),
                *("Patrol interrupted", "at CalledHome", "DriveHome: rover return_to_launch"),
                *("Patrol: CANCELLED", "DriveHome: SUCCEEDED", "at Home", "completed"),
            ],
            never={"at RouteEnded"},
        )
    ],
    "t06": [
        Course(
            [
                *("WatchField: uav1 area_observe", *PICTURE, *PICTURE, *PICTURE, *PICTURE),
                *("Watch interrupted", "at TimeIsUp", "FlyHome: uav1 return_to_launch"),
                *("at Home", "completed"),
            ],
            never={"at NothingLeft"},
        )
    ],
    "t07": [
        Course(
            [
                *("mission.laps = 3", "lap = 0", "lap_speed = 3"),
                *(*ONE_LAP, "lap = 1", "lap_speed = 5", "report = lap 1 of 3"),
                *(*ONE_LAP, "lap = 2", "lap_speed = 7", "report = lap 2 of 3"),
                *(*ONE_LAP, "lap = 3", "lap_speed = 8", "report = lap 3 of 3"),
                *("at Enough", "at End", "completed"),
            ]
        )
    ],
    "t08": [
        Course(
            [
                *("tour.sites = 0", "at InspectGate", "site = gate", *VISIT, "tour.sites = 1"),
                *("at InspectBridge", "site = bridge", *VISIT, "tour.sites = 2"),
                *("FlyHome: uav1 return_to_launch", "at End", "completed"),
            ]
        )
    ],
    "t09": [
        Course(
            [
                *("at SweepRoads", "SweepNorth: SUCCEEDED", "escalation NORTH_DONE to OnNorthDone"),
                *("SweepSouth: rover single_vehicle_routing", "LookAtNorth: uav1 orbit"),
                *("LookAtNorth: SUCCEEDED", "SweepSouth: SUCCEEDED", "at End", "completed"),
            ],
            never={"SweepRoads interrupted", "at OnBlocked"},
        ),
        Course(
            [
                *("escalation NORTH_DONE to OnNorthDone", "SweepSouth: FAILED ROUTE_BLOCKED"),
                *("error ROUTE_BLOCKED to OnBlocked", "DriveHome: rover return_to_launch"),
                *("at GivenUp", "LookAtNorth: SUCCEEDED", "at Looked", "completed"),
            ],
            never={"at End"},
        ),
    ],
    "t10": [
        Course(
            [
                *("at Detect", "DriveRoad: rover single_vehicle_routing"),
                *("ScanRoadside: rover/ptz ptz_scan_sector",),
                *("detection.type = metal", "detection.source = rover/gpr"),
                *("TakePictures: rover/camera take_picture", "TakePictures: SUCCEEDED", "at Join"),
                *("ScanRoadside: SUCCEEDED", "at Join", "DriveRoad: SUCCEEDED", "at Join"),
                *("at End", "completed"),
            ]
        )
    ],
    "t11": [
        Course(
            [
                *(f"MoveUp: {SECTION} formation", "MoveUp: SUCCEEDED"),
                *(f"CrossBridge: {SECTION} bridge_crossing", "CrossBridge: SUCCEEDED"),
                *(f"EscortTruck: {SECTION} escort", "at TruckLeaves", "at Done", "completed"),
            ],
            never={"at NoTruck"},
        )
    ],
    "t13": [
        Course(
            ["at MeasureWind", "wind.gust = 12", "at TooWindy", "completed"], never={"at Survey"}
        )
    ],
    "t16": [
        Course(
            [
                *("DriveRoad: FAILED ROUTE_BLOCKED", "error ROUTE_BLOCKED to RoadBlocked"),
                *("DriveDetour: rover single_vehicle_routing", "DriveDetour: SUCCEEDED"),
                *("at Delivered", "completed"),
            ],
            never={"at FindRover"},
        ),
        Course(
            [
                *("DriveRoad: LOST LINK_LOST", "error LINK_LOST to LostLink"),
                *("FindRover: uav1 orbit", "at NotDelivered", "completed"),
            ],
            never={"at DriveDetour", "at Delivered"},
        ),
    ],
    "t18": [
        Course(
            [
                *("Patrol: rover single_vehicle_routing", "signal LookThere", "at Asked"),
                *("Orbit: uav1 orbit", "Orbit: SUCCEEDED", "looks = 1"),
                *("signal LookThere", "at Asked", "Orbit: SUCCEEDED", "looks = 2"),
                *("Patrol interrupted", "at Enough", "DriveHome: rover return_to_launch"),
                *("Patrol: CANCELLED", "DriveHome: SUCCEEDED", "at Home", "completed"),
            ],
            never={"at RouteEnded"},
        )
    ],
    "t19": [
        Course(
            [
                *("DropFirst: SUCCEEDED", "DropSecond: SUCCEEDED", "AskKeep: keep by default"),
                *("at Laid", "at End", "completed"),
            ],
            never={"at FetchFirst", "at FetchSecond", "at Cancelled"},
        ),
        Course(
            [
                *("DropFirst: SUCCEEDED", "DropSecond: SUCCEEDED", "at Abort"),
                *("at FetchSecond", "TakeSecond: SUCCEEDED"),
                *("at FetchFirst", "TakeFirst: SUCCEEDED"),
                *("at Cancelled", "DriveHome: rover return_to_launch", "at GivenUp", "completed"),
            ],
            never={"at End"},
        ),
    ],
    "t20": [
        Course(
            [
                *("at SearchField", "field = north_field", "Survey: uav1 area_survey"),
                *("field = east_field", "AnythingFound: found by answers file"),
                *("TakePicture: uav1/camera take_picture", "Sharp: again by answers file"),
                *("TakePicture: uav1/camera take_picture", "Sharp: sharp by answers file"),
                *("finds = 1", "field = south_field", "TakePicture: SUCCEEDED", "finds = 2"),
                *("reports = [None, 'east_field', 'south_field', None]", "at FlyHome"),
                *("FlyHome: uav1 return_to_launch", "at End", "completed"),
            ],
        )
    ],
    "t21": [
        Course(
            [
                *("at InspectGate", "site = gate", *INSPECTED, "report.gate = True"),
                *("at InspectBridge", "site = bridge", *INSPECTED, "report.bridge = True"),
                *("FlyHome: uav1 return_to_launch", "at End", "completed"),
            ]
        ),
        Course(
            [
                *("at InspectGate", "site = gate", *INSPECTED, "report.gate = True"),
                *("FlyHome: uav1 return_to_launch", "at End", "completed"),
            ],
            never={"at InspectBridge"},
        ),
    ],
    "t22": [
        Course(
            [
                *("at SendRoute", "SendRoute: continue by answers file"),
                *("DriveRoute: rover single_vehicle_routing", "at End", "completed"),
            ],
            never={"at Aborted"},
        )
    ],
}
"""By example, a course for each rehearsal of its README. The others are all Python, whose output is
compared."""


def first_missing(happens: list[str], happened: list[str]) -> str | None:
    """The first expectation that is not met after those before it, or None if all are."""
    left = iter(happened)
    return next((expected for expected in happens if expected not in left), None)


def test_each_rehearsal_has_an_expected_course() -> None:
    shown = {path.name.partition("_")[0]: len(rehearsals(path)) for path in EXAMPLES}
    assert {key: len(courses) for key, courses in EXPECTED.items()} == {
        key: count for key, count in shown.items() if count
    }


@every_mission
def test_what_is_never_to_happen_could(example: Path) -> None:
    mission = (example / "mission.bpmn").read_text(encoding="utf-8")
    for course in EXPECTED.get(example.name.partition("_")[0], []):
        elements = {re.sub("^at | interrupted$", "", text) for text in course.never}
        assert {element for element in elements if f'id="{element}"' not in mission} == set()


REHEARSED = [
    pytest.param(line, course, id=f"{example.name}-{number}")
    for example in EXAMPLES
    for number, (line, course) in enumerate(
        zip(
            rehearsals(example),
            EXPECTED.get(example.name.partition("_")[0], []),
            strict=False,  # the test above says when they don't match
        )
    )
]


@pytest.mark.parametrize(("line", "course"), REHEARSED)
def test_what_the_example_is_about_happens(
    line: list[str], course: Course, m2pem: Callable[[list[str]], tuple[int, str]]
) -> None:
    status, out = m2pem([*line, "--format", "json"])
    happened = [happening(json.loads(text)) for text in out.splitlines()]
    assert status == 0
    assert first_missing(course.happens, happened) is None, "\n".join(filter(None, happened))
    assert course.never.isdisjoint(happened)
