"""Errors: who catches them, and what ends with them."""

import pytest

from m2pem.engine import records as r
from tests.engine.kit import CANCELLED, Play
from tests.engine.trace import table


def test_an_error_end_event_is_caught_on_its_subprocess_and_ends_what_is_in_it() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="after"/>
        <subProcess id="sub"> <startEvent id="s"/> <userTask id="u"/> <userTask id="v"/>
          <scriptTask id="drive">do drive_stop evsg1</scriptTask>
          <endEvent id="bad">error E</endEvent>
          s -> u -> bad
          s -> v
          s -> drive
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error E</boundaryEvent>
        start -> sub
        catch -> after
    """).start()
    play.trace()
    play.answer(prompt="u")
    assert play.trace() == table("""
        answer p1 done; write user.decision = done; leave u; take f2
        enter bad; error E caught by catch; leave bad
        withdraw p2; leave v interrupted
        cancel b1; leave drive interrupted
        close sub failed; leave sub failed
        enter catch; leave catch; take f6
        enter after; ask p3 after
    """)
    assert play.report("drive", CANCELLED).at == "after"


CATCHERS = """
    <startEvent id="start"/> <scriptTask id="bad">throw error {thrown}</scriptTask>
    <task id="a"/> <task id="b"/> <task id="c"/>
    <boundaryEvent id="all" attachedToRef="bad">error</boundaryEvent>
    <boundaryEvent id="x" attachedToRef="bad">error X</boundaryEvent>
    <boundaryEvent id="y" attachedToRef="bad">error Y</boundaryEvent>
    start -> bad
    all -> a
    x -> b
    y -> c
"""


@pytest.mark.parametrize(("thrown", "caught"), [("X", "x b"), ("Y", "y c"), ("Z", "all a")])
def test_the_boundary_event_that_names_the_code_comes_before_the_one_that_takes_all(
    thrown: str, caught: str
) -> None:
    assert Play(CATCHERS.format(thrown=thrown)).start().entered() == f"start bad {caught}"


SCOPES = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <task id="out"/>
      <callActivity id="call" calledElement="P"/>
      <boundaryEvent id="outer" attachedToRef="call">error</boundaryEvent>
      start -> call
      outer -> out
    </process>
    <process id="P"> <startEvent id="s"/> <task id="in"/>
      <subProcess id="sub"> <startEvent id="s2"/>
        <scriptTask id="bad">throw error {thrown}</scriptTask>
        s2 -> bad
      </subProcess>
      <boundaryEvent id="inner" attachedToRef="sub">error X</boundaryEvent>
      s -> sub
      inner -> in
    </process>
"""


@pytest.mark.parametrize(("thrown", "caught"), [("X", "inner in"), ("Y", "outer out")])
def test_an_error_goes_up_scope_by_scope(thrown: str, caught: str) -> None:
    play = Play(SCOPES.format(thrown=thrown)).start()
    assert play.entered() == f"start call s sub s2 bad {caught}"
    assert play.ended == "completed"


def test_an_error_that_no_event_catches_fails_the_run_and_cancels_every_behavior() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/>
        <endEvent id="bad" name="Oh no">error E</endEvent>
        <scriptTask id="a">do drive_stop evsg1</scriptTask>
        <subProcess id="sub"> <startEvent id="s"/>
          <scriptTask id="b">do drive_stop evsg2</scriptTask>
          <serviceTask id="c">call X</serviceTask>
          s -> b
          s -> c
        </subProcess>
        start -> u -> bad
        start -> a
        start -> sub
    """).start()
    play.orders()
    play.trace()
    play.answer()
    assert play.ended == "failed"
    assert play.trace("leave", "close") == table("""
        leave u; leave bad
        leave b terminated; leave c terminated; close sub terminated
        leave a terminated; leave sub terminated; close MAIN failed
    """)
    assert play.detail == "error E from bad, which no event catches: thrown by Oh no"
    assert sorted(play.orders()) == ["cancel b1", "cancel b2", "cancel s1", "close p1 done"]
    play.report("b1", CANCELLED).report("b2", CANCELLED)
    assert not play.run.state.behaviors


def test_an_error_in_a_triggered_instance_has_no_catcher_around_it() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="u"/>
          start -> u
        </process>
        <process id="P"> <startEvent id="s">signal go</startEvent>
          <endEvent id="e">error E</endEvent>
          s -> e
        </process>
    """).start()
    assert play.signal("go").ended == "failed"


def test_what_catches_an_error_takes_the_other_boundary_events_with_it() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <boundaryEvent id="late" attachedToRef="drive">timer PT5S</boundaryEvent>
        <boundaryEvent id="catch" attachedToRef="drive">error</boundaryEvent>
        <userTask id="after"/> <task id="no"/>
        start -> drive
        catch -> after
        late -> no
    """).start()
    play.report("drive", CANCELLED)
    assert play.at == "after"
    assert play.run.next_due_us is None


def test_an_error_has_the_place_where_it_was_thrown() -> None:
    play = Play(SCOPES.format(thrown="Y")).start()
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.process, error.element, error.caught_by) == ("P", "bad", "outer")


def test_only_what_an_error_goes_through_has_failed() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="after"/>
        <subProcess id="outer"> <startEvent id="s"/> <userTask id="beside"/>
          <subProcess id="inner"> <startEvent id="t"/> <userTask id="u"/>
            <serviceTask id="bad">call Detector</serviceTask>
            t -> bad
            t -> u
          </subProcess>
          s -> inner
          s -> beside
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="outer">error</boundaryEvent>
        start -> outer
        catch -> after
    """).start()
    play.trace()
    play.fail("bad", "E")
    left = set(play.trace("leave", "close"))
    assert left == {
        "leave bad failed",
        "leave u interrupted",
        "close inner failed",
        "leave inner failed",
        "leave beside interrupted",
        "close outer failed",
        "leave outer failed",
        "leave catch",
    }
