"""What tests of missions found: as text, as data (JSON), and as JUnit XML for CI services."""

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

from m2pem.coverage.adding import yaml_of
from m2pem.coverage.items import PLURALS, Kind
from m2pem.coverage.mission_test import MissionReport, NeverSeen, Outcome
from m2pem.coverage.suggesting import Suggestion
from m2pem.coverage.suite import Unusable

VERSION = 1
"""Of the data. It counts up when something that is there changes its meaning or goes."""

Report = MissionReport | Unusable

# --- text -----------------------------------------------------------------------------------------


def text_of(report: Report) -> Iterator[str]:
    """Yield the lines about one mission."""
    if isinstance(report, Unusable):
        yield f"{report.mission}: cannot be tested"
        yield from (f"  {line}" for line in report.error.splitlines())
        return
    count = len(report.outcomes)
    yield f"{report.mission}: {_counted(count, 'scenario') if count else 'no scenarios'}"
    for outcome in report.outcomes:
        verdict = "FAILED" if outcome.differences else "passed"
        yield f"  {verdict}  {outcome.title} ({outcome.status.value}, {outcome.took_s:.0f} s)"
        yield from (f"          {each}" for each in outcome.differences)
    if not count and not report.suggestions and report.unnamed:
        failed = "FAILED  " if report.complete else ""
        yield f"  {failed}none of its {len(report.items)} elements and flows is seen"
        return
    shares = [(PLURALS[kind], *report.seen_of(kind)) for kind in Kind]
    yield "  seen: " + ", ".join(f"{seen} of {all_} {name}" for name, seen, all_ in shares if all_)
    for key in report.stale:
        yield f"  FAILED  unreached: {key} is reached"
    yield from _never_lines(report)
    for number, each in enumerate(report.suggestions, 1):
        yield f"  suggestion {number} ({each.ended}{f': {each.detail}' if each.detail else ''})"
        yield f"    reaches {', '.join(item.id for item in each.reaches)}"
        text = yaml_of(each.answers) if each.answers else "without an answers file"
        yield from (f"    {line}" for line in text.splitlines())


def _never_lines(report: MissionReport) -> Iterator[str]:
    if not report.never:
        return
    groups: dict[tuple[bool, str], dict[Kind, list[str]]] = {}
    for never in report.never:
        group = groups.setdefault((never.named, never.reason), {})
        group.setdefault(never.item.kind, []).append(never.item.id)
    for (named, reason), kinds in sorted(groups.items()):
        verdict = "FAILED  " if report.complete and not named else ""
        yield f"  {verdict}never seen ({reason}):"
        for kind, ids in kinds.items():
            yield f"    {PLURALS[kind]}: {', '.join(ids)}"


def coverage_problems(report: MissionReport) -> list[str]:
    """Return what of the coverage is not as the file of scenarios says, a line for each."""
    problems = [f"unreached: {key} is reached" for key in report.stale]
    if report.complete:
        problems += [f"never seen: {each.item.label}: {each.reason}" for each in report.unnamed]
    return problems


def summary_of(reports: Sequence[Report]) -> str:
    """Return the last line."""
    tested = [each for each in reports if isinstance(each, MissionReport)]
    outcomes = [outcome for each in tested for outcome in each.outcomes]
    failed = sum(bool(each.differences) for each in outcomes)
    never = sum(len(each.never) for each in tested)
    unnamed = sum(len(each.unnamed) for each in tested)
    items = sum(len(each.items) for each in tested)
    words = [_counted(len(tested), "mission"), _counted(len(outcomes), "scenario")]
    words.append(f"{failed} failed")
    words.append(f"{items - never} of {items} items seen, {unnamed} neither seen nor named")
    if unusable := len(reports) - len(tested):
        words.append(f"{_counted(unusable, 'mission')} cannot be tested")
    return ", ".join(words)


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" + ("s" if count != 1 else "")


def exit_status_of(reports: Sequence[Report]) -> int:
    """0: all passed; 1: something has failed; 2: a file cannot be used."""
    if any(isinstance(each, Unusable) for each in reports):
        return 2
    return int(any(isinstance(each, MissionReport) and not each.passed for each in reports))


# --- data -----------------------------------------------------------------------------------------


def as_data(reports: Sequence[Report]) -> dict[str, Any]:
    """Return all reports as data."""
    return {
        "version": VERSION,
        "passed": exit_status_of(reports) == 0,
        "missions": [_mission(each) for each in reports],
    }


def _mission(report: Report) -> dict[str, Any]:
    said = {
        "mission": str(report.mission),
        "scenarios": str(report.scenarios) if report.scenarios is not None else None,
    }
    if isinstance(report, Unusable):
        return {**said, "passed": False, "error": report.error}
    return {
        **said,
        "passed": report.passed,
        "error": "",
        "outcomes": [_outcome(each) for each in report.outcomes],
        "coverage": {
            kind.value: dict(zip(("seen", "all"), report.seen_of(kind), strict=True))
            for kind in Kind
        },
        "never": [_never(each) for each in report.never],
        "stale": [*report.stale],
        "suggestions": [_suggestion(each) for each in report.suggestions],
        "states": report.states,
        "stopped": report.searched or None,
    }


def _outcome(outcome: Outcome) -> dict[str, Any]:
    return {
        "scenario": outcome.title,
        "line": outcome.line,
        "passed": not outcome.differences,
        "differences": [*outcome.differences],
        "ended": outcome.status.value,
        "took_s": outcome.took_s,
        "seen": sorted(outcome.seen),
    }


def _never(never: NeverSeen) -> dict[str, Any]:
    item = never.item
    return {
        "kind": item.kind.value,
        "id": item.id,
        "file": item.file,
        "line": item.line,
        "reason": never.reason,
        "named": never.named,
    }


def _suggestion(suggestion: Suggestion) -> dict[str, Any]:
    return {
        "reaches": [item.key for item in suggestion.reaches],
        "ended": suggestion.ended,
        "detail": suggestion.detail,
        "answers": suggestion.answers,
    }


# --- JUnit XML ------------------------------------------------------------------------------------


def junit_of(reports: Sequence[Report]) -> bytes:
    """Return JUnit XML: a suite for each mission, a case for each scenario and for its coverage."""
    root = ElementTree.Element("testsuites", name="m2pem test")
    for report in reports:
        suite = ElementTree.SubElement(root, "testsuite", name=_printable(str(report.mission)))
        if isinstance(report, Unusable):
            case = _case(suite, report, "mission")
            _problem(case, "error", report.error)
        else:
            for outcome in report.outcomes:
                case = _case(suite, report, outcome.title, outcome.took_s)
                if outcome.differences:
                    _problem(case, "failure", "\n".join(outcome.differences))
            case = _case(suite, report, "coverage")
            if problems := coverage_problems(report):
                _problem(case, "failure", "\n".join(problems))
        for name, tag in (("failures", "failure"), ("errors", "error")):
            suite.set(name, str(len(suite.findall(f"testcase/{tag}"))))
        suite.set("tests", str(len(suite)))
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text


def _case(
    suite: ElementTree.Element, report: Report, name: str, took_s: float = 0.0
) -> ElementTree.Element:
    return ElementTree.SubElement(
        suite,
        "testcase",
        classname=_printable(str(report.mission)),
        name=_printable(name),
        time=f"{took_s:.3f}",
    )


def _problem(case: ElementTree.Element, tag: str, text: str) -> None:
    problem = ElementTree.SubElement(case, tag, message=_printable(text.partition("\n")[0]))
    problem.text = _printable(text)


def _printable(text: str) -> str:
    """The text with only characters that XML 1.0 allows."""
    return "".join(each if each.isprintable() or each == "\n" else "\ufffd" for each in text)
