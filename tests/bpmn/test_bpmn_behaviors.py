"""Script tasks: behaviors in both forms, and statements."""

from collections.abc import Callable

import pytest
from bpmn_text import around, load, summary

from m2pem.mission.behavior import (
    Assignment,
    Behavior,
    BehaviorType,
    Keep,
    OnLoss,
    Role,
    RoleKind,
    ThrowError,
)
from m2pem.mission.elements import ScriptTask
from m2pem.mission.expression import Expression

BEHAVIOR = """<behavior>
  <property name="type" value="vehicle"/>
  <property name="name" value="single_vehicle_routing"/>
  <properties>
    <property name="route" value="route_alpha"/>
    <property name="speed" value="${mission.speed}"/>
  </properties>
  <resources>
    <role name="driver" vehicle="evsg1"/>
    <role name="scanner" payload="evsg2/ptz" optional="true"/>
    <role name="section" team="section"/>
  </resources>
</behavior>"""


def in_cdata(text: str, form: str = ' scriptFormat="application/xml"') -> bytes:
    return around(f'<scriptTask id="T"{form}><script><![CDATA[{text}]]></script></scriptTask>')


def as_child(text: str, form: str = ' scriptFormat="text/xml"') -> bytes:
    return around(f'<scriptTask id="T"{form}><script>{text}</script></scriptTask>')


def as_extension(text: str) -> bytes:
    prefixed = text.replace("</", "</m2pem:").replace("<", "<m2pem:").replace("<m2pem:/", "</")
    return around(
        f'<scriptTask id="T"><extensionElements>{prefixed}</extensionElements></scriptTask>'
    )


def task(data: bytes) -> ScriptTask:
    node = load(data).elements["T"]
    assert isinstance(node, ScriptTask)
    return node


def behavior(data: bytes) -> Behavior:
    found = task(data).behavior
    assert found is not None
    return found


FORMS = {
    "CDATA": in_cdata(BEHAVIOR),
    "CDATA without a format": in_cdata(BEHAVIOR, ""),
    "escaped": around(
        '<scriptTask id="T" scriptFormat="XML"><script>'
        + BEHAVIOR.replace("<", "&lt;")
        + "</script></scriptTask>"
    ),
    "child in BPMN's namespace": as_child(BEHAVIOR),
    "child without a format": as_child(BEHAVIOR, ""),
    "child in no namespace": as_child(BEHAVIOR.replace("<behavior>", '<behavior xmlns="">')),
    "extension element": as_extension(BEHAVIOR),
}


@pytest.mark.parametrize("data", FORMS.values(), ids=FORMS.keys())
def test_all_forms_say_the_same(data: bytes) -> None:
    found = behavior(data)
    assert (found.type, found.name, found.line) == (
        BehaviorType.VEHICLE,
        "single_vehicle_routing",
        3,
    )
    route, speed = found.parameters
    assert (route.name, route.value, route.line) == ("route", "route_alpha", 7)
    assert speed.name == "speed"
    assert isinstance(speed.value, Expression)
    assert speed.value.names == {"mission.speed"}
    assert found.roles == (
        Role("driver", RoleKind.VEHICLE, "evsg1", 11),
        Role("scanner", RoleKind.PAYLOAD, "evsg2/ptz", 12, optional=True),
        Role("section", RoleKind.TEAM, "section", 13),
    )
    assert load(data).warnings == ()


def test_type_and_name_may_be_attributes() -> None:
    data = as_extension('<behavior type="payload" name="take_picture"></behavior>')
    assert (behavior(data).type, behavior(data).name) == (BehaviorType.PAYLOAD, "take_picture")


def test_a_declaration_and_space_before_the_behavior() -> None:
    data = in_cdata(f'\n\n<?xml version="1.0" encoding="UTF-8"?>\n{BEHAVIOR}')
    assert behavior(data).line == 6


def test_values_are_kept_as_written() -> None:
    text = (
        '<behavior type="vehicle" name="goto"><properties>'
        '<property name="target" value=" [1, 2, 3] "/><property name="speed">5 m/s</property>'
        "</properties></behavior>"
    )
    assert [each.value for each in behavior(in_cdata(text)).parameters] == [" [1, 2, 3] ", "5 m/s"]


WRONG = {
    "no type": ('<behavior name="goto"/>', [("behavior-type", 4)]),
    "unknown type": ('<behavior type="swarm" name="goto"/>', [("behavior-type", 4)]),
    "no name": ('<behavior type="team"/>', [("behavior-name", 4)]),
    "name that is an expression": (
        '<behavior type="team" name="${x}"/>',
        [("behavior-name", 4)],
    ),
    "neither type nor name": ("<behavior/>", [("behavior-type", 4), ("behavior-name", 4)]),
    "two types": (
        '<behavior type="team" name="goto">\n<property name="type" value="vehicle"/></behavior>',
        [("behavior-type", 5)],
    ),
    "parameter beside the others": (
        '<behavior type="vehicle" name="goto">\n<property name="speed" value="1"/></behavior>',
        [("misplaced", 5)],
    ),
    "role beside the others": (
        '<behavior type="vehicle" name="goto">\n<role name="d" vehicle="v"/></behavior>',
        [("misplaced", 5)],
    ),
    "parameter without a name": (
        '<behavior type="vehicle" name="goto"><properties>\n<property value="1"/>'
        "</properties></behavior>",
        [("parameter-name", 5)],
    ),
    "parameter twice": (
        '<behavior type="vehicle" name="goto"><properties><property name="a" value="1"/>\n'
        '<property name="a" value="2"/></properties></behavior>',
        [("duplicate-parameter", 5)],
    ),
    "parameter with a wrong expression": (
        '<behavior type="vehicle" name="goto"><properties>\n'
        '<property name="a" value="${1 +}"/></properties></behavior>',
        [("bad-expression", 5)],
    ),
    "unknown child": (
        '<behavior type="vehicle" name="goto">\n<resource/></behavior>',
        [("unknown-extension", 5)],
    ),
    "unknown attribute": (
        '<behavior type="vehicle" name="goto" kind="x"/>',
        [("unknown-extension", 4)],
    ),
}
ROLES = {
    "no name": ('<role vehicle="v"/>', "role-name"),
    "no resource": ('<role name="d"/>', "role-allocation"),
    "empty resource": ('<role name="d" vehicle=""/>', "role-allocation"),
    "two resources": ('<role name="d" vehicle="v" team="t"/>', "role-allocation"),
    "expression": ('<role name="d" vehicle="${v}"/>', "role-not-literal"),
    "need and name": ('<role name="d" vehicle="v" requires="true"/>', "role-allocation"),
    "need that is no expression": ('<role name="d" requires="domain:air"/>', "bad-expression"),
    "need of a named one": ('<role name="d" vehicle="v" store="x"/>', "role-need"),
    "count of none": ('<role name="d" requires="true" count="0"/>', "role-need"),
    "count of a million": ('<role name="d" requires="true" count="1000000"/>', "role-need"),
    "count backwards": ('<role name="d" requires="true" count="3..1"/>', "role-need"),
    "wait without a unit": ('<role name="d" requires="true" wait="10"/>', "role-need"),
    "priority in words": ('<role name="d" requires="true" priority="high"/>', "role-need"),
    "loss of a named one": ('<role name="d" vehicle="v" onLoss="reassign"/>', "role-need"),
    "loss in words": ('<role name="d" requires="true" onLoss="retry"/>', "role-need"),
    "keep in words": ('<role name="d" requires="true" keep="always"/>', "role-need"),
    "data without a name": ('<role name="d" requires="true" store="a b"/>', "role-need"),
    "need of what was chosen, no name": ('<role name="d" same="a+b"/>', "role-need"),
    "optional that is no truth": ('<role name="d" vehicle="v" optional="y"/>', "bad-value"),
    "unknown attribute": ('<role name="d" vehicle="v" robot="r"/>', "unknown-extension"),
    "twice": (
        '<role name="d" vehicle="v"/><role name="d" vehicle="w"/>',
        "duplicate-role",
    ),
}
WRONG |= {
    f"role: {name}": (
        f'<behavior type="vehicle" name="goto"><resources>\n{role}</resources></behavior>',
        [(rule, 5)],
    )
    for name, (role, rule) in ROLES.items()
}


@pytest.mark.parametrize("form", [in_cdata, as_child, as_extension])
@pytest.mark.parametrize(("text", "expected"), WRONG.values(), ids=WRONG.keys())
def test_what_is_wrong_with_a_behavior(
    form: Callable[[str], bytes], text: str, expected: list[tuple[str, int]]
) -> None:
    found = summary(form(f"\n{text}"))
    assert found == [(rule, line, "T") for rule, line in expected]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (in_cdata("<behavior>\n<behavior>"), [("bad-script", 4, "T")]),
        (in_cdata("\n<!DOCTYPE x><behavior/>"), [("bad-script", 4, "T")]),
        (in_cdata("<other/>"), [("bad-script", 3, "T")]),
        (in_cdata("a = 1"), [("bad-script", 3, "T")]),
        (as_child("\n<other/>"), [("bad-script", 4, "T")]),
        (as_child(BEHAVIOR, ' scriptFormat="m2pem"'), [("script-language", 3, "T")]),
        (in_cdata("x()", ' scriptFormat="groovy"'), [("script-language", 3, "T")]),
        (in_cdata("\na == 1\nb = 2\nc", ""), [("bad-script", 4, "T"), ("bad-script", 6, "T")]),
    ],
)
def test_scripts_that_are_refused(data: bytes, expected: list[tuple[str, int, str]]) -> None:
    assert summary(data) == expected


def test_two_behaviors_are_refused() -> None:
    one = '<m2pem:behavior type="vehicle" name="hold"/>'
    both = (
        f'<scriptTask id="T"><extensionElements>{one}</extensionElements>'
        "<script>a = 1</script></scriptTask>"
    )
    twice = f'<scriptTask id="T"><extensionElements>{one}\n{one}</extensionElements></scriptTask>'
    assert summary(around(both)) == [("two-behaviors", 3, "T")]
    assert summary(around(twice)) == [("two-behaviors", 4, "T")]


@pytest.mark.parametrize("form", ["", ' scriptFormat="m2pem"'])
def test_statements_of_a_script_are_read(form: str) -> None:
    found = task(in_cdata("\nmission.speed = 2 * base\nthrow error NO_FUEL\n", form))
    assert found.behavior is None
    assert found.script is not None
    assign, throw = found.script.statements
    assert isinstance(assign, Assignment)
    assert (assign.key, assign.expression.names, assign.line) == (
        "mission.speed",
        frozenset({"base"}),
        4,
    )
    assert throw == ThrowError("NO_FUEL", 5)


def test_what_a_role_needs_is_read() -> None:
    text = """<behavior type="team" name="area_survey"><resources>
        <role name="crew" requires="vehicle.domain == 'air'" count="1..3" prefer="10"
              store="crew" wait="PT5M" priority="2"/>
        <role name="again" same="crew" wait="unlimited"/>
        <role name="lead" vehicle="uav1" wait="PT1M"/></resources></behavior>"""
    behavior = load(as_child(text)).elements["T"].behavior  # type: ignore[attr-defined]
    crew, again, lead = behavior.roles
    assert (crew.kind, crew.resource) == (RoleKind.TEAM, "")
    need = crew.need
    assert (need.condition.text, need.least, need.most) == ("vehicle.domain == 'air'", 1, 3)
    assert (need.preference.text, need.store, need.priority) == ("10", "crew", 2)
    assert need.waits
    assert need.wait_limit.text == "PT5M"
    assert (again.need.same, again.need.waits, again.need.wait_limit) == ("crew", True, None)
    assert (lead.kind, lead.resource, lead.need.waits) == (RoleKind.VEHICLE, "uav1", True)


def test_a_service_names_its_resources() -> None:
    service = '<m2pem:service class="Detector"><m2pem:role name="s" requires="true"/>'
    found = summary(
        around(
            f'<serviceTask id="T"><extensionElements>{service}</m2pem:service>'
            "</extensionElements></serviceTask>"
        )
    )
    assert [rule for rule, *_ in found] == ["role-need"]


def test_what_is_done_when_a_vehicle_is_lost_is_read() -> None:
    roles = '<role name="a" requires="true" onLoss="reassign"/><role name="b" vehicle="v"/>'
    behavior = (
        load(
            as_child(
                f'<behavior type="vehicle" name="goto"><resources>{roles}</resources></behavior>'
            )
        )
        .elements["T"]
        .behavior
    )  # type: ignore[attr-defined]
    assert [role.on_loss for role in behavior.roles] == [OnLoss.REASSIGN, OnLoss.FAIL]


def test_until_when_a_vehicle_is_kept_is_read() -> None:
    roles = '<role name="a" requires="true" keep="process"/><role name="b" vehicle="v"/>'
    text = f'<behavior type="vehicle" name="goto"><resources>{roles}</resources></behavior>'
    behavior = load(as_child(text)).elements["T"].behavior  # type: ignore[attr-defined]
    assert [role.keep for role in behavior.roles] == [Keep.PROCESS, None]
    named = roles.replace('vehicle="v"', 'vehicle="v" keep="task"').replace("requires", "same")
    behavior = load(as_child(text.replace(roles, named))).elements["T"].behavior  # type: ignore[attr-defined]
    assert [role.keep for role in behavior.roles] == [Keep.PROCESS, Keep.TASK]
    assert behavior.allocated_at_start


def test_the_fleet_file_says_what_a_team_does_when_a_member_is_lost() -> None:
    role = '<role name="crew" requires="true" count="2" onLoss="reassign"/>'
    text = f'<behavior type="team" name="area_survey"><resources>\n{role}</resources></behavior>'
    assert summary(as_child(text)) == [("role-need", 4, "T")]
