"""What `check` says of data mappings and scripts of other engines."""

import pytest
from bpmn_text import around, findings


def said(task: str) -> list[tuple[str, str]]:
    return [(each.rule, each.message) for each in findings(around(task))]


def mapped(mapping: str, wrapper: str = "zeebe:ioMapping", inside: str = "") -> str:
    return (
        f'<task id="T"><extensionElements><{wrapper}>{mapping}</{wrapper}></extensionElements>'
        f"{inside}</task>"
    )


@pytest.mark.parametrize("target", ["n", "mission.speed", "Vacation Approval"])
def test_a_mapping_that_is_carried_out_is_no_finding(target: str) -> None:
    assert said(mapped(f'<zeebe:output source="= 7" target="{target}"/>')) == []


@pytest.mark.parametrize(
    ("mapping", "wrapper", "rule", "message"),
    [
        ('<zeebe:input source="= 1" target="a-b"/>', "zeebe:ioMapping", "foreign-effect", "'a-b'"),
        ('<zeebe:input source="= 1"/>', "zeebe:ioMapping", "foreign-effect", "no name"),
        (
            '<zeebe:input source="= {a: }" target="a"/>',
            "zeebe:ioMapping",
            "foreign-effect",
            "'a' gets no value from input: expected a value",
        ),
        (
            '<camunda:inputParameter name="a">${bean.get()}</camunda:inputParameter>',
            "camunda:inputOutput",
            "foreign-effect",
            "'a' gets no value from inputParameter",
        ),
        (
            '<camunda:inputParameter name="a"><camunda:list/></camunda:inputParameter>',
            "camunda:inputOutput",
            "foreign-effect",
            "a list is not read",
        ),
    ],
)
def test_a_mapping_that_is_not_carried_out_is_a_finding(mapping, wrapper, rule, message):
    found = said(mapped(mapping, wrapper))
    assert [each[0] for each in found] == [rule]
    assert message in found[0][1]


def test_an_output_that_reads_the_collection_of_its_own_instances_is_a_finding():
    loop = (
        "<multiInstanceLoopCharacteristics><extensionElements><zeebe:loopCharacteristics "
        'inputCollection="= [1, 2]" outputCollection="results" outputElement="= 1"/>'
        "</extensionElements></multiInstanceLoopCharacteristics>"
    )
    found = said(mapped('<zeebe:output source="= results" target="copy"/>', inside=loop))
    assert ("foreign-effect", True) in [
        (rule, "'results' is written after" in m) for rule, m in found
    ]


def test_a_script_without_a_result_variable_is_refused():
    script = '<zeebe:script expression="= 1"/>'
    task = f'<scriptTask id="T"><extensionElements>{script}</extensionElements></scriptTask>'
    assert [rule for rule, _ in said(task)] == ["bad-key"]


def test_a_name_of_an_error_variable_is_checked():
    task = (
        '<task id="T"/><boundaryEvent id="b" attachedToRef="T"><errorEventDefinition '
        'camunda:errorCodeVariable="a b"/></boundaryEvent>'
    )
    assert "bad-key" in [rule for rule, _ in said(task)]


def test_a_mapping_of_a_call_that_reads_the_one_before_it_is_a_finding():
    call = (
        '<callActivity id="T"><extensionElements><zeebe:calledElement processId="Q" '
        'propagateAllParentVariables="false" propagateAllChildVariables="false"/><zeebe:ioMapping>'
        '<zeebe:input source="= x" target="a"/><zeebe:input source="= a + 1" target="b"/>'
        "</zeebe:ioMapping></extensionElements></callActivity>"
    )
    found = findings(around(call, '<process id="Q"><startEvent id="q"/></process>'))
    [finding] = [each for each in found if each.rule == "foreign-effect"]
    assert "'b' does not read the 'a' of the mapping before it" in finding.message
