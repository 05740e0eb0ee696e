"""A mission of a fleet's element templates: drawn in Camunda's modelers, checked and rehearsed.

The modelers are those of Camunda Modeler and bpmn.io, in a headless Chromium.
"""

import json
from pathlib import Path

import pytest
from lxml import etree

from tests.command_line import FLEET, CommandLine
from tests.editor import draw_from_templates, schema

QUESTION = {
    "template": "Ask: Continue, Abort",
    "category": "m2pem: questions to operators",
    "values": {"question": "Sweep the route?", "abort": "Do not", "timeout": "PT5M"},
}
VEHICLE = {
    "template": "single_vehicle_routing",
    "category": "m2pem: vehicle behaviors",
    "values": {"vehicle": "evsg1", "route": "route_alpha", "speed": "5 m/s"},
}
TEAM = {
    "template": "formation",
    "category": "m2pem: team behaviors",
    "values": {"route": "route_bravo", "spacing": "20 m", "shape": "column"},
}
PAYLOAD = {
    "template": "ptz_scan_polygon",
    "category": "m2pem: payload behaviors",
    "values": {"area": "inspection_area"},
}
SERVICE = {
    "template": "Detector",
    "category": "m2pem: services",
    "values": {"payload": "evsg1/gpr"},
}
STEPS = (QUESTION, VEHICLE, TEAM, PAYLOAD, SERVICE)


@pytest.mark.parametrize(
    ("editor", "modeler"),
    [("camunda", "cloud"), pytest.param("bpmn-io", "platform", marks=pytest.mark.long)],
)
@pytest.mark.tried_with(
    "Camunda Modeler's editors",
    "a mission is drawn with the element templates that m2pem writes, for Camunda 7 and 8",
    kind="BPMN editors",
    result="checked and rehearsed",
    package="camunda-bpmn-js",
)
@pytest.mark.tried_with(
    "element-templates-validator",
    "validates the templates that m2pem writes",
    kind="BPMN editors",
    result="valid",
    package="@bpmn-io/element-templates-validator",
)
def test_a_mission_drawn_of_templates_is_checked_and_rehearsed(
    m2pem: CommandLine, tmp_path: Path, editor: str, modeler: str
) -> None:
    templates = tmp_path / "m2pem.json"
    exported = m2pem.run(
        "templates", "export", "--fleet", FLEET, "--for", editor, "--out", templates
    )
    assert exported[0] == 0
    xml, errors = draw_from_templates(modeler, templates, STEPS)
    assert errors == []
    schema().assertValid(etree.fromstring(xml.encode()))
    mission = tmp_path / "drawn.bpmn"
    mission.write_text(xml, encoding="utf-8")
    checked = m2pem.run("check", mission, "--fleet", FLEET, "--strict")
    assert checked == (0, f"{mission}: nothing found\n", "")
    answers = tmp_path / "answers.yaml"
    answers.write_text("services: {Detector: [{after: 5 s}]}\n", encoding="utf-8")
    rehearsal = ("simulate", mission, "--fleet", FLEET, "--answers", answers, "--format", "json")
    status, out, err = m2pem.run(*rehearsal)
    assert status == 0, err
    records = [json.loads(line) for line in out.splitlines()]
    (question,) = [each for each in records if each["record"] == "PromptOpened"]
    assert (question["text"], question["decisions"]) == (
        "Sweep the route?",
        [{"value": "continue", "label": "Continue"}, {"value": "abort", "label": "Do not"}],
    )
    requested = [each for each in records if each["record"] == "BehaviorRequested"]
    assert [(each["name"], each["resources"], each["parameters"]) for each in requested] == [
        ("single_vehicle_routing", ["evsg1"], {"route": "route_alpha", "speed": "5 m/s"}),
        (
            "formation",
            ["evsg1", "evsg2", "evsg3"],
            {"route": "route_bravo", "spacing": "20 m", "shape": "column"},
        ),
        ("ptz_scan_polygon", ["evsg2/ptz"], {"area": "inspection_area"}),
    ]
    (service,) = [each for each in records if each["record"] == "ServiceRequested"]
    assert (service["name"], service["roles"]) == ("Detector", {"payload": ["evsg1/gpr"]})
    assert [each["outcome"] for each in records if each["record"] == "RunEnded"] == ["completed"]


def test_a_field_that_must_not_be_empty_is_named_by_the_form_and_by_the_check(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    templates = tmp_path / "m2pem.json"
    m2pem.run("templates", "export", "--fleet", FLEET, "--for", "camunda", "--out", templates)
    xml, errors = draw_from_templates("cloud", templates, [{**VEHICLE, "values": {}}])
    assert errors == ["route must not be empty."]
    mission = tmp_path / "drawn.bpmn"
    mission.write_text(xml, encoding="utf-8")
    status, out, _ = m2pem.run("check", mission, "--fleet", FLEET)
    assert status == 1
    assert "single_vehicle_routing needs the parameter 'route'" in out
