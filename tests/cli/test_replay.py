import json
import re
import sqlite3
from pathlib import Path

import pytest

from m2pem import load_mission
from m2pem.mission.mission import version_of_files
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, MISSION, CommandLine
from tests.engine.notation import xml
from tests.executive.conftest import flow, mission
from tests.verify.test_confirmation import COUNTS as COUNTS_FAR


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.db"


@pytest.fixture
def printed(invoke: Invoke, journal: Path) -> str:
    """What a whole run printed."""
    status, out, _ = invoke(
        "run", MISSION, "--fleet", "sim", "--speed", "100", "--ocu", "none", "--format", "json",
        "--answers", ANSWERS / "vignette1_detection.yaml", "--journal", journal,
        "--data", "mission.speed=2.5",
    )  # fmt: skip
    assert status == 0
    return out


def test_replay_prints_what_the_run_printed(invoke: Invoke, journal: Path, printed: str) -> None:
    assert invoke("replay", "r1", "--journal", journal, "--format", "json") == (0, printed, "")


def test_for_people_it_ends_with_how_the_run_stands(
    invoke: Invoke, journal: Path, printed: str
) -> None:
    status, out, _ = invoke("replay", "r1", "--journal", journal)
    assert status == 0
    assert "  DRIVE ROUTE: evsg1 begins single_vehicle_routing\n" in out
    assert "\nr1 is terminated: terminated by mission ended\n" in out
    assert 'user.decision  "abort"' in out


def test_the_state_alone(invoke: Invoke, journal: Path, printed: str) -> None:
    words = ("replay", "r1", "--journal", journal, "--state")
    status, out, _ = invoke(*words, "--format", "json")
    assert status == 0
    assert json.loads(out) == {
        "run": "r1",
        "status": "terminated",
        "detail": "terminated by mission ended",
        "version": version_of_files(MISSION.read_bytes(), load_mission(MISSION).library),
        "tokens": [],
        "behaviors": [],
        "waiting": [],
        "prompts": [],
        "incidents": [],
        "requirements": [],
        "data": {"mission.speed": 2.5, "user.decision": "abort"},
    }
    assert "begins" not in invoke(*words)[1]


def test_the_state_of_a_run_that_was_interrupted(m2pem: CommandLine) -> None:
    program = m2pem.start(
        "run", MISSION, "--fleet", "sim", "--format", "json",
        "--answers", ANSWERS / "vignette1_route_live.yaml",
    )  # fmt: skip
    program.until_record("PromptOpened")
    program.type("continue")
    program.until_record("BehaviorProgressed", state="RUNNING")
    program.kill()
    state = json.loads(m2pem.run("replay", "r1", "--state", "--format", "json")[1])
    assert state["status"] == "interrupted"
    on = {(token["process"], token["element"]) for token in state["tokens"]}
    assert on == {
        ("VIGNETTE1", "CallDetection"),
        ("DETECTION", "DriveRoute"),
        ("DETECTION", "Detector"),
    }
    (behavior,) = state["behaviors"]
    assert behavior["resources"] == ["evsg1"]
    assert behavior["state"] == "RUNNING"
    out = m2pem.run("replay", "r1", "--state")[1]
    assert "r1 is interrupted" in out
    assert "single_vehicle_routing  evsg1  running" in out


def test_deciding_again_gives_the_same(invoke: Invoke, journal: Path, printed: str) -> None:
    status, out, _ = invoke("replay", "r1", "--journal", journal, "--verify")
    assert status == 0
    count = len(printed.splitlines())
    assert out.startswith("r1: ")
    assert out.endswith(f"inputs decided again, {count} records, all the same\n")


def tamper(journal: Path, old: str, new: str) -> None:
    with sqlite3.connect(journal) as connection:
        changed = connection.execute(
            "UPDATE entries SET body = replace(body, ?, ?) WHERE instr(body, ?)", (old, new, old)
        )
        assert changed.rowcount == 1
    connection.close()


def as_from_before_the_chain(journal: Path) -> None:
    """As an earlier release would have written it, which decided otherwise."""
    with sqlite3.connect(journal) as connection:
        connection.execute("UPDATE entries SET hash = NULL")
        connection.execute("UPDATE standings SET hash = NULL, seal = NULL")
        connection.execute("UPDATE identity SET marked = 0")
    connection.close()
    journal.with_name(f"{journal.name}-mark").unlink()


def test_an_entry_that_was_changed_is_named(invoke: Invoke, journal: Path, printed: str) -> None:
    tamper(journal, '"key":"user.decision","value":"abort"', '"key":"user.decision","value":"go"')
    for words in ((), ("--verify",)):
        status, _, err = invoke("replay", "r1", "--journal", journal, *words)
        assert status == 1
        assert re.search(r"journal\.db: r1, record \d+: it does not follow from what was", err)


def test_the_first_difference_is_printed(invoke: Invoke, journal: Path, printed: str) -> None:
    tamper(journal, '"key":"user.decision","value":"abort"', '"key":"user.decision","value":"go"')
    as_from_before_the_chain(journal)
    words = ("replay", "r1", "--journal", journal, "--verify")
    status, out, _ = invoke(*words)
    assert status == 1
    lines = out.splitlines()
    assert "the same; then PromptAnswer differs at record" in lines[0]
    assert '"value":"go"' in lines[1]
    assert '"value":"abort"' in lines[2]
    status, out, _ = invoke(*words, "--format", "json")
    assert status == 1
    difference = json.loads(out)["difference"]
    assert difference["input"] == "PromptAnswer"
    assert json.loads(difference["journal"])["value"] == "go"
    assert json.loads(difference["decided"])["value"] == "abort"
    assert difference["seq"] == json.loads(difference["journal"])["seq"]


def test_a_record_too_few_is_a_difference(invoke: Invoke, journal: Path, printed: str) -> None:
    with sqlite3.connect(journal) as connection:
        query = "SELECT seq, body FROM entries ORDER BY seq LIMIT 1"
        seq, body = connection.execute(query).fetchone()
        given, records = json.loads(body)
        shorter = json.dumps([given, records[:-1]])
        connection.execute("UPDATE entries SET body = ? WHERE seq = ?", (shorter, seq))
    connection.close()
    as_from_before_the_chain(journal)
    status, out, _ = invoke("replay", "r1", "--journal", journal, "--verify")
    assert status == 1
    assert "journal: no more records" in out


def test_an_unknown_run_is_told_with_those_there_are(
    invoke: Invoke, journal: Path, printed: str
) -> None:
    status, _, err = invoke("replay", "r2", "--journal", journal)
    assert (status, err) == (2, "m2pem: the journal has no run 'r2'; it has r1\n")
    status, _, err = invoke("replay", "nonsense")
    assert (status, err) == (2, "m2pem: the journal has no run 'nonsense'; it has none yet\n")


COUNTS = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/>'
    '<scriptTask id="Zero"><script>n = 0</script></scriptTask><exclusiveGateway id="Again"/>'
    '<scriptTask id="Add"><script>n = n + 1</script></scriptTask>'
    '<exclusiveGateway id="Leave" default="Leave_Again"/><endEvent id="E"/>'
    f"{flow('S', 'Zero')}{flow('Zero', 'Again')}{flow('Again', 'Add')}{flow('Add', 'Leave')}"
    f"{flow('Leave', 'Again')}"
    '<sequenceFlow id="Out" sourceRef="Leave" targetRef="E">'
    "<conditionExpression>n &gt; 1000</conditionExpression></sequenceFlow></process>"
)


def test_a_run_that_did_not_wait_for_thousands_of_steps_is_verified(
    invoke: Invoke, journal: Path
) -> None:
    file = journal.with_name("counts.bpmn")
    file.write_bytes(COUNTS)
    words = ("--fleet", "sim", "--ocu", "none", "--format", "json", "--journal", journal)
    status, out, errors = invoke("run", file, *words)
    assert status == 0, errors
    assert "RunYielded" in out
    status, out, _ = invoke("replay", "r1", "--verify", "--journal", journal)
    assert (status, "all the same" in out) == (0, True), out


def test_verify_and_state_exclude_each_other(invoke: Invoke) -> None:
    assert invoke("replay", "r1", "--verify", "--state")[0] == 2


def test_replay_says_of_a_run_that_the_engine_does_not_follow_it(
    invoke: Invoke, tmp_path: Path
) -> None:
    file, report = tmp_path / "counts.bpmn", tmp_path / "counts.json"
    file.write_text(xml(COUNTS_FAR), encoding="utf-8")
    assert invoke("verify", file, "--report", report)[0] == 4
    status, _, error = invoke("replay", "--counterexample", report)
    assert status == 1
    assert "the engine does not follow" in error
