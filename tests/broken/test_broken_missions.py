"""Ten broken missions: each mistake is found, named, drawn, and done by the engine too."""

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.cli.group import run_command_line
from tests.broken.expected import BROKEN, EXPECTED, REPOSITORY, Expected
from tools.broken_mission_pictures import drawn

SCHEMA = json.loads((REPOSITORY / "docs" / "verification.schema.json").read_bytes())
PAGE = (REPOSITORY / "docs" / "verification.md").read_text(encoding="utf-8")

every_one = pytest.mark.parametrize("expected", EXPECTED, ids=lambda each: each.name)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reports")


def report_of(expected: Expected, folder: Path) -> Path:
    """Its report as JSON; written once."""
    file = folder / f"{expected.name}.json"
    if not file.exists():
        assert run_command_line(["verify", str(expected.mission), "--report", str(file)]) == 1
    return file


def reported(expected: Expected, folder: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(report_of(expected, folder).read_bytes())
    return report


@every_one
def test_what_is_wrong_is_found_with_the_right_elements(expected: Expected, folder: Path) -> None:
    found = [
        each
        for each in reported(expected, folder)["violations"]
        if each["property"] == expected.asked and set(each["elements"]) == expected.elements
    ]
    assert any(expected.words in each["text"] for each in found)
    assert {each["warning"] for each in found} == {expected.warning}


@every_one
def test_the_terminal_says_it_with_names(
    expected: Expected, capsys: pytest.CaptureFixture[str]
) -> None:
    for strict in ([], ["--strict"]):
        assert run_command_line(["verify", str(expected.mission), *strict]) == 1
        out, _ = capsys.readouterr()
        kind = "warning" if expected.warning and not strict else expected.asked
        assert any(
            line.startswith(f"{kind}: ") and expected.words in line for line in out.splitlines()
        )


@every_one
def test_the_report_has_the_shape_that_is_documented(expected: Expected, folder: Path) -> None:
    report = reported(expected, folder)
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(report, SCHEMA)
    known = parse_mission(expected.mission.read_bytes(), "mission").elements
    for violation in report["violations"]:
        steps = [*violation["steps"], *violation["loop"]]
        named = {each for step in steps for each in step["passes"]}
        assert (named | {*violation["elements"], *violation["missing"]}) <= set(known)
        assert [step["step"] for step in steps] == [*range(1, len(steps) + 1)]


@every_one
def test_the_engine_does_every_run_of_the_report(
    expected: Expected, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = reported(expected, folder)
    runs = [each for each in report["violations"] if each["steps"]]
    for number, run in enumerate(runs, 1):
        capsys.readouterr()
        words = ["replay", "--counterexample", report_of(expected, folder), "--violation", number]
        assert run_command_line([*map(str, words)]) == 0, run["text"]
        out, _ = capsys.readouterr()
        assert f"step {run['steps'][-1]['step']}: " in out


@every_one
def test_its_picture_is_as_it_would_be_drawn_now(expected: Expected) -> None:
    now = drawn(expected)
    assert expected.picture.read_text(encoding="utf-8") == now, "run `make pictures`"
    hashed = sha256(expected.mission.read_bytes()).hexdigest()
    assert f"Drawn from {expected.mission.name}, SHA-256 {hashed}" in now
    drawing = etree.fromstring(now.encode())
    ids = {each.get("data-element-id") for each in drawing.iter("{*}g")}
    assert expected.elements <= ids


@every_one
def test_the_page_shows_it_and_where_it_is_found(expected: Expected) -> None:
    where = ", ".join(f"`{each}`" for each in sorted(expected.elements))
    link = f"[{expected.name}](broken/{expected.name}.bpmn)"
    assert f"| {link} | `{expected.asked}` | {where} |" in PAGE
    assert f"](broken/{expected.name}.svg)" in PAGE


def test_nothing_else_is_among_them() -> None:
    names = {each.name for each in EXPECTED}
    assert {path.stem for path in BROKEN.iterdir()} == names
    assert len(names) == 10
