"""What an engine did is judged by the elements it entered, the end, and the data it has."""

from pathlib import Path

import pytest

from tests.cases import DATA, Case, read_topic
from tools.conformance.peers import Played
from tools.conformance.rewrite import for_bpmn_elements, for_spiffworkflow
from tools.conformance.verdict import Verdict, judge, not_asked


def case(topic: str, file: str) -> Case:
    return next(each for each in read_topic(DATA / topic) if each.file.stem == file)


LOOP = case("10.6-gateways/exclusive.yaml", "exclusive_loop")
JOIN = case("10.6-gateways/parallel.yaml", "parallel_join")
STUCK = case("10.6-gateways/parallel.yaml", "parallel_deadlock")
PAST = case("10.5-events/timer.yaml", "timer_date_past")
EVERYTHING = tuple(step.entered for step in LOOP.steps)


def test_the_same_elements_and_data_are_the_same() -> None:
    assert judge(LOOP, Played(EVERYTHING, "completed", {"n": 3})) == Verdict("same")


def test_data_of_an_engine_that_has_none_are_not_compared() -> None:
    assert judge(LOOP, Played(EVERYTHING, "completed", None)) == Verdict("same")


@pytest.mark.parametrize(
    ("played", "words"),
    [
        (Played(EVERYTHING, "completed", {"n": 2}), "in the end n is 2, not 3"),
        (Played(EVERYTHING, "running", {"n": 3}), "does not complete"),
        (Played(((*EVERYTHING[0], "end"),), "completed", {}), "`start` adds end"),
        (
            Played((EVERYTHING[0][:-1],), "failed", {}, "no word"),
            "`start` lacks end, fails (no word)",
        ),
    ],
)
def test_a_difference_is_told_at_the_first_step_that_has_one(played: Played, words: str) -> None:
    assert judge(LOOP, played) == Verdict("differs", words)


def test_how_often_a_join_is_entered_is_not_compared() -> None:
    steps = [tuple(name for name in step.entered if name != "join") for step in JOIN.steps]
    assert judge(JOIN, Played(tuple(steps), "completed")) == Verdict("same")


def test_a_process_that_is_stuck_is_one_that_does_not_complete() -> None:
    steps = tuple(step.entered for step in STUCK.steps)
    assert judge(STUCK, Played(steps, "running")) == Verdict("same")
    assert judge(STUCK, Played(steps, "completed")).words == "completes though it is stuck"


def test_whether_a_past_time_is_noticed_at_once_or_at_the_next_tick_is_all_the_same() -> None:
    assert judge(PAST, Played((("start", "wait", "end"), ()), "completed")) == Verdict("same")


def test_a_model_that_is_refused_and_a_hang_are_verdicts() -> None:
    assert str(judge(LOOP, Played(refused=True, problem="no loops"))) == "refuses: no loops"
    assert judge(LOOP, Played(ended="hangs", problem="20 s")).kind == "hangs"


def test_a_case_that_needs_an_extension_is_for_m2pem_alone() -> None:
    tasks = read_topic(DATA / "10.3-activities" / "tasks.yaml")
    asked = {each.file.stem for each in tasks if not not_asked(each)}
    assert "task_user" in asked
    assert "task_service_class" not in asked


def test_each_engine_reads_expressions_and_times_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "a.bpmn"
    file.write_text("""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL">
        <process id="P"><startEvent id="s"/><task id="t"/>
        <sequenceFlow id="f" sourceRef="s" targetRef="t">
        <conditionExpression>x == null</conditionExpression></sequenceFlow>
        <timeDuration>PT5S</timeDuration><loopCardinality>n + 1</loopCardinality>
        </process><process id="Q"/></definitions>""")
    python, javascript = for_spiffworkflow(file, "P"), for_bpmn_elements(file, "P")
    assert "<conditionExpression>x == None<" in python
    assert "<timeDuration>'PT5S'<" in python
    assert "<conditionExpression>x == null<" in javascript
    assert "<timeDuration>PT5S<" in javascript
    assert "<loopCardinality>${n + 1}<" in javascript
    assert '<process id="Q" isExecutable="false"/>' in javascript
    assert '<startEvent id="s"><outgoing>f</outgoing></startEvent>' in javascript
