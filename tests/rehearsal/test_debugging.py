"""A rehearsal that is debugged: where it stops, what is changed, and that going back is exact."""

from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from m2pem.engine.inputs import SetData, SignalReceived
from m2pem.engine.records import StopReason
from m2pem.errors import AnswersError, MissionError, OperatorError
from m2pem.executive.loading import load_source
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import load_answers
from m2pem.rehearsal.answers_file import AnswersModel
from m2pem.rehearsal.debugging import OF_DEBUGGING, DebugSession
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.scripting.sources import fleet_of
from tests.engine.notation import mission

REPOSITORY = Path(__file__).parents[2]
MISSION = load_source(REPOSITORY / "missions/vignette1.bpmn")
FLEET = fleet_of(str(REPOSITORY / "fleet_configs/vignette1.yaml"), MISSION)
ANSWERS = REPOSITORY / "missions/answers/vignette1_detection.yaml"
STOP = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"


@pytest.fixture
def session() -> Iterator[DebugSession]:
    with debugged() as there:
        yield there


def debugged() -> DebugSession:
    return DebugSession(MISSION, FLEET, plugins=PluginManager(), answers=load_answers(ANSWERS))


def made(session: DebugSession) -> list[object]:
    """What the mission has done: mission times and records, without those of debugging."""
    return [
        (round(each.t_s, 6), each.record)
        for each in session.records
        if not isinstance(each.record, OF_DEBUGGING)
    ]


def to_the_end(session: DebugSession) -> None:
    while not session.ended:
        session.step()


def test_a_rehearsal_by_single_steps_is_the_rehearsal_itself(session: DebugSession) -> None:
    to_the_end(session)
    whole = rehearse(MISSION, FLEET, plugins=PluginManager(), answers=load_answers(ANSWERS))
    assert made(session) == [(round(each.t_s, 6), each.record) for each in whole.records]
    assert session.here.summary.status is whole.summary.status


def test_it_stops_before_a_task_and_its_vehicle_has_not_moved(session: DebugSession) -> None:
    session.set_breakpoints(["DriveRoute"])
    here = session.resume()
    assert here.reached is not None
    assert (here.reached.element, here.reached.reason) == ("DriveRoute", StopReason.BREAKPOINT)
    assert session.view.behaviors == {}
    assert here.states["evsg1"].behavior == ""
    assert [each.element for each in session.view.active()] == [
        "CallDetection",
        "DriveRoute",
        "Detector",
    ]


def test_a_condition_over_the_data_of_a_called_process_stops_it(session: DebugSession) -> None:
    session.set_breakpoints([], ["detection.type == 'camera'"])
    session.resume()
    assert {"detection.type": "camera"} in [each.data for each in session.data()]


def test_each_instance_has_its_data() -> None:
    two = """
        <startEvent id="start"/> <endEvent id="end"/>
        <userTask id="ask">ask a b<each m2pem:collection="['x', 'y']" m2pem:elementVariable="item">
        </each></userTask>
        start -> ask -> end
    """
    with DebugSession(mission(two), None, plugins=PluginManager(), data={"n": 1}) as session:
        session.step()
        session.step()
        found = {(each.element, each.instance): each.data for each in session.data()}
    assert found == {
        ("MAIN", None): {"n": 1},
        ("ask", 0): {"item": "x"},
        ("ask", 1): {"item": "y"},
    }


def test_a_called_process_can_be_given_other_data(session: DebugSession) -> None:
    session.set_breakpoints(["GatewayDetection"])
    reached = session.resume().reached
    assert reached is not None
    session.change(SetData({"detection.type": "gpr"}, reached.scope))
    session.set_breakpoints(["ThrowStop"])
    reached = session.resume().reached
    assert reached is not None
    assert reached.element == "ThrowStop"
    assert session.here.t_s == 5.0  # at the second visit it would be later


def test_the_next_visit_goes_as_it_is_scripted_on_the_way(session: DebugSession) -> None:
    session.set_breakpoints(["Reverse"])
    session.resume()
    session.change(
        AnswersModel.model_validate(
            {"behaviors": {"Reverse": [{"after": 2.0, "end": "failed", "error": "BLOCKED"}]}}
        )
    )
    assert session.resume().summary.status.value == "failed"
    assert "BLOCKED" in session.here.summary.detail


def test_going_back_undoes_changes_and_another_way_is_taken(session: DebugSession) -> None:
    whole = debugged()
    with whole:
        to_the_end(whole)
        expected = made(whole)
    session.set_breakpoints(["Reverse"])
    there = session.resume()
    session.change(
        AnswersModel.model_validate(
            {"behaviors": {"Reverse": [{"after": 2.0, "end": "failed", "error": "BLOCKED"}]}}
        )
    )
    session.resume()
    assert session.ended
    back = session.go_back(there.moment)
    assert (back.moment, back.t_s) == (there.moment, there.t_s)
    assert back.reached is not None
    assert back.reached.element == "Reverse"
    to_the_end(session)
    assert made(session) == expected


def test_a_moment_that_one_goes_back_to_is_the_same_moment() -> None:
    """Whatever was done on the way: steps, breakpoints, conditions, data, signals, answers."""
    for seed in range(12):
        dice = Random(seed)
        elements = [node.id for node in MISSION.nodes]
        with debugged() as session:
            moments: dict[int, list[object]] = {}
            while not session.ended and len(session.stops) < 40:
                moments.setdefault(session.here.moment, made(session))
                act = dice.randrange(6)
                if act == 0:
                    session.set_breakpoints(
                        dice.sample(elements, 3), ["detection.type != null", "other == 3"]
                    )
                elif act == 1:
                    session.change(SetData({"other": dice.randrange(4)}))
                elif act == 2:
                    session.change(SignalReceived(STOP, by="test"))
                elif act == 3:
                    decision = dice.choice(["continue", "abort"])
                    session.change(
                        AnswersModel.model_validate({"answers": {"UserSendRoute": [decision]}})
                    )
                elif act == 4:
                    session.resume()
                else:
                    session.step()
            for moment in sorted(dice.sample(sorted(moments), min(5, len(moments))), reverse=True):
                here = session.go_back(moment)
                assert here.moment == moment, seed
                assert made(session) == moments[moment], seed


def test_the_stop_at_a_mission_time_is_found(session: DebugSession) -> None:
    to_the_end(session)
    here = session.go_back(session.moment_at(9.0))
    assert here.t_s == 9.0
    assert session.go_back(0).t_s == 0.0


def test_an_expression_is_evaluated_as_the_next_element_sees_the_data_and_changes_nothing() -> None:
    items = "m2pem:collection=\"['north', 'south']\" m2pem:elementVariable=\"field\""
    source = mission(f"""
        <startEvent id="start"/> <scriptTask id="write">lap = 3; note = 'x'</scriptTask>
        <task id="each"><each {items}></each></task>
        start -> write -> each
    """)
    with DebugSession(source, None, plugins=PluginManager()) as there:
        there.set_breakpoints(["each"])
        there.resume()
        while there.evaluate("field").value is None:
            there.step()
        before = made(there)
        for text, shown in (
            ("field == 'north' and lap > 2", "true (boolean)"),
            ("= lap / 2", "1.5 (number)"),
            ("${lap + '2'}", "5 (number)"),
            ('= duration("PT" + string(lap) + "S")', '"PT3S" (days and time duration)'),
            ("= [lap, field]", '[3, "north"] (list)'),
            ("= armed and lap > 2", "null: armed is not set"),
            ('= now() > @"2020-01-01T00:00:00Z"', "true (boolean)"),
        ):
            assert str(there.evaluate(text)) == shown
        with pytest.raises(OperatorError, match=r"in 'note \+ 1' at column 3 of .*is the text 'x'"):
            there.evaluate("= note + 1 > lap")
        with pytest.raises(OperatorError, match="expected a value, found the end at column 6"):
            there.evaluate("lap > ")
        big = "= count(for a in 1..400, b in 1..400 return a)"
        with pytest.raises(OperatorError, match="it looks at more than 100,000 values"):
            there.evaluate(big)
        assert made(there) == before
        to_the_end(there)
        with pytest.raises(OperatorError, match="the run has ended: go back"):
            there.evaluate("lap")


def test_what_cannot_be_done_says_why(session: DebugSession) -> None:
    with pytest.raises(OperatorError, match="no 'Revers': did you mean 'Reverse'"):
        session.set_breakpoints(["Revers"])
    with pytest.raises(AnswersError, match="UserSendRout"):
        session.change(AnswersModel.model_validate({"answers": {"UserSendRout": ["abort"]}}))
    with pytest.raises(OperatorError, match="scope 7 is not open"):
        session.change(SetData({"a": 1}, 7))
    with pytest.raises(OperatorError, match="cannot go back to 999"):
        session.go_back(999)
    session.resume()
    assert session.ended
    with pytest.raises(OperatorError, match="the run has ended: go back"):
        session.step()


def test_a_mission_that_commands_needs_a_fleet() -> None:
    with pytest.raises(MissionError, match="there is no fleet"):
        DebugSession(MISSION, None, plugins=PluginManager())
