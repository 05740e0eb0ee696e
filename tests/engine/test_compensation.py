"""Undoing completed activities: what can be undone, in which order, and who waits (13.5.5)."""

from tests.engine.kit import Play
from tests.engine.trace import table

UNDO = ["undo", "undoing", "undone", "reopen", "enable"]

TWO = """
    <startEvent id="start"/> <userTask id="a"/> <userTask id="b"/>
    <intermediateThrowEvent id="back">compensate</intermediateThrowEvent>
    <task id="after"/> <endEvent id="end"/>
    <userTask id="unA" isForCompensation="true"/> <userTask id="unB" isForCompensation="true"/>
    a undo unA
    b undo unB
    start -> a -> b -> back -> after -> end
"""


def test_completed_activities_are_undone_one_after_the_other_in_reverse_order() -> None:
    play = Play(TWO).start().answer().answer()
    assert play.at == "back unB"
    play.answer()
    assert play.at == "back unA"
    play.answer()
    assert play.entered() == "start a b back unB unA after end"
    assert play.ended == "completed"


def test_the_records_of_a_compensation() -> None:
    play = Play(TWO).start().answer()
    play.trace()
    play.answer().answer().answer()
    assert play.trace() == table(
        """
        answer p2 done; write user.decision = done; enable b; leave b; take f3; enter back
        undo back 2 1; undoing b; enter unB; ask p3 unB
        answer p3 done; write user.decision = done; leave unB
        undoing a; enter unA; ask p4 unA
        answer p4 done; write user.decision = done; leave unA; undone 1
        leave back; take f4; enter after; leave after; take f5; enter end; leave end
        close MAIN; end completed
        """
    )


def test_an_activity_that_has_not_completed_is_not_undone() -> None:
    play = Play(
        """
        <startEvent id="start"/> <userTask id="a"/> <userTask id="b"/>
        <boundaryEvent id="stop" attachedToRef="b">signal S</boundaryEvent>
        <intermediateThrowEvent id="back">compensate</intermediateThrowEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        <userTask id="unA" isForCompensation="true"/> <userTask id="unB" isForCompensation="true"/>
        a undo unA
        b undo unB
        start -> a -> b -> end
        stop -> back -> end2
        """
    )
    play.start().answer().signal("S")
    assert play.at == "back unA"
    play.answer()
    assert play.ended == "completed"
    assert "unB" not in play.entered()


def test_an_activity_that_an_event_names_is_undone_alone_and_once() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <task id="b"/> <endEvent id="end"/>
        <intermediateThrowEvent id="one">compensate a</intermediateThrowEvent>
        <intermediateThrowEvent id="again">compensate a</intermediateThrowEvent>
        <intermediateThrowEvent id="all">compensate</intermediateThrowEvent>
        <task id="unA" isForCompensation="true"/> <task id="unB" isForCompensation="true"/>
        a undo unA
        b undo unB
        start -> a -> b -> one -> again -> all -> end
        """
    ).start()
    assert play.entered() == "start a b one unA again all unB end"
    assert play.ended == "completed"


def test_an_activity_that_completed_twice_is_undone_twice() -> None:
    play = Play(
        """
        <startEvent id="start"/> <scriptTask id="a">n = n + 1</scriptTask>
        <exclusiveGateway id="more" default="no"/>
        <endEvent id="back">compensate a</endEvent>
        <scriptTask id="unA" isForCompensation="true">undone = undone + 1</scriptTask>
        a undo unA
        start -> a -> more
        more -> a if n < 3
        no: more -> back
        """
    ).start({"n": 0, "undone": 0})
    assert play.data["undone"] == 3
    assert play.ended == "completed"


def test_nothing_to_undo_lets_the_event_go_on() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/>
        <intermediateThrowEvent id="back">compensate</intermediateThrowEvent>
         <endEvent id="end"/> <task id="unA" isForCompensation="true"/>
        a undo unA
        start -> back -> a -> end
        """
    ).start()
    assert play.trace(*UNDO) == ["undo back", "enable a"]
    assert play.ended == "completed"


NOWAIT = """
    <startEvent id="start"/> <task id="a"/> <task id="b"/> <endEvent id="end"/>
    <intermediateThrowEvent id="back">compensate nowait</intermediateThrowEvent>
    <userTask id="after"/>
    <userTask id="unA" isForCompensation="true"/> <userTask id="unB" isForCompensation="true"/>
    a undo unA
    b undo unB
    start -> a -> b -> back -> after -> end
"""


def test_an_event_that_does_not_wait_goes_on_at_once() -> None:
    play = Play(NOWAIT).start()
    assert play.at == "after unB"
    play.answer(prompt="unB")
    assert play.at == "after unA"
    play.answer(prompt="after").answer(prompt="unA")
    assert play.ended == "completed"


def test_a_scope_does_not_end_before_what_is_undone_in_it() -> None:
    play = Play(NOWAIT).start().answer(prompt="after")
    assert play.at == "unB"
    play.answer(prompt="unB")
    assert play.at == "unA"
    assert not play.ended
    play.answer()
    assert play.ended == "completed"


def test_an_end_event_waits_until_all_is_undone() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <endEvent id="back">compensate</endEvent>
        <userTask id="unA" isForCompensation="true"/>
        a undo unA
        start -> a -> back
        """
    ).start()
    assert play.at == "back unA"
    play.answer()
    assert play.trace(*UNDO, "leave")[-2:] == ["undone 1", "leave back"]
    assert play.ended == "completed"


def test_what_one_event_is_undoing_another_leaves_alone() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <parallelGateway id="fork"/>
        <intermediateThrowEvent id="one">compensate</intermediateThrowEvent>
        <intermediateThrowEvent id="two">compensate</intermediateThrowEvent>
        <userTask id="c"/> <endEvent id="end"/>
        <userTask id="unA" isForCompensation="true"/>
        a undo unA
        start -> a -> fork -> one -> end
        fork -> c -> two -> end
        """
    ).start()
    play.answer(prompt="c")
    assert play.trace("undo") == ["undo one 1", "undo two"]
    assert play.at == "one unA"


# --- subprocesses -------------------------------------------------------------------------------

INSIDE = """
    <startEvent id="start"/>
    <subProcess id="sub">
      <startEvent id="s"/> <task id="a"/> <task id="b"/> <endEvent id="e"/>
      <task id="unA" isForCompensation="true"/> <task id="unB" isForCompensation="true"/>
      a undo unA
      b undo unB
      s -> a -> b -> e
    </subProcess>
    <task id="c"/> <task id="unC" isForCompensation="true"/>
    c undo unC
    <endEvent id="back">compensate</endEvent>
    start -> sub -> c -> back
"""


def test_a_completed_subprocess_is_undone_by_undoing_what_was_done_in_it() -> None:
    play = Play(INSIDE).start()
    assert play.entered() == "start sub s a b e c back unC sub unB unA"
    assert play.ended == "completed"


def test_the_records_of_a_subprocess_that_is_undone() -> None:
    play = Play(INSIDE).start()
    assert play.trace("open", "close", "reopen", "enable", "undo", "undoing", "undone") == table(
        """
        open MAIN; open sub; enable a; enable b; close sub kept; enable sub; enable c
        undo back 4 3; undoing c
        undoing sub; reopen sub; undo sub 2 1; undoing b; undoing a; undone 2; close sub
        undone 1; close MAIN
        """
    )


def test_a_subprocess_with_nothing_to_undo_is_forgotten() -> None:
    play = Play(
        """
        <startEvent id="start"/> <userTask id="wait"/> <endEvent id="end"/>
        <subProcess id="sub"><startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
        s -> a -> e
        </subProcess>
        start -> sub -> wait -> end
        """
    ).start()
    root = play.run.state.root
    assert root is not None
    assert not root.compensable
    assert "close sub" in play.trace()


def test_a_subprocess_with_a_compensation_activity_is_undone_by_that_alone() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <subProcess id="sub">
          <startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
          <task id="unA" isForCompensation="true"/>
          a undo unA
          s -> a -> e
        </subProcess>
        <task id="unSub" isForCompensation="true"/>
        sub undo unSub
        <endEvent id="back">compensate</endEvent>
        start -> sub -> back
        """
    ).start()
    assert play.trace("close", "undoing") == ["close sub", "undoing sub", "close MAIN"]


def test_undoing_goes_down_through_all_depths() -> None:
    play = Play(
        """
        <startEvent id="start"/> <endEvent id="back">compensate outer</endEvent>
        <subProcess id="outer">
          <startEvent id="s1"/> <endEvent id="e1"/>
          <subProcess id="inner">
            <startEvent id="s2"/> <task id="a"/> <endEvent id="e2"/>
            <userTask id="unA" isForCompensation="true"/>
            a undo unA
            s2 -> a -> e2
          </subProcess>
          <task id="b"/> <task id="unB" isForCompensation="true"/>
          b undo unB
          s1 -> inner -> b -> e1
        </subProcess>
        start -> outer -> back
        """
    ).start()
    assert play.at == "back unA"
    assert play.entered().endswith("back outer unB inner unA")
    play.answer()
    assert play.ended == "completed"


def test_many_levels_are_undone_without_recursion() -> None:
    depth = 300
    head = "".join(
        f'<subProcess id="sub{n}"><startEvent id="s{n}"/> <endEvent id="e{n}"/>\n'
        f"s{n} -> {f'sub{n + 1}' if n < depth else 'a'} -> e{n}\n"
        for n in range(1, depth + 1)
    )
    play = Play(
        f"""
        <startEvent id="start"/> <endEvent id="back">compensate</endEvent>
        {head}
        <task id="a"/> <task id="unA" isForCompensation="true"/>
        a undo unA
        {"</subProcess>" * depth}
        start -> sub1 -> back
        """
    ).start()
    assert play.entered().endswith(f"sub{depth} unA")
    assert play.ended == "completed"


def test_a_called_process_is_undone_with_the_data_that_it_had() -> None:
    play = Play(
        """
        <process id="MAIN" isExecutable="true">
          <startEvent id="start"/> <endEvent id="back">compensate</endEvent>
          <callActivity id="first" calledElement="SUB">in 1 as n</callActivity>
          <callActivity id="second" calledElement="SUB">in 2 as n</callActivity>
          start -> first -> second -> back
        </process>
        <process id="SUB">
          <startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
          <scriptTask id="unA" isForCompensation="true">seen = n</scriptTask>
          a undo unA
          s -> a -> e
        </process>
        """
    ).start()
    assert play.trace("write") == ["write n = 1", "write n = 2", "write seen = 2", "write seen = 1"]
    assert play.ended == "completed"


def test_a_throw_in_a_subprocess_undoes_only_what_was_done_there() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <endEvent id="end"/>
        <task id="unA" isForCompensation="true"/>
        a undo unA
        <subProcess id="sub">
          <startEvent id="s"/> <task id="b"/> <endEvent id="back">compensate</endEvent>
          <task id="unB" isForCompensation="true"/>
          b undo unB
          s -> b -> back
        </subProcess>
        start -> a -> sub -> end
        """
    ).start()
    assert play.entered() == "start a sub s b back unB end"


def test_a_scope_that_was_terminated_cannot_be_undone() -> None:
    play = Play(
        """
        <startEvent id="start"/> <endEvent id="back">compensate</endEvent>
        <subProcess id="sub">
          <startEvent id="s"/> <task id="a"/> <endEvent id="e">terminate</endEvent>
          <task id="unA" isForCompensation="true"/>
          a undo unA
          s -> a -> e
        </subProcess>
        <task id="unSub" isForCompensation="true"/>
        sub undo unSub
        start -> sub -> back
        """
    ).start()
    assert play.trace("undo", "undoing") == ["undo back"]
    assert play.ended == "completed"


# --- what ends it early -------------------------------------------------------------------------


def test_an_interruption_ends_what_is_being_undone() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <subProcess id="sub">
          <startEvent id="s"/> <task id="a"/> <endEvent id="back">compensate</endEvent>
          <scriptTask id="unA" isForCompensation="true">do goto uav1</scriptTask>
          a undo unA
          s -> a -> back
        </subProcess>
        <boundaryEvent id="stop" attachedToRef="sub">signal S</boundaryEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        start -> sub -> end
        stop -> end2
        """
    )
    play.start().signal("S")
    assert play.orders()[-1] == "cancel b1"
    assert play.ended == "completed"


def test_terminate_ends_what_is_being_undone() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <parallelGateway id="fork"/>
        <endEvent id="back">compensate</endEvent> <userTask id="w"/>
        <endEvent id="kill">terminate</endEvent>
        <userTask id="unA" isForCompensation="true"/>
        a undo unA
        start -> a -> fork -> back
        fork -> w -> kill
        """
    )
    play.start().answer(prompt="w")
    assert play.ended == "terminated"


def test_stop_and_pause_while_something_is_undone() -> None:
    play = Play(TWO).start().answer().answer().pause().answer()
    assert play.at == "back unB"
    play.resume()
    assert play.at == "back unA"
    play.stop()
    assert play.ended == "stopped"


def test_steps_left_over_by_a_batch_go_on() -> None:
    whole = Play(INSIDE).start()
    for batch in (1, 2, 3):
        play = Play(INSIDE, batch=batch).start()
        assert play.entered() == "start sub s a b e c back unC sub unB unA"
        assert play.ended == whole.ended == "completed"


def test_an_inclusive_join_does_not_wait_for_what_undoes() -> None:
    play = Play(
        """
        <startEvent id="start"/> <inclusiveGateway id="or"/> <task id="b"/>
        <inclusiveGateway id="join"/> <endEvent id="end"/> <parallelGateway id="fork"/>
        <subProcess id="sub"><startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
          <userTask id="unA" isForCompensation="true"/>
          a undo unA
          s -> a -> e
        </subProcess>
        <intermediateThrowEvent id="back">compensate nowait</intermediateThrowEvent>
        start -> or -> fork -> b -> join
        fork -> sub -> back -> join
        join -> end
        """
    ).start()
    assert play.at == "unA"
    assert "end" in play.entered().split()
    play.answer()
    assert play.ended == "completed"


def test_what_can_be_undone_does_not_keep_the_run_alive() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <endEvent id="end"/>
        <task id="unA" isForCompensation="true"/>
        a undo unA
        start -> a -> end
        """
    ).start()
    assert play.ended == "completed"
