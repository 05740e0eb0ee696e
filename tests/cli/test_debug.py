"""`m2pem debug`: commands on standard input, and what is printed."""

import io
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from m2pem.cli.debug import DebugShell
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION
from tests.engine.notation import xml
from tests.rehearsal.test_debugging import debugged

DETECTION = (MISSION, "--fleet", FLEET, "--answers", ANSWERS / "vignette1_detection.yaml")
Printed = Callable[..., list[str]]


@pytest.fixture
def printed(invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> Printed:
    """Give commands, and return the lines that they print."""

    def run(*commands: str, options: tuple[str, ...] = ()) -> list[str]:
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{each}\n" for each in commands)))
        status, out, err = invoke("debug", *DETECTION, *options)
        assert (status, err) == (0, "")
        return [line.strip() for line in out.splitlines()]

    return run


def test_it_begins_before_the_first_step(printed: Printed) -> None:
    assert printed("quit") == ["0.0 s  next is StartVignette1"]


def test_steps_and_places(printed: Printed) -> None:
    lines = printed("step 3", "where", "data")
    assert lines[-5:] == [
        "0.0 s  next is DETECTION",
        "CallDetection (DETECTION)",
        "0.0 s  next is DETECTION",
        "VIGNETTE1 (VIGNETTE1):",
        "user.decision = 'continue'",
    ]


def test_data_of_stores_and_of_each_instance(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = """
        <dataStore id="seen" name="seen"/> <process id="MAIN" isExecutable="true">
        <startEvent id="start"/> <endEvent id="end"/> <scriptTask id="write">seen = 2</scriptTask>
        <dataStoreReference id="memory" dataStoreRef="seen"/>
        <userTask id="ask">ask a b<each m2pem:collection="['x', 'y']" m2pem:elementVariable="item">
        </each></userTask>
        start -> write -> ask -> end
        </process>
    """
    file = tmp_path / "two.bpmn"
    file.write_text(xml(text), encoding="utf-8")
    monkeypatch.setattr(sys, "stdin", io.StringIO("step 3\ndata\n"))
    _, out, _ = invoke("debug", file)
    assert out.splitlines()[-6:] == [
        "  data stores:",
        "    seen = 2",
        "  ask (ask), instance 0:",
        "    item = 'x'",
        "  ask (ask), instance 1:",
        "    item = 'y'",
    ]


def test_an_expression_is_printed_with_its_kind_or_what_fails_in_it(printed: Printed) -> None:
    lines = printed(
        "step 3",
        "print user.decision",
        "print = armed",
        "print ${user.decision + 1}",
        "print = 1 +",
        "print",
    )
    assert lines[-5:] == [
        '"continue" (text)',
        "null: armed is not set",
        "the text 'continue' is no number, in 'user.decision + 1' at column 3 of "
        "'${user.decision + 1}', where user.decision is the text 'continue'",
        "expected a value, found the end at column 6 of '= 1 +'",
        "an expression is missing",
    ]


def test_names_of_the_data_are_completed() -> None:
    with debugged() as session:
        session.step()
        shell = DebugShell(session)
        shell.onecmd("step 2")
        assert shell.complete_print("user.", "print user.", 6, 11) == ["user.decision"]
        assert shell.complete_print("x", "print x", 6, 7) == []


def test_breakpoints_are_listed_and_deleted(printed: Printed) -> None:
    lines = printed(
        "break Reverse DriveRoute", "clear Reverse", "break when n > 3", "clear", "break"
    )
    assert lines[1:3] == ["Reverse (REVERSE)", "DriveRoute (DRIVE ROUTE)"]
    assert lines[3:5] == ["DriveRoute (DRIVE ROUTE)", "when n > 3"]
    assert lines[5:] == ["no breakpoints"]


def test_a_condition_stops_it_and_a_time_is_gone_back_to(printed: Printed) -> None:
    options = ("--when", "detection.type == 'camera'")
    lines = printed("continue", "back 5 s", "records 2", options=options)
    became = "detection.type == 'camera' has become true; next is Source of detection?"
    assert f"5.0 s  {became}" in lines
    assert any(line.startswith("5.0 s  next is") for line in lines)


def test_another_way_is_taken(printed: Printed) -> None:
    lines = printed(
        "break Reverse",
        "continue",
        "vehicles",
        "end Reverse failed 3 BLOCKED",
        "continue",
        "back",
        "continue",
    )
    ends = [line for line in lines if line.startswith("the run has ended:")]
    assert "BLOCKED" in ends[0]
    assert "terminated" in ends[1]


def test_what_is_wrong_is_said_and_ends_nothing(printed: Printed) -> None:
    lines = printed(
        "stp",
        "break Revers",
        "set a",
        "answer UserSendRoute",
        "answer UserSendRoute maybe",
        "end Reverse succeeded 3 CODE",
        "step x",
        "continue",
        "step",
    )
    assert lines[1].startswith("there is no command 'stp'; did you mean 'step'")
    assert "did you mean 'Reverse'?" in lines[2]
    assert "it takes ELEMENT DECISION" in lines
    assert any("has no decision 'maybe'" in line for line in lines)
    assert any("'error' goes with" in line for line in lines)
    assert lines[-1] == "the run has ended: go back to a moment before"
