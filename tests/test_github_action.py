"""The action of deploy/github-action: its file, and what its steps do."""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

REPOSITORY = Path(__file__).parents[1]
ACTION = REPOSITORY / "deploy" / "github-action" / "action.yml"
PAGE = REPOSITORY / "docs" / "verification.md"
GOOD = "missions/vignette1.bpmn"
BROKEN = "docs/broken/dead_task.bpmn"


@pytest.fixture
def action() -> dict[str, Any]:
    read: dict[str, Any] = YAML(typ="safe").load(ACTION)
    return read


class Workspace:
    """A clone in which steps are run as a runner of the action runs them."""

    def __init__(self, folder: Path, action: dict[str, Any]) -> None:
        self.folder, self.action = folder, action
        for name in (GOOD, BROKEN, "fleet_configs/vignette1.yaml"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(REPOSITORY / name, folder / name)
        for part in ("geo", "routes"):
            shutil.copytree(REPOSITORY / "fleet_configs" / part, folder / "fleet_configs" / part)
        commands = folder / "bin"
        commands.mkdir()
        (commands / "m2pem").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m m2pem "$@"\n')
        (commands / "m2pem").chmod(0o755)
        self.path = f"{commands}:{os.environ['PATH']}"

    def run(self, name: str, **inputs: str) -> tuple[int, str]:
        """Exit status and output of a step. `inputs`: others have their defaults."""
        (step,) = [each for each in self.action["runs"]["steps"] if each["name"] == name]
        given = {key: each.get("default", "") for key, each in self.action["inputs"].items()}
        given |= inputs
        variables = {
            key: re.sub(r"\$\{\{ inputs\.(\w+) \}\}", lambda found: given[found[1]], value)
            for key, value in step["env"].items()
        }
        assert step["shell"] == "bash"
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            cwd=self.folder,
            env={**os.environ, "PATH": self.path, "PYTHONPATH": str(REPOSITORY), **variables},
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout + done.stderr

    def sarif(self) -> dict[str, list[str]]:
        """By file, the rules of its errors."""
        logs = {
            file.name: json.loads(file.read_text(encoding="utf-8"))
            for file in sorted((self.folder / "m2pem-sarif").iterdir())
        }
        return {
            name: [r["ruleId"] for r in log["runs"][0]["results"] if r["level"] == "error"]
            for name, log in logs.items()
        }


@pytest.fixture
def workspace(tmp_path: Path, action: dict[str, Any]) -> Workspace:
    return Workspace(tmp_path, action)


def test_the_file_is_an_action(action: dict[str, Any]) -> None:
    schema = resources.files("check_jsonschema").joinpath(
        "builtin_schemas/vendor/github-actions.json"
    )
    jsonschema.validate(action, json.loads(schema.read_text(encoding="utf-8")))
    for step in action["runs"]["steps"]:
        assert subprocess.run(["bash", "-n", "-c", step["run"]], check=False).returncode == 0


def test_the_page_names_its_inputs(action: dict[str, Any]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    section = text[text.index("## In CI") : text.index("## Playing a run")]
    assert re.findall(r"^\| `(\w+)` \|", section, re.M) == list(action["inputs"])
    (example,) = re.findall(r"^```yaml\n(.*?)^```", section, re.M | re.S)
    steps = YAML(typ="safe").load(example)["steps"]
    (used,) = [step for step in steps if step["uses"] == "./deploy/github-action"]
    assert used["with"].keys() <= action["inputs"].keys()
    assert sorted(REPOSITORY.glob(used["with"]["missions"]))
    assert (REPOSITORY / used["with"]["fleet"]).exists()


def test_missions_that_hold_pass(workspace: Workspace) -> None:
    inputs = {"missions": "missions/**/*.bpmn", "fleet": "fleet_configs/vignette1.yaml"}
    assert workspace.run("Check", **inputs)[0] == 0
    assert workspace.run("Verify", **inputs)[0] == 0
    assert workspace.sarif() == {"missions-vignette1.sarif": []}
    assert workspace.run("Verify", **inputs, strict="true")[0] == 1
    assert workspace.sarif()["missions-vignette1.sarif"]


def test_a_violation_fails_and_the_other_missions_are_verified(workspace: Workspace) -> None:
    status, said = workspace.run("Verify", missions=f"{BROKEN}\n{GOOD}\n")
    assert status == 1
    assert "no-dead-element: SurveyField" in said
    found = workspace.sarif()
    assert "no-dead-element" in found["docs-broken-dead_task.sarif"]
    assert found["missions-vignette1.sarif"] == []


def test_a_mission_with_errors_fails_the_check(workspace: Workspace) -> None:
    (workspace.folder / "missions" / "no.bpmn").write_text("<no/>", encoding="utf-8")
    assert workspace.run("Check", missions="missions/*.bpmn")[0] == 1
    assert workspace.run("Verify", missions="missions/*.bpmn")[0] == 1
    assert workspace.sarif() == {"missions-vignette1.sarif": []}


def test_a_pattern_without_a_file_is_refused(workspace: Workspace) -> None:
    status, said = workspace.run("Check", missions="mission/*.bpmn")
    assert status == 2
    assert "no file matches the input missions: mission/*.bpmn" in said
