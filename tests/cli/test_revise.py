"""`m2pem revise`: the plan is shown before anything is done. tests/e2e/test_revise.py has real
executives."""

import io
import json
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

from m2pem.api.revision import RevisionEffect, RevisionPreview, RevisionRefusal
from m2pem.api.runs import IncidentPreview, IncidentVerdict
from m2pem.control_socket import client
from m2pem.errors import StuckError
from tests.cli.conftest import Invoke

MISSION = Path(__file__).parents[2] / "missions" / "vignette1.bpmn"
PLAN = RevisionPreview(
    "r1",
    "new.bpmn",
    "d1",
    "b" * 64,
    "a" * 64,
    ("new: script task 'Land' (L)",),
    (RevisionEffect("restarts", "Go", 1, "parameter speed of script task Go changes"),),
    outlook=IncidentPreview(IncidentVerdict.COMPLETES),
)
REFUSED = RevisionPreview(
    "r1",
    "new.bpmn",
    "d2",
    "b" * 64,
    "a" * 64,
    refusals=(RevisionRefusal("Go", 1, "a token is on script task Go", ("Land",)),),
)


class Executive:
    """What it is asked to do, and what it answers."""

    def __init__(self) -> None:
        self.preview = PLAN
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.refusal: Exception | None = None

    def ask_driver(self, journal: Path, run: str, method: str, **params: Any) -> Any:
        self.asked.append((method, params))
        if method == "plan_revision":
            return msgspec.to_builtins(self.preview)
        if self.refusal is not None:
            raise self.refusal
        return None

    @property
    def done(self) -> list[dict[str, Any]]:
        return [params for method, params in self.asked if method == "revise"]


@pytest.fixture
def executive(monkeypatch: pytest.MonkeyPatch) -> Executive:
    made = Executive()
    monkeypatch.setattr(client, "ask_driver", made.ask_driver)
    return made


def test_the_plan_is_shown_and_nothing_is_done(invoke: Invoke, executive: Executive) -> None:
    status, out, _ = invoke("revise", "r1", MISSION, "--plan")
    assert status == 0
    assert out == (
        "r1: from version aaaaaaaaaaaa to bbbbbbbbbbbb\n"
        "  new: script task 'Land' (L)\n"
        "what becomes of the run:\n"
        "  restarts: parameter speed of script task Go changes\n"
        "after it, the mission completes on all paths from there\n"
    )
    assert executive.done == []


def test_without_a_terminal_it_must_be_confirmed(invoke: Invoke, executive: Executive) -> None:
    status, _, err = invoke("revise", "r1", MISSION)
    assert (status, err) == (1, "m2pem: r1 is not revised. --yes does it\n")
    assert executive.done == []
    status, _, err = invoke("revise", "r1", MISSION, "--yes", "--by", "anna")
    assert (status, err) == (0, "r1 goes on with version bbbbbbbbbbbb\n")
    (done,) = executive.done
    assert (done["plan"], done["by"], done["even_if_stuck"]) == ("d1", "anna", False)
    assert done["mission"].source == MISSION.read_bytes()


@pytest.mark.parametrize(("typed", "done"), [("y\n", 1), ("n\n", 0)])
def test_on_a_terminal_it_is_asked(
    invoke: Invoke, executive: Executive, monkeypatch: pytest.MonkeyPatch, typed: str, done: int
) -> None:
    terminal = io.StringIO(typed)
    terminal.isatty = lambda: True  # type: ignore[method-assign]  # as if it were one
    monkeypatch.setattr(sys, "stdin", terminal)
    assert invoke("revise", "r1", MISSION)[0] == 1 - done
    assert len(executive.done) == done


def test_what_is_refused_ends_with_1(invoke: Invoke, executive: Executive) -> None:
    executive.preview = REFUSED
    status, out, err = invoke("revise", "r1", MISSION, "--yes")
    assert status == 1
    assert "refused: a token is on script task Go\n" in out
    assert err == "m2pem: r1 is not revised\n"
    assert executive.done == []


def test_tokens_are_moved_and_ended(invoke: Invoke, executive: Executive) -> None:
    words = ("--move", "Go=Land", "--end", "Scan", "--plan", "--format", "json")
    status, out, _ = invoke("revise", "r1", MISSION, *words)
    assert status == 0
    assert executive.asked[0][1]["moves"] == {"Go": "Land", "Scan": ""}
    assert json.loads(out)["is_possible"] is True


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--move", "Go"), "not of the form ELEMENT=TARGET"),
        (("--move", "Go=A", "--move", "Go=B"), "Go can go to one element only"),
        (("--move", "Go=A", "--end", "Go"), "cannot both move and end"),
        (("--plan", "--yes"), "give one of both"),
    ],
)
def test_wrong_words_are_refused(
    invoke: Invoke, executive: Executive, words: tuple[str, ...], said: str
) -> None:
    status, _, err = invoke("revise", "r1", MISSION, *words)
    assert status == 2
    assert said in err
    assert executive.asked == []


def test_a_version_that_cannot_complete_needs_a_confirmation(
    invoke: Invoke, executive: Executive
) -> None:
    executive.refusal = StuckError("r1 is not revised: the mission cannot complete from there")
    status, _, err = invoke("revise", "r1", MISSION, "--yes")
    assert status == 1
    assert err.endswith("--even-if-stuck does it all the same\n")
