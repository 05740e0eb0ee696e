"""How what undoes what is read: associations, compensation activities, cancel events."""

import pytest
from bpmn_text import definitions, flow, line_of, load, process, summary

from m2pem.model.elements import Activity, BoundaryEvent, EndEvent, Transaction
from m2pem.model.events import CancelEventDefinition, CompensateEventDefinition

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
    assert summary(data) == [("no-compensation", 3, "B"), ("unused-compensation", 3, "U")]


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


CANCEL = '<endEvent id="e"><cancelEventDefinition/></endEvent>'
INSIDE = f'<startEvent id="s"/>{CANCEL}{flow("s", "e")}'

WRONG = {
    "no association": (
        process(f"{TASK}\n{EVENT}\n{line_of('T')}"),
        [("no-compensation", 4, "B")],
    ),
    "a compensation activity that nothing leads to": (
        process(f"{TASK}\n{UNDO}\n{line_of('T')}"),
        [("unused-compensation", 4, "U")],
    ),
    "two activities that undo one": (
        process(
            f'{HEAD}<task id="U2" isForCompensation="true"/>{line_of("T")}{ONE}'
            '<association sourceRef="B" targetRef="U2" associationDirection="One"/>'
        ),
        [("several-compensations", 3, "B"), ("unused-compensation", 3, "U2")],
    ),
    "two compensation events": (
        process(
            f'{HEAD}\n<boundaryEvent id="B2" attachedToRef="T"><compensateEventDefinition/>'
            f'</boundaryEvent>{line_of("T")}{ONE}<association sourceRef="B2" targetRef="U" '
            'associationDirection="One"/>'
        ),
        [("several-compensations", 4, "B2")],
    ),
    "an activity that is not for compensation": (
        process(f'{TASK}{EVENT}\n<task id="U"/>{line_of("T")}{flow("S", "U")}{ONE}'),
        [("not-for-compensation", 4, "U")],
    ),
    "across the border of a subprocess": (
        process(
            f'{TASK}{EVENT}<subProcess id="sub">\n<startEvent id="s"/>{UNDO}</subProcess>'
            f"{line_of('T', 'sub')}{ONE}"
        ),
        [("association-crosses-border", 3, "B")],
    ),
    "activityRef to nothing": (
        process(
            '<endEvent id="X">\n<compensateEventDefinition activityRef="Tt"/></endEvent>'
            f"{TASK}{line_of('T')}{flow('T', 'X')}"
        ),
        [("dangling-reference", 4, "X")],
    ),
    "activityRef to what is in a subprocess": (
        process(
            '<endEvent id="X">\n<compensateEventDefinition activityRef="in"/></endEvent>'
            '<subProcess id="sub"><task id="in"/></subProcess>'
            f"{line_of('sub')}{flow('sub', 'X')}"
        ),
        [("not-visible", 4, "X")],
    ),
    "a cancel boundary event on a task": (
        process(
            f'{TASK}\n<boundaryEvent id="C" attachedToRef="T"><cancelEventDefinition/>'
            f"</boundaryEvent>{flow('C', 'E')}{line_of('T')}"
        ),
        [("cancel-outside-transaction", 4, "C")],
    ),
    "a cancel boundary event that does not interrupt": (
        process(
            f'<transaction id="T">{INSIDE}</transaction>\n<boundaryEvent id="C" '
            'attachedToRef="T" cancelActivity="false"><cancelEventDefinition/></boundaryEvent>'
            f"{flow('C', 'E')}{line_of('T')}"
        ),
        [("cancel-not-interrupting", 4, "C")],
    ),
    "a cancel end event in a process": (
        process(f"{TASK}\n{CANCEL}{flow('T', 'e')}{line_of('T')}"),
        [("cancel-outside-transaction", 4, "e")],
    ),
    "a cancel end event in a subprocess of a transaction": (
        process(
            f'<transaction id="T"><subProcess id="sub">\n{INSIDE}</subProcess></transaction>'
            f"{line_of('T')}"
        ),
        [("cancel-outside-transaction", 4, "e")],
    ),
    "a cancellation that nobody catches": (
        process(f'<transaction id="T">\n{INSIDE}</transaction>{line_of("T")}'),
        [("uncaught-cancel", 4, "e")],
    ),
    "waitForCompletion that is no truth": (
        process(
            '<endEvent id="X">\n<compensateEventDefinition waitForCompletion="maybe"/></endEvent>'
            f"{TASK}{line_of('T')}{flow('T', 'X')}"
        ),
        [("bad-value", 4, "X")],
    ),
    "a start event with a trigger in a compensation subprocess": (
        process(
            f'{TASK}{EVENT}<subProcess id="U" isForCompensation="true">\n<startEvent id="s">'
            "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
            f"</startEvent></subProcess>{line_of('T')}{ONE}"
        ),
        [("typed-start-in-subprocess", 4, "s")],
    ),
}


@pytest.mark.parametrize(("data", "expected"), WRONG.values(), ids=WRONG)
def test_says_what_is_wrong(data: bytes, expected: list[tuple[str, int, str]]) -> None:
    assert summary(data) == expected
