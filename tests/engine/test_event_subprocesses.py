"""Event subprocesses (BPMN 2.0.2, clauses 10.3.5 and 13.5.4): what begins them, what they end."""

import pytest

from tests.engine.event_subprocesses import NOT, WORK, around, handler
from tests.engine.kit import CANCELLED, Play
from tests.engine.trace import table

TRIGGERS = {
    "message go": lambda play: play.message("go"),
    "timer PT5S": lambda play: play.advance(5),
    "signal go": lambda play: play.signal("go"),
}


# --- interrupting -------------------------------------------------------------------------------


@pytest.mark.parametrize("trigger", TRIGGERS)
def test_an_interrupting_one_ends_all_in_its_scope_and_the_scope_ends_with_it(trigger: str) -> None:
    play = Play(around(WORK + handler(trigger))).start()
    assert play.at == "a"
    play.trace()
    TRIGGERS[trigger](play)
    assert play.trace("leave", "enter", "open", "interrupt") == table("""
        leave a interrupted; interrupt 2 h; enter h; open h; enter hs; leave hs; enter hu
    """)
    assert play.answer().entered() == "done"
    assert play.ended == "completed"


@pytest.mark.parametrize("trigger", TRIGGERS)
def test_an_interrupting_event_subprocess_happens_once(trigger: str) -> None:
    play = Play(around(WORK + handler(trigger))).start()
    TRIGGERS[trigger](play)
    before = play.at
    TRIGGERS[trigger](play)
    assert play.at == before == "hu"


def test_the_scope_is_cut_before_its_next_step_when_it_throws_itself() -> None:
    play = Play(
        around(
            """<startEvent id="s"/>
            <intermediateThrowEvent id="throw">signal go</intermediateThrowEvent>
            <scriptTask id="next">ran = true</scriptTask>
            s -> throw -> next
            """
            + handler("signal go")
        )
    ).start()
    assert play.at == "hu"
    assert "ran" not in play.data


def test_what_the_scope_commanded_is_cancelled() -> None:
    play = Play(
        around(
            """<startEvent id="s"/> <scriptTask id="go">do goto uav1 target=p</scriptTask>
            <subProcess id="deep"> <startEvent id="ds"/> <userTask id="du"/>
              ds -> du
            </subProcess>
            s -> go
            s -> deep
            """
            + handler("signal stop")
        )
    ).start()
    play.trace()
    play.signal("stop")
    assert play.trace("cancel", "withdraw", "leave", "close") == table("""
        withdraw p1; leave du interrupted; close deep interrupted
        cancel b1; leave go interrupted; leave deep interrupted; leave hs
    """)
    assert play.orders()[-2:] == ["cancel b1", "open p2 done"]
    play.report("go", CANCELLED).answer()
    assert play.ended == "completed"


def test_of_two_that_wait_for_the_same_signal_the_first_that_interrupts_is_the_only_one() -> None:
    play = Play(around(WORK + handler("signal go") + handler("signal go", name="i"))).start()
    assert play.signal("go").at == "hu"


def test_an_event_subprocess_goes_down_with_the_scope_that_another_interrupts() -> None:
    play = Play(
        around(WORK + handler("signal more", NOT) + handler("signal stop", name="i"))
    ).start()
    assert play.signal("more").at == "a hu"
    assert play.signal("stop").at == "iu"
    assert play.signal("more").at == "iu"


def test_boundary_events_of_the_activity_stay_armed_while_its_handler_runs() -> None:
    play = Play(
        around(
            WORK + handler("signal go"),
            after="""<boundaryEvent id="late" attachedToRef="sub">timer PT9S</boundaryEvent>
            <task id="done"/> <task id="gone"/>
            start -> sub -> done
            late -> gone
            """,
        )
    ).start()
    play.signal("go").trace()
    play.advance(9)
    assert play.trace("leave", "enter")[:4] == table("""
        leave hu interrupted; leave h interrupted; leave sub interrupted; enter late
    """)
    assert play.ended == "completed"


# --- not interrupting ---------------------------------------------------------------------------


@pytest.mark.parametrize("trigger", ["message go", "signal go"])
def test_an_event_subprocess_that_does_not_interrupt_begins_as_often_as_it_is_triggered(
    trigger: str,
) -> None:
    play = Play(around(WORK + handler(trigger, NOT))).start()
    for _ in range(3):
        TRIGGERS[trigger](play)
    assert play.at == "a hu hu hu"
    assert play.answer(prompt="a").at == "hu hu hu b"


def test_a_scope_whose_own_work_is_done_waits_for_its_handlers_and_begins_no_more() -> None:
    play = Play(around(WORK + handler("signal go", NOT))).start()
    play.signal("go").signal("go")
    play.answer(prompt="a").answer(prompt="b")
    assert play.at == "hu hu"
    assert play.signal("go").at == "hu hu"
    play.answer()
    assert (play.at, play.ended) == ("hu", "")
    assert play.answer().ended == "completed"


def test_a_timer_cycle_begins_it_once_a_round() -> None:
    play = Play(around(WORK + handler("cycle R3/PT10S", NOT))).start()
    assert play.advance(10).at == "a hu"
    assert play.advance(100).at == "a hu hu hu"


def test_a_duration_begins_it_once() -> None:
    assert Play(around(WORK + handler("timer PT5S", NOT))).start().advance(60).at == "a hu"


def test_nothing_of_it_is_armed_before_its_scope_begins_or_after_it_has_ended() -> None:
    play = Play(
        around(
            WORK + handler("signal go", NOT),
            after="""<userTask id="before"/> <userTask id="after"/>
            start -> before -> sub -> after
            """,
        )
    ).start()
    assert play.signal("go").at == "before"
    assert play.answer().signal("go").at == "a hu"
    play.answer(prompt="hu").answer(prompt="a").answer(prompt="b")
    assert play.signal("go").at == "after"


# --- data ---------------------------------------------------------------------------------------


def test_an_event_subprocess_reads_and_writes_what_its_scope_does() -> None:
    inside = """<scriptTask id="calc">mine = x; local = seen + 1</scriptTask>
        hs -> calc
    """
    play = Play(
        around(
            '<property id="x" name="x"/>'
            '<startEvent id="s"/> <scriptTask id="set">x = 4</scriptTask> <userTask id="a"/>'
            "\ns -> set -> a\n" + handler("signal go", NOT, inside)
        )
    ).start()
    play.signal("go", {"seen": 1})
    assert play.data == {"mine": 4, "seen": 1, "local": 2}


def test_what_the_trigger_carries_goes_to_the_handler_that_declares_it() -> None:
    inside = '<property id="n" name="n"/><userTask id="hu"/>\nhs -> hu\n'
    head, _, rest = handler("signal go", NOT, inside).partition("<startEvent")
    start, _, rest = rest.partition('<property id="n" name="n"/>')
    play = Play(
        around(WORK + head + '<property id="n" name="n"/><startEvent' + start + rest)
    ).start()
    play.signal("go", {"n": 1}).signal("go", {"n": 2})
    scopes = [scope for scope in play.run.state.scopes.values() if scope.container.id == "h"]
    assert [scope.data for scope in scopes] == [{"n": 1}, {"n": 2}]
    assert play.data == {}


# --- letters ------------------------------------------------------------------------------------

KEPT = """
    <startEvent id="start"/> <sendTask id="send" messageRef="go"/> <userTask id="wait"/>
    <subProcess id="sub"> {inside} </subProcess> <task id="done"/>
    start -> send -> wait -> sub -> done
"""


def test_a_message_that_came_before_begins_it_as_soon_as_its_scope_begins() -> None:
    play = Play(KEPT.format(inside=WORK + handler("message go"))).start()
    assert play.answer().at == "hu"
    assert "a" not in play.entered().split()


def test_an_event_subprocess_that_does_not_interrupt_takes_every_message_that_was_kept() -> None:
    play = Play(KEPT.format(inside=WORK + handler("message go", NOT))).start()
    play.message("go")
    assert play.answer().at == "a hu hu"


# --- multiple -----------------------------------------------------------------------------------

BOTH = '<signalEventDefinition signalRef="S"/><messageEventDefinition messageRef="M"/>'


def test_a_multiple_start_event_begins_it_on_any_of_its_triggers() -> None:
    play = Play(around(WORK + handler(BOTH, NOT))).start()
    assert play.signal("S").message("M").at == "a hu hu"


def test_a_parallel_multiple_one_waits_for_all_and_keeps_what_they_carry() -> None:
    play = Play(around(WORK + handler(BOTH, f'{NOT} parallelMultiple="true"'))).start()
    assert play.signal("S", {"x": 1}).at == "a"
    assert play.message("M", {"y": 2}).at == "a hu"
    assert play.data == {"x": 1, "y": 2}
    assert play.message("M").at == "a hu"
    assert play.signal("S").at == "a hu hu"


# --- ends ---------------------------------------------------------------------------------------


def test_a_terminate_end_event_in_it_ends_the_handler_only() -> None:
    inside = """<userTask id="hu"/> <userTask id="hv"/> <endEvent id="he">terminate</endEvent>
        hs -> hu -> he
        hs -> hv
    """
    play = Play(around(WORK + handler("signal go", NOT, inside))).start()
    assert play.signal("go").at == "a hu hv"
    assert play.answer(prompt="hu").at == "a"


def test_an_event_subprocess_that_was_begun_as_the_last_token_ended_still_runs() -> None:
    # In one step of the run: `end` throws the signal, and its scope has no other token.
    play = Play(
        around(
            """<startEvent id="s"/> <endEvent id="end">signal go</endEvent>
            s -> end
            """
            + handler("signal go", NOT)
        )
    ).start()
    assert play.at == "hu"
    assert play.answer().ended == "completed"


# --- the rest of the engine ---------------------------------------------------------------------

STUCK = """<startEvent id="s"/> <startEvent id="s2"/> <exclusiveGateway id="never" default="d"/>
    <parallelGateway id="join"/> <endEvent id="end"/> <endEvent id="other"/>
    s -> join -> end
    s2 -> never -> join if false
    d: never -> other
"""


def test_a_stuck_scope_with_one_armed_for_the_outside_is_not_a_deadlock() -> None:
    play = Play(STUCK + handler("signal go")).start()
    assert (play.at, play.ended) == ("join", "")
    assert play.signal("go").answer().ended == "completed"


def test_an_event_subprocess_armed_for_errors_only_cannot_free_a_stuck_scope() -> None:
    play = Play(STUCK + handler("error")).start()
    assert play.ended == "failed"
    assert "join" in play.detail


def test_the_token_of_a_handler_keeps_no_inclusive_join_waiting() -> None:
    play = Play(
        """<startEvent id="s"/> <inclusiveGateway id="split"/> <userTask id="a"/> <task id="b"/>
        <inclusiveGateway id="join"/> <userTask id="end"/>
        s -> split -> a -> join -> end
        split -> b -> join
        """
        + handler("signal go", NOT)
    ).start()
    assert play.signal("go").at == "a join hu"
    assert play.answer(prompt="a").at == "hu end"


def test_a_paused_run_begins_none_until_it_goes_on() -> None:
    play = Play(around(WORK + handler("signal go"))).start()
    play.pause().signal("go")
    assert play.at == "a"
    assert play.resume().at == "hu"


def test_a_stopped_run_ends_what_its_handlers_do() -> None:
    play = Play(
        WORK
        + handler(
            "signal go",
            NOT,
            '<scriptTask id="fly">do goto uav1 target=p</scriptTask>\nhs -> fly\n',
        )
    ).start()
    play.signal("go").orders()
    play.stop()
    assert play.ended == "stopped"
    assert play.orders() == ["cancel b1", "close p1"]


def test_a_timer_that_is_none_is_an_error_of_the_activity_around() -> None:
    after = """<boundaryEvent id="out" attachedToRef="sub">error EXPRESSION</boundaryEvent>
        <userTask id="o"/>
        start -> sub
        out -> o
    """
    play = Play(around(WORK + handler("timer ${nothing}"), after=after)).start()
    assert play.at == "o"
