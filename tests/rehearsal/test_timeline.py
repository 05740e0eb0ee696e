"""What a Gantt chart shows is what the records say."""

import pytest

from m2pem.api.runs import StampedRecord
from m2pem.engine import records as r
from m2pem.mission.catalogue import BehaviorState
from m2pem.rehearsal.timeline import Mark, Outcome, Span, Timeline, read_timeline

TASK = (1, "P", "Drive", 1)


def timeline(*records: tuple[float, r.Record]) -> Timeline:
    return read_timeline(
        StampedRecord("r1", seq, t_s, record) for seq, (t_s, record) in enumerate(records, 1)
    )


def requested(behavior: str, *resources: str) -> r.BehaviorRequested:
    return r.BehaviorRequested(*TASK, behavior, "goto", "vehicle", resources, {}, {})


def ended(behavior: str, state: BehaviorState, code: str = "") -> r.BehaviorEnded:
    return r.BehaviorEnded(*TASK, behavior, state, code)


@pytest.mark.parametrize(
    ("state", "code", "outcome"),
    [
        (BehaviorState.SUCCEEDED, "", Outcome.SUCCEEDED),
        (BehaviorState.CANCELLED, "", Outcome.INTERRUPTED),
        (BehaviorState.FAILED, "FAILED", Outcome.FAILED),
        (BehaviorState.REJECTED, "REJECTED", Outcome.FAILED),
        (BehaviorState.LOST, "LINK_LOST", Outcome.FAILED),
    ],
)
def test_a_behavior_lasts_from_its_request_to_its_end_on_each_resource(
    state: BehaviorState, code: str, outcome: Outcome
) -> None:
    line = timeline((1.5, requested("r1.b1", "a", "b/ptz")), (4.0, ended("r1.b1", state, code)))
    span = Span(1.5, 4.0, "goto", "Drive", outcome, code)
    assert line.resources == {"a": [span], "b/ptz": [span]}


def asked(allocation: str) -> r.AllocationRequested:
    return r.AllocationRequested(*TASK, allocation, "goto", "vehicle", {}, 0, 0)


def test_a_task_that_waits_for_resources_has_a_span_from_when_it_asked() -> None:
    line = timeline(
        (1.0, asked("r1.a1")),
        (1.0, asked("r1.a2")),
        (1.0, asked("r1.a3")),
        (1.5, r.AllocationDelayed("r1.a2", "uav1 is held by r2.b1", {"uav1": "r2.b1"})),
        (2.0, r.AllocationDelayed("r1.a3", "nothing is free", {})),
        (2.0, r.ResourcesAllocated(*TASK, "r1.a1", {"scout": ("uav2",)}, {})),
        (4.0, r.ResourcesAllocated(*TASK, "r1.a2", {"scout": ("uav1",)}, {})),
        (5.0, r.AllocationEnded("r1.a3", "RESOURCE_UNAVAILABLE")),
    )
    assert line.waits == [
        Span(1.0, 4.0, "goto", "Drive", Outcome.SUCCEEDED, "uav1"),
        Span(1.0, 5.0, "goto", "Drive", Outcome.FAILED, "RESOURCE_UNAVAILABLE"),
    ]


def test_prompts_and_services_are_spans_too() -> None:
    line = timeline(
        (0.0, r.PromptOpened(1, "P", "Ask", 1, "p1", "Go?", ())),
        (0.0, r.PromptOpened(1, "P", "Ask", 1, "p2", "Go?", ())),
        (1.0, r.ServiceRequested(1, "P", "Look", 1, "s1", "Detector", {}, {})),
        (2.0, r.PromptAnswered(1, "P", "Ask", 1, "p1", "continue", "kim")),
        (3.0, r.PromptWithdrawn("p2")),
        (4.0, r.ServiceEnded(1, "P", "Look", 1, "s1", "BROKEN")),
        (5.0, r.ServiceRequested(1, "P", "Look", 1, "s2", "Detector", {}, {})),
        (6.0, r.ServiceWithdrawn("s2")),
    )
    assert line.prompts == [
        Span(0.0, 2.0, "continue", "Ask", Outcome.ANSWERED, "by kim"),
        Span(0.0, 3.0, "", "Ask", Outcome.INTERRUPTED, "withdrawn"),
    ]
    assert line.services == [
        Span(1.0, 4.0, "Detector", "Look", Outcome.FAILED, "BROKEN"),
        Span(5.0, 6.0, "Detector", "Look", Outcome.INTERRUPTED),
    ]


def test_what_has_not_ended_lasts_to_the_last_record() -> None:
    line = timeline(
        (0.0, r.RunStarted("P", 7)), (1.0, requested("r1.b1", "a")), (9.0, r.InputIgnored("late"))
    )
    assert line.resources["a"] == [Span(1.0, 9.0, "goto", "Drive", Outcome.OPEN)]
    assert (line.process, line.started_us, line.end_s, line.ended_s) == ("P", 7, 9.0, None)


def test_a_run_may_end_before_its_last_behavior_is_released() -> None:
    line = timeline(
        (1.0, requested("r1.b1", "a")),
        (2.0, r.RunEnded(r.RunOutcome.FAILED, "why")),
        (3.0, ended("r1.b1", BehaviorState.CANCELLED)),
    )
    assert (line.ended_s, line.end_s, line.outcome, line.detail) == (2.0, 3.0, "failed", "why")


def test_what_is_thrown_is_marked_with_where_it_comes_from() -> None:
    uuid = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"
    line = timeline(
        (1.0, r.SignalThrown(uuid, 1, "P", "Throw", 1)),
        (2.0, r.SignalThrown(uuid, by="kim")),
        (3.0, r.MessageThrown("go", by="kim")),
        (4.0, r.EscalationThrown(1, "P", "End", 1, "e1", "HAZARD")),
        (5.0, r.ErrorThrown(1, "P", "Drive", 1, "ROUTE_BLOCKED", "a tree")),
    )
    assert line.marks == [
        Mark(1.0, "signal", "Throw", uuid),
        Mark(2.0, "signal", "dc45ff2b\u2026 by kim", uuid),
        Mark(3.0, "message", "go by kim", "go"),
        Mark(4.0, "escalation", "End", "HAZARD"),
        Mark(5.0, "error", "ROUTE_BLOCKED from Drive", "a tree"),
    ]
