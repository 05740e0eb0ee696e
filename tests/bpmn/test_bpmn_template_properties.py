"""m2pem's elements as Camunda's properties: `zeebe:property` and `camunda:property`."""

import pytest
from bpmn_text import around, definitions, findings, line_of, load, summary

from m2pem.mission.behavior import BehaviorType, Decision, Keep, OnLoss, RoleKind
from m2pem.mission.elements import ScriptTask, ServiceTask, UserTask
from m2pem.mission.expression import Expression

ENGINES = ("camunda", "zeebe")

BEHAVIOR = {
    "m2pem:behavior": "goto",
    "m2pem:type": "vehicle",
    "m2pem:property:target": "gate",
    "m2pem:property:speed": "2 m/s",
    "m2pem:property:altitude": "",
    "m2pem:vehicle:mover": "ugv1",
}
QUESTION = {
    "m2pem:prompt": "Survey the field?",
    "m2pem:decision:continue": "Continue",
    "m2pem:decision:abort": "Abort",
    "m2pem:store": "operator.choice",
    "m2pem:role": "lead",
    "m2pem:timeout": "PT5M",
}


def properties(engine: str, of: dict[str, str]) -> str:
    """Extension elements with a property on each line, the first on the third."""
    each = "\n".join(f'<{engine}:property name="{name}" value="{of[name]}"/>' for name in of)
    container = f"<{engine}:properties>\n{each}\n</{engine}:properties>"
    return f"<extensionElements>\n{container}\n</extensionElements>"


def task(kind: str, engine: str, of: dict[str, str], more: str = "") -> bytes:
    return around(f'<{kind} id="T"{more}>{properties(engine, of)}</{kind}>')


@pytest.mark.parametrize("engine", ENGINES)
def test_a_behavior_is_read(engine: str) -> None:
    mission = load(task("scriptTask", engine, BEHAVIOR))
    (found,) = [node for node in mission.nodes if isinstance(node, ScriptTask)]
    behavior = found.behavior
    assert mission.warnings == ()
    assert behavior is not None
    assert (behavior.type, behavior.name, behavior.line) == (BehaviorType.VEHICLE, "goto", 5)
    assert [(each.name, each.value, each.line) for each in behavior.parameters] == [
        ("target", "gate", 7),
        ("speed", "2 m/s", 8),
    ]
    assert [(each.name, each.kind, each.resource, each.line) for each in behavior.roles] == [
        ("mover", RoleKind.VEHICLE, "ugv1", 10)
    ]


@pytest.mark.parametrize("engine", ENGINES)
def test_what_a_role_needs_is_read(engine: str) -> None:
    needs = {
        "m2pem:requires:mover": "vehicle.battery > 0.4",
        "m2pem:wait:mover": "PT10M",
        "m2pem:onLoss:mover": "reassign",
        "m2pem:keep:mover": "process",
        "m2pem:vehicle:leader": "ugv1",
        "m2pem:wait:leader": "unlimited",
    }
    of = {"m2pem:behavior": "follow", "m2pem:type": "vehicle", **needs}
    mission = load(task("scriptTask", engine, of))
    (found,) = [node for node in mission.nodes if isinstance(node, ScriptTask)]
    assert mission.warnings == ()
    assert found.behavior is not None
    mover, leader = found.behavior.roles
    assert mover.need is not None
    assert mover.need.condition is not None
    assert (mover.name, mover.need.condition.text) == ("mover", "vehicle.battery > 0.4")
    assert mover.need.wait_limit is not None
    assert mover.on_loss is OnLoss.REASSIGN
    assert mover.keep is Keep.PROCESS
    assert leader.need is not None
    assert (leader.resource, leader.need.waits, leader.need.wait_limit) == ("ugv1", True, None)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_prompt_is_read(engine: str) -> None:
    mission = load(task("userTask", engine, QUESTION))
    (found,) = [node for node in mission.nodes if isinstance(node, UserTask)]
    prompt = found.prompt
    assert mission.warnings == ()
    assert prompt.text == "Survey the field?"
    assert prompt.decisions == (Decision("continue", "Continue"), Decision("abort", "Abort"))
    assert (prompt.store, prompt.role) == ("operator.choice", "lead")
    assert isinstance(prompt.timeout, Expression)


@pytest.mark.parametrize(
    ("engine", "task_text"),
    [
        ("camunda", '<serviceTask id="T" camunda:class="Detector">{}</serviceTask>'),
        ("zeebe", '<serviceTask id="T">{}</serviceTask>'),
    ],
)
def test_roles_and_properties_of_a_service_are_read(engine: str, task_text: str) -> None:
    inside = properties(engine, {"m2pem:payload:gpr": "ugv1/gpr", "m2pem:property:range": "5 m"})
    if engine == "zeebe":
        job = '<zeebe:taskDefinition type="Detector"/></extensionElements>'
        inside = inside.replace("</extensionElements>", job)
    mission = load(around(task_text.format(inside)))
    (found,) = [node for node in mission.nodes if isinstance(node, ServiceTask)]
    assert mission.warnings == ()
    assert found.call is not None
    assert found.call.service == "Detector"
    assert [(role.kind, role.resource) for role in found.call.roles] == [
        (RoleKind.PAYLOAD, "ugv1/gpr")
    ]
    assert [(each.name, each.value) for each in found.call.properties] == [("range", "5 m")]


def test_a_value_may_be_an_expression_of_feel() -> None:
    mission = load(task("scriptTask", "zeebe", {**BEHAVIOR, "m2pem:property:speed": "=mission.v"}))
    (found,) = [node for node in mission.nodes if isinstance(node, ScriptTask)]
    assert found.behavior is not None
    (speed,) = [each.value for each in found.behavior.parameters if each.name == "speed"]
    assert isinstance(speed, Expression)
    assert speed.names == {"mission.v"}


@pytest.mark.parametrize(
    ("of", "found"),
    [
        ({"m2pem:behaviour": "goto"}, ("unknown-extension", 5, "did you mean 'm2pem:behavior'?")),
        (
            {"m2pem:vehicle": "ugv1"},
            ("unknown-extension", 5, "write for example 'm2pem:vehicle:mover'"),
        ),
        (
            {"m2pem:requires": "true"},
            ("unknown-extension", 5, "write for example 'm2pem:requires:mover'"),
        ),
        (
            {"m2pem:type": "vehicle"},
            (
                "unknown-extension",
                5,
                "add the property 'm2pem:behavior' with a name of the catalogue",
            ),
        ),
        (
            {"m2pem:behavior": "goto"},
            ("behavior-type", 5, "write one of the types vehicle, payload, team"),
        ),
        (
            {**BEHAVIOR, "m2pem:vehicle:mover": "${who}"},
            ("role-not-literal", 10, "write the vehicle, payload or team itself"),
        ),
        (QUESTION, ("misplaced-extension", 5, "it is for: user task, global user task,")),
    ],
)
def test_findings_have_the_line_of_the_property_and_a_remedy(
    of: dict[str, str], found: tuple[str, int, str]
) -> None:
    of_rule = [each for each in findings(task("scriptTask", "zeebe", of)) if each.rule == found[0]]
    assert [each.line for each in of_rule] == [found[1]]
    assert of_rule[0].remedy.startswith(found[2])


def test_a_property_given_twice_is_refused() -> None:
    text = properties("camunda", BEHAVIOR)
    again = '\n<camunda:property name="m2pem:behavior" value="land"/>\n</camunda:properties>'
    twice = text.replace("\n</camunda:properties>", again)
    data = around(f'<scriptTask id="T">{twice}</scriptTask>')
    assert summary(data) == [("duplicate-property", 11, "T")]


def test_a_timeout_may_be_a_duration_of_feel_and_no_date() -> None:
    feel = {**QUESTION, "m2pem:timeout": "=duration(&quot;PT5M&quot;)"}
    assert findings(task("userTask", "zeebe", feel)) == ()
    (found,) = findings(task("userTask", "zeebe", {**QUESTION, "m2pem:timeout": "=today()"}))
    assert found.rule == "timer-time"
    assert "gives a date, not a duration" in found.message


def test_properties_without_the_prefix_stay_what_they_were() -> None:
    (found,) = findings(task("scriptTask", "zeebe", {**BEHAVIOR, "color": "red"}))
    assert (found.rule, found.line) == ("foreign-extension", 4)
    mission = load(task("serviceTask", "camunda", {"rate": "5"}, ' camunda:class="Wash"'))
    (call,) = [node.call for node in mission.nodes if isinstance(node, ServiceTask)]
    assert call is not None
    assert [each.name for each in call.properties] == ["rate"]


def test_lines_are_right_where_a_start_tag_has_several_lines() -> None:
    body = properties("zeebe", {**BEHAVIOR, "m2pem:vehicle:mover": "${who}"})
    data = definitions(
        f'<process\n id="P">\n<scriptTask id="T">{body}</scriptTask>\n{line_of("T")}\n</process>'
    )
    (found,) = findings(data)
    assert (found.rule, found.line) == ("role-not-literal", 11)
