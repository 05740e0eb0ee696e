"""Element templates of a fleet: one for each behavior, service and common question."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from m2pem.editing.element_templates import QUESTIONS, Editor, element_templates
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec

FLEET = load_fleet(Path(__file__).parents[2] / "fleet_configs" / "vignette1.yaml")
GOTO = SHARED["goto", BehaviorType.VEHICLE]
REVERSE = SHARED["reverse", BehaviorType.VEHICLE]
SURVEY = SHARED["area_survey", BehaviorType.TEAM]
POINT_AT = SHARED["ptz_point_at", BehaviorType.PAYLOAD]
OFFERS: Mapping[str, Sequence[BehaviorSpec]] = {
    "evsg1": (GOTO, REVERSE, SURVEY),
    "evsg2": (GOTO,),
    "lead": (GOTO,),
    "evsg2/ptz": (POINT_AT,),
    "section": (SURVEY,),
}


def made(
    editor: Editor = Editor.CAMUNDA,
    offers: Mapping[str, Sequence[BehaviorSpec]] = OFFERS,
    fleet: Fleet = FLEET,
) -> dict[str, Any]:
    templates = element_templates(fleet, offers, ["Detector"], editor)
    named = {each["name"]: each for each in templates}
    assert len(named) == len(templates) == len({each["id"] for each in templates})
    return named


def field(template: Mapping[str, Any], label: str) -> Mapping[str, Any]:
    (found,) = [each for each in template["properties"] if each.get("label") == label]
    return dict(found)


def hidden(template: Mapping[str, Any]) -> dict[str, str]:
    return {
        each["binding"].get("name", each["binding"]["type"]): each["value"]
        for each in template["properties"]
        if each["type"] == "Hidden"
    }


def values(asked: Mapping[str, Any]) -> list[str]:
    return [choice["value"] for choice in asked["choices"]]


def test_there_is_one_for_each_behavior_service_and_question() -> None:
    names = list(made())
    assert names[:5] == ["ptz_point_at", "area_survey", "goto", "reverse", "Detector"]
    assert len(names) == 5 + len(QUESTIONS)


def test_a_behavior_is_a_script_task_with_its_name_and_type() -> None:
    template = made()["goto"]
    assert template["elementType"] == {"value": "bpmn:ScriptTask"}
    assert template["description"] == GOTO.doc
    assert hidden(template) == {
        "zeebe:taskDefinition": "m2pem:goto",
        "m2pem:behavior": "goto",
        "m2pem:type": "vehicle",
    }


def test_roles_offer_what_can_do_the_behavior_and_is_not_manned() -> None:
    templates = made()
    vehicle = field(templates["goto"], "vehicle")
    assert vehicle["binding"]["name"] == "m2pem:vehicle:vehicle"
    assert values(vehicle) == ["", "evsg1", "evsg2"]
    assert "constraints" not in vehicle  # empty: it is chosen by what it requires
    assert "value" not in vehicle
    assert field(templates["ptz_point_at"], "payload")["value"] == "evsg2/ptz"
    assert values(field(templates["area_survey"], "team")) == ["", "section"]


def test_roles_offer_what_a_role_by_need_says() -> None:
    templates = made()
    needs = ["requires", "same", "prefer", "store", "wait", "priority"]
    asked = [field(templates["goto"], each)["binding"]["name"] for each in needs]
    assert asked == [f"m2pem:{each}:vehicle" for each in needs]
    assert field(templates["ptz_point_at"], "wait")["binding"]["name"] == "m2pem:wait:payload"
    assert field(templates["area_survey"], "count")["binding"]["name"] == "m2pem:count:team"
    assert not [each for each in templates["goto"]["properties"] if each.get("label") == "count"]


def test_roles_offer_what_happens_when_what_fills_them_is_lost() -> None:
    templates = made()
    on_loss = field(templates["goto"], "onLoss")
    assert on_loss["binding"]["name"] == "m2pem:onLoss:vehicle"
    assert values(on_loss) == ["", "fail", "reassign", "ask"]
    # Of a team, the fleet file says it.
    of_team = templates["area_survey"]["properties"]
    assert not [each for each in of_team if each.get("label") == "onLoss"]


def test_roles_offer_until_when_the_run_keeps_what_fills_them() -> None:
    keep = field(made()["area_survey"], "keep")
    assert keep["binding"]["name"] == "m2pem:keep:team"
    assert values(keep) == ["", "process", "subprocess", "task"]


def test_parameters_say_units_bounds_and_defaults() -> None:
    templates = made()
    distance = field(templates["reverse"], "distance")
    assert (
        distance["description"] == "How far. With its unit: m, cm, km, ft, mi, nmi. At least 0 m."
    )
    assert (distance["value"], distance["optional"]) == ("5 m", True)
    assert field(templates["goto"], "target")["constraints"] == {"notEmpty": True}
    assert "It needs target, or bearing and elevation." in templates["ptz_point_at"]["description"]


def test_geometries_of_the_fleet_and_those_to_be_handed_over_are_choices() -> None:
    area = field(made(fleet=replace(FLEET, handed_over=("field",)))["area_survey"], "area")
    assert values(area) == ["inspection_area", "field"]


def test_two_arbiters_with_other_parameters_have_a_template_each() -> None:
    other = replace(GOTO, parameters=(ParameterSpec("depth", ParameterKind.DISTANCE),))
    templates = made(offers={"evsg1": (GOTO,), "evsg2": (other,)})
    assert {"goto (evsg1)", "goto (evsg2)"} <= templates.keys()
    assert values(field(templates["goto (evsg2)"], "vehicle")) == ["", "evsg2"]


@pytest.mark.parametrize(
    ("editor", "binding", "service"),
    [
        (Editor.CAMUNDA, "zeebe:property", {"type": "zeebe:taskDefinition", "property": "type"}),
        (Editor.BPMN_IO, "camunda:property", {"type": "property", "name": "camunda:class"}),
    ],
)
def test_the_bindings_are_those_of_the_editor(
    editor: Editor, binding: str, service: Mapping[str, str]
) -> None:
    templates = made(editor)
    assert field(templates["goto"], "speed")["binding"]["type"] == binding
    detector = templates["Detector"]["properties"][0]
    assert (detector["value"], detector["binding"]) == ("Detector", service)
    assert ("zeebe" in templates["goto"]["$schema"]) is (editor is Editor.CAMUNDA)
    assert ("zeebe" in json.dumps(templates)) is (editor is Editor.CAMUNDA)


def test_a_question_has_its_answers_as_fields() -> None:
    template = made()["Ask: Continue, Abort"]
    assert template["elementType"] == {"value": "bpmn:UserTask"}
    assert field(template, "abort")["binding"]["name"] == "m2pem:decision:abort"
    assert field(template, "abort")["value"] == "Abort"
