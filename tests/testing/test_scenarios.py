"""The scenarios are missions that run, and end where they say."""

import pytest

from m2pem.bpmn import parse_mission
from m2pem.testing import run_mission, scenarios

FLEET = scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}, "ugv1/camera": {}})
NEAR = f"[{scenarios.ORIGIN[0] + 0.0001}, {scenarios.ORIGIN[1]}]"
FAR = f"[{scenarios.ORIGIN[0] + 0.1}, {scenarios.ORIGIN[1]}]"
SPEED = 100


@pytest.mark.parametrize(
    ("mission", "visited"),
    [
        (scenarios.one_behavior("goto", "ugv1", target=NEAR), "Start Task End"),
        (scenarios.one_behavior("take_picture", "ugv1/camera"), "Start Task End"),
        (
            scenarios.in_sequence("goto", "ugv1", {"target": NEAR}, {"target": NEAR}),
            "Start Task1 Task2 End",
        ),
        (scenarios.interrupted("goto", "ugv1", target=FAR), "Start Task Timer Late"),
        (scenarios.question(), "Start Question End"),
    ],
)
def test_a_scenario_goes_through_its_elements(mission: bytes, visited: str) -> None:
    assert run_mission(mission, FLEET, speed=SPEED).visited == visited.split()


def test_two_vehicles_drive_side_by_side() -> None:
    result = run_mission(
        scenarios.in_parallel("goto", "ugv1", "ugv2", target=NEAR), FLEET, speed=SPEED
    )
    names = [type(record).__name__ for record in result.records]
    assert names.index("BehaviorEnded") > len(names) - names[::-1].index("BehaviorRequested") - 1
    assert result.visited[-1] == "End"


def test_an_error_is_caught() -> None:
    broken = {"faults": [{"kind": "fail", "error": "ROUTE_BLOCKED", "after": "1 s"}]}
    fleet = scenarios.fleet("sim", {"ugv1": broken})
    mission = scenarios.caught_error("goto", "ugv1", "ROUTE_BLOCKED", target=FAR)
    assert run_mission(mission, fleet, speed=SPEED).visited == [
        "Start",
        "Task",
        "Caught",
        "Handled",
    ]


def test_two_questions_are_asked_at_once_and_answered_by_their_names() -> None:
    result = run_mission(scenarios.two_questions(), FLEET, answers={"Question2": "no"})
    written = {record.key: record.value for record in result.of("DataWritten")}
    assert written == {"decision.Question1": "yes", "decision.Question2": "no"}


def test_texts_may_have_any_characters() -> None:
    mission = parse_mission(scenarios.question('a < b & "c"', ("x & y", "<z>")), "scenario.bpmn")
    (prompt,) = [node.prompt for node in mission.nodes if hasattr(node, "prompt")]
    assert prompt is not None
    assert prompt.text == 'a < b & "c"'
    assert [decision.value for decision in prompt.decisions] == ["x & y", "<z>"]
