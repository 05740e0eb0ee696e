from pathlib import Path

import pytest

from m2pem.findings import Severity
from m2pem.fleet.check_roles import TaskFindings, check_roles, place
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import Role, RoleKind

from .fleets import patrol
from .missions import drive, mission, payload, team, vehicle


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    return patrol(tmp_path)


def check(fleet: Fleet, *roles: Role) -> tuple[list[str], TaskFindings]:
    task = next(mission(drive(*roles)).activities())
    findings = TaskFindings("patrol.bpmn", task)
    return [role.name for role in check_roles(roles, fleet, findings)], findings


def test_roles_that_the_fleet_fills_give_no_finding(fleet: Fleet) -> None:
    filled, findings = check(fleet, vehicle("evsg2"), payload("evsg3/ptz"), team("section"))
    assert filled == ["driver", "camera", "section"]
    assert findings.found == []


@pytest.mark.parametrize(
    ("role", "rule", "message", "remedy"),
    [
        (vehicle("evsg9"), "unknown-vehicle", "{file} has no vehicle 'evsg9'", "did you mean"),
        (
            vehicle("mule"),
            "unknown-vehicle",
            "{file} has no vehicle 'mule'",
            "known vehicles: evsg1, evsg2, evsg3, lead",
        ),
        (team("sektion"), "unknown-team", "{file} has no team 'sektion'", "mean 'section'?"),
        (
            payload("evsg2/ptz"),
            "unknown-payload",
            "evsg2 ({file}:8) has no payload 'ptz'",
            "evsg3/ptz ({file}:13) exists",
        ),
        (
            payload("evsg3/ptt"),
            "unknown-payload",
            "evsg3 ({file}:9) has no payload 'ptt'",
            "did you mean 'ptz'?",
        ),
        (
            payload("evsg2/arm"),
            "unknown-payload",
            "evsg2 ({file}:8) has no payload 'arm'",
            "there are no payloads of it",
        ),
        (
            payload("evsg9/ptz"),
            "unknown-payload",
            "{file} has no vehicle 'evsg9' and so no payload 'evsg9/ptz'",
            "evsg3/ptz ({file}:13) exists",
        ),
        (
            payload("ptz"),
            "unknown-payload",
            "'ptz' is no payload of {file}",
            "evsg3/ptz ({file}:13) exists",
        ),
        (
            payload("arm"),
            "unknown-payload",
            "'arm' is no payload of {file}",
            "a payload is named vehicle/payload",
        ),
        (
            vehicle("section"),
            "wrong-kind",
            "section ({file}:16) is a team, not a vehicle",
            'write team="section"',
        ),
        (
            team("evsg1"),
            "wrong-kind",
            "evsg1 ({file}:3) is a vehicle, not a team",
            'write vehicle="evsg1"',
        ),
        (
            vehicle("evsg3/ptz", optional=True),
            "wrong-kind",
            "evsg3/ptz ({file}:13) is a payload, not a vehicle",
            'write payload="evsg3/ptz"',
        ),
        (
            Role("driver", RoleKind.VEHICLE, "", 15, requires="domain:air"),
            "reserved",
            "'requires' (dynamic allocation) is reserved and not understood yet",
            "name a vehicle, payload or team",
        ),
    ],
)
def test_a_role_that_cannot_be_filled_says_why_and_what_would_be_right(
    fleet: Fleet, role: Role, rule: str, message: str, remedy: str
) -> None:
    filled, findings = check(fleet, role)
    assert filled == []
    (finding,) = findings.found
    assert (finding.file, finding.line, finding.element) == ("patrol.bpmn", 15, "DriveRoute")
    assert (finding.severity, finding.rule) == (Severity.ERROR, rule)
    expected = f"DriveRoute (line 12), role '{role.name}': {message.format(file=fleet.file)}"
    assert finding.message == expected
    assert remedy.format(file=fleet.file) in finding.remedy


def test_an_optional_role_that_the_fleet_lacks_gives_no_finding(fleet: Fleet) -> None:
    filled, findings = check(fleet, vehicle("evsg1"), payload("evsg1/ptz", optional=True))
    assert filled == ["driver"]
    assert findings.found == []


def test_two_roles_cannot_name_one_resource(fleet: Fleet) -> None:
    _, findings = check(fleet, team("section"), vehicle("evsg3"))
    (finding,) = findings.found
    assert finding.rule == "resource-twice"
    assert "role 'driver': evsg3 fills role 'section' already" in finding.message


def test_two_roles_cannot_have_one_name(fleet: Fleet) -> None:
    _, findings = check(fleet, vehicle("evsg1"), vehicle("evsg3"))
    assert [finding.rule for finding in findings.found] == ["duplicate-role"]


def test_a_place_without_a_line_is_named_by_its_file(fleet: Fleet) -> None:
    assert place(fleet, "evsg1") == f"evsg1 ({fleet.file}:3)"
    assert place(fleet, "nobody") == f"nobody ({fleet.file})"


def test_the_same_finding_is_kept_once(fleet: Fleet) -> None:
    _, findings = check(fleet)
    for _ in range(2):
        findings.add("rule", "message", line=3)
    assert len(findings.found) == 1


@pytest.mark.parametrize(
    ("role", "meant"),
    [
        (payload("evsg3/ptt", optional=True), "ptz"),
        (payload("esvg3/ptz", optional=True), "evsg3"),
        (vehicle("esvg1", optional=True), "evsg1"),
        (team("sektion", optional=True), "section"),
    ],
)
def test_an_optional_role_that_looks_mistyped_is_warned_of(
    fleet: Fleet, role: Role, meant: str
) -> None:
    _, findings = check(fleet, role)
    (found,) = findings.found
    assert (found.severity, found.rule) == (Severity.WARNING, "optional-role")
    assert f"'{meant}'" in found.remedy


@pytest.mark.parametrize("resource", ["evsg7", "mule"])
def test_an_optional_role_of_another_vehicle_is_not_taken_for_mistyped(
    fleet: Fleet, resource: str
) -> None:
    assert check(fleet, vehicle(resource, optional=True))[1].found == []
