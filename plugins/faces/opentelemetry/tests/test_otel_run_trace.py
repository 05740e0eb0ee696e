"""The spans of runs: one tree a run, with the times of its records and ids that stay the same."""

from collections.abc import Sequence

import pytest
from m2pem_plugin_opentelemetry.run_trace import RunTrace, root_id
from m2pem_plugin_opentelemetry.spans import MAX_EVENTS, MAX_TEXT, Span

from m2pem import rehearse_async
from m2pem.api import records as r
from m2pem.api.run_view import RunView
from m2pem.api.runs import RunStatus, RunSummary, StampedRecord
from m2pem.engine.inputs import IncidentChoice
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.scripting.run_result import RunResult
from tests.command_line import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
RUNS = {
    "behaviors of a team": (
        "missions/mehds_vignette_4.bpmn",
        "fleet_configs/mehds.yaml",
        "missions/answers/mehds_vignette_4_advanced.yaml",
    ),
    "a fault that ends a behavior": (
        "missions/survey_pair.bpmn",
        "fleet_configs/survey_pair.yaml",
        "missions/answers/survey_pair_lost.yaml",
    ),
    "a process that is called": (
        "examples/t08_reuse/mission.bpmn",
        "examples/t08_reuse/fleet.yaml",
        None,
    ),
    "an event subprocess": (
        "examples/t18_event_subprocess/mission.bpmn",
        "sim",
        "examples/t18_event_subprocess/answers.yaml",
    ),
    "compensation": (
        "examples/t19_compensation/mission.bpmn",
        "sim",
        "examples/t19_compensation/answers_abort.yaml",
    ),
    "loops and instances": (
        "examples/t20_loops/mission.bpmn",
        "examples/t20_loops/fleet.yaml",
        "examples/t20_loops/answers.yaml",
    ),
}


async def rehearsed(name: str) -> RunResult:
    mission, fleet, answers = RUNS[name]
    return await rehearse_async(
        REPOSITORY / mission,
        fleet if fleet == "sim" else REPOSITORY / fleet,
        answers=None if answers is None else REPOSITORY / answers,
    )


def spans_of(result: RunResult) -> list[Span]:
    """The spans of a run that has ended, in the order in which they ended."""
    return built(result.records, result.summary, result.mission)


def built(
    records: Sequence[StampedRecord],
    summary: RunSummary,
    mission: Mission | None = None,
    *,
    whole: bool = True,
) -> list[Span]:
    view = RunView(summary, mission)
    spans: list[Span] = []

    def keep(span: Span, _: r.Record) -> None:
        spans.append(span)

    trace: RunTrace | None = None
    for stamped in records:
        view.apply(stamped)
        if isinstance(stamped.record, r.RunStarted):
            trace = RunTrace(view, stamped.record, keep, whole=whole)
        assert trace is not None
        trace.apply(stamped)
    assert trace is not None
    assert trace.is_over
    return spans


def assert_one_tree(spans: Sequence[Span]) -> None:
    by_id = {each.span_id: each for each in spans}
    assert len(by_id) == len(spans)
    assert len({each.trace_id for each in spans}) == 1
    assert sum(each.parent_id is None for each in spans) == 1
    for each in spans:
        assert each.began_us <= each.ended_us
        if each.parent_id is not None:
            assert by_id[each.parent_id].began_us <= each.began_us


@pytest.mark.parametrize("name", RUNS)
async def test_a_run_is_one_tree_with_the_times_of_its_records(name: str) -> None:
    result = await rehearsed(name)
    spans = spans_of(result)
    assert_one_tree(spans)
    root = next(each for each in spans if each.parent_id is None)
    assert (root.began_us, root.ended_us) == (result.summary.started_us, result.summary.ended_us)
    zero_us = result.summary.started_us
    requested = {
        each.record.behavior: each
        for each in result.records
        if isinstance(each.record, r.BehaviorRequested)
    }
    ended = {
        each.record.behavior: each
        for each in result.records
        if isinstance(each.record, r.BehaviorEnded)
    }
    behaviors = {
        each.attributes["m2pem.behavior.id"]: each
        for each in spans
        if "m2pem.behavior.state" in each.attributes
    }
    assert requested.keys() == ended.keys() == behaviors.keys()
    for behavior, span in behaviors.items():
        began, over = requested[str(behavior)], ended[str(behavior)]
        assert span.seq == began.seq
        assert span.began_us == zero_us + round(began.t_s * 1e6)
        assert span.ended_us == zero_us + round(over.t_s * 1e6)
        assert span.attributes["m2pem.behavior.state"] == over.record.state.value


async def test_the_same_records_give_the_same_spans() -> None:
    result = await rehearsed("behaviors of a team")
    first, again = (spans_of(result) for _ in range(2))
    assert first == again
    assert root_id(first[0].trace_id) in {each.span_id for each in first}


async def test_a_mission_that_cannot_be_read_still_gives_a_tree() -> None:
    result = await rehearsed("compensation")
    assert_one_tree(built(result.records, result.summary))


async def test_what_is_measured_alone_has_the_ids_and_times_of_the_whole_tree() -> None:
    result = await rehearsed("behaviors of a team")
    whole = {each.span_id: each for each in spans_of(result)}
    measured = built(result.records, result.summary, result.mission, whole=False)
    kinds = ("m2pem.behavior.state", "m2pem.prompt.decision")
    expected = {
        key: (each.began_us, each.ended_us)
        for key, each in whole.items()
        if any(kind in each.attributes for kind in kinds) or each.parent_id is None
    }
    assert {each.span_id: (each.began_us, each.ended_us) for each in measured} == expected


def test_a_span_keeps_a_bounded_number_of_events() -> None:
    span = Span("x", 1, 1, 0, None, {})
    for number in range(MAX_EVENTS + 7):
        span.add("again", number, reason="x" * 5000)
    assert (len(span.events), span.events_dropped) == (MAX_EVENTS, 7)
    assert span.events[0].attributes == {"m2pem.reason": "x" * MAX_TEXT}


def stamped(*records: r.Record) -> list[StampedRecord]:
    return [StampedRecord("r1", seq, float(seq), each) for seq, each in enumerate(records, 1)]


def test_pauses_attempts_answers_and_incidents_are_told() -> None:
    place = {"token": 1, "process": "P", "element": "T", "scope": 1}
    records = stamped(
        r.RunStarted("P", 5_000_000, "anna"),
        r.ScopeOpened(1, "P", "P"),
        r.TokenEntered(**place),
        r.BehaviorRequested(
            **place,
            behavior="r1.b1",
            name="goto",
            type="vehicle",
            resources=("ugv1",),
            roles={},
            parameters={},
        ),
        r.BehaviorProgressed("r1.b1", 1, BehaviorState.RUNNING),
        r.RunPaused(10_000_000, "ben"),
        r.RunResumed(25_000_000, "ben"),
        r.BehaviorRestarted("r1.b1", 2, "ben"),
        r.BehaviorEnded(**place, behavior="r1.b1", state=BehaviorState.FAILED, code="STUCK"),
        r.IncidentOpened(
            **place,
            incident="r1.i1",
            code="STUCK",
            reason="mud",
            choices=(IncidentChoice.END,),
        ),
        r.PromptOpened(**place, prompt="r1.p1", text="Go on?", decisions=()),
        r.PromptAnswered(**place, prompt="r1.p1", decision="no", by="carl"),
        r.IncidentResolved(**place, incident="r1.i1", choice=IncidentChoice.END, by="carl"),
        r.RunEnded(r.RunOutcome.FAILED, "STUCK: mud"),
    )
    spans = built(records, RunSummary("r1", "m.bpmn", "P", RunStatus.FAILED, 5_000_000))
    assert_one_tree(spans)
    by_name = {each.name: each for each in spans}
    goto = by_name["goto"]
    assert [each.name for each in goto.events] == ["RUNNING", "held", "resumed", "attempt"]
    assert [each.at_us for each in goto.events][1:3] == [10_000_000, 25_000_000]
    assert goto.error == "STUCK"
    assert by_name["prompt"].attributes["m2pem.operator.name"] == "carl"
    assert by_name["prompt"].attributes["m2pem.prompt.decision"] == "no"
    incident = by_name["incident STUCK"]
    assert incident.error == "STUCK: mud"
    assert incident.attributes["m2pem.incident.choice"] == "end"
    assert by_name["run m.bpmn"].error == "STUCK: mud"
    assert {each.name for each in spans if not each.error} == {"prompt", "scope P", "T"}


def test_what_is_left_of_a_behavior_is_linked_to_it() -> None:
    place = {"token": 1, "process": "P", "element": "T", "scope": 1}

    def requested(behavior: str, *resources: str) -> r.Record:
        return r.BehaviorRequested(
            **place,
            behavior=behavior,
            name=behavior,
            type="vehicle",
            resources=resources,
            roles={},
            parameters={},
        )

    def over(behavior: str, state: BehaviorState) -> r.Record:
        return r.BehaviorEnded(**place, behavior=behavior, state=state, code="")

    records = stamped(
        r.RunStarted("P", 5_000_000),
        r.TokenEntered(**place),
        requested("r1.b1", "ugv1"),
        r.WorkReassigned(
            **place,
            behavior="r1.b1",
            code="LINK_LOST",
            reason="no telemetry",
            parameters={},
            excluded=("ugv1",),
        ),
        over("r1.b1", BehaviorState.LOST),
        requested("r1.b2", "ugv2"),
        over("r1.b2", BehaviorState.SUCCEEDED),
        r.RunEnded(r.RunOutcome.COMPLETED, ""),
    )
    spans = built(records, RunSummary("r1", "m.bpmn", "P", RunStatus.COMPLETED, 5_000_000))
    by_name = {each.name: each for each in spans}
    (link,) = by_name["r1.b2"].links
    assert link.span_id == by_name["r1.b1"].span_id
    assert by_name["r1.b1"].error == "LOST"
