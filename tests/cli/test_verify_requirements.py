"""`m2pem verify` with requirements: in a file of their own, and in the mission's."""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from m2pem.verify.net.petri_net import Action
from m2pem.verify.search.explore import Progress
from tests.cli.conftest import Invoke
from tests.cli.test_verify import wide
from tests.command_line import REPOSITORY

PAIR = REPOSITORY / "missions" / "survey_pair.bpmn"
ON_PAIR = ("--fleet", REPOSITORY / "fleet_configs" / "survey_pair.yaml")
SCHEMA = json.loads((REPOSITORY / "docs" / "verification.schema.json").read_bytes())
SPEC = """
requirements:
  - {id: home, ltl: "[](completed(ReturnUav1) -> [] !commanded(uav1))"}
  - {id: two-each, text: both halves by each, pattern: visits_at_least,
     args: {resource: each, behavior: area_survey, times: 2}}
  - {id: step, pattern: prompt_reaction, args: {when: TakeoffUav1, then: 'active(SurveyWest)'}}
"""
LOOP = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="loop"><process id="Loop">
  <extensionElements>
    <m2pem:requirement id="ends" ltl="&lt;&gt; ended"/>
    <m2pem:requirement id="ends-if-fair" ltl="&lt;&gt; ended" fair="true"/>
  </extensionElements>
  <startEvent id="Start"/><sequenceFlow id="a" sourceRef="Start" targetRef="Merge"/>
  <exclusiveGateway id="Merge"/><sequenceFlow id="b" sourceRef="Merge" targetRef="Ask"/>
  <userTask id="Ask"><extensionElements><m2pem:userTask><m2pem:prompt>Again?</m2pem:prompt>
    <m2pem:decision value="again"/><m2pem:decision value="enough"/></m2pem:userTask>
  </extensionElements></userTask>
  <sequenceFlow id="c" sourceRef="Ask" targetRef="Decide"/>
  <exclusiveGateway id="Decide" default="e"/>
  <sequenceFlow id="d" sourceRef="Decide" targetRef="Merge">
    <conditionExpression>user.decision == 'again'</conditionExpression></sequenceFlow>
  <sequenceFlow id="e" sourceRef="Decide" targetRef="End"/><endEvent id="End"/>
</process></definitions>"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    file = tmp_path / "spec.yaml"
    file.write_text(SPEC, encoding="utf-8")
    return file


@pytest.fixture
def loop(tmp_path: Path) -> Path:
    file = tmp_path / "loop.bpmn"
    file.write_text(LOOP, encoding="utf-8")
    return file


def required(out: str) -> dict[str, dict[str, Any]]:
    """The requirements of a report as JSON, by id."""
    report = json.loads(out)
    jsonschema.validate(report, SCHEMA)
    return {each["property"]: each for each in report["properties"] if each["required"]}


def verdicts(out: str) -> dict[str, str]:
    return {name: each["verdict"] for name, each in required(out).items()}


def test_the_schema_of_reports_has_every_action() -> None:
    found: list[list[str]] = []
    waiting: list[Any] = [SCHEMA]
    for each in waiting:
        if isinstance(each, dict):
            found += [each["action"]["enum"]] if "enum" in each.get("action", {}) else []
            waiting += each.values()
        elif isinstance(each, list):
            waiting += each
    assert found
    assert all(sorted(each) == sorted(Action) for each in found)


def test_each_requirement_has_a_line_in_plain_english(invoke: Invoke, spec: Path) -> None:
    status, out, _ = invoke("verify", PAIR, *ON_PAIR, "--spec", spec)
    assert status == 1
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert "holds home Whenever 'UAV1 RETURNS' is completed, never uav1 is commanded." in lines
    assert (
        "violated two-each/uav1 uav1 completes area_survey at 2 different places at least." in lines
    )
    assert "for: both halves by each" in lines
    assert any(line.startswith("two-each/uav1: broken by this run") for line in lines)


def test_a_run_that_goes_on_for_ever_is_told_with_what_goes_on(invoke: Invoke, loop: Path) -> None:
    status, out, _ = invoke("verify", loop, "--format", "json")
    assert status == 1
    assert verdicts(out) == {"ends": "violated", "ends-if-fair": "holds"}
    violation = next(each for each in json.loads(out)["violations"] if each["required"])
    assert violation["property"] == "ends"
    told = [step["text"] for step in violation["loop"]]
    assert "user task Ask: the operator answers 'again'" in told
    assert len(violation["steps"]) + 1 == violation["loop"][0]["step"]


def test_the_engine_does_the_run_that_breaks_a_requirement(
    invoke: Invoke, spec: Path, tmp_path: Path
) -> None:
    report, picture = tmp_path / "found.json", tmp_path / "found.svg"
    words = ("--report", report, "--report", picture)
    invoke("verify", PAIR, *ON_PAIR, "--spec", spec, *words)
    assert invoke("replay", "--counterexample", report, *ON_PAIR)[0] == 0
    drawing = picture.read_text(encoding="utf-8")
    assert "uav1 completes area_survey at 2 different places at least" in drawing


def test_spin_answers_what_it_can_and_a_note_says_what_it_cannot(
    invoke: Invoke, spec: Path, loop: Path
) -> None:
    for words in ((PAIR, *ON_PAIR, "--spec", spec), (loop,)):
        ours = invoke("verify", *words, "--format", "json")
        spins = invoke("verify", *words, "--format", "json", "--engine", "spin")
        assert (ours[0], spins[0]) == (1, 1)
        assert verdicts(spins[1]) == verdicts(ours[1])
        notes = " ".join(json.loads(spins[1])["coverage"]["notes"])
        name = "step" if words[0] == PAIR else "ends-if-fair"
        assert f"Spin cannot answer {name}: the built-in search did" in notes


def test_all_that_is_wrong_with_requirements_is_told_and_nothing_is_checked(
    invoke: Invoke, spec: Path, tmp_path: Path
) -> None:
    wrong = SPEC.replace("ReturnUav1", "RetrunUav1").replace("prompt_reaction", "promt_reaction")
    spec.write_text(wrong, encoding="utf-8")
    status, out, err = invoke("verify", PAIR, *ON_PAIR, "--spec", spec)
    assert (status, out) == (2, "")
    assert "spec.yaml:3" in err
    assert "did you mean 'ReturnUav1'" in err
    assert "did you mean 'prompt_reaction'" in err
    assert invoke("verify", PAIR, "--spec", tmp_path / "none.yaml")[0] == 2


def test_a_search_cut_short_leaves_requirements_undecided(
    invoke: Invoke, spec: Path, tmp_path: Path
) -> None:
    mission = tmp_path / "wide.bpmn"
    mission.write_text(wide(12), encoding="utf-8")
    spec.write_text('requirements: [{id: h, ltl: "[] !ended(failed)"}]', encoding="utf-8")
    words = ("verify", mission, "--spec", spec, "--max-states", "1500", "--format", "json")
    status, out, _ = invoke(*words)
    assert status == 3
    assert required(out)["h"]["verdict"] == "undecided"
    assert required(out)["h"]["note"] == "the search stopped at the limit of states"


def test_ctrl_c_ends_the_search_of_requirements_too(
    invoke: Invoke, spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pressed(searched: Progress) -> None:
        if searched.states > 1_000:
            raise KeyboardInterrupt

    monkeypatch.setattr("m2pem.cli.verify.progress", lambda: nullcontext(pressed))
    mission = tmp_path / "wide.bpmn"
    mission.write_text(wide(12), encoding="utf-8")
    spec.write_text('requirements: [{id: h, ltl: "[] !ended(failed)"}]', encoding="utf-8")
    status, out, _ = invoke("verify", mission, "--spec", spec, "--format", "json")
    assert status == 3
    assert required(out)["h"]["note"] == "not begun, after an interruption by hand"
