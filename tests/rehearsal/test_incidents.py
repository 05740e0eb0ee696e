"""Every error of a simulated vehicle, and every scripted choice about it, on the virtual clock."""

from dataclasses import replace

import msgspec
import pytest

from m2pem.api.runs import RunStatus
from m2pem.bpmn import parse_mission
from m2pem.engine import records as r
from m2pem.errors import AnswersError
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import ErrorPolicy
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import RehearsalResult, rehearse
from tests.engine.notation import xml

PATROL = parse_mission(
    xml("""
    <startEvent id="start"/> <endEvent id="end"/> <endEvent id="away"/>
    <scriptTask id="go">do drive_stop ugv1</scriptTask>
    <scriptTask id="back">do drive_stop ugv1</scriptTask> <task id="home"/>
    <boundaryEvent id="recall" attachedToRef="go">signal R</boundaryEvent>
    start -> go -> back -> end
    recall -> home -> away
""").encode(),
    "patrol.bpmn",
)


def fleet(on_error: ErrorPolicy = ErrorPolicy.INCIDENT) -> Fleet:
    names = [ResourceId(name) for name in ("ugv1", "ugv2")]
    vehicles = {name: Vehicle(name, Domain.GROUND, "sim", {}) for name in names}
    return replace(Fleet("two", "two.yaml", vehicles), on_error=on_error)


def rehearsed(answers: object, on_error: ErrorPolicy = ErrorPolicy.INCIDENT) -> RehearsalResult:
    text = msgspec.yaml.encode(answers) if isinstance(answers, dict) else answers
    assert isinstance(text, bytes)
    return rehearse(PATROL, fleet(on_error), plugins=PluginManager(), answers=text)


def failing(code: str, *entries: dict[str, object]) -> dict[str, object]:
    end = "lost" if code == "LINK_LOST" else "failed"
    first = {"after": "5 s", "end": end, "error": code}
    return {
        "behaviors": {"go": [first, {"after": "1 s", "end": "succeeded"}]},
        "incidents": {"go": list(entries)},
    }


CODES = (
    "FAILED",
    "REJECTED",
    "TIMEOUT",
    "LINK_LOST",
    "BATTERY_LOW",
    "ROUTE_BLOCKED",
    "RESOURCE_UNAVAILABLE",
    "TAKEN_OVER",
)
CHOICES: dict[str, dict[str, object]] = {
    "retry": {"data": {"tries": 1}},
    "retry_with": {"roles": {"role1": ["ugv2"]}, "after": "30 s"},
    "skip": {},
    "move": {"to": "home"},
    "end": {},
}


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("code", CODES)
def test_every_error_can_be_answered_with_every_choice(code: str, choice: str) -> None:
    result = rehearsed(failing(code, {"choice": choice, **CHOICES[choice]}))
    records = [each.record for each in result.records]
    (opened,) = [each for each in records if isinstance(each, r.IncidentOpened)]
    (resolved,) = [each for each in records if isinstance(each, r.IncidentResolved)]
    assert (opened.code, opened.element, opened.resources) == (code, "go", ("ugv1",))
    assert (resolved.choice, resolved.by) == (choice, "answers file")
    assert result.summary.status is (RunStatus.FAILED if choice == "end" else RunStatus.COMPLETED)
    requested = [each for each in records if isinstance(each, r.BehaviorRequested)]
    expected = {
        "retry": [("go", "ugv1"), ("go", "ugv1"), ("back", "ugv1")],
        "retry_with": [("go", "ugv1"), ("go", "ugv2"), ("back", "ugv1")],
        "skip": [("go", "ugv1"), ("back", "ugv1")],
        "move": [("go", "ugv1")],
        "end": [("go", "ugv1")],
    }
    assert [(each.element, each.resources[0]) for each in requested] == expected[choice]
    if choice == "retry":
        assert any(isinstance(each, r.IncidentUpdated) for each in records)
    if choice == "retry_with":
        times = [each.t_s for each in result.records if isinstance(each.record, r.IncidentResolved)]
        assert times == [35.0]


def test_an_incident_without_a_script_ends_the_rehearsal_as_without_incidents() -> None:
    answers = failing("ROUTE_BLOCKED")
    stopped, plain = rehearsed(answers), rehearsed(answers, ErrorPolicy.END)
    assert stopped.summary.status is plain.summary.status is RunStatus.FAILED
    assert stopped.summary.detail == plain.summary.detail


def test_answers_about_incidents_of_no_element_are_refused() -> None:
    with pytest.raises(AnswersError, match="no element with tokens 'gp'"):
        rehearsed({"incidents": {"gp": [{"choice": "skip"}]}})
    with pytest.raises(AnswersError, match="'to' goes with 'choice: move'"):
        rehearsed({"incidents": {"go": [{"choice": "skip", "to": "home"}]}})
