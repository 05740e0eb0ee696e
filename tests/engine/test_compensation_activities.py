"""Activities that undo others: what they may be, and what becomes of errors in them (10.7)."""

from tests.engine.kit import FAILED, Play


def test_a_compensation_activity_may_command_vehicles() -> None:
    play = Play(
        """
        <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask>
        <endEvent id="back">compensate</endEvent>
        <scriptTask id="home" isForCompensation="true">do return_to_launch uav1</scriptTask>
        go undo home
        start -> go -> back
        """
    )
    play.start().report("go").report("home")
    assert play.ended == "completed"


def test_a_compensation_activity_may_be_a_subprocess() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <endEvent id="back">compensate</endEvent>
        <subProcess id="unA" isForCompensation="true">
          <startEvent id="s"/> <userTask id="x"/> <userTask id="y"/> <endEvent id="e"/>
          s -> x -> y -> e
        </subProcess>
        a undo unA
        start -> a -> back
        """
    ).start()
    play.answer().answer()
    assert play.entered() == "start a back unA s x y e"
    assert play.ended == "completed"


def test_a_compensation_activity_may_call_a_process() -> None:
    play = Play(
        """
        <process id="MAIN" isExecutable="true">
          <startEvent id="start"/> <task id="a"/> <endEvent id="back">compensate</endEvent>
          <callActivity id="unA" calledElement="SUB" isForCompensation="true"/>
          a undo unA
          start -> a -> back
        </process>
        <process id="SUB">
          <startEvent id="s"/> <userTask id="x"/> <endEvent id="e"/>
          s -> x -> e
        </process>
        """
    )
    play.start().answer()
    assert play.ended == "completed"


def test_an_error_in_a_compensation_activity_goes_up_as_any_other() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <subProcess id="sub">
          <startEvent id="s"/> <task id="a"/> <task id="b"/>
          <endEvent id="back">compensate</endEvent>
          <scriptTask id="unA" isForCompensation="true">do land uav1</scriptTask>
          <scriptTask id="unB" isForCompensation="true">do goto uav1</scriptTask>
          a undo unA
          b undo unB
          s -> a -> b -> back
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error</boundaryEvent>
        <endEvent id="end"/> <endEvent id="end2"/>
        start -> sub -> end
        catch -> end2
        """
    )
    play.start().report("unB", FAILED)
    assert play.entered() == "start sub s a b back unB catch end2"
    assert play.ended == "completed"


def test_an_error_in_a_compensation_activity_that_no_event_catches_fails_the_run() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <endEvent id="back">compensate</endEvent>
        <scriptTask id="unA" isForCompensation="true">throw error E</scriptTask>
        a undo unA
        start -> a -> back
        """
    ).start()
    assert play.ended == "failed"
    assert "error E from unA" in play.detail


def test_a_compensation_activity_has_boundary_events_of_its_own() -> None:
    play = (
        Play(
            """
        <startEvent id="start"/> <task id="a"/> <task id="b"/>
        <endEvent id="back">compensate</endEvent> <task id="unA" isForCompensation="true"/>
        <userTask id="unB" isForCompensation="true"/>
        <boundaryEvent id="late" attachedToRef="unB">timer PT5S</boundaryEvent> <task id="tell"/>
        <endEvent id="told"/>
        a undo unA
        b undo unB
        late -> tell -> told
        start -> a -> b -> back
        """
        )
        .start()
        .advance(5)
    )
    assert play.entered() == "start a b back unB late unA tell told"
    assert play.ended == "completed"


def test_the_boundary_events_of_an_activity_that_is_undone_are_over() -> None:
    play = Play(
        """
        <startEvent id="start"/> <endEvent id="back">compensate</endEvent>
        <subProcess id="sub">
          <startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
          <userTask id="unA" isForCompensation="true"/>
          <boundaryEvent id="gone" attachedToRef="unA">signal X</boundaryEvent>
          <endEvent id="failed">error E</endEvent>
          a undo unA
          s -> a -> e
          gone -> failed
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error E</boundaryEvent>
        <boundaryEvent id="stop" attachedToRef="sub">signal S</boundaryEvent> <endEvent id="end"/>
        start -> sub -> back
        catch -> end
        stop -> end
        """
    ).start()
    play.signal("S")
    assert play.at == "back unA"
    play.signal("X")
    assert play.ended == "failed"
