"""Messages go to one receiver, and are kept until a receiver waits."""

import pytest

from m2pem.engine.inputs import MessageReceived
from tests.engine.kit import Play
from tests.engine.snapshot import snapshot


def test_a_message_goes_to_the_one_that_has_waited_longest() -> None:
    play = Play("""
        <startEvent id="start"/> <receiveTask id="one" messageRef="m"/>
        <intermediateCatchEvent id="two">message m</intermediateCatchEvent> <userTask id="u"/>
        <boundaryEvent id="three" attachedToRef="u">message m</boundaryEvent>
        start -> one
        start -> two
        start -> u
        three -> end
        <endEvent id="end"/>
    """).start()
    assert play.message("m").at == "two u"
    assert play.message("m").at == "u"
    assert play.message("m").ended == "completed"


def test_a_message_is_kept_with_its_data_until_a_receiver_waits() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <receiveTask id="get" messageRef="m"/>
        <receiveTask id="next" messageRef="m"/> <receiveTask id="last" messageRef="m"/>
        start -> u -> get -> next -> last
    """).start()
    play.message("m", {"x": 1}).message("m", {"x": 2, "y": 3})
    assert play.data == {}
    play.trace()
    assert play.answer().at == "last"
    assert play.trace("write")[1:] == ["write x = 1", "write x = 2", "write y = 3"]


@pytest.mark.parametrize("sequential", ["true", "false"])
@pytest.mark.parametrize("kept", [0, 1, 2, 3])
def test_each_instance_of_a_receive_task_takes_a_message(sequential: str, kept: int) -> None:
    play = Play(f"""
        <startEvent id="start"/> <userTask id="u"/>
        <receiveTask id="get" messageRef="m">
          <each isSequential="{sequential}">3</each>
        </receiveTask>
        start -> u -> get
    """).start()
    for _ in range(kept):
        play.message("m")
    play.answer()
    for _ in range(kept, 3):
        assert not play.ended
        play.message("m")
    assert play.ended == "completed"
    assert play.run.state.kept_messages == {}


def test_a_message_that_the_mission_sends_is_kept_too() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/>
        <intermediateThrowEvent id="send">message m</intermediateThrowEvent>
        <intermediateCatchEvent id="get">message m</intermediateCatchEvent>
        start -> send
        start -> u -> get
    """).start()
    assert "message m kept" in play.trace()
    assert play.answer().ended == "completed"


def test_a_message_that_nothing_receives_is_kept_for_a_revision_unless_it_is_from_outside() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <endEvent id="send">message m</endEvent>
        start -> u
        start -> send
    """).start()
    assert "message m kept" in play.trace()
    before = snapshot(play.run.state)
    play.give(MessageReceived("m", id="9"))
    assert play.ignored() == "nothing in the mission receives message m"
    assert snapshot(play.run.state) == before | {"seq": before["seq"] + 1}


def test_a_kept_message_interrupts_an_activity_as_it_is_entered() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="after"/>
        <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <boundaryEvent id="stop" attachedToRef="drive">message m</boundaryEvent>
        start -> u -> drive
        stop -> after
    """).start()
    play.message("m")
    assert play.answer().at == "after"
    assert "start" not in play.orders()


def test_a_boundary_that_does_not_interrupt_takes_every_message_that_was_kept() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="v"/> <userTask id="n"/>
        <boundaryEvent id="catch" attachedToRef="v" cancelActivity="false">message m</boundaryEvent>
        start -> u -> v
        catch -> n
    """).start()
    play.message("m", {"x": 1}).message("m", {"x": 2})
    play.trace()
    assert play.answer().at == "v n n"
    assert play.trace("write")[1:] == ["write x = 1", "write x = 2"]
    assert play.run.state.kept_messages == {}
    assert play.message("m").at == "v n n n"


def test_a_receive_task_with_a_boundary_for_the_same_message_takes_it_at_the_boundary() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="a"/> <userTask id="b"/>
        <receiveTask id="get" messageRef="m"/>
        <boundaryEvent id="catch" attachedToRef="get">message m</boundaryEvent>
        start -> u -> get -> a
        catch -> b
    """).start()
    play.message("m")
    assert play.answer().at == "b"


def test_messages_start_an_instance_for_each_once_no_receiver_waits() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <receiveTask id="get" messageRef="m"/> <userTask id="u"/>
          start -> get
          start -> u
        </process>
        <process id="P"> <startEvent id="s">message m</startEvent> <userTask id="p"/>
          s -> p
        </process>
    """).start()
    assert play.message("m").at == "u"
    assert play.message("m").message("m").at == "u p p"


def test_an_uncaught_error_after_a_message_is_delivered_ends_the_run_there() -> None:
    play = Play("""
        <startEvent id="start"/> <sendTask id="send" messageRef="m"/> <task id="next"/>
        <receiveTask id="get" messageRef="m"/> <task id="no"/> <intermediateThrowEvent id="pause"/>
        start -> get
        start -> pause -> send -> next
        get -> no if 1 / x > 0
    """).start({"x": 0})
    assert play.ended == "failed"
    assert play.entered() == "start get pause send"
