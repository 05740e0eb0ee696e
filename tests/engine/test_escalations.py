"""Escalations: caught outside the scope that throws them, or only recorded."""

from tests.engine.kit import CANCELLED, Play
from tests.engine.trace import table

INSIDE = """
    <startEvent id="start"/> <userTask id="after"/> <task id="done"/>
    <subProcess id="sub"> <startEvent id="s"/> <userTask id="other"/> <userTask id="u"/>
      {throw}
      s -> other
    </subProcess>
    <boundaryEvent id="catch" attachedToRef="sub" {interrupting}>escalation X</boundaryEvent>
    start -> sub -> done
    catch -> after
"""
THROW = """<intermediateThrowEvent id="throw">escalation X</intermediateThrowEvent>
    <scriptTask id="next">ran = true</scriptTask>
    s -> u -> throw -> next
"""
END = """<endEvent id="throw">escalation X</endEvent>
    s -> u -> throw
"""
NOT = 'cancelActivity="false"'


def test_an_interrupting_boundary_ends_the_subprocess_before_its_next_step() -> None:
    play = Play(INSIDE.format(throw=THROW, interrupting="")).start()
    play.trace()
    play.answer(prompt="u")
    assert play.trace("enter", "leave", "escalation", "write", "close") == table("""
        write user.decision = done; leave u
        enter throw; escalation X caught by catch
        leave other interrupted; leave throw interrupted
        close sub interrupted; leave sub interrupted
        enter catch; leave catch; enter after
    """)
    assert "ran" not in play.data


def test_a_boundary_that_does_not_interrupt_lets_the_inside_run_on() -> None:
    play = Play(INSIDE.format(throw=THROW, interrupting=NOT)).start()
    assert play.answer(prompt="u").at == "other after"
    assert play.data["ran"] is True
    assert play.answer(prompt="other").at == "after"


def test_a_boundary_event_catches_as_often_as_it_is_thrown() -> None:
    play = Play(
        INSIDE.format(throw=THROW.replace("next\n", "next\n s -> throw\n"), interrupting=NOT)
    ).start()
    assert play.answer(prompt="u").at == "other after after"


def test_an_escalation_end_event_ends_its_path_only() -> None:
    play = Play(INSIDE.format(throw=END, interrupting=NOT)).start()
    assert play.answer(prompt="u").at == "other after"


def test_an_escalation_end_event_as_the_last_of_its_scope_ends_the_scope() -> None:
    play = Play(INSIDE.format(throw=END, interrupting=NOT)).start()
    play.answer(prompt="other").answer(prompt="u")
    assert play.at == "after"
    assert "done" in play.entered()


def test_an_interrupting_boundary_is_reached_by_an_end_event_too() -> None:
    play = Play(INSIDE.format(throw=END, interrupting="")).start()
    assert play.answer(prompt="u").at == "after"
    assert "done" not in play.entered()


def test_an_escalation_that_no_event_catches_is_recorded_and_changes_nothing() -> None:
    play = Play(f"""
        <startEvent id="s"/> <userTask id="u"/> {THROW}
    """).start()
    play.trace()
    play.answer()
    assert play.trace("escalation", "enter") == ["enter throw", "escalation X", "enter next"]
    assert play.ended == "completed"


def test_the_nearest_catcher_of_the_code_catches_else_one_that_takes_all() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <task id="a"/> <task id="b"/> <callActivity id="call" calledElement="P"/>
          <boundaryEvent id="all" attachedToRef="call">escalation</boundaryEvent>
          <boundaryEvent id="y" attachedToRef="call">escalation Y</boundaryEvent>
          start -> call
          all -> a
          y -> b
        </process>
        <process id="P"> <startEvent id="s"/>
          <subProcess id="sub"> <startEvent id="s2"/> <endEvent id="e">escalation X</endEvent>
            s2 -> e
          </subProcess>
          <boundaryEvent id="wrong" attachedToRef="sub">escalation Z</boundaryEvent>
          <endEvent id="end"/>
          s -> sub -> end
          wrong -> end
        </process>
    """).start()
    assert play.entered() == "start call s sub s2 e all a"


def test_the_original_systems_detection_pattern() -> None:
    # Drive while a detector looks; a detection escalates, which must stop the drive and nothing
    # of the inside may run on.
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="search"> <startEvent id="s"/> <parallelGateway id="fork"/>
          <scriptTask id="drive">do single_vehicle_routing evsg1 route=alpha</scriptTask>
          <serviceTask id="look">call Detector evsg1/gpr</serviceTask>
          <intermediateThrowEvent id="found">escalation HAZARD</intermediateThrowEvent>
          <scriptTask id="wrong">do ptz_track evsg1/ptz</scriptTask> <endEvent id="e"/>
          s -> fork -> drive -> e
          fork -> look -> found -> wrong -> e
        </subProcess>
        <boundaryEvent id="hazard" attachedToRef="search">escalation HAZARD</boundaryEvent>
        <scriptTask id="back">do reverse evsg1</scriptTask> <endEvent id="end"/>
        start -> search -> end
        hazard -> back -> end
    """).start()
    play.orders()
    play.complete("look", detection={"type": "gpr"})
    assert play.orders() == ["cancel b1", "start b2 reverse evsg1"]
    assert play.behavior("b2").preempts == ("r1.b1",)
    assert play.at == "back"
    assert play.report("b1", CANCELLED).report("b2").ended == "completed"
    assert "wrong" not in play.entered()
