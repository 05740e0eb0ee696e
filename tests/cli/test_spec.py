"""Requirements that a command line names: runs and rehearsals are monitored for them."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import REPOSITORY, CommandLine

PAIR = (
    REPOSITORY / "missions" / "survey_pair.bpmn",
    "--fleet",
    REPOSITORY / "fleet_configs" / "survey_pair.yaml",
)
WAIT = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">
  <process id="P" isExecutable="true">
    <extensionElements><m2pem:requirement id="ends" ltl="&lt;&gt; ended"/></extensionElements>
    <startEvent id="Start"/>
    <sequenceFlow id="F1" sourceRef="Start" targetRef="Wait"/>
    <intermediateCatchEvent id="Wait"><timerEventDefinition>
      <timeDuration>PT0.2S</timeDuration>
    </timerEventDefinition></intermediateCatchEvent>
    <sequenceFlow id="F2" sourceRef="Wait" targetRef="End"/>
    <endEvent id="End"/>
  </process>
</definitions>
"""
SPEC = """requirements:
  - {id: soon, ltl: "<>[0 s, 0.1 s] completed(Wait)"}
  - {id: later, ltl: "<>[0 s, 9 s] completed(Wait)"}
"""
NO_OPERATOR = ("--fleet", "sim", "--ocu", "none")


@pytest.fixture
def wait(tmp_path: Path) -> Path:
    """A mission that waits 0.2 s, that has one requirement."""
    path = tmp_path / "wait.bpmn"
    path.write_text(WAIT, encoding="utf-8")
    return path


def spec(folder: Path, *requirements: str) -> Path:
    path = folder / "spec.yaml"
    text = "".join(f"  - {each}\n" for each in requirements)
    path.write_text(f"requirements:\n{text}" if requirements else SPEC, encoding="utf-8")
    return path


def records(out: str, name: str) -> list[dict[str, Any]]:
    read = [json.loads(line) for line in out.splitlines()]
    return [each for each in read if each["record"] == name]


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_run_is_monitored_for_those_in_both_files(
    invoke: Invoke, wait: Path, tmp_path: Path, command: str
) -> None:
    more = (*NO_OPERATOR, "--journal", "memory:") if command == "run" else ()
    status, out, _ = invoke(command, wait, *more, "--spec", spec(tmp_path), "--format", "json")
    assert status == 0
    monitored = [each["requirement"] for each in records(out, "RequirementMonitored")]
    assert monitored == ["ends", "soon", "later"]
    decided = records(out, "RequirementDecided")
    assert {each["requirement"]: each["verdict"] for each in decided} == {
        "soon": "violated", "later": "satisfied", "ends": "satisfied",
    }  # fmt: skip
    assert [each["decided_us"] for each in decided if each["requirement"] == "soon"] == [100_000]


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_at_the_end_a_table_says_what_became_of_each(
    invoke: Invoke, wait: Path, tmp_path: Path, command: str
) -> None:
    more = (*NO_OPERATOR, "--journal", "memory:") if command == "run" else ()
    status, out, _ = invoke(command, wait, *more, "--spec", spec(tmp_path))
    assert status == 0
    *_, summary, header, first, _, _ = out.splitlines()
    assert summary == "requirements of r1: 1 violated, 2 satisfied"
    assert header.split() == ["REQUIREMENT", "VERDICT", "SINCE", "WHAT", "WHY"]
    assert " ".join(first.split()) == (
        "soon violated 0.1 s Within 0.1 s 'Wait' is completed its time is over"
    )


def test_the_journal_keeps_them(invoke: Invoke, wait: Path, tmp_path: Path) -> None:
    journal = ("--journal", tmp_path / "journal.db")
    assert invoke("run", wait, *NO_OPERATOR, *journal, "--spec", spec(tmp_path))[0] == 0
    _, out, _ = invoke("replay", "r1", *journal, "--state", "--format", "json")
    found = {each["requirement"]: each for each in json.loads(out)["requirements"]}
    assert found["soon"] == {
        "requirement": "soon",
        "verdict": "violated",
        "since": 0.1,
        "because": "its time is over",
        "english": "Within 0.1 s 'Wait' is completed.",
        "formula": "<>[0 s, 0.1 s] completed(Wait)",
    }
    assert found["later"]["verdict"] == "satisfied"
    _, out, _ = invoke("replay", "r1", *journal, "--state")
    assert "soon         violated   0.1 s" in out
    assert invoke("replay", "r1", *journal, "--verify")[0] == 0


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_two_with_one_id_are_refused(
    invoke: Invoke, wait: Path, tmp_path: Path, command: str
) -> None:
    more = (*NO_OPERATOR, "--journal", tmp_path / "journal.db") if command == "run" else ()
    both = spec(tmp_path, "{id: ends, ltl: '<> completed(Wait)'}")
    status, out, err = invoke(command, wait, *more, "--spec", both)
    assert (status, out) == (2, "")
    assert f"{both}:2: ends: error: {wait} has a requirement of this id too" in err


@pytest.mark.parametrize(
    ("requirement", "says"),
    [
        ("{id: r, ltl: '<> completed(Wiat)'}", "did you mean 'Wait'"),
        ("{id: r, ltl: '<>[0 s, 3] completed(Wait)'}", "bounds are two times with their units"),
        ("{id: r, ltl: '[] battery(uav1) > 20 %'}", "the fleet has no vehicle 'uav1'"),
        ("{id: r, pattern: existance, args: {what: Wait}}", "did you mean 'existence'"),
    ],
)
def test_one_that_cannot_be_read_is_refused_before_a_run_begins(
    invoke: Invoke, wait: Path, tmp_path: Path, requirement: str, says: str
) -> None:
    journal = ("--journal", tmp_path / "journal.db")
    wrong = spec(tmp_path, requirement)
    status, out, err = invoke("run", wait, *NO_OPERATOR, *journal, "--spec", wrong)
    assert (status, out) == (2, "")
    assert f"m2pem: the requirements cannot be used:\n{wrong}:2: requirements[0]." in err
    assert says in err
    assert invoke("runs", *journal, "--format", "json")[1] == "[]\n"


def test_one_about_single_steps_is_left_out_and_named(
    invoke: Invoke, wait: Path, tmp_path: Path
) -> None:
    steps = spec(
        tmp_path, "{id: next, pattern: prompt_reaction, args: {when: Wait, then: 'active(End)'}}"
    )
    status, out, err = invoke("simulate", wait, "--spec", steps, "--format", "json")
    assert status == 0
    assert [each["requirement"] for each in records(out, "RequirementMonitored")] == ["ends"]
    assert "the run is not monitored for next: only `m2pem verify` counts single steps" in err


def test_a_rehearsal_knows_telemetry_from_the_first_moment_on(
    invoke: Invoke, tmp_path: Path
) -> None:
    about = spec(
        tmp_path,
        "{id: charged, ltl: '[] battery(uav1) > 20 %'}",
        "{id: full, ltl: '[] battery(uav1) > 99 %'}",
        "{id: lost, ltl: '<> link(rover1) == lost'}",
    )
    status, out, _ = invoke("simulate", *PAIR, "--spec", about, "--format", "json")
    assert status == 0
    decided = {each["requirement"]: each for each in records(out, "RequirementDecided")}
    assert {key: each["verdict"] for key, each in decided.items()} == {
        "charged": "satisfied", "full": "violated", "lost": "violated",
    }  # fmt: skip
    assert decided["full"]["because"] == "not battery(uav1) > 99 %"
    assert records(out, "RequirementLeftOpen") == []


def test_an_operator_who_comes_later_lists_them(m2pem: CommandLine, tmp_path: Path) -> None:
    mission = tmp_path / "wait.bpmn"
    mission.write_text(WAIT.replace("PT0.2S", "PT1H"), encoding="utf-8")
    words = (mission, *NO_OPERATOR, "--spec", spec(tmp_path), "--format", "json")
    program = m2pem.start("run", *words)
    program.until_record("RequirementDecided", requirement="soon")
    operator = m2pem.start("attach", "--ocu", "plain")
    operator.type("requirements")
    assert operator.until_text("soon is violated") == (
        "soon is violated since 0.1 s: Within 0.1 s 'Wait' is completed (its time is over)"
    )
    assert operator.until_text("later is") == "later is open: Within 9 s 'Wait' is completed"
    operator.type("stop")
    left = program.until_record("RequirementLeftOpen", requirement="later")
    assert left["because"] == "the run was stopped"
    assert program.rest()[0] == 130
