"""Timers that repeat: after an outage or a pause, at dates, and as starts of processes."""

import pytest

from m2pem.engine.inputs import Tick
from tests.engine.kit import START_US, Play

HOUR_S = 3600


def cycle(text: str, *, interrupting: bool = False) -> Play:
    attribute = "" if interrupting else 'cancelActivity="false"'
    return Play(f"""
        <startEvent id="start"/> <userTask id="u"/> <scriptTask id="count">n = n + 1</scriptTask>
        <boundaryEvent id="tick" attachedToRef="u" {attribute}>cycle {text}</boundaryEvent>
        start -> u
        tick -> count
    """).start({"n": 0, "every": "0 */15 * * * ?"})


def outage(play: Play, seconds: float) -> Play:
    """No tick comes for that long."""
    play.now_us += round(seconds * 1_000_000)
    return play.give(Tick())


def due(play: Play) -> float | None:
    """When the next timer is due, in seconds from the start."""
    at_us = play.run.next_due_us
    return None if at_us is None else (at_us - START_US) / 1_000_000


# --- rounds that were missed --------------------------------------------------------------------


def test_missed_rounds_come_once() -> None:
    play = outage(cycle("R/PT10S"), 3605)
    assert play.data["n"] == 1
    assert due(play) == 3610
    assert play.advance(5).data["n"] == 2


def test_a_number_of_rounds_is_how_often_it_fires_however_late() -> None:
    play = outage(cycle("R3/PT10S"), 3605)
    assert play.advance(HOUR_S).data["n"] == 3
    assert due(play) is None


def test_rounds_at_dates_are_over_when_their_dates_are() -> None:
    play = cycle("R4/2026-01-01T01:00:00Z/PT1H")
    assert play.advance(HOUR_S).data["n"] == 1
    assert outage(play, 2.5 * HOUR_S).data["n"] == 2
    assert due(play) == 4 * HOUR_S
    assert play.advance(9 * HOUR_S).data["n"] == 3


def test_a_late_round_may_stand_for_all_that_were_left() -> None:
    play = outage(cycle("R3/2026-01-01T01:00:00Z/PT1H"), 20 * HOUR_S)
    assert play.data["n"] == 1
    assert due(play) is None


def test_a_start_that_has_passed_fires_at_once_and_then_at_its_own_dates() -> None:
    play = cycle("R/2025-12-31T23:40:00Z/PT1H").advance(0)
    assert play.data["n"] == 1
    assert due(play) == 40 * 60


def test_a_pause_stops_a_cycle_without_dates() -> None:
    play = cycle("R/PT10S").advance(5).pause().advance(1000).resume()
    assert play.data["n"] == 0
    assert play.advance(5).data["n"] == 1


def test_dates_go_on_in_a_pause_and_come_once_after_it() -> None:
    play = cycle("@hourly").advance(0.5 * HOUR_S).pause().advance(5 * HOUR_S).resume()
    assert play.advance(0).data["n"] == 1
    assert due(play) == 6 * HOUR_S


# --- dates ------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["*/15 * * * *", "0 0/15 * * * ?", "0 0,15,30,45 * ? * * *"])
def test_a_cron_text_fires_at_its_dates(text: str) -> None:
    play = cycle(text)
    assert play.advance(14 * 60 + 59).data["n"] == 0
    assert play.advance(1).data["n"] == 1
    assert play.advance(HOUR_S).data["n"] == 5


def test_a_cron_text_may_come_from_the_data() -> None:
    assert cycle("${every}").advance(HOUR_S).data["n"] == 4


def test_a_cycle_with_an_end_fires_last_then() -> None:
    play = cycle("R/PT1H/2026-01-01T02:30:00Z")
    for expected in (0.5, 1.5, 2.5):
        assert due(play) == expected * HOUR_S
        play.advance(HOUR_S)
    assert due(play) is None
    assert play.data["n"] == 3


def test_interrupting_dates_fire_once() -> None:
    assert cycle("@hourly", interrupting=True).advance(99 * HOUR_S).ended == "completed"


@pytest.mark.parametrize("text", ["@hourly", "0 0 1 1 1 ? 2026"])
def test_a_catch_event_waits_for_the_first_date(text: str) -> None:
    play = Play(f"""
        <startEvent id="start"/> <intermediateCatchEvent id="wait">cycle {text}
        </intermediateCatchEvent> <endEvent id="end"/>
        start -> wait -> end
    """).start()
    assert play.advance(HOUR_S - 1).at == "wait"
    assert play.advance(1).ended == "completed"


def test_a_cron_text_whose_dates_are_over_throws_expression() -> None:
    play = cycle("0 0 1 1 1 ? 2020")
    assert play.detail.startswith("error EXPRESSION from u")
    assert "timer of tick: none of its dates is left" in play.detail


def test_an_event_subprocess_begins_in_each_round_while_its_scope_lasts() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/>
        <subProcess id="handler" triggeredByEvent="true">
          <startEvent id="tick" isInterrupting="false">cycle R3/PT10S</startEvent>
          <scriptTask id="count">n = n + 1</scriptTask>
          tick -> count
        </subProcess>
        start -> u
    """).start({"n": 0})
    assert play.advance(15).data["n"] == 1
    assert outage(play, 5).data["n"] == 2
    assert play.answer().ended == "completed"


# --- starts of other processes ----------------------------------------------------------------

POOLS = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
      start -> main
    </process>
    <process id="OTHER"> <startEvent id="begin" {attributes}>{trigger}</startEvent>
      <userTask id="a"/>
      begin -> a
    </process>
"""


def pools(trigger: str, attributes: str = "") -> Play:
    text = POOLS.format(trigger=trigger, attributes=attributes)
    return Play(text).start({"every": "PT5S"})


@pytest.mark.parametrize("trigger", ["timer ${every}", "date 2026-01-01T00:00:05Z"])
def test_a_timer_start_makes_one_instance(trigger: str) -> None:
    play = pools(trigger)
    assert play.advance(4).at == "main"
    assert play.advance(100).at == "main a"


def test_a_cycle_start_makes_an_instance_for_each_round() -> None:
    play = pools("cycle R3/PT10S")
    assert play.advance(10).at == "main a"
    assert play.advance(100).at == "main a a a"
    stores = [scope.id for scope in play.run.state.scopes.values()]
    assert len(stores) == 4


def test_a_timer_start_lasts_as_long_as_the_process_that_the_run_began_with() -> None:
    play = pools("cycle R/PT10S").advance(15)
    assert play.answer(prompt="main").at == "a"
    assert play.advance(100).at == "a"
    assert play.answer(prompt="a").ended == "completed"


def test_the_timers_of_a_called_process_begin_nothing_by_themselves() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
          <callActivity id="call" calledElement="OTHER"/>
          start -> main -> call
        </process>
        <process id="OTHER"> <startEvent id="begin">timer PT5S</startEvent> <userTask id="a"/>
          begin -> a
        </process>
    """).start()
    assert play.advance(100).at == "main"


def test_a_start_that_waits_for_a_time_and_a_signal_gets_an_instance_by_either_that_waits_on() -> (
    None
):
    both = '<signalEventDefinition signalRef="go"/><timerEventDefinition><timeDuration>PT5S'
    both += "</timeDuration></timerEventDefinition>"
    text = POOLS.format(trigger=f"{both} ", attributes='parallelMultiple="true"')
    play = Play(text).start()
    assert play.advance(5).at == "main begin"
    assert play.signal("go").at == "main a begin"


def test_a_wrong_timer_start_fails_the_run() -> None:
    play = Play(POOLS.format(trigger="timer ${never}", attributes="")).start()
    assert play.ended == "failed"
    assert "timer of begin" in play.detail
