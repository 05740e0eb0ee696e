"""What is doubtful about a mission as a whole."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from bpmn_text import around, definitions, flow, line_of, load, process

from m2pem.bpmn import parse_mission
from m2pem.bpmn.lint import lint
from m2pem.bpmn.search_path import SearchPath
from m2pem.findings import Severity


def found(
    data: bytes,
    known: Sequence[str] = (),
    writes: Mapping[str, Sequence[str]] | None = None,
) -> list[tuple[str, int, str]]:
    return [(each.rule, each.line, each.element) for each in lint(load(data), known, writes or {})]


# --- the graph ----------------------------------------------------------------------------------


def test_unreachable_elements_load_and_are_errors() -> None:
    data = process(f'<task id="T"/>{line_of("T")}\n<task id="A"/>\n<task id="B"/>{flow("A", "B")}')
    assert found(data) == [("unreachable", 4, "A"), ("unreachable", 5, "B")]
    assert {each.severity for each in lint(load(data))} == {Severity.ERROR}


def test_what_follows_a_boundary_event_can_be_reached() -> None:
    data = around(
        '<task id="T"/><boundaryEvent id="B" attachedToRef="T"><errorEventDefinition/>'
        f'</boundaryEvent><task id="A"/>{flow("B", "A")}'
    )
    assert found(data) == []


def test_contents_of_an_unreachable_subprocess_are_not_named_again() -> None:
    data = process(f'<task id="T"/>{line_of("T")}\n<subProcess id="X"><task id="x"/></subProcess>')
    assert found(data) == [("unreachable", 4, "X")]


def test_implicit_starts_reach() -> None:
    assert found(process(f'<task id="A"/><task id="B"/>{flow("A", "B")}<task id="C"/>')) == []


@pytest.mark.parametrize("kind", ["exclusiveGateway", "inclusiveGateway"])
def test_a_diverging_gateway_without_conditions(kind: str) -> None:
    data = around(f'<{kind} id="T"/><task id="A"/>{flow("T", "A")}')
    assert found(data) == [("no-conditions", 3, "T")]


def test_gateways_that_are_decided() -> None:
    condition = "<conditionExpression>true</conditionExpression>"
    assert found(around(f'<parallelGateway id="T"/><task id="A"/>{flow("T", "A")}')) == []
    assert found(around('<exclusiveGateway id="T"/>')) == []
    decided = f'<sequenceFlow id="f" sourceRef="T" targetRef="A">{condition}</sequenceFlow>'
    assert found(around(f'<exclusiveGateway id="T"/><task id="A"/>{decided}')) == []


# --- signals and messages -----------------------------------------------------------------------

CATCH = (
    '<intermediateCatchEvent id="T"><signalEventDefinition signalRef="s"/></intermediateCatchEvent>'
)
THROW = '<endEvent id="X"><signalEventDefinition signalRef="s"/></endEvent>'


def test_a_signal_that_only_the_outside_can_send() -> None:
    assert found(around(CATCH, '\n<signal id="s"/>')) == [("outside-only", 6, "s")]


def test_a_signal_that_operators_send_or_the_file_throws() -> None:
    assert found(around(CATCH, '<signal id="s" m2pem:from="operator"/>')) == []
    assert found(around(CATCH + THROW + flow("S", "X"), '<signal id="s"/>')) == []


def test_messages_alike() -> None:
    receive = '<receiveTask id="T" messageRef="m"/>'
    send = f'<sendTask id="A" messageRef="m"/>{flow("S", "A")}'
    assert found(around(receive, '\n<message id="m"/>')) == [("outside-only", 6, "m")]
    assert found(around(receive + send, '<message id="m"/>')) == []


def test_a_message_does_not_trigger_a_signal_of_the_same_id() -> None:
    data = process(
        f'<receiveTask id="T"/>{line_of("T")}<endEvent id="X"><signalEventDefinition/></endEvent>'
        f"{flow('S', 'X')}"
    )
    assert [rule for rule, _, _ in found(data)] == ["outside-only"]


# --- calls --------------------------------------------------------------------------------------


def calls(**edges: str) -> bytes:
    return definitions(
        "\n".join(
            f'<process id="{name}">'
            + "".join(f'<callActivity id="{name}{to}" calledElement="{to}"/>' for to in targets)
            + f'<task id="{name}t"/></process>'
            for name, targets in edges.items()
        )
    )


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (calls(A="A"), ["AA"]),
        (calls(A="B", B="A"), ["AB", "BA"]),
        (calls(A="BC", B="C", C=""), []),
        (calls(A="B", B="C", C="B", D="A"), ["BC", "CB"]),
        (calls(A="B", B="C", C="A"), ["AB", "BC", "CA"]),
    ],
)
def test_processes_that_call_themselves(data: bytes, expected: list[str]) -> None:
    assert [element for rule, _, element in found(data) if rule == "call-recursion"] == expected


def test_a_long_chain_of_calls_needs_no_recursion() -> None:
    count = 3000
    text = "".join(
        f'<process id="p{i}"><callActivity id="c{i}" calledElement="p{i + 1}"/></process>'
        for i in range(count)
    )
    data = definitions(f'{text}<process id="p{count}"><task id="t"/></process>')
    assert found(data) == []


# --- names --------------------------------------------------------------------------------------


def script(identifier: str, text: str) -> str:
    return f'<scriptTask id="{identifier}"><script>{text}</script></scriptTask>'


def test_names_that_nothing_writes() -> None:
    condition = "<conditionExpression>user.decison == 'x'</conditionExpression>"
    data = process(
        f'<userTask id="T"/>{line_of("T")}{script("A", "a = missing.name + b")}\n'
        f'<sequenceFlow id="f" sourceRef="T" targetRef="A">{condition}</sequenceFlow>\n'
        f"{script('B', 'b = a')}{flow('A', 'B')}"
    )
    assert found(data) == [("unwritten-name", 3, "A"), ("unwritten-name", 4, "f")]
    typo = lint(load(data))[1]
    assert typo.remedy == "did you mean 'user.decision'?"


@pytest.mark.parametrize("known", ["mission.speed", "mission"])
def test_names_that_are_known_from_outside(known: str) -> None:
    data = around(script("T", "a = mission.speed"))
    assert found(data) == [("unwritten-name", 3, "T")]
    assert found(data, [known]) == []


def test_what_services_write() -> None:
    condition = "<conditionExpression>detection.type == 'gpr'</conditionExpression>"
    data = process(
        f'<serviceTask id="T" class="Detector"/>{line_of("T")}<task id="A"/>\n'
        f'<sequenceFlow id="f" sourceRef="T" targetRef="A">{condition}</sequenceFlow>'
    )
    assert found(data, writes={"Detector": ["detection.type"]}) == []
    assert found(data, writes={"Detector": ["detection.time"]}) == [("unwritten-name", 4, "f")]
    assert found(data, writes={}) == []  # nobody knows what it writes


def test_a_called_process_sees_only_what_is_passed_in() -> None:
    def data(mapping: str) -> bytes:
        return definitions(
            f'<process id="P">{script("T", "speed = 1")}<callActivity id="C" calledElement="Q">'
            f"<extensionElements>{mapping}</extensionElements></callActivity>"
            f"{flow('T', 'C')}</process>\n"
            f'<process id="Q">{script("U", "x = speed")}</process>'
        )

    assert found(data("")) == [("unwritten-name", 3, "U")]
    assert found(data('<m2pem:in source="speed" target="speed"/>')) == []
    assert found(data('<m2pem:in source="sped" target="speed"/>')) == [("unwritten-name", 2, "C")]
    assert found(
        data('<m2pem:out source="y" target="z"/><m2pem:in source="1" target="speed"/>')
    ) == [("unwritten-name", 2, "C")]


def test_parameters_timers_and_prompts_read_too() -> None:
    data = process(
        '<scriptTask id="A"><extensionElements><m2pem:behavior type="vehicle" name="goto">'
        '<m2pem:properties>\n<m2pem:property name="target" value="${a}"/></m2pem:properties>'
        "</m2pem:behavior></extensionElements></scriptTask>\n"
        '<intermediateCatchEvent id="B">\n<timerEventDefinition><timeDuration>${b}</timeDuration>'
        "</timerEventDefinition></intermediateCatchEvent>\n"
        '<userTask id="C" m2pem:timeout="${c}"/>\n'
        '<serviceTask id="D" class="X"><extensionElements>\n'
        '<m2pem:property name="p" value="${d}"/></extensionElements></serviceTask>'
        f"{line_of('A', 'B', 'C', 'D')}"
    )
    assert found(data, writes={"X": []}) == [
        ("unwritten-name", 4, "A"),
        ("unwritten-name", 6, "B"),
        ("unwritten-name", 7, "C"),
        ("unwritten-name", 9, "D"),
    ]


def test_what_data_associations_write_is_known() -> None:
    data = process(
        f'<task id="T"><dataOutputAssociation id="o"><targetRef>O</targetRef>'
        f"</dataOutputAssociation></task>{script('A', 'x = report')}{flow('T', 'A')}"
        '<dataObject id="O" name="report"/>'
    )
    assert [rule for rule, _, _ in found(data)] == []


def test_findings_are_sorted_by_line_and_have_remedies() -> None:
    data = process(
        f'<exclusiveGateway id="T"/>{line_of("T")}{flow("T", "A")}\n{script("A", "a = b")}\n'
        '<task id="U"/>'
    )
    findings = lint(load(data))
    assert [each.rule for each in findings] == ["no-conditions", "unwritten-name", "unreachable"]
    assert all(each.remedy and each.message and each.file == "m.bpmn" for each in findings)


def test_a_condition_that_begins_a_process_reads_the_main_one() -> None:
    text = """
        <process id="MAIN" isExecutable="true"> <startEvent id="s"/>
          <scriptTask id="set"><script>x = 1</script></scriptTask>
          <sequenceFlow id="f" sourceRef="s" targetRef="set"/>
        </process>
        <process id="OTHER"> <startEvent id="on"><conditionalEventDefinition><condition>x + {y} > 3
          </condition></conditionalEventDefinition></startEvent> <task id="t"/>
          <sequenceFlow id="g" sourceRef="on" targetRef="t"/>
        </process>
    """
    assert lint(load(definitions(text.format(y="1")))) == []
    [found] = lint(load(definitions(text.format(y="y"))))
    assert (found.rule, found.element) == ("unwritten-name", "on")


def test_what_a_call_reads_of_a_process_in_another_file_is_found_in_the_file_that_calls(
    tmp_path: Path,
) -> None:
    out = '<extensionElements><m2pem:out source="x" target="y"/></extensionElements>'
    caller, called = tmp_path / "caller.bpmn", tmp_path / "called.bpmn"
    caller.write_bytes(around(f'<callActivity id="T" calledElement="Q">\n{out}</callActivity>'))
    called.write_bytes(definitions('<process id="Q"><task id="A"/></process>'))
    mission = parse_mission(caller.read_bytes(), str(caller), SearchPath(caller))
    [found] = lint(mission)
    assert (found.rule, found.file, found.line, found.element) == (
        "unwritten-name",
        str(caller),
        4,
        "T",
    )
