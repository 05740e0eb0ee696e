"""Standard loops (BPMN 2.0.2, clauses 10.3.8 and 13.3.6)."""

import pytest

from m2pem.engine import records as r
from m2pem.engine.inputs import Continue, StartRun
from m2pem.engine.run import MissionRun
from m2pem.mission.mission import Mission
from tests.engine.kit import FAILED, Play
from tests.engine.notation import mission
from tests.engine.trace import table


def counted(marker: str, script: str = "n = n + 1; last = loopCounter") -> Play:
    body = script.replace(";", "\n")
    return Play(f"""
        <startEvent id="s"/> <endEvent id="e"/>
        <scriptTask id="t">{marker}<script>{body}</script></scriptTask>
        s -> t -> e
    """).start({"n": 0})


def waiting(marker: str, boundary: str = "", behind: str = "") -> Play:
    """A user task that loops, with a boundary event."""
    return Play(f"""
        <startEvent id="s"/> <endEvent id="e"/> <userTask id="u">ask yes no{marker}</userTask>
        {boundary}
        s -> u -> e
        {behind}
    """).start()


# --- how often ----------------------------------------------------------------------------------


def test_a_loop_repeats_while_the_condition_is_true_and_asks_after_each_round() -> None:
    assert counted("<loop>n < 3</loop>").data == {"n": 3, "last": 2}
    assert counted("<loop>false</loop>").data == {"n": 1, "last": 0}


def test_with_test_before_it_asks_before_each_round_and_before_the_first() -> None:
    assert counted('<loop testBefore="true">n < 3</loop>').data == {"n": 3, "last": 2}
    assert counted('<loop testBefore="true">n < 0</loop>').data == {"n": 0}


def test_a_condition_reads_the_counter_of_the_round_that_would_come() -> None:
    assert counted("<loop>loopCounter < 3</loop>").data["n"] == 3
    assert counted('<loop testBefore="true">loopCounter < 3</loop>').data["n"] == 3


@pytest.mark.parametrize("before", ["true", "false"])
@pytest.mark.parametrize("rounds", [0, 1, 4])
def test_the_maximum_caps_the_rounds(before: str, rounds: int) -> None:
    play = counted(f'<loop testBefore="{before}" loopMaximum="{rounds}">n < 100</loop>')
    assert play.data["n"] == rounds


def test_the_maximum_alone_says_how_often() -> None:
    assert counted('<loop loopMaximum="5"> </loop>').data["n"] == 5


def test_without_condition_and_maximum_it_repeats_until_something_ends_it() -> None:
    play = waiting(
        "<loop> </loop>", '<boundaryEvent id="b" attachedToRef="u">signal S</boundaryEvent>'
    )
    for _ in range(5):
        play.answer("yes")
    assert play.at == "u"
    assert play.signal("S").ended == "completed"


def test_a_condition_that_cannot_be_evaluated_is_an_error_of_the_activity() -> None:
    play = counted("<loop>1 / 0 > n</loop>")
    assert play.ended == "failed"
    assert "EXPRESSION from t" in play.detail
    assert "loop condition of t" in play.detail
    caught = Play("""
        <startEvent id="s"/> <task id="t"><loop testBefore="true">1 / 0 > n</loop></task>
        <boundaryEvent id="b" attachedToRef="t">error EXPRESSION</boundaryEvent>
        <userTask id="u"/>
        s -> t
        b -> u
    """).start()
    assert caught.at == "u"


# --- what is recorded ---------------------------------------------------------------------------


def test_the_whole_and_each_round_are_entered_and_left() -> None:
    play = Play("""
        <startEvent id="s"/> <endEvent id="e"/> <task id="t"><loop loopMaximum="2"> </loop></task>
        s -> t -> e
    """).start()
    around = [
        (record.element, record.scope, record.instance)
        for record in play.records()
        if isinstance(record, r.TokenEntered)
    ]
    assert around == [("s", 1, None), ("t", 1, None), ("t", 2, 0), ("t", 2, 1), ("e", 1, None)]
    assert play.trace("enter", "leave", "open", "close", "take") == table("""
        open MAIN; enter s; leave s; take f1; enter t
        open t; enter t; leave t; enter t; leave t; close t
        leave t; take f2; enter e; leave e; close MAIN
    """)


# --- kinds of activities ------------------------------------------------------------------------


def test_an_operator_is_asked_again_in_each_round() -> None:
    play = waiting("<loop>user.decision == 'no'</loop>")
    assert play.answer("no").at == "u"
    assert play.answer("no").at == "u"
    assert play.answer("yes").ended == "completed"


def test_a_vehicle_does_its_behavior_again_in_each_round() -> None:
    play = Play("""
        <startEvent id="s"/>
        <scriptTask id="go">do goto uav1 speed=${1+loopCounter}<loop loopMaximum="2"> </loop>
        </scriptTask>
        s -> go
    """).start()
    assert play.orders() == ["start b1 goto uav1"]
    assert play.behavior("go").parameters == {"speed": 1}
    play.report("go")
    assert play.orders() == ["start b2 goto uav1"]
    assert play.behavior("go").parameters == {"speed": 2}
    assert play.report("go").ended == "completed"


def test_a_subprocess_has_fresh_data_of_its_own_in_each_round() -> None:
    play = Play("""
        <startEvent id="s"/> <endEvent id="e"/>
        <subProcess id="sub"><loop>total < 3</loop> <property id="own"/>
          <scriptTask id="t">seen = own; own = 1; total = total + own</scriptTask>
        </subProcess>
        s -> sub -> e
    """).start({"total": 0})
    assert play.data == {"total": 3, "seen": None}


def test_a_called_process_is_called_anew_in_each_round() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/>
          <callActivity id="call" calledElement="ADD">in n as n, in loopCounter as k, out n as n
            <loop>n < 4</loop></callActivity>
          s -> call
        </process>
        <process id="ADD"> <startEvent id="s2"/>
          <scriptTask id="t">n = n + 1; before = before + 1; seen = loopCounter</scriptTask>
          s2 -> t
        </process>
    """).start({"n": 1})
    assert play.data == {"n": 4}


def test_a_loop_in_a_loop_counts_on_its_own() -> None:
    play = Play("""
        <startEvent id="s"/>
        <subProcess id="outer"><loop loopMaximum="3"> </loop>
          <scriptTask id="keep">row = loopCounter</scriptTask>
          <scriptTask id="t"><loop loopMaximum="2"> </loop><script>n = n + 10 * row + loopCounter
          </script></scriptTask>
          keep -> t
        </subProcess>
        s -> outer
    """).start({"n": 0})
    assert play.data["n"] == 0 + 1 + 10 + 11 + 20 + 21


# --- what ends it early -------------------------------------------------------------------------


def test_an_error_in_a_round_ends_the_whole_at_its_boundary() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="u"/>
        <scriptTask id="go">do goto uav1<loop loopMaximum="3"> </loop></scriptTask>
        <boundaryEvent id="b" attachedToRef="go">error</boundaryEvent>
        s -> go
        b -> u
    """).start()
    play.report("go").trace()
    assert play.report("go", FAILED).trace("error", "leave", "close", "enter") == table("""
        error FAILED caught by b; leave go failed; close go failed; leave go failed
        enter b; leave b; enter u
    """)


def test_boundary_events_belong_to_the_whole_and_are_armed_once() -> None:
    play = waiting(
        "<loop> </loop>",
        '<boundaryEvent id="b" attachedToRef="u">timer PT10S</boundaryEvent>',
    )
    assert play.trace("await") == ["await b"]
    play.advance(6).answer("yes").advance(3.9)
    assert play.at == "u"
    assert play.trace("await") == []
    assert play.advance(0.2).ended == "completed"


def test_a_boundary_event_that_does_not_interrupt_leaves_the_rounds_alone() -> None:
    play = waiting(
        '<loop loopMaximum="2"> </loop>',
        '<boundaryEvent id="b" attachedToRef="u" cancelActivity="false">signal S</boundaryEvent>'
        '<userTask id="also"/>',
        "b -> also",
    )
    play.answer("yes", prompt="u").signal("S")
    assert play.at == "u also"
    assert play.answer("yes", prompt="u").at == "also"


# --- size ---------------------------------------------------------------------------------------


def rounds(made: Mission, count: int) -> tuple[MissionRun, int]:
    """A run of a mission that goes on for ever, `count` batches on; and the most that it held."""
    run = MissionRun(made, None, "r1")
    run.receive(StartRun("MAIN", {"n": 0}), 0)
    held = 0
    for _ in range(count):
        run.receive(Continue(), 0)
        state = run.state
        held = max(held, len(state.tokens) + len(state.scopes) + len(state.yielded))
    return run, held


def test_rounds_without_end_leave_nothing_in_the_state() -> None:
    run, held = rounds(
        mission("""
        <startEvent id="s"/>
        <subProcess id="sub"><loop> </loop> <scriptTask id="t">n = n + 1</scriptTask>
        </subProcess>
        <boundaryEvent id="b" attachedToRef="sub">signal S</boundaryEvent>
        s -> sub
    """),
        50,
    )
    root = run.state.root
    assert root is not None
    rounds_done = root.data["n"]
    assert isinstance(rounds_done, int)
    assert rounds_done > 15_000
    assert held <= 7
