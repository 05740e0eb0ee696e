"""Missions against fleets, before anything moves."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from m2pem.findings import Finding, Severity
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import check_mission, check_roles, place
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import (
    Behavior,
    BehaviorType,
    Need,
    OnLoss,
    Role,
    RoleKind,
    ServiceCall,
)
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.expression import parse
from m2pem.mission.geometry import Point, Route

from .fleets import PATROL, everything, patrol
from .missions import READ_LATER, behavior, drive, mission, payload, team, vehicle

PAYLOAD, TEAM = BehaviorType.PAYLOAD, BehaviorType.TEAM


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    return patrol(tmp_path)


def check(
    fleet: Fleet, *tasks: Behavior | ServiceCall, handed_over: Sequence[str] = ()
) -> list[Finding]:
    return check_mission(mission(*tasks), fleet, everything, handed_over=handed_over)


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, "\n".join(map(str, findings))
    return findings[0]


def test_a_mission_that_fits_its_fleet_has_no_findings(fleet: Fleet) -> None:
    tasks = [
        drive(vehicle("evsg1"), route="alpha", speed="5 m/s"),
        behavior("formation", team("section"), type_=TEAM, spacing="20 m"),
        behavior("zoom", payload("evsg3/ptz"), type_=PAYLOAD, level="2"),
        behavior("goto", vehicle("evsg1"), target="gate"),
        behavior("follow", vehicle("evsg1"), target="lead"),
        behavior("hold", duration="5 s"),
        ServiceCall("Detector", 30, (payload("evsg1/gpr"),)),
        ServiceCall("Detector", 30),
        ServiceCall("Mailer", 30, (vehicle("evsg1"),)),
    ]
    assert check(fleet, *tasks) == []


# Item 3 of what the core must show: refused before start, naming the task, its line, the role and
# the fleet file.


def test_a_fleet_without_the_vehicle_is_found(tmp_path: Path) -> None:
    without = patrol(tmp_path, "version: 1\nvehicles: {evsg2: {domain: ground, arbiter: sim}}\n")
    findings = check(without, drive(vehicle("evsg1")))
    finding = next(f for f in findings if f.severity is Severity.ERROR)
    assert str(finding) == (
        f"patrol.bpmn:15: DriveRoute: error: DriveRoute (line 12), role 'driver': "
        f"{without.file} has no vehicle 'evsg1'; did you mean 'evsg2'? [unknown-vehicle]"
    )


def test_a_payload_on_another_vehicle_is_found(fleet: Fleet) -> None:
    finding = only(check(fleet, behavior("zoom", payload("evsg2/ptz"), type_=PAYLOAD)))
    assert str(finding) == (
        f"patrol.bpmn:15: DriveRoute: error: DriveRoute (line 12), role 'camera': "
        f"evsg2 ({fleet.file}:8) has no payload 'ptz'; evsg3/ptz ({fleet.file}:13) exists "
        "[unknown-payload]"
    )


def test_an_unknown_behavior_is_found(fleet: Fleet) -> None:
    finding = only(check(fleet, behavior("single_vehicle_ruting", vehicle("evsg1"))))
    assert str(finding) == (
        f"patrol.bpmn:13: DriveRoute: error: DriveRoute (line 12), role 'driver': arbiter 'ros' "
        f"of evsg1 ({fleet.file}:3) offers no vehicle behavior 'single_vehicle_ruting'; "
        "did you mean 'single_vehicle_routing'? [unknown-behavior]"
    )


def test_a_mistyped_unit_is_found_at_its_parameter(fleet: Fleet) -> None:
    finding = only(check(fleet, drive(vehicle("evsg1"), route="alpha", speed="5 m/z")))
    assert (finding.line, finding.element, finding.rule) == (21, "DriveRoute", "bad-value")
    assert finding.message == (
        f"DriveRoute (line 12), role 'driver': evsg1 ({fleet.file}:3): "
        "parameter 'speed': '5 m/z': unknown unit 'm/z'; did you mean 'm/s'?"
    )


def test_a_behavior_that_the_fleet_does_not_allow_is_found(fleet: Fleet) -> None:
    finding = only(check(fleet, drive(vehicle("evsg2"))))
    assert finding.rule == "behavior-not-allowed"
    assert f"does not let evsg2 ({fleet.file}:8) do 'single_vehicle_routing'" in finding.message
    assert finding.remedy == "it allows: drive_stop"


def test_a_behavior_of_another_type_is_found(fleet: Fleet) -> None:
    finding = only(check(fleet, behavior("formation", vehicle("evsg1"))))
    assert finding.rule == "wrong-type"
    assert "'formation' is a team behavior, not a vehicle behavior" in finding.message
    assert finding.remedy == 'set type="team" and name a team'


def test_a_behavior_that_another_resource_offers_says_which(fleet: Fleet) -> None:
    own = BehaviorSpec("somersault", BehaviorType.VEHICLE)

    def some(resource: ResourceId) -> Sequence[BehaviorSpec]:
        return [own] if resource == "evsg3" else [SHARED["goto", BehaviorType.VEHICLE]]

    tasks = mission(behavior("somersault", vehicle("evsg1")))
    finding = only(check_mission(tasks, fleet, some))
    assert finding.remedy == "it is offered on evsg3"


def test_a_simulated_check_speaks_of_the_simulated_arbiter(fleet: Fleet) -> None:
    tasks = mission(behavior("somersault", vehicle("evsg1")))
    finding = only(check_mission(tasks, simulated_fleet(fleet), everything))
    assert "the simulated arbiter of evsg1" in finding.message


@pytest.mark.parametrize(
    ("task", "rule", "message"),
    [
        (drive(), "no-role", "the vehicle behavior single_vehicle_routing has no role"),
        (
            behavior("formation", type_=TEAM),
            "no-role",
            "the team behavior formation has no role",
        ),
        (
            behavior("formation", vehicle("evsg1"), type_=TEAM),
            "no-role",
            "the team behavior formation has no role with a team",
        ),
        (
            behavior("zoom", vehicle("evsg1"), type_=PAYLOAD),
            "no-role",
            "the payload behavior zoom has no role with a payload",
        ),
        (
            drive(vehicle("evsg9", optional=True)),
            "no-role",
            "fills none of the optional roles of the vehicle behavior single_vehicle_routing",
        ),
        (drive(vehicle("lead")), "manned", "is manned and cannot be commanded"),
        (
            behavior("formation", team("convoy"), type_=TEAM),
            "manned",
            "role 'section': lead (",
        ),
        (drive(vehicle("evsg1"), vehicle("evsg1", "b")), "resource-twice", "evsg1 fills role"),
        (
            drive(vehicle("evsg1"), speed="1 m/s"),
            "missing-parameter",
            "needs the parameter 'route'",
        ),
        (drive(vehicle("evsg1"), route="field"), "wrong-geometry", "is an area, not a route"),
        (
            behavior("goto", vehicle("evsg1"), target="gate", sped="1 m/s"),
            "unknown-parameter",
            "goto has no parameter 'sped'",
        ),
        (
            behavior("follow", vehicle("evsg1"), target="evsg7"),
            "unknown-vehicle",
            "no vehicle is named 'evsg7'",
        ),
        (behavior("hold", duration="5 m"), "bad-value", "'5 m' is a distance, not a duration"),
        (
            ServiceCall("Detector", 30, (payload("evsg3/ptz"),)),
            "no-detector",
            "is no detector payload",
        ),
        (
            ServiceCall("Mailer", 30, (vehicle("evsg9"),)),
            "unknown-vehicle",
            "has no vehicle 'evsg9'",
        ),
    ],
)
def test_a_task_that_does_not_fit_is_an_error(
    fleet: Fleet, task: Behavior | ServiceCall, rule: str, message: str
) -> None:
    finding = only(check(fleet, task))
    assert (finding.rule, finding.severity) == (rule, Severity.ERROR)
    assert message in finding.message
    assert finding.message.startswith("DriveRoute (line 12)")


def test_a_behavior_without_a_role_and_unknown_to_all_is_found_twice(fleet: Fleet) -> None:
    findings = check(fleet, behavior("holdd"))
    assert [f.rule for f in findings] == ["no-role", "unknown-behavior"]
    assert findings[1].remedy == "did you mean 'hold'?"


@pytest.mark.parametrize(
    ("task", "remedy"),
    [
        (
            drive(vehicle("evsg1"), route="alpga"),
            "did you mean 'alpha'? if an operator hands it over, "
            "list it in the fleet's 'handed_over'",
        ),
        (
            behavior("goto", vehicle("evsg1"), target="moon"),
            "if an operator hands it over, list it in the fleet's 'handed_over'",
        ),
    ],
)
def test_a_geometry_that_the_fleet_lacks_is_an_error(
    fleet: Fleet, task: Behavior, remedy: str
) -> None:
    finding = only(check(fleet, task))
    assert (finding.rule, finding.severity) == ("unknown-geometry", Severity.ERROR)
    assert finding.line == 20
    assert fleet.file in finding.message
    assert finding.remedy == remedy


def test_a_geometry_that_operators_hand_over_is_a_warning_until_they_have(fleet: Fleet) -> None:
    task = behavior("goto", vehicle("evsg1"), target="moon")
    declared = replace(fleet, handed_over=("moon",))
    finding = only(check(declared, task))
    assert (finding.rule, finding.severity) == ("unknown-geometry", Severity.WARNING)
    assert finding.remedy == "an operator must hand it over before the task starts"
    assert not check(fleet, task, handed_over=("moon",))


def test_what_a_file_leaves_out_of_a_route_is_a_warning_where_the_route_is_named(
    fleet: Fleet,
) -> None:
    warned = Finding(
        Severity.WARNING, fleet.file, 9, "routes.alpha", "geometry", "item 1: left out"
    )
    other = replace(warned, element="routes.beta")
    doubtful = replace(fleet, warnings=(warned, other))
    assert check(doubtful, drive(vehicle("evsg1"), route="alpha")) == [warned]
    assert check(doubtful, drive(vehicle("evsg1"), route=READ_LATER)) == []


def test_a_geometry_of_the_missions_own_is_known_and_stands_in_place_of_the_fleets(
    fleet: Fleet,
) -> None:
    near = (fleet.origin[0], fleet.origin[1], None)
    own = {"moon": Point(near), "field": Route((near,))}
    drawn = replace(
        mission(
            behavior("goto", vehicle("evsg1"), target="moon"),
            drive(vehicle("evsg1"), route="field"),
        ),
        geometries=own,
    )
    assert check_mission(drawn, fleet, everything) == []


def test_a_geometry_of_the_missions_own_that_is_too_far_away_is_an_error(fleet: Fleet) -> None:
    far = {"moon": Point((-fleet.origin[0], fleet.origin[1], None))}
    drawn = replace(mission(behavior("goto", vehicle("evsg1"), target="moon")), geometries=far)
    finding = only(check_mission(drawn, fleet, everything))
    assert finding.rule == "out-of-reach"
    assert finding.message.startswith("geometry 'moon': ")


def test_a_vehicle_that_is_held_and_not_commanded_is_a_warning(fleet: Fleet) -> None:
    assert check(fleet, drive(vehicle("evsg1"), payload("evsg3/ptz"))) == []
    zoom = behavior("zoom", payload("evsg3/ptz"), vehicle("evsg1"), type_=PAYLOAD)
    finding = only(check(fleet, zoom))
    assert (finding.rule, finding.severity) == ("idle-role", Severity.WARNING)
    assert "evsg1 is held while the payload behavior zoom runs" in finding.message


def test_a_detector_in_a_fleet_without_one_is_a_warning(tmp_path: Path) -> None:
    without = patrol(tmp_path, PATROL.replace("{detector: true}", "{}"))
    finding = only(check(without, ServiceCall("Detector", 30)))
    assert (finding.rule, finding.severity) == ("no-detector", Severity.WARNING)


def test_a_value_that_is_read_later_counts_as_given(fleet: Fleet) -> None:
    assert check(fleet, drive(vehicle("evsg1"), route=READ_LATER)) == []
    finding = only(check(fleet, drive(vehicle("evsg1"), rout=READ_LATER, route="alpha")))
    assert finding.rule == "unknown-parameter"


def test_parameters_are_checked_even_when_no_role_can_be_filled(fleet: Fleet) -> None:
    findings = check(fleet, drive(vehicle("evsg9"), route="alpha", speed="5 m"))
    assert [f.rule for f in findings] == ["unknown-vehicle", "bad-value"]


def test_a_problem_that_two_vehicles_share_is_told_once(fleet: Fleet) -> None:
    task = drive(vehicle("evsg1"), vehicle("evsg3", "b"), route="alpha", speed="5 m")
    assert only(check(fleet, task)).rule == "bad-value"


def test_findings_come_in_the_order_of_the_mission(fleet: Fleet) -> None:
    findings = check(fleet, drive(vehicle("evsg9")), drive(vehicle("evsg1"), speed="1 m/s"))
    assert [f.element for f in findings] == ["DriveRoute", "Task2"]


def test_a_speed_far_beyond_that_of_cruising_is_doubtful(tmp_path: Path) -> None:
    slow = PATROL.replace("  evsg1:\n", "  evsg1:\n    cruise_speed: 2 m/s\n")
    fleet = patrol(tmp_path, slow)
    finding = only(check(fleet, drive(vehicle("evsg1"), route="alpha", speed="2000 m/s")))
    assert (finding.rule, finding.severity) == ("fast", Severity.WARNING)
    assert "2000 m/s is more than 5 times the 2 m/s at which evsg1" in finding.message
    assert check(fleet, drive(vehicle("evsg1"), route="alpha", speed="10 m/s")) == []
    assert check(fleet, drive(vehicle("evsg3"), route="alpha", speed="2000 m/s")) == []


def filled_by(fleet: Fleet, *roles: Role) -> tuple[list[str], TaskFindings]:
    task = next(mission(drive(*roles)).activities())
    findings = TaskFindings("patrol.bpmn", task)
    return [role.name for role in check_roles(roles, fleet, findings)], findings


def test_roles_that_the_fleet_fills_give_no_finding(fleet: Fleet) -> None:
    filled, findings = filled_by(fleet, vehicle("evsg2"), payload("evsg3/ptz"), team("section"))
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
    ],
)
def test_a_role_that_cannot_be_filled_says_why_and_what_would_be_right(
    fleet: Fleet, role: Role, rule: str, message: str, remedy: str
) -> None:
    filled, findings = filled_by(fleet, role)
    assert filled == []
    (finding,) = findings.found
    assert (finding.file, finding.line, finding.element) == ("patrol.bpmn", 15, "DriveRoute")
    assert (finding.severity, finding.rule) == (Severity.ERROR, rule)
    expected = f"DriveRoute (line 12), role '{role.name}': {message.format(file=fleet.file)}"
    assert finding.message == expected
    assert remedy.format(file=fleet.file) in finding.remedy


def test_an_optional_role_that_the_fleet_lacks_gives_no_finding(fleet: Fleet) -> None:
    filled, findings = filled_by(fleet, vehicle("evsg1"), payload("evsg1/ptz", optional=True))
    assert filled == ["driver"]
    assert findings.found == []


def test_two_roles_cannot_name_one_resource(fleet: Fleet) -> None:
    _, findings = filled_by(fleet, team("section"), vehicle("evsg3"))
    (finding,) = findings.found
    assert finding.rule == "resource-twice"
    assert "role 'driver': evsg3 fills role 'section' already" in finding.message


def test_two_roles_cannot_have_one_name(fleet: Fleet) -> None:
    _, findings = filled_by(fleet, vehicle("evsg1"), vehicle("evsg3"))
    assert [finding.rule for finding in findings.found] == ["duplicate-role"]


def test_a_place_without_a_line_is_named_by_its_file(fleet: Fleet) -> None:
    assert place(fleet, "evsg1") == f"evsg1 ({fleet.file}:3)"
    assert place(fleet, "nobody") == f"nobody ({fleet.file})"


def test_the_same_finding_is_kept_once(fleet: Fleet) -> None:
    _, findings = filled_by(fleet)
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
    _, findings = filled_by(fleet, role)
    (found,) = findings.found
    assert (found.severity, found.rule) == (Severity.WARNING, "optional-role")
    assert f"'{meant}'" in found.remedy


@pytest.mark.parametrize("resource", ["evsg7", "mule"])
def test_an_optional_role_of_another_vehicle_is_not_taken_for_mistyped(
    fleet: Fleet, resource: str
) -> None:
    assert filled_by(fleet, vehicle(resource, optional=True))[1].found == []


ONE_FIELD = (
    "version: 1\nvehicles: {evsg1: {domain: ground, arbiter: sim}, "
    "uav1: {domain: air, arbiter: sim}, uav2: {domain: air, arbiter: sim}}\n"
)


def by_need(condition: str | None, *, same: str = "", store: str = "", most: int = 1) -> Role:
    """A role whose work another is to do when what fills it is lost."""
    need = Need(parse(condition) if condition else None, most=most, same=same, store=store)
    return Role("driver", RoleKind.VEHICLE, "", 15, need=need, on_loss=OnLoss.REASSIGN)


def test_a_role_that_one_vehicle_alone_can_fill_is_not_reassigned(tmp_path: Path) -> None:
    fleet = patrol(tmp_path, ONE_FIELD)
    found = only(check(fleet, behavior("drive_stop", by_need("vehicle.domain == 'ground'"))))
    assert (found.severity, found.rule) == (Severity.WARNING, "no-other")
    assert "only evsg1 can fill it" in found.message
    assert check(fleet, behavior("drive_stop", by_need("vehicle.domain == 'air'"))) == []


def test_a_role_that_must_be_the_vehicle_of_an_earlier_one_is_not_reassigned(
    tmp_path: Path,
) -> None:
    fleet = patrol(tmp_path, ONE_FIELD)
    first = behavior("drive_stop", by_need("vehicle.domain == 'air'", store="who"))
    found = only(check(fleet, first, behavior("drive_stop", by_need(None, same="who"))))
    assert found.rule == "no-other"
    assert "it is filled by 'who' alone" in found.message
