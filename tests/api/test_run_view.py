"""A run folded from its records: elements, behaviors, prompts, waits and status."""

from collections.abc import Iterable
from typing import Any

import pytest

from m2pem.api import BehaviorState, RunStatus, RunSummary, RunView, StampedRecord, parse_mission
from m2pem.api import records as r
from m2pem.api.run_view import NEWEST, Changes
from m2pem.engine.inputs import PromptAnswer, SignalReceived, StartRun
from m2pem.engine.run import MissionRun

P = "Process"


def folded(*records: Any, every_s: float = 1.0) -> RunView:
    """The view after records, one a second."""
    view = RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0))
    apply(view, records, every_s)
    return view


def apply(view: RunView, records: Iterable[Any], every_s: float = 1.0) -> None:
    for record in records:
        seq = view.seq + 1
        view.apply(StampedRecord("r1", seq, seq * every_s, record))


def enter(token: int, element: str, **more: Any) -> r.TokenEntered:
    return r.TokenEntered(token=token, process=P, element=element, scope=1, **more)


def leave(token: int, element: str, outcome: str = "completed", **more: Any) -> r.TokenLeft:
    return r.TokenLeft(
        token=token, process=P, element=element, scope=1, outcome=r.TokenOutcome(outcome), **more
    )


def shown(view: RunView, element: str) -> tuple[int, int, float, bool, bool]:
    state = view.elements[P, element]
    return state.active, state.hits, state.last, state.failed, state.asking


def test_tokens_are_counted_as_they_come_and_go() -> None:
    view = folded(enter(1, "A"), enter(2, "A"), leave(1, "A"))
    assert shown(view, "A") == (1, 2, 3.0, False, False)
    assert view.seq == 3


def test_an_element_has_failed_until_it_is_entered_again() -> None:
    view = folded(enter(1, "A"), leave(1, "A", "failed"))
    assert shown(view, "A") == (0, 1, 2.0, True, False)
    apply(view, [enter(2, "A")])
    assert shown(view, "A") == (1, 2, 3.0, False, False)


def test_of_a_loop_its_instances_are_counted_and_not_what_waits_around_them() -> None:
    opened = r.ScopeOpened(scope=2, process=P, element="A", parent=1, token=1, instances=2)
    view = folded(enter(1, "A"), opened, enter(2, "A", instance=0), enter(3, "A", instance=1))
    assert shown(view, "A")[:2] == (2, 2)
    apply(view, [leave(2, "A", instance=0), leave(3, "A", instance=1), leave(1, "A")])
    assert shown(view, "A")[:2] == (0, 2)


def test_where_the_run_is_paused_to_look_at_it_is_shown_until_it_goes_on() -> None:
    at_a = r.BreakpointsSet(("A",), ("n > 3",))
    reached = r.BreakpointReached(r.StopReason.BREAKPOINT, 1, P, "A", 1)
    view = folded(at_a)
    view.changes = Changes()
    apply(view, [enter(1, "A")])
    assert not view.changes.debugging
    apply(view, [reached, r.RunPaused(3)])
    assert view.changes.debugging == {"reached"}
    assert (view.breakpoints, view.reached, view.stepping) == (at_a, reached, False)
    view.changes.clear()
    apply(view, [r.BreakpointsSet(("A",), ("n > 3",), step=True), r.RunResumed(3)])
    assert view.changes.debugging == {"breakpoints", "reached", "stepping"}
    assert (view.reached, view.stepping) == (None, True)
    apply(view, [reached, r.RunPaused(3)])
    assert (view.reached, view.stepping) == (reached, False)
    apply(view, [r.BreakpointsSet()])
    assert view.breakpoints is None


def test_a_run_that_has_ended_is_stopped_nowhere_and_makes_no_step() -> None:
    reached = r.BreakpointReached(r.StopReason.STEP, 1, P, "A", 1)
    view = folded(enter(1, "A"), reached, r.RunPaused(3), r.RunEnded(r.RunOutcome.STOPPED, ""))
    assert view.reached is None
    view = folded(r.BreakpointsSet(step=True), r.RunEnded(r.RunOutcome.COMPLETED, ""))
    assert not view.stepping


def test_a_subprocess_is_active_while_its_scope_is() -> None:
    opened = r.ScopeOpened(scope=2, process=P, element="Sub", parent=1, token=1)
    view = folded(enter(1, "Sub"), opened, enter(2, "Inner"))
    assert shown(view, "Sub")[:2] == (1, 1)


def asks(prompt: str, element: str = "A") -> r.PromptOpened:
    return r.PromptOpened(
        token=1, process=P, element=element, scope=1, prompt=prompt, text="?", decisions=()
    )


def answers(prompt: str, element: str = "A") -> r.PromptAnswered:
    return r.PromptAnswered(
        token=1, process=P, element=element, scope=1, prompt=prompt, decision="go", by="anna"
    )


def test_an_element_asks_while_one_of_its_prompts_is_open() -> None:
    view = folded(enter(1, "A"), asks("p1"), asks("p2"), answers("p1"))
    assert shown(view, "A")[4]
    assert set(view.prompts) == {"p2"}
    apply(view, [r.PromptWithdrawn(prompt="p2")])
    assert not shown(view, "A")[4]
    assert view.prompts == {}


def test_behaviors_are_known_from_request_to_end() -> None:
    wanted = r.BehaviorRequested(
        token=1, process=P, element="A", scope=1, behavior="r1.b1", name="goto", type="vehicle",
        resources=("ugv1",), roles={}, parameters={},
    )  # fmt: skip
    view = folded(enter(1, "A"), wanted)
    assert view.behaviors["r1.b1"].resources == ("ugv1",)
    assert view.behaviors["r1.b1"].since_s == 2.0
    view.changes = Changes()
    ended = r.BehaviorEnded(
        token=1, process=P, element="A", scope=1, behavior="r1.b1",
        state=BehaviorState.SUCCEEDED, code="",
    )  # fmt: skip
    apply(view, [ended])
    assert view.behaviors == {}
    assert view.changes.behaviors == {"r1.b1"}
    assert view.behavior("r1.b1") is not None, "describe needs its name"


def asks_for_resources(allocation: str, token: int = 1) -> r.AllocationRequested:
    return r.AllocationRequested(token, P, "A", 1, allocation, "goto", "vehicle", {}, 0, 0)


def test_an_element_waits_while_a_task_of_it_has_no_resources() -> None:
    view = folded(enter(1, "A"), enter(2, "A"), asks_for_resources("a1"))
    assert not view.elements[P, "A"].waiting  # nothing says yet that they are not free
    apply(view, [r.AllocationDelayed("a1", "uav1 is held by r2.b1", {"uav1": "r2.b1"})])
    assert view.elements[P, "A"].waiting
    ((waiting,),) = [each.allocations for each in view.active()]
    assert (waiting.name, waiting.since_s, waiting.holders) == ("goto", 3.0, {"uav1": "r2.b1"})
    apply(view, [asks_for_resources("a2", 2), r.AllocationDelayed("a2", "nothing is free", {})])
    given = r.ResourcesAllocated(1, P, "A", 1, "a1", {"scout": ("uav1",)}, {})
    apply(view, [given])
    assert view.elements[P, "A"].waiting
    apply(view, [r.AllocationEnded("a2", "RESOURCE_UNAVAILABLE")])
    assert not view.elements[P, "A"].waiting
    assert not view.allocations
    assert view.holder("a2") == "A (a2)"


def test_when_a_run_has_ended_nothing_waits() -> None:
    delayed = r.AllocationDelayed("a1", "nothing is free", {})
    view = folded(enter(1, "A"), asks_for_resources("a1"), delayed)
    apply(view, [r.RunEnded(r.RunOutcome.STOPPED, "")])
    assert not view.elements[P, "A"].waiting
    assert not view.allocations


def test_the_status_of_a_run_follows_its_records() -> None:
    view = folded(r.RunStarted(process=P, started_us=1_000_000))
    assert view.summary.started_us == 1_000_000
    apply(view, [r.RunPaused(at_us=3_000_000)])
    assert view.summary.status is RunStatus.PAUSED
    apply(view, [r.RunResumed(at_us=13_000_000)])
    assert view.summary.status is RunStatus.RUNNING
    apply(view, [r.RunEnded(outcome=r.RunOutcome.STOPPED, detail="enough")])
    summary = view.counted()
    assert summary.status is RunStatus.STOPPED
    assert (summary.ended_us, summary.detail, summary.records) == (15_000_000, "enough", 4)


def test_when_a_run_has_ended_nothing_is_active() -> None:
    ended = r.RunEnded(outcome=r.RunOutcome.STOPPED, detail="")
    view = folded(enter(1, "A"), asks("p1"), ended)
    assert shown(view, "A") == (0, 1, 3.0, False, False)
    assert view.prompts == {}


def test_an_interrupted_run_goes_on_when_it_is_claimed() -> None:
    view = folded(r.RunStarted(process=P, started_us=1), enter(1, "A"))
    view.interrupt()
    assert view.summary.status is RunStatus.INTERRUPTED
    apply(view, [r.RunClaimed(epoch=2)])
    assert view.summary.status is RunStatus.RUNNING


@pytest.mark.parametrize("count", [1, NEWEST, NEWEST * 2])
def test_only_the_newest_records_are_kept(count: int) -> None:
    view = folded(*[r.RunYielded(steps=())] * count)
    assert len(view.newest) == min(count, NEWEST)
    assert view.newest[-1].seq == view.seq == count


def test_pauses_are_counted_into_times_of_the_clock() -> None:
    second = 1_000_000
    view = RunView(RunSummary("r1", "", "", RunStatus.RUNNING, 0))
    for seq, (t_s, record) in enumerate(
        (
            (0.0, r.RunStarted("P", 100 * second)),
            (10.0, r.RunPaused(110 * second)),
            (10.0, r.RunResumed(140 * second)),
            (15.0, r.TokenEntered(1, "P", "Task", 0)),
            (20.0, r.RunEnded(r.RunOutcome.STOPPED, "enough")),
        ),
        1,
    ):
        view.apply(StampedRecord("r1", seq, t_s, record))
    assert view.summary.ended_us == 150 * second
    assert (view.summary.status, view.summary.detail) == (RunStatus.STOPPED, "enough")
    assert view.active() == []


def test_an_active_element_has_its_instances_and_not_the_token_around_them() -> None:
    opened = r.ScopeOpened(scope=1, process=P, element="A", token=1, instances=3)
    instances = [enter(2 + number, "A", instance=number) for number in range(3)]
    (active,) = folded(enter(1, "A"), opened, *instances).active()
    assert (active.element, active.tokens, active.since_us) == ("A", 3, 1_000_000)


def test_a_record_that_was_applied_changes_nothing() -> None:
    view = folded(r.RunStarted(P, 1))
    assert not view.apply(StampedRecord("r1", 1, 0.0, enter(1, "A")))
    assert view.active() == []


MISSION = """
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t">
  <signal id="go"/>
  <process id="P" isExecutable="true">
    <startEvent id="start"/> <userTask id="work"/>
    <sequenceFlow id="f" sourceRef="start" targetRef="work"/>
    <subProcess id="handler" triggeredByEvent="true">
      <startEvent id="on" isInterrupting="{interrupting}">
        <signalEventDefinition signalRef="go"/>
      </startEvent>
      <userTask id="handle"/>
      <sequenceFlow id="g" sourceRef="on" targetRef="handle"/>
    </subProcess>
  </process>
</definitions>"""

TWICE = """<userTask id="work" startQuantity="2"/>
<sequenceFlow id="again" sourceRef="start" targetRef="work"/>"""


class Watched:
    """A run, and its view."""

    def __init__(self, interrupting: str, text: str = MISSION) -> None:
        mission = parse_mission(text.format(interrupting=interrupting).strip().encode(), "m.bpmn")
        self.run = MissionRun(mission, None, "r1")
        self.view = RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0), mission)
        self.give(StartRun("P"))

    def give(self, item: StartRun | SignalReceived | PromptAnswer) -> None:
        step = self.run.receive(item, 0)
        for seq, record in enumerate(step.records, step.seq):
            self.view.apply(StampedRecord("r1", seq, 0.0, record))

    @property
    def awaited(self) -> bool:
        return self.view.signals()["go"][1]


@pytest.mark.parametrize(("interrupting", "after"), [("true", False), ("false", True)])
def test_a_signal_that_an_event_subprocess_waits_for_is_awaited(
    interrupting: str, after: bool
) -> None:
    watched = Watched(interrupting)
    assert watched.awaited
    watched.give(SignalReceived("go", {}))
    assert watched.awaited is after


def test_a_signal_is_no_longer_awaited_when_its_scope_has_ended() -> None:
    watched = Watched("false")
    watched.give(PromptAnswer("p1", "done", "ops"))
    assert not watched.awaited


def test_tokens_that_begin_an_activity_with_another_are_not_finished() -> None:
    watched = Watched("false", MISSION.replace('<userTask id="work"/>', TWICE))
    watched.give(PromptAnswer("p1", "done", "ops"))
    assert [token.element for token in watched.view.finished][-1:] == ["work"]
