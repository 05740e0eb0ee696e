"""The examples of docs/missions.md are read as they stand there."""

import re
from pathlib import Path

import pytest
from bpmn_text import definitions, load

from m2pem.bpmn.lint import lint
from m2pem.mission.elements import Activity, CallActivity, ScriptTask, ServiceTask
from m2pem.mission.loops import MultiInstance, StandardLoop

DOCS = (Path(__file__).parent.parent.parent / "docs" / "missions.md").read_text()
ALERT = re.compile(r'Alert\([^,]+, "[A-Z_]+"|CODE = "[A-Z_]+"')
"""An alert has a code, too, but is no error of a mission."""
CODE = r'"([A-Z]{2,}(?:_[A-Z]+)+|EXPRESSION|RECURSION)"'
EXAMPLES = re.findall(r"```xml\n(.*?)```", DOCS, re.DOTALL)


def example(start: str) -> str:
    (found,) = (each for each in EXAMPLES if each.lstrip().startswith(start))
    return str(found)


def test_the_whole_mission_has_no_finding() -> None:
    mission = load(example("<definitions").encode())
    assert mission.warnings == ()
    assert lint(mission) == []


@pytest.mark.parametrize(
    ("start", "wrapper"),
    [
        ("<extensionElements", '<scriptTask id="T">{}</scriptTask>'),
        (
            "<m2pem:userTask",
            '<userTask id="T"><extensionElements>{}</extensionElements></userTask>',
        ),
        ("<serviceTask", "{}"),
        ("<callActivity", "{}"),
    ],
)
def test_an_example_has_no_warning(start: str, wrapper: str) -> None:
    task = wrapper.format(example(start))
    called = '<process id="DETECTION"><task id="t"/></process>'
    mission = load(definitions(f'<process id="P">{task}</process>{called}'))
    assert mission.warnings == ()
    (node, _) = mission.nodes
    if isinstance(node, ServiceTask):
        assert node.call is not None
    if isinstance(node, CallActivity):
        assert len(node.mappings.inputs) == 2


def test_the_example_of_compensation_undoes_the_activity() -> None:
    body = f'<task id="Drop"/>{example("<boundaryEvent")}'
    mission = load(definitions(f'<process id="P">{body}</process>'))
    drop = mission.elements["Drop"]
    assert isinstance(drop, Activity)
    assert drop.compensation is mission.elements["PickUp"]
    assert mission.warnings == ()


def test_the_event_subprocess_has_no_warning() -> None:
    task = (
        '<startEvent id="S"/><endEvent id="E"/><sequenceFlow id="f" sourceRef="S" targetRef="E"/>'
    )
    handler = example('<subProcess id="TooManyFinds"')
    text = f'<process id="P">{handler}{task}</process>'
    mission = load(definitions(text))
    assert mission.warnings == ()
    assert [each.id for each in mission.processes[0].event_subprocesses] == ["TooManyFinds"]


def test_the_example_of_a_geometry_has_no_warning() -> None:
    mission = load(definitions(f"{example('<process')}<task id='t'/></process>"))
    assert mission.warnings == ()
    assert [*mission.geometries] == ["lane"]


def test_the_examples_of_loops_have_no_warning() -> None:
    instances = example('<subProcess id="SurveyField"').replace("...", '<task id="t"/>')
    body = f"{example('<userTask')}{instances}"
    mission = load(definitions(f'<process id="P">{body}</process>'))
    assert mission.warnings == ()
    ask, survey = mission.elements["Ask"], mission.elements["SurveyField"]
    assert isinstance(ask, Activity)
    assert isinstance(survey, Activity)
    assert isinstance(ask.loop, StandardLoop)
    assert isinstance(survey.loop, MultiInstance)
    assert survey.loop.output_collection == "reports"


def test_every_example_is_tested() -> None:
    assert len(EXAMPLES) == 11


def test_the_example_of_what_is_left_names_a_task() -> None:
    route = example('<m2pem:property name="route"').strip()
    behavior = '<m2pem:behavior type="vehicle" name="single_vehicle_routing"><m2pem:properties>'
    role = '<m2pem:role name="driver" vehicle="uav1"/>'
    task = (
        f'<scriptTask id="FlyRoute"><extensionElements>{behavior}{route}</m2pem:properties>'
        f"<m2pem:resources>{role}</m2pem:resources></m2pem:behavior></extensionElements>"
        "</scriptTask>"
    )
    node = load(definitions(f'<process id="P">{task}</process>')).elements["FlyRoute"]
    assert isinstance(node, ScriptTask)
    assert node.behavior is not None
    assert not isinstance(node.behavior.parameters[0].value, str)


def test_every_error_that_the_program_throws_is_documented() -> None:
    package = Path(__file__).parent.parent.parent / "m2pem"
    thrown = {
        code
        for folder in ("engine", "executive", "simulation", "telemetry")
        for module in sorted((package / folder).rglob("*.py"))
        for code in re.findall(CODE, ALERT.sub("", module.read_text()))
    }
    assert {"NO_FLOW", "LINK_LOST"} <= thrown
    assert thrown <= set(re.findall(r"^\| `([A-Z_]+)` \|", DOCS, re.MULTILINE))
