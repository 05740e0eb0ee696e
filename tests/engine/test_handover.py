"""Hand-over: what a mission sees of an operator who takes a vehicle and gives it back."""

import pytest

from m2pem.bpmn import parse_mission
from m2pem.engine.elements.behaviors import preview_control_taken
from m2pem.engine.inputs import ControlReturned, ControlTaken
from m2pem.engine.records import ErrorThrown
from tests.engine.kit import CANCELLED, SUCCEEDED, Play
from tests.engine.notation import xml

WAITS = """
    <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    <boundaryEvent id="taken" attachedToRef="drive">error TAKEN_OVER</boundaryEvent>
    <intermediateCatchEvent id="back">signal returned</intermediateCatchEvent> <endEvent id="end"/>
    start -> drive -> end
    taken -> back -> drive
"""


def test_a_taken_vehicle_ends_its_behavior_with_an_error_that_the_mission_catches() -> None:
    play = Play(WAITS).start()
    play.orders()
    play.give(ControlTaken("evsg1", "anna"))
    assert play.orders() == ["cancel b1"]
    assert play.at == "back"
    assert play.run.state.taken == {"evsg1": "anna"}


def test_a_mission_waits_for_the_vehicle_and_goes_on_with_it() -> None:
    marked = xml(WAITS).replace(
        '<signal id="returned"', '<signal id="returned" m2pem:returned="evsg1"'
    )
    assert marked != xml(WAITS)
    play = Play(parse_mission(marked.encode(), "waits.bpmn")).start()
    play.give(ControlTaken("evsg1", "anna")).report("drive", CANCELLED)
    play.orders()
    play.give(ControlReturned("evsg1", "anna"))
    assert play.orders() == ["start b2 drive_stop evsg1"]
    play.report("drive", SUCCEEDED)
    assert play.ended == "completed"


def test_nothing_commands_a_vehicle_while_an_operator_has_it() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/>
        <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        start -> u -> drive
    """).start()
    play.give(ControlTaken("evsg1", "anna")).answer()
    assert play.ended == "failed"
    assert "evsg1 is with anna" in play.detail


def test_a_payload_goes_on_while_its_vehicle_is_taken() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="scan">do ptz_track evsg1/ptz</scriptTask>
        start -> scan
    """).start()
    play.orders()
    play.give(ControlTaken("evsg1", "anna"))
    assert play.orders() == []
    assert play.at == "scan"


def test_taking_twice_and_releasing_what_no_operator_has_changes_nothing() -> None:
    play = Play(WAITS).start()
    play.give(ControlReturned("evsg1", "ben"))
    assert play.ignored() == "evsg1 is not with an operator"
    play.give(ControlTaken("evsg1", "anna")).give(ControlTaken("evsg1", "ben"))
    assert play.ignored() == "evsg1 is with anna already"


FREE = """
    <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    start -> drive
"""
OTHER = """
    <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    <boundaryEvent id="lost" attachedToRef="drive">error LINK_LOST</boundaryEvent>
    <endEvent id="end"/>
    start -> drive
    lost -> end
"""
ANY = OTHER.replace("error LINK_LOST", "error")
AROUND = """
    <startEvent id="start"/>
    <subProcess id="leg">
        <startEvent id="s"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        s -> drive
    </subProcess>
    <boundaryEvent id="lost" attachedToRef="leg">error TAKEN_OVER</boundaryEvent>
    <endEvent id="end"/>
    start -> leg
    lost -> end
"""
INSIDE = """
    <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    start -> drive
    <subProcess id="rescue" triggeredByEvent="true">
        <startEvent id="lost">error TAKEN_OVER</startEvent> <endEvent id="e"/>
        lost -> e
    </subProcess>
"""


@pytest.mark.parametrize(
    ("text", "catcher"),
    [
        (FREE, ""),
        (OTHER, ""),
        (WAITS, "taken"),
        (ANY, "lost"),
        (AROUND, "lost"),
        (INSIDE, "lost"),
    ],
)
def test_the_preview_of_taking_a_vehicle_says_what_taking_it_then_does(
    text: str, catcher: str
) -> None:
    play = Play(text).start()
    [(behavior, caught_by, _)] = preview_control_taken(play.run.state, "evsg1")
    assert (behavior.id, caught_by.id if caught_by else "") == ("r1.b1", catcher)
    play.give(ControlTaken("evsg1", "anna"))
    thrown = [each for each in play.steps[-1].records if isinstance(each, ErrorThrown)]
    assert [(each.code, each.caught_by) for each in thrown] == [("TAKEN_OVER", catcher)]
    assert play.ended == ("" if text is WAITS else "completed" if catcher else "failed")
    assert preview_control_taken(play.run.state, "evsg1") == []
    assert preview_control_taken(play.run.state, "evsg2") == []
