"""Signals reach every catcher of the run, once, and are not kept."""

import pytest

from m2pem.engine.inputs import SignalReceived
from tests.engine.kit import Play
from tests.engine.trace import table

CATCH = '<intermediateCatchEvent id="{id}">signal go</intermediateCatchEvent>'


def test_a_signal_reaches_every_catcher_in_the_order_they_were_armed() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <intermediateCatchEvent id="one">signal go</intermediateCatchEvent>
          <subProcess id="sub"> <startEvent id="s"/> <userTask id="u"/>
            <boundaryEvent id="two" attachedToRef="u">signal go</boundaryEvent>
            <task id="c"/>
            s -> u
            two -> c
          </subProcess>
          <callActivity id="call" calledElement="P"/> <task id="a"/>
          start -> one -> a
          start -> sub
          start -> call
        </process>
        <process id="P"> <startEvent id="s3"/>
          <intermediateCatchEvent id="three">signal go</intermediateCatchEvent>
          s3 -> three
        </process>
        <process id="Q"> <startEvent id="four">signal go</startEvent> <task id="d"/>
          four -> d
        </process>
    """).start()
    play.trace()
    play.signal("go")
    assert play.trace("signal", "triggered", "leave", "enter", "withdraw") == table("""
        signal go
        triggered; leave one; enter a
        triggered; withdraw p1; leave u interrupted; enter two
        triggered; leave three
        enter four
        leave a; leave two; enter c; leave call; leave four; enter d; leave c; leave d
        leave sub
    """)


def test_a_signal_from_outside_writes_its_data_where_each_catcher_stands() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="u"/>
          <intermediateCatchEvent id="one">signal go</intermediateCatchEvent>
          <callActivity id="call" calledElement="P">out y as y</callActivity>
          start -> one
          start -> call
          start -> u
        </process>
        <process id="P"> <startEvent id="s"/> <scriptTask id="t">y = pose.x + 1</scriptTask>
          <intermediateCatchEvent id="two">signal go</intermediateCatchEvent>
          s -> two -> t
        </process>
    """).start()
    play.signal("go", {"pose": {"x": 4}})
    assert play.data == {"pose.x": 4, "y": 5}


def test_a_signal_is_not_kept_for_whoever_waits_later() -> None:
    play = Play(f"""
        <startEvent id="start"/> <userTask id="u"/> {CATCH.format(id="catch")}
        start -> u -> catch
    """).start()
    assert play.signal("go").answer().at == "catch"
    assert play.signal("go").ended == "completed"


def test_throwing_interrupts_the_scope_that_throws() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="after"/>
        <subProcess id="sub"> <startEvent id="s"/>
          <intermediateThrowEvent id="throw">signal go</intermediateThrowEvent>
          <scriptTask id="next">ran = true</scriptTask>
          s -> throw -> next
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">signal go</boundaryEvent>
        start -> sub
        catch -> after
    """).start()
    assert play.at == "after"
    assert "ran" not in play.data
    assert "leave throw interrupted" in play.trace()


def test_a_signal_end_event_throws_and_ends_its_path() -> None:
    play = Play(f"""
        <startEvent id="start"/> {CATCH.format(id="catch")} <userTask id="u"/>
        <endEvent id="throw">signal go</endEvent>
        start -> catch
        start -> u -> throw
    """).start()
    play.trace()
    play.answer()
    assert play.trace("enter", "signal", "leave", "end") == table("""
        leave u; enter throw; signal go; leave catch; leave throw; end completed
    """)


def test_an_outer_interruption_leaves_nothing_for_the_inner_one() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="a"/> <userTask id="b"/>
        <subProcess id="sub"> <userTask id="u"/>
          <boundaryEvent id="inner" attachedToRef="u">signal go</boundaryEvent> <userTask id="c"/>
          inner -> c
        </subProcess>
        <boundaryEvent id="outer" attachedToRef="sub">signal go</boundaryEvent>
        <boundaryEvent id="beside" attachedToRef="sub" cancelActivity="false">signal go
        </boundaryEvent>
        start -> sub
        outer -> a
        beside -> b
    """).start()
    assert play.signal("go").at == "a"


def test_a_boundary_that_does_not_interrupt_catches_every_time() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="n"/>
        <boundaryEvent id="catch" attachedToRef="u" cancelActivity="false">signal go</boundaryEvent>
        start -> u
        catch -> n
    """).start()
    assert play.signal("go").signal("go").at == "u n n"
    assert play.answer(prompt="u").at == "n n"
    assert play.signal("go").at == "n n"


def test_a_signal_that_its_own_catcher_throws_again_is_caught_again_without_end() -> None:
    play = Play(
        """
        <startEvent id="start"/> <userTask id="u"/>
        <boundaryEvent id="catch" attachedToRef="u" cancelActivity="false">signal go</boundaryEvent>
        <endEvent id="throw">signal go</endEvent>
        start -> u
        catch -> throw
    """,
        batch=50,
    ).start()
    play.goes_on = False
    for _ in range(5):
        play.signal("go")
        assert play.run.wants_continue
        assert len(play.steps[-1].records) < 1000
    assert play.stop().ended == "stopped"


def test_a_signal_with_an_id_is_taken_once() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <task id="n"/>
        <boundaryEvent id="catch" attachedToRef="u" cancelActivity="false">signal go</boundaryEvent>
        start -> u
        catch -> n
    """).start()
    play.give(SignalReceived("go", id="7")).give(SignalReceived("go", id="8"))
    assert play.entered().split().count("n") == 2
    assert play.give(SignalReceived("go", id="7")).ignored() == "SignalReceived 7 was taken before"


@pytest.mark.parametrize("steps", range(8))
def test_a_subprocess_completes_or_is_interrupted_never_both(steps: int) -> None:
    # The signal comes before, between and after the last token's end and the subprocess's.
    names = [f"t{number}" for number in range(steps)]
    chain = " -> ".join(["s", *names, "throw"])
    tasks = "".join(f'<task id="{name}"/>' for name in names)
    play = Play(f"""
        <startEvent id="s"/> {tasks} <endEvent id="throw">signal go</endEvent>
        <subProcess id="sub"> <startEvent id="in"/> <task id="t"/>
          in -> t
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">signal go</boundaryEvent>
        <task id="completed"/> <task id="interrupted"/>
        s -> sub -> completed
        catch -> interrupted
        {chain}
    """).start()
    assert play.ended == "completed"
    entered = set(play.entered().split()) & {"completed", "interrupted"}
    assert entered == ({"interrupted"} if steps < 3 else {"completed"})
