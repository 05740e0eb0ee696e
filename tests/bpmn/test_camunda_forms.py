"""Forms of Camunda 8: what a person has to write in their place is said with the finding."""

import json
from typing import Any
from xml.sax.saxutils import escape

import pytest
from bpmn_text import findings, line_of, load, process

from m2pem.findings import Finding
from m2pem.mission.elements import UserTask

SELECT = {
    "type": "select",
    "key": "route.choice",
    "label": "Which way?",
    "values": [{"label": "North", "value": "north"}, {"label": "South", "value": "south"}],
}
CHECKBOX = {"type": "checkbox", "key": "safe", "label": "Is it safe?"}
NUMBER = {"type": "number", "key": "speed", "label": "Speed"}
TEXT = {"type": "text", "text": "# Look at the bridge"}
BUTTON = {"type": "button", "label": "Submit", "action": "submit"}


def data(form: str, key: str = 'formKey="camunda-forms:bpmn:F"', own: str = "") -> bytes:
    embedded = f'<zeebe:userTaskForm id="F">{escape(form)}</zeebe:userTaskForm>'
    task = (
        f'<extensionElements>{embedded}</extensionElements>\n<userTask id="T" name="LOOK">'
        f"<extensionElements>\n<zeebe:formDefinition {key}/>{own}</extensionElements></userTask>"
    )
    return process(f"{task}\n{line_of('T')}")


def finding(*components: dict[str, Any]) -> Finding:
    form = json.dumps({"type": "default", "components": [*components, BUTTON]})
    (only,) = findings(data(form))
    return only


def test_a_choice_is_written_as_a_prompt_with_decisions() -> None:
    found = finding(TEXT, SELECT)
    assert (found.rule, found.line, found.element) == ("foreign-form", 5, "T")
    assert "the form (formKey=" in found.message
    assert "the operator reads 'LOOK' and answers Done" in found.message
    assert found.remedy == (
        'write <m2pem:prompt store="route.choice">Which way?</m2pem:prompt>'
        '<m2pem:decision value="north" label="North"/><m2pem:decision value="south" label="South"/>'
    )


def test_what_is_written_in_its_place_is_read_as_that_question() -> None:
    own = finding(SELECT).remedy.removeprefix("write ")
    mission = load(data("{}", own=own))
    task = mission.elements["T"]
    assert isinstance(task, UserTask)
    assert task.prompt is not None
    assert (task.prompt.text, task.prompt.store) == ("Which way?", "route.choice")
    assert [each.value for each in task.prompt.decisions] == ["north", "south"]
    assert mission.warnings == ()


def test_several_fields_are_several_tasks_and_typed_ones_are_not_asked() -> None:
    group = {"type": "group", "components": [CHECKBOX, NUMBER]}
    remedy = finding(SELECT, group).remedy
    assert "; ask for 'safe' in user tasks of their own; " in remedy
    assert remedy.endswith("operators type nothing: let a service or --data write 'speed'")


def test_a_checkbox_is_a_question_of_yes_and_no() -> None:
    assert finding(CHECKBOX).remedy == (
        'write <m2pem:prompt store="safe">Is it safe?</m2pem:prompt>'
        '<m2pem:decision value="true" label="Yes"/><m2pem:decision value="false" label="No"/>'
    )


def test_a_form_that_only_says_something_is_a_prompt() -> None:
    assert finding(TEXT).remedy == "write <m2pem:prompt>Look at the bridge</m2pem:prompt>"


@pytest.mark.parametrize(
    ("form", "key"),
    [
        ("{}", 'formId="Form_1"'),
        ("{", 'formKey="camunda-forms:bpmn:F"'),
        ("[" * 100_000, 'formKey="camunda-forms:bpmn:F"'),
        ("[]", 'formKey="camunda-forms:bpmn:F"'),
        ('{"components": [1, {"type": "select", "values": 3}]}', 'formKey="camunda-forms:bpmn:F"'),
        ("{}", 'formKey="camunda-forms:bpmn:other"'),
        ("{}", 'externalReference="https://example.org/form"'),
        ("{}", ""),
    ],
)
def test_a_form_that_cannot_be_read_has_an_example(form: str, key: str) -> None:
    (found,) = findings(data(form, key))
    assert found.rule == "foreign-form"
    assert found.remedy.startswith("write <m2pem:prompt>...?</m2pem:prompt><m2pem:decision ")
