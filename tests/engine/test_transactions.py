"""Transactions: committed, cancelled, or left by an error (10.3.5, 10.5.6, 13.5.6)."""

from tests.engine.kit import FAILED, Play
from tests.engine.trace import table

BOOK = """
    <startEvent id="start"/>
    <transaction id="trip">
      <startEvent id="s"/> <task id="flight"/> <task id="hotel"/> <userTask id="ok"/>
      <exclusiveGateway id="which" default="yes"/>
      <endEvent id="booked"/> <endEvent id="no">cancel</endEvent>
      <userTask id="unFlight" isForCompensation="true"/>
      <userTask id="unHotel" isForCompensation="true"/>
      flight undo unFlight
      hotel undo unHotel
      s -> flight -> hotel -> ok -> which
      yes: which -> booked
      which -> no if user.decision == 'no'
    </transaction>
    <boundaryEvent id="cancelled" attachedToRef="trip">cancel</boundaryEvent>
    <boundaryEvent id="hazard" attachedToRef="trip">error</boundaryEvent>
    <boundaryEvent id="late" attachedToRef="trip">timer PT1M</boundaryEvent>
    <task id="sorry"/> <endEvent id="end"/> <endEvent id="end2"/> <endEvent id="end3"/>
    <endEvent id="end4"/>
    start -> trip -> end
    cancelled -> sorry -> end2
    hazard -> end3
    late -> end4
"""
YES_OR_NO = BOOK.replace('<userTask id="ok"/>', '<userTask id="ok">ask yes no</userTask>')


def test_a_transaction_that_completes_goes_on_as_a_subprocess() -> None:
    play = Play(YES_OR_NO).start().answer("yes")
    assert play.entered() == "start trip s flight hotel ok which booked end"
    assert play.ended == "completed"


def test_a_cancelled_transaction_is_undone_before_it_is_left() -> None:
    play = Play(YES_OR_NO).start().answer("no")
    assert play.at == "unHotel"
    play.answer()
    assert play.at == "unFlight"
    play.answer()
    assert play.entered().endswith("no unHotel unFlight cancelled sorry end2")
    assert play.ended == "completed"


def test_the_records_of_a_cancelled_transaction() -> None:
    play = Play(YES_OR_NO).start()
    play.trace()
    play.answer("no").answer().answer()
    assert [
        line for line in play.trace() if line.split()[0] not in ("write", "answer", "take")
    ] == table(
        """
        leave ok; enter which; leave which; enter no; leave no
        cancelled no; undo no 2 1
        undoing hotel; enter unHotel; ask p2 unHotel; leave unHotel
        undoing flight; enter unFlight; ask p3 unFlight; leave unFlight; undone 1
        close trip terminated; leave trip terminated; enter cancelled
        leave cancelled; enter sorry; leave sorry; enter end2; leave end2
        close MAIN; end completed
        """
    )


def test_boundary_events_wait_for_nothing_during_the_rollback() -> None:
    play = Play(YES_OR_NO).start().answer("no").advance(120)
    assert play.at == "unHotel"


def test_a_cancel_ends_all_else_in_the_transaction() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <transaction id="trip">
          <startEvent id="s"/> <parallelGateway id="fork"/> <userTask id="w"/>
          <scriptTask id="go">do goto uav1</scriptTask>
          <subProcess id="inner"><startEvent id="is"/> <userTask id="iw"/> <endEvent id="ie"/>
            is -> iw -> ie
          </subProcess>
          <endEvent id="no">cancel</endEvent> <endEvent id="e"/>
          <task id="unGo" isForCompensation="true"/>
          go undo unGo
          s -> fork -> w -> no
          fork -> go -> e
          fork -> inner -> e
        </transaction>
        <boundaryEvent id="cancelled" attachedToRef="trip">cancel</boundaryEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        start -> trip -> end
        cancelled -> end2
        """
    ).start()
    play.orders()
    play.answer(prompt="w")
    assert play.orders() == ["close p1 done", "close p2", "cancel b1"]
    assert play.trace("undo", "undoing", "cancelled") == ["cancelled no", "undo no"]
    assert play.ended == "completed"


def test_an_error_leaves_a_transaction_without_undoing_anything() -> None:
    play = Play(
        YES_OR_NO.replace(
            '<userTask id="ok">ask yes no</userTask>',
            '<scriptTask id="ok">do goto uav1</scriptTask>',
        )
    ).start()
    play.report("ok", FAILED)
    assert play.entered() == "start trip s flight hotel ok hazard end3"
    assert play.trace("undo") == []


def test_an_error_during_the_rollback_is_a_hazard() -> None:
    play = (
        Play(
            YES_OR_NO.replace(
                '<userTask id="unHotel" isForCompensation="true"/>',
                '<scriptTask id="unHotel" isForCompensation="true">throw error E</scriptTask>',
            )
        )
        .start()
        .answer("no")
    )
    assert play.entered().endswith("no unHotel hazard end3")
    assert play.ended == "completed"


def test_a_cancel_that_no_event_catches_ends_the_branch() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <transaction id="trip">
          <startEvent id="s"/> <task id="a"/> <endEvent id="no">cancel</endEvent>
          <task id="unA" isForCompensation="true"/>
          a undo unA
          s -> a -> no
        </transaction>
        <task id="after"/> <endEvent id="end"/>
        start -> trip -> after -> end
        """
    ).start()
    assert play.entered() == "start trip s a no unA"
    assert play.ended == "completed"


def test_what_was_being_undone_is_undone_by_the_rollback_instead() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <transaction id="trip">
          <startEvent id="s"/> <task id="a"/> <task id="b"/> <parallelGateway id="fork"/>
          <intermediateThrowEvent id="back">compensate</intermediateThrowEvent> <endEvent id="e"/>
          <userTask id="w"/> <endEvent id="no">cancel</endEvent>
          <userTask id="unA" isForCompensation="true"/>
          <userTask id="unB" isForCompensation="true"/>
          a undo unA
          b undo unB
          s -> a -> b -> fork -> back -> e
          fork -> w -> no
        </transaction>
        <boundaryEvent id="cancelled" attachedToRef="trip">cancel</boundaryEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        start -> trip -> end
        cancelled -> end2
        """
    ).start()
    assert play.at == "back w unB"
    play.answer(prompt="w")
    assert play.at == "unA"
    play.answer()
    assert play.ended == "completed"
    assert play.trace("undoing") == ["undoing b", "undoing a"]


def test_a_committed_transaction_can_be_undone_by_its_parent() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <transaction id="trip">
          <startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
          <task id="unA" isForCompensation="true"/>
          a undo unA
          s -> a -> e
        </transaction>
        <endEvent id="back">compensate trip</endEvent>
        start -> trip -> back
        """
    ).start()
    assert play.entered() == "start trip s a e back trip unA"
    assert play.ended == "completed"


def test_a_transaction_in_a_transaction_is_undone_with_it() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <transaction id="outer">
          <startEvent id="s1"/> <task id="a"/> <endEvent id="no">cancel</endEvent>
          <transaction id="inner">
            <startEvent id="s2"/> <task id="b"/> <endEvent id="e2"/>
            <task id="unB" isForCompensation="true"/>
            b undo unB
            s2 -> b -> e2
          </transaction>
          <task id="unA" isForCompensation="true"/>
          a undo unA
          s1 -> a -> inner -> no
        </transaction>
        <boundaryEvent id="cancelled" attachedToRef="outer">cancel</boundaryEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        start -> outer -> end
        cancelled -> end2
        """
    ).start()
    assert play.entered() == "start outer s1 a inner s2 b e2 no inner unB unA cancelled end2"
    assert play.ended == "completed"
