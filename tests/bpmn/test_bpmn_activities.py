"""Global tasks: read when they are called, as a process with one task."""

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from tests.bpmn.bpmn_text import around, findings, load, summary

BEHAVIOR = (
    '<extensionElements><m2pem:behavior type="vehicle" name="reverse"><m2pem:resources>'
    '<m2pem:role name="driver" vehicle="evsg1"/></m2pem:resources></m2pem:behavior>'
    "</extensionElements>"
)


def calling(task: str) -> bytes:
    return around('<callActivity id="T" calledElement="G"/>', f"\n{task}")


def task_of(mission: Mission) -> e.FlowNode:
    call = mission.elements["T"]
    assert isinstance(call, e.CallActivity)
    assert call.called.global_task
    assert call.called.id == "G"
    [node] = call.called.nodes
    assert call.called.entries == (node,)
    assert mission.elements["G"] is node
    return node


@pytest.mark.parametrize(
    ("xml", "kind"),
    [
        ('<globalTask id="G"/>', e.Task),
        ('<globalManualTask id="G"/>', e.ManualTask),
        ('<globalUserTask id="G"/>', e.UserTask),
        ('<globalScriptTask id="G"><script>x = 1</script></globalScriptTask>', e.ScriptTask),
        ('<globalBusinessRuleTask id="G" m2pem:service="Rules"/>', e.BusinessRuleTask),
    ],
)
def test_a_global_task_is_called_as_the_task_it_is(xml: str, kind: type) -> None:
    mission = load(calling(xml))
    assert type(task_of(mission)) is kind
    assert mission.warnings == ()
    assert mission.process().id == "P"
    with pytest.raises(KeyError):
        mission.process("G")


def test_a_global_user_task_asks_what_its_extensions_say() -> None:
    prompt = "<m2pem:prompt>Go?</m2pem:prompt><m2pem:decision value='yes'/>"
    node = task_of(
        load(
            calling(
                f'<globalUserTask id="G"><extensionElements>{prompt}</extensionElements>'
                "</globalUserTask>"
            )
        )
    )
    assert isinstance(node, e.UserTask)
    assert node.prompt is not None
    assert node.prompt.text == "Go?"


@pytest.mark.parametrize("language", ["", ' scriptLanguage="m2pem"', ' scriptLanguage="M2PEM"'])
def test_the_script_of_a_global_task_says_its_language(language: str) -> None:
    text = f'<globalScriptTask id="G"{language}><script>x = 1</script></globalScriptTask>'
    node = task_of(load(calling(text)))
    assert isinstance(node, e.ScriptTask)
    assert node.script is not None


def test_a_global_script_in_another_language_is_refused() -> None:
    text = '<globalScriptTask id="G" scriptLanguage="python"><script>x</script></globalScriptTask>'
    [finding] = findings(calling(text))
    assert (finding.rule, finding.line, finding.element) == ("script-language", 6, "G")
    assert 'scriptLanguage="m2pem"' in finding.remedy


def test_a_global_task_may_command_a_behavior() -> None:
    mission = load(calling(f'<globalScriptTask id="G">{BEHAVIOR}</globalScriptTask>'))
    assert "evsg1" in fleet_for(mission).vehicles


def test_what_nobody_calls_is_not_looked_into() -> None:
    text = '<globalScriptTask id="G" scriptLanguage="python"><script>x</script></globalScriptTask>'
    assert summary(around('<task id="T"/>', text)) == []


def test_data_inputs_of_a_global_task_hide_nothing_that_is_passed_in() -> None:
    text = '<globalTask id="G"><ioSpecification><dataInput id="i" name="speed"/>'
    node = task_of(load(calling(f"{text}</ioSpecification></globalTask>")))
    assert isinstance(node, e.Task)
    assert not node.own_data
