"""Models whose verdicts are known from another checker: m2pem says the same, or why it does not.

`M2PEM_CORPORA` names a folder of BPMN files with `expected.json` in it: for each model (paths from
the folder) what was found elsewhere, 1 or 0 for each of `safe`, `proper_completion`,
`option_to_complete` and `no_dead_activities`. docs/verification-internals.md explains the
disagreements.
"""

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest

from m2pem.bpmn import parse_mission
from m2pem.verify.check import Report, check
from m2pem.verify.properties.results import Verdict
from m2pem.verify.translate import Options

if not os.environ.get("M2PEM_CORPORA"):
    pytest.skip("M2PEM_CORPORA names no folder of foreign BPMN files", allow_module_level=True)

CORPORA = Path(os.environ["M2PEM_CORPORA"])
KNOWN: dict[str, dict[str, Any]] = {
    name: verdicts
    for file in sorted(CORPORA.rglob("expected.json"))
    for name, verdicts in json.loads(file.read_text(encoding="utf-8")).items()
}
DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "verification-internals.md").read_text(encoding="utf-8")
ASKED = {
    "safe": "one-token",
    "proper_completion": "proper-completion",
    "option_to_complete": "can-complete",
    "no_dead_activities": "no-dead-element",
}
DISAGREEMENTS = {
    "e020.bpmn": {"option_to_complete", "no_dead_activities"},
    "livelock.bpmn": {"safe", "proper_completion"},
}
"""By file: what the other checker is asked and answers otherwise."""

NOTHING_WRONG: set[str] = set()


def named(file: str) -> str:
    """The text of the model with a file name."""
    path = next(CORPORA / name for name in KNOWN if name.endswith(f"/{file}"))
    return path.read_text(encoding="utf-8")


def checked(text: str, process: str | None = None, *, all_pools: bool = False) -> Report:
    mission = parse_mission(text.encode(), "model.bpmn")
    return check(mission, process=process, options=Options(all_pools=all_pools))


def violated(report: Report) -> set[str]:
    return {each.property for each in report.results if each.verdict is Verdict.VIOLATED}


@pytest.mark.parametrize("name", KNOWN)
def test_a_model_gets_the_verdicts_that_are_known_but_for_those_explained(name: str) -> None:
    found = violated(checked((CORPORA / name).read_text(encoding="utf-8")))
    said = {asked: int(ASKED[asked] not in found) for asked in ASKED.keys() & KNOWN[name].keys()}
    differ = {asked for asked, answer in said.items() if answer != KNOWN[name][asked]}
    file = Path(name).name
    assert differ == DISAGREEMENTS.get(file, NOTHING_WRONG)
    assert not differ or f"`{file}`" in PAGE


@pytest.mark.parametrize("name", KNOWN)
def test_where_all_pools_begin_the_verdicts_are_those_that_are_known(name: str) -> None:
    text = (CORPORA / name).read_text(encoding="utf-8")
    found = violated(checked(text, all_pools=True))
    said = {asked: int(ASKED[asked] not in found) for asked in ASKED.keys() & KNOWN[name].keys()}
    differ = {asked for asked, answer in said.items() if answer != KNOWN[name][asked]}
    expected = DISAGREEMENTS["livelock.bpmn"] if name.endswith("/livelock.bpmn") else NOTHING_WRONG
    assert differ == expected


def test_two_pools_without_triggers_hold_all_when_both_are_begun() -> None:
    text = named("e020.bpmn")
    assert "no-deadlock" in violated(checked(text))
    tag = re.search(r"</(\w+:)?definitions>", text)
    assert tag is not None
    both = "".join(
        f'<sequenceFlow id="Both{n}" sourceRef="{source}" targetRef="{target}"/>'
        for n, (source, target) in enumerate(
            [
                ("Begin", "Fork"),
                ("Fork", "CallStudent"),
                ("Fork", "CallCompany"),
                ("CallStudent", "Join"),
                ("CallCompany", "Join"),
                ("Join", "Over"),
            ]
        )
    )
    process = (
        '<process xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" id="Both">'
        '<startEvent id="Begin"/><parallelGateway id="Fork"/><parallelGateway id="Join"/>'
        '<callActivity id="CallStudent" calledElement="Student_"/>'
        f'<callActivity id="CallCompany" calledElement="Company_"/><endEvent id="Over"/>{both}'
        "</process>"
    )
    # Pictures would name none of the elements that are added.
    without_diagram = re.sub(r"<(\w+:)BPMNDiagram.*</\1BPMNDiagram>", "", text, flags=re.S)
    report = checked(without_diagram.replace(tag[0], process + tag[0]), "Both")
    assert report.judged(strict=True) is Verdict.HOLDS
    assert report.found.stopped is None


def test_tokens_meet_where_the_tasks_of_the_round_take_time() -> None:
    text = named("livelock.bpmn")
    assert "one-token" not in violated(checked(text))
    timed = re.sub(r"<(/?)task\b", r"<\1userTask", text)
    assert timed != text
    assert {"one-token", "proper-completion", "can-complete"} <= violated(checked(timed))


def test_every_property_is_asked_of_some_model() -> None:
    asked = {each for verdicts in KNOWN.values() for each in verdicts}
    assert asked >= ASKED.keys()
