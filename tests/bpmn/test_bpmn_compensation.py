"""How what undoes what is read: associations, compensation activities, cancel events."""

import pytest
from bpmn_text import definitions, flow, line_of, load, process, summary

from m2pem.mission.elements import Activity, BoundaryEvent, EndEvent, Transaction
from m2pem.mission.events import CancelEventDefinition, CompensateEventDefinition

TASK = '<task id="T"/>'
EVENT = '<boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>'
UNDO = '<task id="U" isForCompensation="true"/>'
ONE = '<association id="A" sourceRef="B" targetRef="U" associationDirection="One"/>'
HEAD = f"{TASK}{EVENT}{UNDO}"


def compensation(data: bytes) -> Activity | None:
    task = load(data).elements["T"]
    assert isinstance(task, Activity)
    return task.compensation


@pytest.mark.parametrize(
    "drawn",
    [
        ONE,
        '<association id="A" sourceRef="tns:B" targetRef="tns:U"/>',
        '<association id="A" sourceRef="U" targetRef="B" associationDirection="None"/>',
    ],
    ids=["one", "with prefixes", "from the other end"],
)
def test_an_association_joins_an_activity_to_what_undoes_it(drawn: str) -> None:
    data = process(f"{HEAD}{line_of('T')}\n{drawn}")
    undo = compensation(data)
    assert undo is not None
    assert undo.id == "U"
    assert undo.for_compensation
    assert summary(data) == []


def test_an_association_of_a_collaboration_joins_too() -> None:
    data = definitions(
        f'<collaboration id="C"><participant id="p" processRef="P"/>{ONE}</collaboration>'
        f'<process id="P">{HEAD}{line_of("T")}</process>'
    )
    undo = compensation(data)
    assert undo is not None
    assert undo.id == "U"


def test_an_association_against_its_direction_joins_nothing() -> None:
    data = process(
        f'{HEAD}{line_of("T")}\n<association sourceRef="U" targetRef="B" '
        'associationDirection="One"/>'
    )
    assert compensation(data) is None


def test_associations_of_annotations_have_no_effect() -> None:
    data = process(
        f"{HEAD}{line_of('T')}\n{ONE}<textAnnotation id='N'><text>n</text></textAnnotation>"
        '<association id="A2" sourceRef="B" targetRef="N"/>'
        '<association id="A3" sourceRef="T" targetRef="N"/>'
    )
    assert compensation(data) is not None
    assert summary(data) == []


def test_a_compensation_activity_needs_no_incoming_flow_and_does_not_begin_by_itself() -> None:
    mission = load(process(f"{HEAD}\n{flow('T', 'E')}<endEvent id='E'/>{ONE}"))
    assert [node.id for node in mission.processes[0].entries] == ["T"]


def definition_of(data: bytes, event: str) -> object:
    [definition] = load(data).elements[event].definitions  # type: ignore[attr-defined]
    return definition


@pytest.mark.parametrize(
    ("attributes", "activity", "wait"),
    [
        ("", "", True),
        ('activityRef="T"', "T", True),
        ('activityRef="tns:T" waitForCompletion="false"', "T", False),
        ('waitForCompletion="1"', "", True),
    ],
)
def test_what_a_compensation_event_undoes(attributes: str, activity: str, wait: bool) -> None:
    data = process(
        f'{TASK}<intermediateThrowEvent id="X"><compensateEventDefinition {attributes}/>'
        f"</intermediateThrowEvent>{line_of('T', 'X')}"
    )
    definition = definition_of(data, "X")
    assert isinstance(definition, CompensateEventDefinition)
    assert (definition.activity, definition.wait) == (activity, wait)


def test_a_transaction_and_its_cancel_events() -> None:
    data = process(
        '<transaction id="T" method="##Compensate"><startEvent id="s"/><endEvent id="e">'
        f"<cancelEventDefinition/></endEvent>{flow('s', 'e')}</transaction>"
        '<boundaryEvent id="B" attachedToRef="T"><cancelEventDefinition/></boundaryEvent>'
        f"{flow('B', 'E')}{line_of('T')}"
    )
    elements = load(data).elements
    transaction, end, boundary = elements["T"], elements["e"], elements["B"]
    assert isinstance(transaction, Transaction)
    assert isinstance(end, EndEvent)
    assert isinstance(boundary, BoundaryEvent)
    assert isinstance(end.definitions[0], CancelEventDefinition)
    assert isinstance(boundary.definitions[0], CancelEventDefinition)
    assert summary(data) == []
