"""What another engine did, beside what the case says."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from m2pem.mission.values import Value
from tests.cases import Case
from tests.cases.playing import play_case
from tools.conformance.peers import VERBS, Played

_BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
_MARKERS = ("standardLoopCharacteristics", "multiInstanceLoopCharacteristics")
_JOINS = ("parallelGateway", "inclusiveGateway", "complexGateway")


@dataclass(frozen=True, slots=True)
class Verdict:
    """`kind`: same, differs, refuses, hangs, crashes or n.a.; `words`: how, or why."""

    kind: str
    words: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.words}" if self.words else self.kind


def not_asked(case: Case) -> str:
    """Why a case is for m2pem alone; "" when it is not."""
    if case.extension:
        return case.extension
    other = [step.when.verb for step in case.steps if step.when.verb not in VERBS]
    return f"`{other[0]}`" if other else ""


def judge(case: Case, played: Played) -> Verdict:
    """Compare step by step; the first difference counts."""
    if played.refused:
        return Verdict("refuses", played.problem)
    if played.ended in ("hangs", "crashes"):
        return Verdict(played.ended, played.problem)
    if played.data is None and _is_about_data(case):
        return Verdict("n.a.", "leaves data to the application")
    ignored = uncounted(case.file)
    for when, expected, got in _moments(case, played):
        for name in ignored:
            del expected[name], got[name]
        if expected != got:
            return Verdict("differs", _difference(when, expected, got, played))
    if len(played.steps) < len(case.steps):
        return Verdict("differs", played.problem)
    words = _end(case, played) or _data(case.then.data, played)
    return Verdict("differs", words) if words else Verdict("same")


def _is_about_data(case: Case) -> bool:
    return case.topic.parent.name.startswith("10.4")


def _moments(case: Case, played: Played) -> list[tuple[str, Counter[str], Counter[str]]]:
    """What was to be entered and what was, input by input. `advance 0 s` is no input of its own:
    whether a time that has passed is noticed at once or at the next tick is all the same."""
    moments: list[tuple[str, Counter[str], Counter[str]]] = []
    for step, entered in zip(case.steps, played.steps, strict=False):
        if step.when.verb == "advance" and step.when.seconds == 0:
            moments[-1][1].update(step.entered)
            moments[-1][2].update(entered)
        else:
            moments.append((step.when.text, Counter(step.entered), Counter(entered)))
    return moments


def uncounted(file: Path) -> frozenset[str]:
    """Elements whose entering engines count differently, though they do the same.

    At a join some note each token that comes, others when it goes on. Some enter an event
    subprocess as such, others its start event only; some a compensation boundary event when its
    activity has completed. A loop or multi-instance activity is entered as a whole, for each
    instance, or both. What comes after, or is inside, tells them apart.
    """
    root = etree.parse(file).getroot()
    incoming = Counter(flow.get("targetRef") for flow in root.iter(f"{_BPMN}sequenceFlow"))
    joins = {
        str(element.get("id"))
        for tag in _JOINS
        for element in root.iter(f"{_BPMN}{tag}")
        if incoming[element.get("id")] > 1
    }
    inside = {
        str(element.get("id"))
        for element in root.iter(f"{_BPMN}subProcess")
        if element.get("triggeredByEvent") == "true"
    }
    compensation = {
        str(event.get("id"))
        for event in root.iter(f"{_BPMN}boundaryEvent")
        if event.find(f"{_BPMN}compensateEventDefinition") is not None
    }
    looping = {
        str(marker.getparent().get("id"))
        for tag in _MARKERS
        for marker in root.iter(f"{_BPMN}{tag}")
    }
    return frozenset(joins | inside | compensation | looping)


def _difference(when: str, expected: Counter[str], got: Counter[str], played: Played) -> str:
    parts = []
    if missing := list((expected - got).elements()):
        parts.append(f"lacks {' '.join(missing)}")
    if more := list((got - expected).elements()):
        parts.append(f"adds {' '.join(more)}")
    if played.ended == "failed":
        parts.append(f"fails ({played.problem})")
    return f"`{when}` {', '.join(parts)}"


def _end(case: Case, played: Played) -> str:
    """How it ended; a run that m2pem calls stuck is one that never ends."""
    expected = {"terminated": "completed"}.get(str(case.then.ended), str(case.then.ended))
    if expected == played.ended:
        return ""
    if expected == "failed" and play_case(case).detail.startswith("stuck"):
        return "" if played.ended == "running" else f"{_ENDS[played.ended]} though it is stuck"
    problem = f" ({played.problem})" if played.problem else ""
    return f"{_ENDS[played.ended]}{problem}"


_ENDS = {"completed": "completes", "failed": "fails", "running": "does not complete"}


def _data(expected: dict[str, Value] | None, played: Played) -> str:
    if expected is None or played.data is None:
        return ""
    for name, value in expected.items():
        got = played.data.get(name)
        if got != value:
            return f"in the end {name} is {got}, not {value}"
    return ""
