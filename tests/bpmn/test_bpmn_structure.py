"""The graph that reading builds: elements, links both ways, tables."""

import sys
from pathlib import Path

import pytest
from bpmn_text import around, definitions, flow, line_of, load, process, summary

from m2pem import load_mission
from m2pem.errors import MissionError
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    CallActivity,
    EndEvent,
    ExclusiveGateway,
    FlowNode,
    InclusiveGateway,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    ManualTask,
    ParallelGateway,
    ReceiveTask,
    SendTask,
    SequenceFlow,
    StartEvent,
    SubProcess,
    Task,
    UserTask,
)
from m2pem.mission.events import (
    ErrorEventDefinition,
    EscalationEventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TerminateEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.mission.mission import Mission

EVERY = Path(__file__).parent.parent / "data" / "model" / "every_element.bpmn"


@pytest.fixture(scope="module")
def mission() -> Mission:
    return load_mission(EVERY)


def node(mission: Mission, identifier: str) -> FlowNode:
    element = mission.elements[identifier]
    assert isinstance(element, FlowNode)
    return element


def test_a_sound_file_has_no_warning_but_of_what_is_another_programs(mission: Mission) -> None:
    assert [each.rule for each in mission.warnings] == ["foreign-extension"]


def test_nodes_are_in_the_order_of_the_xml_with_contents_after_their_subprocess(
    mission: Mission,
) -> None:
    assert [(each.id, type(each)) for each in mission.nodes] == [
        ("Start", StartEvent),
        ("Timed", StartEvent),
        ("Split", ParallelGateway),
        ("Ask", UserTask),
        ("Choose", ExclusiveGateway),
        ("Call", CallActivity),
        ("Any", InclusiveGateway),
        ("Stop", EndEvent),
        ("Sub", SubProcess),
        ("SubStart", StartEvent),
        ("Deeper", SubProcess),
        ("Load", ManualTask),
        ("Tell", SendTask),
        ("Wait", ReceiveTask),
        ("Raise", EndEvent),
        ("OnFound", BoundaryEvent),
        ("OnAbort", BoundaryEvent),
        ("OnError", BoundaryEvent),
        ("Pause", IntermediateCatchEvent),
        ("Shout", IntermediateThrowEvent),
        ("Failed", EndEvent),
        ("Only", Task),
    ]


def test_links_lead_both_ways_and_indices_are_places_in_the_tables(mission: Mission) -> None:
    for index, each in enumerate(mission.nodes):
        assert each.index == index
        assert each in each.container.nodes
        assert mission.elements[each.id] is each
        assert all(flow.source is each for flow in each.outgoing)
        assert all(flow.target is each for flow in each.incoming)
        if isinstance(each, Activity):
            assert all(event.attached_to is each for event in each.boundary)
    for index, each_flow in enumerate(mission.flows):
        assert each_flow.index == index
        assert each_flow in each_flow.source.outgoing
        assert each_flow in each_flow.target.incoming
        assert each_flow in each_flow.source.container.flows
        assert mission.elements[each_flow.id] is each_flow


def test_outgoing_flows_are_in_the_order_of_the_sequence_flow_elements(mission: Mission) -> None:
    assert [each.id for each in node(mission, "Split").outgoing] == ["f4", "f3"]


def test_lines_are_those_of_start_tags_that_wrap_too(mission: Mission) -> None:
    lines = EVERY.read_text().splitlines()
    for each in mission.elements.values():
        assert f'id="{each.id}"' in lines[each.line - 1]
    assert mission.elements["Main"].line == 17


def test_containers_know_their_entries_and_their_process(mission: Mission) -> None:
    main, other = mission.processes
    assert [each.id for each in main.entries] == ["Start", "Timed"]
    assert [each.id for each in other.entries] == ["Only"]
    sub, deeper = node(mission, "Sub"), node(mission, "Deeper")
    assert isinstance(sub, SubProcess)
    assert isinstance(deeper, SubProcess)
    assert [each.id for each in sub.entries] == ["SubStart"]
    assert [each.id for each in deeper.entries] == ["Load"]
    assert deeper.container is sub
    assert deeper.process is main
    assert main.executable
    assert not other.executable


def test_events_carry_their_definitions(mission: Mission) -> None:
    def only(identifier: str) -> object:
        event = node(mission, identifier)
        (definition,) = event.definitions  # type: ignore[attr-defined]
        return definition

    abort = mission.signals["Abort"]
    assert isinstance(only("Stop"), TerminateEventDefinition)
    shout, on_abort = only("Shout"), only("OnAbort")
    assert isinstance(shout, SignalEventDefinition)
    assert isinstance(on_abort, SignalEventDefinition)
    assert shout.signal is on_abort.signal is abort
    assert abort.from_operator
    raised = only("Raise")
    assert isinstance(raised, EscalationEventDefinition)
    assert raised.escalation is not None
    assert raised.escalation.code == "MINE"
    failed, on_error = only("Failed"), only("OnError")
    assert isinstance(failed, ErrorEventDefinition)
    assert isinstance(on_error, ErrorEventDefinition)
    assert failed.error is not None
    assert failed.error.code == "ROUTE_BLOCKED"
    assert on_error.error is None
    timed, pause = only("Timed"), only("Pause")
    assert isinstance(timed, TimerEventDefinition)
    assert isinstance(pause, TimerEventDefinition)
    assert (timed.kind, timed.expression.text) == (TimerKind.DATE, "2026-01-01T12:00:00Z")
    assert (pause.kind, pause.expression.names) == (TimerKind.DURATION, frozenset({"pause"}))
    assert node(mission, "Start").definitions == ()  # type: ignore[attr-defined]


def test_boundary_events_are_attached_in_order_and_say_whether_they_interrupt(
    mission: Mission,
) -> None:
    sub = node(mission, "Sub")
    assert isinstance(sub, SubProcess)
    assert [(each.id, each.interrupting) for each in sub.boundary] == [
        ("OnFound", False),
        ("OnAbort", True),
        ("OnError", True),
    ]


def test_conditions_and_defaults(mission: Mission) -> None:
    choose = node(mission, "Choose")
    assert isinstance(choose, ExclusiveGateway)
    assert choose.default is mission.elements["f7"]
    condition = choose.outgoing[0].condition
    assert condition is not None
    assert condition.holds(lambda _: "continue")
    assert not condition.holds(lambda _: None)


@pytest.mark.parametrize(
    ("default", "language", "text"),
    [
        ("https://www.omg.org/spec/DMN/20191111/FEEL/", "", "a = 1"),
        ("https://www.omg.org/spec/DMN/20191111/FEEL/", "", "a == 1"),
        ("http://www.w3.org/1999/XPath", "", "a == 1"),
        ("", ' language="http://www.w3.org/1999/XPath"', "a == 1"),
        ("", ' language="FEEL"', "a = 1"),
    ],
)
def test_the_language_that_an_editor_declares(default: str, language: str, text: str) -> None:
    data = process(
        f'<task id="T"/>{line_of("T")}<endEvent id="E2"/>'
        '<sequenceFlow id="f" sourceRef="T" targetRef="E2">'
        f"<conditionExpression{language}>{text}</conditionExpression></sequenceFlow>"
    ).replace(b"<definitions ", f'<definitions expressionLanguage="{default}" '.encode(), 1)
    flow = load(data).elements["f"]
    assert isinstance(flow, SequenceFlow)
    assert flow.condition is not None
    assert flow.condition.holds(lambda _: 1)
    assert not flow.condition.holds(lambda _: 2)


def test_a_prefixed_called_element_is_found(mission: Mission) -> None:
    call = node(mission, "Call")
    assert isinstance(call, CallActivity)
    assert call.called is mission.processes[1]


def test_pools_lanes_and_message_flows_are_kept(mission: Mission) -> None:
    assert [(each.id, each.process_id) for each in mission.participants] == [
        ("Pool", "Main"),
        ("Base", ""),
    ]
    assert [(each.id, each.node_ids) for each in mission.lanes] == [
        ("Outer", ("Start",)),
        ("Low", ("Ask",)),
    ]
    (report,) = mission.message_flows
    assert (report.source_id, report.target_id) == ("Tell", "Base")


def test_a_message_flow_names_the_message_of_a_task_that_names_none(mission: Mission) -> None:
    tell, wait = node(mission, "Tell"), node(mission, "Wait")
    assert isinstance(tell, SendTask)
    assert isinstance(wait, ReceiveTask)
    assert tell.message is mission.messages["Report"]
    assert wait.message is mission.messages["Go"]


def test_data_objects_and_properties_declare_keys(mission: Mission) -> None:
    sub = node(mission, "Sub")
    assert isinstance(sub, SubProcess)
    assert [each.key for each in mission.processes[0].data] == ["mission.speed"]
    assert [each.key for each in sub.data] == ["mine.position"]


def test_the_source_is_kept(mission: Mission) -> None:
    assert mission.source == EVERY.read_bytes()
    assert mission.file == str(EVERY)


@pytest.mark.parametrize("prefix", ["bpmn", "semantic", "x-1"])
def test_any_prefix_for_the_namespace(prefix: str) -> None:
    plain = around('<userTask id="T" name="Ask"/>').decode()
    head, _, body = plain.partition(">")
    body = (
        body.replace("</", f"</{prefix}:")
        .replace("<", f"<{prefix}:")
        .replace(f"<{prefix}:/{prefix}:", f"</{prefix}:")
    )
    head = head.replace("<definitions xmlns=", f"<{prefix}:definitions xmlns:{prefix}=")
    loaded = load(f"{head}>{body}".encode())
    assert [each.id for each in loaded.nodes] == ["T", "S", "E"]


def test_implicit_starts_are_all_nodes_without_an_incoming_flow() -> None:
    loaded = load(
        process(
            '<task id="A"/><task id="B"/><task id="C"/>'
            '<boundaryEvent id="X" attachedToRef="A"><errorEventDefinition/></boundaryEvent>'
            f"{flow('A', 'C')}{flow('X', 'C')}"
        )
    )
    assert [each.id for each in loaded.processes[0].entries] == ["A", "B"]


def test_messages_of_joined_message_flows_are_one() -> None:
    loaded = load(
        definitions(
            '<message id="M"/>'
            '<collaboration id="C"><messageFlow id="a" sourceRef="S1" targetRef="R"/>'
            '<messageFlow id="b" sourceRef="S2" targetRef="R"/></collaboration>'
            '<process id="P"><sendTask id="S1"/><sendTask id="S2" messageRef="M"/></process>'
            '<process id="Q"><startEvent id="R"><messageEventDefinition/></startEvent></process>'
        )
    )
    one, two, start = loaded.nodes
    assert isinstance(one, SendTask)
    assert isinstance(two, SendTask)
    assert isinstance(start, StartEvent)
    (definition,) = start.definitions
    assert isinstance(definition, MessageEventDefinition)
    assert one.message is two.message is definition.message is loaded.messages["M"]


def test_flows_without_ids_are_called_after_their_ends() -> None:
    unnamed = '<sequenceFlow sourceRef="S" targetRef="E"/>'
    mission = load(process(f'<startEvent id="S"/><endEvent id="E"/>{unnamed}{unnamed}'))
    assert [each.id for each in mission.flows] == ["S~E", "S~E2"]
    assert [each.id for each in mission.nodes[1].incoming] == ["S~E", "S~E2"]
    assert mission.warnings == ()


def test_an_event_that_names_nothing_has_a_signal_of_its_own() -> None:
    loaded = load(
        around('<intermediateThrowEvent id="T"><signalEventDefinition/></intermediateThrowEvent>')
    )
    assert loaded.signals["T"].id == "T"


def test_500_nested_subprocesses_load_with_a_small_stack() -> None:
    depth = 500
    inner = "".join(f'<subProcess id="n{i}">\n' for i in range(depth))
    data = process(f'{inner}<task id="last"/>{"</subProcess>" * depth}')
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(200)
    try:
        loaded = load(data)
    finally:
        sys.setrecursionlimit(limit)
    assert len(loaded.nodes) == depth + 1
    assert loaded.nodes[-1].line == 3 + depth


@pytest.mark.parametrize("depth", [999, 1001, 1500, 5000])
def test_the_limit_of_depth(depth: int) -> None:
    inner = "".join(f'<subProcess id="n{i}">' for i in range(depth))
    data = process(f'{inner}<task id="last"/>{"</subProcess>" * depth}')
    if depth < 1000:
        assert len(load(data).nodes) == depth + 1
        return
    assert [rule for rule, _, _ in summary(data)] == ["too-deep"]


def test_missions_with_the_same_text_are_read_alike() -> None:
    data = EVERY.read_bytes()
    first, second = load(data), load(data)
    assert [each.id for each in first.nodes] == [each.id for each in second.nodes]
    assert all(isinstance(each, SequenceFlow) for each in first.flows)


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(MissionError, match="unreadable-file"):
        load_mission("no/such/file.bpmn")


def test_the_main_process_is_the_first_that_is_not_called() -> None:
    loaded = load(
        definitions(
            '<process id="Q"><task id="t"/></process>'
            f'<process id="P"><callActivity id="T" calledElement="Q"/>{line_of("T")}</process>'
        )
    )
    assert loaded.process().id == "P"
    assert loaded.process("Q").id == "Q"
