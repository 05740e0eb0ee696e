"""`m2pem debug`: commands on standard input, and what is printed."""

import io
import sys
from collections.abc import Callable

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION

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
