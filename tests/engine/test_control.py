"""Hand-over: what a mission sees of an operator who takes a vehicle and gives it back."""

from m2pem.engine.inputs import ControlReturned, ControlTaken
from m2pem.model.bpmn import parse_mission
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


def test_taking_twice_and_giving_back_what_nobody_has_changes_nothing() -> None:
    play = Play(WAITS).start()
    play.give(ControlReturned("evsg1", "ben"))
    assert play.ignored() == "evsg1 is not with an operator"
    play.give(ControlTaken("evsg1", "anna")).give(ControlTaken("evsg1", "ben"))
    assert play.ignored() == "evsg1 is with anna already"
