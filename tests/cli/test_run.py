import json
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION

NOBODY = ("--ocu", "none")
MEMORY = ("--journal", "memory:")

TWO = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="x">
  <error id="E" errorCode="WRONG"/>
  <process id="Well" isExecutable="true">
    <startEvent id="StartWell"/>
    <sequenceFlow id="F1" sourceRef="StartWell" targetRef="EndWell"/>
    <endEvent id="EndWell"/>
  </process>
  <process id="Badly" isExecutable="true">
    <startEvent id="StartBadly"/>
    <sequenceFlow id="F2" sourceRef="StartBadly" targetRef="EndBadly"/>
    <endEvent id="EndBadly"><errorEventDefinition errorRef="E"/></endEvent>
  </process>
</definitions>
"""


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """A mission with two processes: the first completes, the other fails."""
    path = tmp_path / "two.bpmn"
    path.write_text(TWO, encoding="utf-8")
    return path


def test_the_exit_status_says_how_it_ended(invoke: Invoke, two: Path) -> None:
    words = ("run", two, "--fleet", FLEET, *NOBODY, *MEMORY)
    status, out, _ = invoke(*words)
    assert status == 0
    assert "r1 completed" in out
    status, out, _ = invoke(*words, "--process", "Badly")
    assert status == 1
    assert "EndBadly: error WRONG (thrown by EndBadly), not caught" in out
    assert "r1 failed" in out


def test_an_unknown_process_is_refused(invoke: Invoke, two: Path) -> None:
    status, out, err = invoke("run", two, "--fleet", FLEET, *NOBODY, "--process", "Nope")
    assert (status, out) == (2, "")
    assert "there is no process 'Nope'; name one of: Well, Badly" in err


def test_warnings_are_printed_before_the_run_starts(invoke: Invoke, tmp_path: Path) -> None:
    mission = tmp_path / "warned.bpmn"
    objects = "".join(f'<dataObject id="D{number}" nmae="x"/>' for number in range(25))
    mission.write_text(TWO.replace("</process>", f"{objects}</process>", 1), encoding="utf-8")
    *warnings, summary = invoke("check", mission, "--fleet", FLEET)[1].splitlines()
    assert "warning" in summary
    assert len(warnings) >= 21  # 20 of a rule, and how many more there are
    status, out, err = invoke("run", mission, "--fleet", FLEET, *NOBODY, *MEMORY)
    assert status == 0
    assert err.splitlines() == warnings
    assert "warning" not in out


def test_data_is_there_from_the_start(invoke: Invoke, two: Path) -> None:
    words = ("--data", "mission.speed=2.5", "--data", "areas=[north]", "--format", "json")
    _, out, _ = invoke("run", two, "--fleet", FLEET, *NOBODY, *MEMORY, *words)
    records = [json.loads(line) for line in out.splitlines()]
    written = {r["key"]: r["value"] for r in records if r["record"] == "DataWritten"}
    assert written == {"mission.speed": 2.5, "areas": ["north"]}
    assert all(record["t"] == 0 for record in records if record["record"] == "DataWritten")


def test_as_json_there_is_one_record_a_line_in_order(invoke: Invoke) -> None:
    answers = ("--answers", ANSWERS / "vignette1_abort.yaml")
    status, out, err = invoke(
        "run", MISSION, "--fleet", "sim", "--ocu", "plain", *MEMORY, *answers, "--format", "json"
    )
    assert status == 0
    records = [json.loads(line) for line in out.splitlines()]
    assert [record["seq"] for record in records] == list(range(1, len(records) + 1))
    assert {record["run"] for record in records} == {"r1"}
    assert list(records[0])[:4] == ["run", "seq", "t", "record"]
    assert "[p1] UserSendRoute" in err  # what an operator's unit prints


def test_the_mission_can_be_a_url(invoke: Invoke, two: Path) -> None:
    assert invoke("run", two.as_uri(), "--fleet", FLEET, *NOBODY, *MEMORY)[0] == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nothing.bpmn", "--fleet", FLEET), "nothing.bpmn cannot be read"),
        ((MISSION, "--fleet", "nothing.yaml"), "nothing.yaml cannot be used as a fleet"),
        ((MISSION, "--fleet", FLEET, "--answers", "nothing.yaml"), "nothing.yaml"),
        ((MISSION, "--fleet", FLEET, "--ocu", "foo"), "there is no ocu 'foo'; known: "),
        ((MISSION, "--fleet", FLEET, "--ocu", "plain,none"), "name units, or `none` alone"),
        ((MISSION, "--fleet", FLEET, "--speed", "0"), "--speed"),
        ((MISSION, "--fleet", FLEET, "--speed", "fast"), "--speed"),
        ((MISSION, "--fleet", FLEET, "--format", "xml"), "--format"),
        ((MISSION,), "--fleet"),
        ((), "MISSION"),
    ],
)
def test_unusable_words_end_with_2(invoke: Invoke, words: tuple[object, ...], said: str) -> None:
    status, out, err = invoke("run", *words)
    assert (status, out) == (2, "")
    assert said in err
    assert "Traceback" not in err


def test_answers_for_another_mission_are_refused(invoke: Invoke, tmp_path: Path) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("answers: {UserSendRout: [abort]}\n")
    status, _, err = invoke("run", MISSION, "--fleet", FLEET, *NOBODY, "--answers", answers)
    assert status == 2
    assert f"{answers}:1: answers.UserSendRout: error:" in err


def test_a_journal_that_cannot_be_made_is_told(invoke: Invoke, tmp_path: Path) -> None:
    journal = tmp_path / "no" / "journal.db"
    status, _, err = invoke("run", MISSION, "--fleet", FLEET, *NOBODY, "--journal", journal)
    assert status == 2
    assert f"the folder {journal.parent} does not exist" in err


def test_nothing_is_left_beside_the_journal_of_a_run_that_ended(
    invoke: Invoke, tmp_path: Path
) -> None:
    answers = ("--answers", ANSWERS / "vignette1_detection.yaml", "--speed", "100")
    assert invoke("run", MISSION, "--fleet", FLEET, *NOBODY, *answers)[0] == 0
    names = {path.name for path in (tmp_path / "m2pem").iterdir()}
    assert names == {"journal.db", "journal.db-lock", "journal.db-mark", "journal.db-control"}
    assert list((tmp_path / "m2pem" / "journal.db-control").iterdir()) == []
