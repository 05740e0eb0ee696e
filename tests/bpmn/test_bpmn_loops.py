"""Reading loop and multi-instance markers (BPMN 2.0.2, clause 10.3.8)."""

import pytest

from m2pem.bpmn import parse_mission
from m2pem.bpmn.lint import lint
from m2pem.errors import MissionError
from m2pem.findings import Finding, Severity
from m2pem.mission.elements import Activity, BoundaryEvent
from m2pem.mission.events import SignalEventDefinition
from m2pem.mission.loops import InstanceBehavior, MultiInstance, StandardLoop
from tests.bpmn.bpmn_text import around, definitions, line_of, load, process

VENDORS = 'xmlns:flowable="http://flowable.org/bpmn" xmlns:activiti="http://activiti.org/bpmn"'


def marked(marker: str, kind: str = "task", more: str = "", roots: str = "") -> bytes:
    """Activity T on line 3, its marker on line 4."""
    if kind == "subProcess":
        return around(f'<subProcess id="T">\n{marker}<task id="x"/></subProcess>{more}', roots)
    called = ' calledElement="C"' if kind == "callActivity" else ""
    text = around(f'<{kind} id="T"{called}>\n{marker}</{kind}>{more}', roots).decode()
    if called:
        text = text.replace(
            "</definitions>", '<process id="C"><task id="c"/></process></definitions>'
        )
    return text.encode()


def loop_of(data: bytes) -> StandardLoop | MultiInstance | None:
    node = load(data).elements["T"]
    assert isinstance(node, Activity)
    return node.loop


def many(data: bytes) -> MultiInstance:
    loop = loop_of(data)
    assert isinstance(loop, MultiInstance)
    return loop


def errors(data: bytes) -> list[Finding]:
    with pytest.raises(MissionError) as caught:
        load(data)
    return [each for each in caught.value.findings if each.severity is Severity.ERROR]


KINDS = (
    *("task", "userTask", "manualTask", "scriptTask", "serviceTask", "sendTask", "receiveTask"),
    *("businessRuleTask", "subProcess", "callActivity"),
)


@pytest.mark.parametrize("kind", KINDS)
def test_every_activity_may_loop(kind: str) -> None:
    marker = (
        '<standardLoopCharacteristics testBefore="true" loopMaximum="7">'
        "<loopCondition>x &lt; 3</loopCondition></standardLoopCharacteristics>"
    )
    loop = loop_of(marked(marker, kind))
    assert isinstance(loop, StandardLoop)
    assert (str(loop.condition), loop.test_before, loop.maximum) == ("x < 3", True, 7)


@pytest.mark.parametrize("kind", KINDS)
def test_every_activity_may_have_instances(kind: str) -> None:
    marker = (
        '<multiInstanceLoopCharacteristics isSequential="true"><loopCardinality>${n}'
        "</loopCardinality><completionCondition>done</completionCondition>"
        "</multiInstanceLoopCharacteristics>"
    )
    loop = many(marked(marker, kind))
    assert (str(loop.cardinality), str(loop.completion)) == ("${n}", "done")
    assert loop.sequential
    assert loop.behavior is InstanceBehavior.ALL


def test_a_marker_without_anything_repeats_for_ever() -> None:
    assert loop_of(marked("<standardLoopCharacteristics/>")) == StandardLoop(None)


def instances(inside: str = "", attributes: str = "") -> str:
    return (
        f"<multiInstanceLoopCharacteristics {VENDORS} {attributes}>{inside}"
        "</multiInstanceLoopCharacteristics>"
    )


# --- collections --------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", ["m2pem", "camunda", "flowable", "activiti"])
@pytest.mark.parametrize("text", ["fields", "${fields}", "=fields"])
def test_editors_name_a_collection_and_its_item(prefix: str, text: str) -> None:
    attributes = f'{prefix}:collection="{text}" {prefix}:elementVariable="field"'
    loop = many(marked(instances(attributes=attributes)))
    assert loop.collection is not None
    assert loop.collection.names == {"fields"}
    assert loop.item == "field"


@pytest.mark.parametrize(
    ("element", "item", "output"),
    [("found", "found", None), ("= found", "found", None), ("= found.x", "found", "found.x")],
)
def test_zeebe_names_collections_and_elements(element: str, item: str, output: str | None) -> None:
    inside = (
        '<extensionElements><zeebe:loopCharacteristics inputCollection="= fields" '
        f'inputElement="field" outputCollection="results" outputElement="{element}"/>'
        "</extensionElements>"
    )
    loop = many(marked(instances(inside)))
    assert str(loop.collection) == "= fields"
    assert (loop.item, loop.output_collection, loop.output_item) == ("field", "results", item)
    assert (loop.output and str(loop.output)) == output


def test_zeebe_computes_an_output() -> None:
    inside = (
        '<extensionElements><zeebe:loopCharacteristics inputCollection="= fields" '
        'outputCollection="results" outputElement="= found * 2"/></extensionElements>'
    )
    loop = many(marked(instances(inside)))
    assert (str(loop.output), loop.output_item) == ("= found * 2", "")


REFS = (
    "<loopDataInputRef>in</loopDataInputRef><loopDataOutputRef>tns:out</loopDataOutputRef>"
    '<inputDataItem id="item" name="field"/><outputDataItem id="given"/>'
)


def test_a_data_object_or_its_reference_is_the_collection() -> None:
    objects = (
        '<dataObject id="o"/><dataObjectReference id="in" name="fields" dataObjectRef="o"/>'
        '<dataObject id="out" name="results"/>'
    )
    loop = many(marked(instances(REFS), more=objects))
    assert str(loop.collection) == "fields"
    assert (loop.item, loop.output_collection, loop.output_item) == ("field", "results", "given")


@pytest.mark.parametrize("kind", ["task", "callActivity"])
def test_a_data_input_and_output_are_joined_to_the_collections_by_associations(kind: str) -> None:
    own = (
        '<ioSpecification><dataInput id="in" name="a"/><dataInput id="x"/><dataOutput id="out"/>'
        "</ioSpecification>"
        "<dataInputAssociation><sourceRef>all</sourceRef><targetRef>in</targetRef>"
        "</dataInputAssociation>"
        "<dataInputAssociation><sourceRef>item</sourceRef><targetRef>x</targetRef>"
        "</dataInputAssociation>"
        "<dataOutputAssociation><sourceRef>out</sourceRef><targetRef>results</targetRef>"
        "</dataOutputAssociation>"
    )
    objects = '<dataObject id="all"/><dataObject id="results"/>'
    data = marked(own + instances(REFS), kind, objects)
    loop = many(data)
    assert str(loop.collection) == "all"
    assert loop.output_collection == "results"
    node = load(data).elements["T"]
    assert isinstance(node, Activity)
    mappings = getattr(node, "mappings", node.data_flow)
    assert [(str(each.source), each.target) for each in mappings.inputs] == [("field", "x")]
    assert mappings.outputs == ()


def test_a_transformation_makes_the_collection() -> None:
    own = (
        '<ioSpecification><dataInput id="in"/></ioSpecification>'
        "<dataInputAssociation><sourceRef>all</sourceRef><targetRef>in</targetRef>"
        "<transformation>[all, 2]</transformation></dataInputAssociation>"
    )
    marker = instances("<loopDataInputRef>in</loopDataInputRef>")
    loop = many(marked(own + marker, more='<dataObject id="all"/>'))
    assert str(loop.collection) == "[all, 2]"


def test_a_name_where_bpmn_has_a_reference_is_taken_with_a_warning() -> None:
    data = marked(
        instances(
            "<loopDataInputRef>fields</loopDataInputRef><loopDataOutputRef>found</loopDataOutputRef>"
            '<outputDataItem name="one"/>'
        )
    )
    loop = many(data)
    assert str(loop.collection) == "fields"
    assert loop.output_collection == "found"
    said = [each for each in load(data).warnings if each.rule == "dangling-reference"]
    assert [(each.line, each.element) for each in said] == [(4, "T"), (4, "T")]


# --- what is thrown -----------------------------------------------------------------------------

ROOTS = (
    '<signal id="Sig"/><signalEventDefinition id="d" signalRef="Sig"/>'
    '<timerEventDefinition id="t"/>'
)
NAMED = 'behavior="One" oneBehaviorEventRef="d"'
THREE = "<loopCardinality>3</loopCardinality>"


def test_the_event_of_a_behavior_is_read() -> None:
    attributes = 'behavior="One" oneBehaviorEventRef="tns:d"'
    loop = many(marked(instances(THREE, attributes), roots=ROOTS))
    [definition] = loop.events
    assert isinstance(definition, SignalEventDefinition)
    assert definition.signal.id == "Sig"
    assert loop.behavior is InstanceBehavior.ONE


def test_without_one_it_is_a_signal_that_its_own_boundary_events_catch() -> None:
    boundary = (
        '<boundaryEvent id="B" attachedToRef="T"><signalEventDefinition/></boundaryEvent>'
        '<endEvent id="E2"/><sequenceFlow id="f" sourceRef="B" targetRef="E2"/>'
    )
    mission = load(marked(instances(THREE, 'behavior="None"'), more=boundary))
    event = mission.elements["B"]
    assert isinstance(event, BoundaryEvent)
    [definition] = event.definitions
    assert isinstance(definition, SignalEventDefinition)
    assert definition.signal.id == "T"
    assert "missing-reference" not in [each.rule for each in mission.warnings]


def test_complex_behavior_has_conditions_and_events() -> None:
    inside = (
        f"{THREE}<complexBehaviorDefinition><condition>x</condition>"
        '<event id="ev"><signalEventDefinition signalRef="Sig"/></event>'
        "</complexBehaviorDefinition>"
        "<complexBehaviorDefinition><condition>y</condition>"
        "<event><eventDefinitionRef>d</eventDefinitionRef></event></complexBehaviorDefinition>"
    )
    loop = many(marked(instances(inside, 'behavior="Complex"'), roots=ROOTS))
    assert [str(each.condition) for each in loop.complex] == ["x", "y"]
    assert [len(each.events) for each in loop.complex] == [1, 1]


# --- what is wrong ------------------------------------------------------------------------------

WRONG = {
    "no count": (instances(), "instance-count"),
    "an empty count": (
        instances("<loopCardinality> </loopCardinality>"),
        "instance-count",
    ),
    "two counts": (instances(THREE, 'm2pem:collection="f"'), "instances-counted-twice"),
    "two markers": (f"<standardLoopCharacteristics/>\n{instances(THREE)}", "two-loops"),
    "no kind of loop": ("<loopCharacteristics/>", "no-loop"),
    "a maximum that is no number": (
        '<standardLoopCharacteristics loopMaximum="-1"/>',
        "loop-maximum",
    ),
    "a condition that is no expression": (
        "<standardLoopCharacteristics><loopCondition>x &lt;</loopCondition>"
        "</standardLoopCharacteristics>",
        "bad-expression",
    ),
    "an item that is no name": (
        instances(attributes='m2pem:collection="f" m2pem:elementVariable="a b"'),
        "bad-key",
    ),
    "a collection that nobody can name": (
        instances("<loopDataInputRef>a b</loopDataInputRef>"),
        "dangling-reference",
    ),
    "a behavior that nobody knows": (
        instances(THREE, 'behavior="Some"'),
        "instances-behavior",
    ),
    "an event that is not there": (
        instances(THREE, 'behavior="One" oneBehaviorEventRef="nowhere"'),
        "dangling-reference",
    ),
    "an event that nobody can throw": (
        instances(THREE, 'behavior="One" oneBehaviorEventRef="t"'),
        "event-not-allowed",
    ),
    "a complex behavior that throws nothing": (
        instances(
            f"{THREE}<complexBehaviorDefinition><condition>x</condition>"
            "</complexBehaviorDefinition>",
            'behavior="Complex"',
        ),
        "complex-behavior",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_refused_once(name: str) -> None:
    marker, rule = WRONG[name]
    assert [each.rule for each in errors(marked(marker, roots=ROOTS))] == [rule]


def test_an_event_subprocess_cannot_loop() -> None:
    data = process(
        f'<task id="T"/>{line_of("T")}\n<subProcess id="X" triggeredByEvent="true">'
        '<standardLoopCharacteristics loopMaximum="2"/>'
        '<startEvent id="xs"><signalEventDefinition signalRef="Sig"/></startEvent><task id="x"/>'
        '<endEvent id="xe"/><sequenceFlow id="a" sourceRef="xs" targetRef="x"/>'
        '<sequenceFlow id="b" sourceRef="x" targetRef="xe"/></subProcess>',
        '<signal id="Sig"/>',
    )
    assert [(each.rule, each.line, each.element) for each in errors(data)] == [
        ("loop-not-allowed", 4, "X")
    ]


# --- names --------------------------------------------------------------------------------------


def unwritten(data: bytes) -> list[str]:
    mission = parse_mission(data, "m.bpmn")
    found = lint(mission, ["fields"])
    return [each.message.split("'")[1] for each in found if each.rule == "unwritten-name"]


def test_what_a_loop_gives_to_its_instances_counts_as_written() -> None:
    inside = "<loopDataOutputRef>all</loopDataOutputRef><outputDataItem name='one'/>"
    inside += "<completionCondition>numberOfActiveInstances &lt; 3 or odd</completionCondition>"
    attributes = 'm2pem:collection="fields" m2pem:elementVariable="field"'
    script = "<script>one = field.x + loopCounter</script>"
    data = marked(instances(inside, attributes) + script, "scriptTask", '<dataObject id="all"/>')
    assert unwritten(data) == ["odd"]


def test_a_loop_condition_reads_what_must_be_written() -> None:
    marker = (
        "<standardLoopCharacteristics><loopCondition>again and loopCounter &lt; 3</loopCondition>"
        "</standardLoopCharacteristics>"
    )
    assert unwritten(marked(marker)) == ["again"]


def test_a_signal_that_instances_throw_does_not_come_from_outside_only() -> None:
    boundary = (
        '<boundaryEvent id="B" attachedToRef="T"><signalEventDefinition signalRef="Sig"/>'
        '</boundaryEvent><endEvent id="E2"/><sequenceFlow id="f" sourceRef="B" targetRef="E2"/>'
    )
    data = marked(instances(THREE, NAMED), more=boundary, roots=ROOTS)
    assert "outside-only" not in [each.rule for each in lint(load(data))]
    alone = marked(instances(THREE), more=boundary, roots=ROOTS)
    assert "outside-only" in [each.rule for each in lint(load(alone))]


def test_definitions_may_stand_in_any_order() -> None:
    task = f'<task id="T">{instances(THREE, NAMED)}</task>'
    body = f'<process id="P">{task}{line_of("T")}</process>'
    assert len(many(definitions(body + ROOTS)).events) == 1
