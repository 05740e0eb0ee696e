"""Who has which role of operators: what a fleet file says, and missions that do not fit that."""

from pathlib import Path

import pytest

from m2pem.bpmn import parse_mission
from m2pem.errors import FleetError
from m2pem.findings import Finding
from m2pem.fleet.check import check_mission
from m2pem.fleet.fleet import Fleet, dump, restore
from m2pem.fleet.fleet_file import load_fleet
from m2pem.fleet.operator_roles import why_not_allowed

from .fleets import everything, write_fleet

VEHICLES = "version: 1\nvehicles: {ugv1: {domain: ground, arbiter: sim}}\n"
OPERATORS = "operators: {commander: [anna, ben@gcs1], pilot: [otto]}\n"
MISSION = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
 xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
 <process id="P" isExecutable="true" m2pem:onError="incident" m2pem:incidentRole="commander">
  <startEvent id="S"/>
  <userTask id="Ask" m2pem:role="pilot"/>
  <endEvent id="E"/>
  <sequenceFlow id="a" sourceRef="S" targetRef="Ask"/>
  <sequenceFlow id="b" sourceRef="Ask" targetRef="E"/>
 </process>
</definitions>"""


def fleet(folder: Path, text: str = OPERATORS) -> Fleet:
    return load_fleet(write_fleet(folder, VEHICLES + text))


def findings(folder: Path, text: str = OPERATORS, mission: str = MISSION) -> list[Finding]:
    parsed = parse_mission(mission.encode(), "mission.bpmn")
    return check_mission(parsed, fleet(folder, text), everything)


def test_a_fleet_file_says_who_has_each_role(tmp_path: Path) -> None:
    given = fleet(tmp_path, f"incident_role: pilot\n{OPERATORS}")
    assert given.operators == {"commander": ("anna", "ben@gcs1"), "pilot": ("otto",)}
    assert given.incident_role == "pilot"
    assert restore(dump(given)) == given


@pytest.mark.parametrize(
    ("role", "by", "said"),
    [
        ("", "", ""),
        ("commander", "anna", ""),
        ("commander", "anna@gcs2", ""),
        ("commander", "ben@gcs1", ""),
        ("commander", "ben@gcs2", "only operators with the role 'commander' may: anna, ben@gcs1"),
        ("commander", "ben", "'ben' is not"),
        ("commander", "", "who asks gave no name"),
        ("surgeon", "anna", "the fleet file names none"),
    ],
)
def test_a_name_stands_for_an_operator_on_every_host(
    tmp_path: Path, role: str, by: str, said: str
) -> None:
    refusal = why_not_allowed(fleet(tmp_path), role, by)
    assert said in refusal
    assert bool(refusal) == bool(said)
    assert not why_not_allowed(fleet(tmp_path, ""), role, by)


def test_a_mission_whose_roles_are_known_has_no_findings(tmp_path: Path) -> None:
    assert findings(tmp_path) == []
    assert findings(tmp_path, "") == []


def test_roles_that_nobody_has_are_named_with_their_lines(tmp_path: Path) -> None:
    wrong = MISSION.replace('"commander"', '"comander"').replace('"pilot"', '"surgeon"')
    first, second = findings(tmp_path, mission=wrong)
    assert (first.rule, first.line, first.element) == ("no-operator", 3, "P")
    assert "m2pem:incidentRole='comander'" in first.message
    assert "did you mean 'commander'?" in first.remedy
    assert (second.line, second.element) == (5, "Ask")
    assert findings(tmp_path, "", wrong) == []


def test_a_role_of_the_fleet_file_that_nobody_has_is_a_finding(tmp_path: Path) -> None:
    with pytest.raises(FleetError) as refused:
        fleet(tmp_path, f"incident_role: pilt\n{OPERATORS}")
    (finding,) = refused.value.findings
    assert (finding.line, finding.element) == (3, "incident_role")
    assert "did you mean 'pilot'?" in finding.remedy


@pytest.mark.parametrize(
    ("operators", "approval", "says"),
    [
        ("{reviewer: [anna, ben]}", "{persons: 5, role: reviewer}", "names anna, ben"),
        (
            "{reviewer: [anna, Anna@gcs1]}",
            "{persons: 2, role: reviewer}",
            "names anna, Anna@gcs1, some of whom are the same person",
        ),
        ("{reviewer: [anna], pilot: [otto]}", "{persons: 3}", "names anna, otto"),
        ("{reviewer: [anna], pilot: [otto]}", "{persons: 2}", ""),
    ],
)
def test_an_approval_that_no_operators_can_give_is_named(
    tmp_path: Path, operators: str, approval: str, says: str
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(f"{VEHICLES}operators: {operators}\napproval: {approval}\n")
    if not says:
        assert load_fleet(file).approval_persons == 2
        return
    with pytest.raises(FleetError) as raised:
        load_fleet(file)
    (finding,) = raised.value.findings
    assert (finding.rule, finding.line) == ("approval-persons", 4)
    assert says in finding.message
