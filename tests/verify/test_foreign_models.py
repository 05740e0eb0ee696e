"""Models that others drew are checked within limits: each is decided or undecided, or refused.

`M2PEM_CORPORA` names a folder of them; without it only the project's own are checked.
"""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tools.corpora.models import models
from tools.corpora_verification.counting import Counts
from tools.corpora_verification.judging import Terms
from tools.corpora_verification.measuring import measure_all
from tools.corpora_verification.sketches import read_sketch

ROOT = Path(__file__).parents[2]
CORPORA = os.environ.get("M2PEM_CORPORA", "")
TERMS = Terms()
SKETCH = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">
  <process id="P">
    <startEvent id="S"/><task id="Dig"/><endEvent id="E"/>
    <boundaryEvent id="Late" attachedToRef="Dig"><timerEventDefinition/></boundaryEvent>
    <sequenceFlow id="s" sourceRef="S" targetRef="Dig"/>
    <sequenceFlow id="d" sourceRef="Dig" targetRef="E"/>
    <sequenceFlow id="l" sourceRef="Late" targetRef="E"/>
    <sequenceFlow id="nowhere" sourceRef="Late"/>
  </process>
</definitions>"""


def checked(folder: Path, terms: Terms = TERMS, but: str = "") -> Counts:
    """What became of the models of a folder, but for those of a folder in it."""
    counts = Counts(terms)
    chosen = [path for path in models(folder) if not but or but not in path.parts]
    for found in measure_all(chosen, terms):
        counts.add(found)
    return counts


def test_what_a_sketch_leaves_unsaid_is_filled_in(tmp_path: Path) -> None:
    (tmp_path / "sketch.bpmn").write_bytes(SKETCH)
    counts = checked(tmp_path)
    assert counts.wrong == []
    assert (counts.kinds["decided"], counts.kinds["no violation"]) == (1, 1)
    assert dict(counts.filled) == {"timer-time": 1, "dangling-reference": 1}


def test_as_drawn_a_sketch_is_refused_for_what_it_leaves_unsaid(tmp_path: Path) -> None:
    (tmp_path / "sketch.bpmn").write_bytes(SKETCH)
    counts = checked(tmp_path, Terms(as_drawn=True))
    assert counts.kinds == {"refused": 1}
    assert set(counts.refused) == {"timer-time", "dangling-reference"}


def test_what_is_drawn_wrong_is_not_filled_in(tmp_path: Path) -> None:
    wrong = SKETCH.replace(b'targetRef="E"/>', b'targetRef="S"/>', 1)
    (tmp_path / "wrong.bpmn").write_bytes(wrong)
    counts = checked(tmp_path)
    assert counts.wrong == []
    assert counts.kinds == {"refused": 1}


def test_a_task_of_a_sketch_takes_time() -> None:
    mission, _ = read_sketch(SKETCH, "sketch.bpmn")
    assert type(mission.elements["Dig"]).__name__ == "ServiceTask"


def test_a_file_that_takes_too_much_memory_is_told(tmp_path: Path) -> None:
    branches = "".join(
        f'<task id="T{n}"/><endEvent id="E{n}"/>'
        f'<sequenceFlow id="t{n}" sourceRef="S" targetRef="T{n}"/>'
        f'<sequenceFlow id="e{n}" sourceRef="T{n}" targetRef="E{n}"/>'
        for n in range(8)
    )
    wide = SKETCH.replace(b'<startEvent id="S"/>', b'<startEvent id="S"/>' + branches.encode())
    (tmp_path / "wide.bpmn").write_bytes(wide)
    assert checked(tmp_path).wrong == []
    counts = checked(tmp_path, Terms(memory_mb=1))
    assert len(counts.wrong) == 1
    assert " MB" in counts.wrong[0]


@pytest.mark.parametrize(
    ("does", "said"),
    [
        (lambda *_: os._exit(7), "the process ended with 7"),
        (lambda *_: time.sleep(60), "it hangs"),
        (lambda *_: int("gone"), "ValueError: invalid literal"),
    ],
    ids=["dies", "hangs", "raises"],
)
def test_a_crash_costs_one_file_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, does: Callable[..., object], said: str
) -> None:
    (tmp_path / "sketch.bpmn").write_bytes(SKETCH)
    monkeypatch.setattr("tools.corpora_verification.measuring.judge", does)
    counts = checked(tmp_path, Terms(seconds=0.02 if said == "it hangs" else 5.0))
    assert counts.kinds == {"crashed": 1}
    assert said in counts.wrong[0]


@pytest.mark.long
@pytest.mark.skipif(not CORPORA, reason="M2PEM_CORPORA names no folder of foreign BPMN files")
@pytest.mark.timeout(3_600)
@pytest.mark.parametrize("terms", [TERMS, Terms(as_drawn=True)], ids=["filled in", "as drawn"])
def test_every_foreign_model_is_decided_undecided_or_refused_within_limits(terms: Terms) -> None:
    counts = checked(Path(CORPORA), terms)
    assert counts.files
    assert counts.wrong == []


@pytest.mark.parametrize("folder", ["missions", "docs/broken"])
def test_the_missions_of_the_repository_are_decided_within_limits(folder: str) -> None:
    # Those by need are verified with their fleets: one that is made for a mission has too many
    # vehicles for each role (tests/e2e/test_field_missions_by_need.py).
    counts = checked(ROOT / folder, Terms(as_drawn=True), but="by_need")
    assert counts.wrong == []
    assert counts.kinds["decided"] == len(counts.files) > 0
