"""The check of a mission with all that the executive knows: plugins too."""

import pytest

from m2pem.bpmn import parse_mission
from m2pem.executive.loading import findings_for
from m2pem.findings import Severity
from m2pem.plugins import PluginManager

MISSION = """\
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:m"
             xmlns:m2pem="https://m2pem.org/schema/1">
  <process id="P">
    <serviceTask id="Look" m2pem:service="{service}"/>
  </process>
</definitions>
"""


def checked(service: str) -> list[tuple[Severity, int, str, str]]:
    mission = parse_mission(MISSION.format(service=service).encode(), "mission.bpmn")
    findings = findings_for(mission, None, PluginManager(block=("all",)))
    assert all(finding.rule == "unknown-service" for finding in findings)
    return [(each.severity, each.line, each.element, each.remedy) for each in findings]


@pytest.mark.parametrize(
    ("service", "remedy"),
    [("Detectr", "did you mean 'Detector'?"), ("Gauge", "install the plugin that does")],
)
def test_a_service_that_no_plugin_provides_is_warned_of(service: str, remedy: str) -> None:
    assert checked(service) == [(Severity.WARNING, 4, "Look", remedy)]


def test_a_service_that_is_registered_is_well() -> None:
    assert checked("Detector") == []


def test_a_behavior_without_a_role_is_an_error_without_a_fleet() -> None:
    task = (
        '<scriptTask id="Go"><extensionElements><m2pem:behavior type="vehicle" name="{}"/>'
        "</extensionElements></scriptTask>"
    )
    for name, expected in (("goto", [("no-role", Severity.ERROR)]), ("hold", [])):
        text = MISSION.replace('<serviceTask id="Look" m2pem:service="{service}"/>', task)
        mission = parse_mission(text.format(name).encode(), "mission.bpmn")
        findings = findings_for(mission, None, PluginManager(block=("all",)))
        assert [(each.rule, each.severity) for each in findings] == expected
