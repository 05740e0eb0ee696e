"""Timers: durations, dates and cycles, on a clock that the test moves."""

from datetime import UTC, datetime, timedelta

import pytest

from m2pem.engine.inputs import Tick
from tests.engine.kit import START_US, Play

CATCH = """
    <startEvent id="start"/> <intermediateCatchEvent id="wait">{time}</intermediateCatchEvent>
    <userTask id="after"/>
    start -> wait -> after
"""
START = datetime(2026, 1, 1, tzinfo=UTC)


def iso(seconds: float) -> str:
    """A date, counted from the start of the run."""
    return (START + timedelta(seconds=seconds)).isoformat()


def cycle(text: str, *, interrupting: bool = False) -> Play:
    attribute = "" if interrupting else 'cancelActivity="false"'
    return Play(f"""
        <startEvent id="start"/> <userTask id="u"/> <scriptTask id="count">n = n + 1</scriptTask>
        <boundaryEvent id="tick" attachedToRef="u" {attribute}>cycle {text}</boundaryEvent>
        start -> u
        tick -> count
    """).start({"n": 0})


@pytest.mark.parametrize("time", ["timer PT10S", "timer ${wait}", "date ${when}", "cycle R3/PT10S"])
def test_a_timer_fires_when_it_is_due_and_not_before(time: str) -> None:
    play = Play(CATCH.format(time=time)).start({"wait": "PT10S", "when": iso(10)})
    assert play.run.next_due_us == START_US + 10_000_000
    assert play.advance(9.999999).at == "wait"
    assert play.advance(0.000001).at == "after"
    assert play.advance(1000).at == "after"


def test_a_tick_before_anything_is_due_changes_nothing() -> None:
    play = Play(CATCH.format(time="timer PT10S")).start()
    assert play.give(Tick()).ignored() == "no timer is due"


@pytest.mark.parametrize("seconds", [0, -1, -1e9, -3e9])
def test_a_date_that_has_passed_fires_at_once(seconds: float) -> None:
    play = Play(CATCH.format(time="date ${when}")).start({"when": iso(seconds)})
    assert play.advance(0).at == "after"


def test_a_cycle_beside_an_activity_fires_as_often_as_it_says() -> None:
    play = cycle("R3/PT10S")
    for expected in (1, 2, 3, 3):
        assert play.advance(10).data["n"] == expected


def test_a_cycle_without_a_number_fires_until_the_activity_ends() -> None:
    play = cycle("R/PT10S")
    assert play.advance(1000).data["n"] == 100
    play.answer()
    assert play.ended == "completed"
    assert play.run.next_due_us is None


def test_a_cycle_does_not_drift_when_its_ticks_come_late() -> None:
    play = cycle("R/PT10S")
    play.now_us += 13_000_000
    play.give(Tick())
    assert play.run.next_due_us == START_US + 20_000_000


def test_an_interrupting_cycle_fires_once() -> None:
    play = cycle("R3/PT10S", interrupting=True)
    assert play.advance(100).data["n"] == 1
    assert play.ended == "completed"


def test_a_cycle_with_a_start_fires_first_then() -> None:
    play = cycle(f"R3/{START:%Y-%m-%dT%H:%M}:30Z/PT10S")
    assert play.advance(29).data["n"] == 0
    assert play.advance(1).data["n"] == 1
    assert play.advance(9).data["n"] == 1
    assert play.advance(11).data["n"] == 3
    assert play.advance(100).data["n"] == 3


def test_a_cycle_whose_start_has_passed_begins_at_once_and_makes_up_for_nothing() -> None:
    play = cycle("R/2020-01-01T00:00:00Z/PT10S")
    assert play.advance(0).data["n"] == 1
    assert play.advance(9).data["n"] == 1
    assert play.advance(1).data["n"] == 2


def test_a_cycle_that_reaches_the_end_of_the_calendar_stops() -> None:
    play = cycle("R/P3000Y")
    play.advance(3000 * 366 * 86_400)
    assert play.data["n"] == 1
    play.advance(3000 * 366 * 86_400)
    assert play.data["n"] == 2
    assert play.run.next_due_us is None


def test_several_due_at_once_fire_by_their_time_and_then_by_when_they_were_armed() -> None:
    play = Play("""
        <startEvent id="start"/>
        <intermediateCatchEvent id="c">timer PT3S</intermediateCatchEvent>
        <intermediateCatchEvent id="b">date ${when}</intermediateCatchEvent>
        <intermediateCatchEvent id="a">timer PT1S</intermediateCatchEvent>
        <intermediateCatchEvent id="d">timer PT3S</intermediateCatchEvent>
        <task id="x"/> <task id="y"/>
        start -> c -> y
        start -> b
        start -> a -> x
        start -> d
    """).start({"when": iso(2)})
    play.now_us += 60_000_000
    play.trace()
    play.give(Tick())
    assert play.trace("leave") == [f"leave {name}" for name in ("a", "x", "b", "c", "y", "d")]


def test_what_a_timer_leads_to_happens_before_the_next_timer_fires() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="no"/>
        <intermediateCatchEvent id="first">timer PT1S</intermediateCatchEvent>
        <intermediateThrowEvent id="throw">signal go</intermediateThrowEvent>
        <boundaryEvent id="stop" attachedToRef="u">signal go</boundaryEvent>
        <boundaryEvent id="late" attachedToRef="u">timer PT2S</boundaryEvent>
        start -> u
        start -> first -> throw
        late -> no
        stop -> end
        <endEvent id="end"/>
    """).start()
    play.now_us += 60_000_000
    play.give(Tick())
    assert play.ended == "completed"
    assert "no" not in play.entered()


def test_boundary_timers_are_disarmed_when_their_activity_completes() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="after"/> <userTask id="no"/>
        <boundaryEvent id="late" attachedToRef="u">timer PT5S</boundaryEvent>
        <boundaryEvent id="then" attachedToRef="u" cancelActivity="false">date 2026-02-01T00:00:00Z
        </boundaryEvent>
        start -> u -> after
        late -> no
        then -> no
    """).start()
    play.answer()
    assert play.run.next_due_us is None
    assert play.advance(1e8).at == "after"


def test_timers_that_are_over_do_not_pile_up() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/>
        <boundaryEvent id="late" attachedToRef="u">timer PT1H</boundaryEvent>
        <boundaryEvent id="then" attachedToRef="u">date 2030-01-01</boundaryEvent>
        <intermediateCatchEvent id="soon">timer PT1M</intermediateCatchEvent>
        <intermediateCatchEvent id="later">date 2029-01-01</intermediateCatchEvent>
        <endEvent id="end"/>
        start -> soon
        start -> later
        start -> merge -> u -> merge
        <exclusiveGateway id="merge"/>
        late -> end
        then -> end
    """).start()
    for _ in range(1000):
        play.answer()
    assert len(play.run.state.timers) < 100
    assert len(play.run.state.dates) < 100


@pytest.mark.parametrize(
    ("time", "value"),
    [
        ("timer ${x}", "10 s"),
        ("timer ${x}", None),
        ("timer ${x}", True),
        ("timer ${1/x}", 0),
        ("timer ${x}", "-5"),
        ("timer ${x}", "P9999Y"),
        ("date ${x}", "tomorrow"),
        ("date ${x}", ["2026-01-01"]),
        ("cycle ${x}", "PT5S"),
        ("cycle ${x}", "R0/PT5S"),
        ("cycle ${x}", "R/PT0S"),
        ("cycle ${x}", "R/P9999Y"),
    ],
)
def test_a_timer_of_no_time_throws_expression_at_its_event(time: str, value: object) -> None:
    play = Play(CATCH.format(time=time)).start({"x": value})  # type: ignore[dict-item]
    assert play.ended == "failed"
    assert play.detail.startswith("error EXPRESSION from wait")


def test_a_wrong_boundary_timer_is_an_error_of_its_activity() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="after"/> <userTask id="no"/>
        <boundaryEvent id="late" attachedToRef="u">timer ${x}</boundaryEvent>
        <boundaryEvent id="wrong" attachedToRef="u">error EXPRESSION</boundaryEvent>
        start -> u
        late -> no
        wrong -> after
    """).start()
    assert play.at == "after"
    assert play.orders() == ["open p1 done"]


@pytest.mark.parametrize(
    ("time", "seconds"),
    [
        ('timer = duration("PT" + string(x) + "S")', 7),
        ('timer = duration("PT5S") + duration("PT5S")', 10),
        ("timer = x", 7),
        ("timer = text", 8),
        ("timer = duration(text) * 2", 16),
        ("timer = date and time(when) - now()", 60),
        ("timer = now() - date and time(when)", 0),
        ('date = now() + duration("PT1M")', 60),
        ("date = when", 60),
        ("date = date and time(when)", 60),
        ("date ${date(when)}", 60),
        ("date ${now() + 60}", 60),
        ('cycle = cycle(3, duration("PT10S"))', 10),
        ("cycle = cycle(duration(text))", 8),
    ],
)
def test_a_timer_takes_what_is_computed(time: str, seconds: int) -> None:
    """What Camunda 8 takes, and numbers of seconds, as `duration()` and `date()` of others give."""
    play = Play(CATCH.format(time=time)).start({"x": 7, "text": "PT8S", "when": iso(60)})
    assert play.run.next_due_us == START_US + seconds * 1_000_000
    assert play.advance(seconds).at == "after"


@pytest.mark.parametrize(
    ("boundary", "nags"),
    [("timer = duration(text)", 1), ('cycle = cycle(3, duration("PT10S"))', 3)],
)
def test_a_boundary_timer_takes_what_is_computed(boundary: str, nags: int) -> None:
    play = (
        cycle("R1/PT1S")
        if not boundary
        else Play(f"""
        <startEvent id="start"/> <userTask id="u"/> <scriptTask id="count">n = n + 1</scriptTask>
        <boundaryEvent id="tick" attachedToRef="u" cancelActivity="false">{boundary}</boundaryEvent>
        start -> u
        tick -> count
    """).start({"n": 0, "text": "PT8S"})
    )
    assert play.advance(60).data["n"] == nags


def test_now_is_the_time_of_the_input_and_its_value_is_in_a_record() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <scriptTask id="note">at = now()</scriptTask>
        <userTask id="after"/>
        start -> u -> note -> after
    """).start()
    play.advance(90).answer()
    assert play.data["at"] == START_US / 1e6 + 90
    play.advance(1000)
    assert play.data["at"] == START_US / 1e6 + 90


@pytest.mark.parametrize(
    "time",
    ['date = now() + duration("PT8S")', "timer = duration(text)", "cycle = cycle(duration(text))"],
)
def test_timers_of_other_places_take_what_is_computed(time: str) -> None:
    interrupting = Play(f"""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="after"/>
        <boundaryEvent id="late" attachedToRef="u">{time}</boundaryEvent>
        start -> u
        late -> after
    """).start({"text": "PT8S"})
    assert interrupting.advance(7.9).at == "u"
    assert interrupting.advance(0.1).at == "after"
    in_scope = Play(f"""
        <startEvent id="start"/> <userTask id="u"/>
        <subProcess id="h" triggeredByEvent="true">
          <startEvent id="due">{time}</startEvent> <userTask id="after"/>
          due -> after
        </subProcess>
        start -> u
    """).start({"text": "PT8S"})
    assert in_scope.advance(8).at == "after"
