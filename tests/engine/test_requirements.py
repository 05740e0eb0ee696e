"""What the engine does with the requirements of a run: it records verdicts, and acts on them."""

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from tests.engine.kit import Play

VIOLATED, SATISFIED = i.RequirementVerdict.VIOLATED, i.RequirementVerdict.SATISFIED

ASKING = """
    <startEvent id="start"/> <userTask id="work"/> <endEvent id="end"/>
    start -> work -> end
"""
CATCHING = ASKING.replace(
    '<endEvent id="end"/>',
    """<endEvent id="end"/>
    <subProcess id="handler" triggeredByEvent="true">
      <startEvent id="on">error UNSAFE</startEvent> <userTask id="mend"/>
      on -> mend
    </subProcess>""",
)
HEARING = ASKING.replace(
    '<endEvent id="end"/>',
    """<endEvent id="end"/> <endEvent id="stopped"/>
    <boundaryEvent id="stop" attachedToRef="work">signal S</boundaryEvent>
    stop -> stopped""",
)


def begun(text: str, on_violation: str = "") -> Play:
    play = Play(text)
    process = play.mission.process().id
    required = i.MonitoredRequirement("safe", "[]!ended", "Never ended.", (), on_violation)
    return play.give(i.StartRun(process, requirements=(required,)))


def violate(play: Play) -> Play:
    return play.give(i.RequirementDecided("safe", VIOLATED, 0, "it says so"))


def test_a_run_records_which_requirements_it_is_monitored_for() -> None:
    play = begun(ASKING, "error:UNSAFE")
    expected = r.RequirementMonitored("safe", "[]!ended", "Never ended.", (), "error:UNSAFE")
    assert list(play.records())[1] == expected
    assert play.run.state.requirements == {"safe": expected}


def test_a_verdict_is_recorded_once() -> None:
    play = violate(begun(ASKING))
    recorded = play.steps[-1].records
    assert recorded == [r.RequirementDecided("safe", VIOLATED, "Never ended.", 0, "it says so")]
    assert "decided before" in violate(play).ignored()
    assert play.at == "work"


def test_a_verdict_on_a_requirement_of_no_monitor_is_ignored() -> None:
    play = begun(ASKING).give(i.RequirementDecided("other", VIOLATED, 0))
    assert "not monitored" in play.ignored()


def test_an_error_of_a_violation_is_caught_by_an_event_subprocess() -> None:
    play = violate(begun(CATCHING, "error:UNSAFE"))
    assert play.at == "mend"
    assert play.answer().ended == "completed"


@pytest.mark.parametrize("text", [ASKING, CATCHING])
def test_an_error_of_a_violation_that_nothing_catches_fails_the_run(text: str) -> None:
    play = violate(begun(text, "error:OTHER"))
    assert play.ended == "failed"
    assert "requirement safe is violated: Never ended." in play.detail


def test_a_signal_of_a_violation_reaches_those_that_wait_for_it() -> None:
    assert violate(begun(HEARING, "signal:S")).ended == "completed"


def test_what_is_satisfied_throws_nothing() -> None:
    play = begun(ASKING, "error:UNSAFE").give(i.RequirementDecided("safe", SATISFIED, 0))
    assert play.at == "work"


def test_the_end_of_a_run_decides_and_throws_nothing() -> None:
    play = violate(begun(ASKING, "error:UNSAFE").answer())
    assert play.ended == "completed"
    assert {key: each.verdict for key, each in play.run.state.verdicts.items()} == {
        "safe": VIOLATED
    }


def test_a_violation_during_a_pause_throws_when_the_run_goes_on() -> None:
    play = violate(begun(CATCHING, "error:UNSAFE").pause())
    assert play.at == "work"
    assert play.resume().at == "mend"


def test_what_telemetry_says_is_recorded_when_it_changes() -> None:
    play = begun(ASKING)
    for holds in (True, None, False):
        play.give(i.TelemetryConditionChanged("battery(uav1) < 20 %", holds))
        recorded = r.TelemetryConditionChanged("battery(uav1) < 20 %", holds)
        assert play.steps[-1].records == [recorded]
    assert "same" in play.give(i.TelemetryConditionChanged("battery(uav1) < 20 %", False)).ignored()


def test_what_the_end_of_a_run_leaves_open_is_recorded_once() -> None:
    left = i.RequirementLeftOpen("safe", "the run was stopped")
    play = begun(ASKING).give(i.StopRun(by="anna")).give(left)
    expected = r.RequirementLeftOpen("safe", "Never ended.", "the run was stopped")
    assert play.steps[-1].records == [expected]
    assert "decided before" in play.give(left).ignored()


def test_what_telemetry_says_at_the_start_comes_before_the_first_token() -> None:
    play = Play(ASKING)
    required = i.MonitoredRequirement(
        "low", "[]battery(a) > 0.2", "", conditions=("battery(a) > 0.2",)
    )
    known = {"battery(a) > 0.2": True}
    play.give(i.StartRun(play.mission.process().id, requirements=(required,), conditions=known))
    kinds = [type(each).__name__ for each in play.records()][:4]
    assert kinds == [
        "RunStarted",
        "RequirementMonitored",
        "TelemetryConditionChanged",
        "ScopeOpened",
    ]
    assert play.run.state.telemetry_conditions == known
