"""One vehicle that several tasks name which may be active at the same time."""

import pytest

from m2pem.findings import Finding, Severity
from m2pem.fleet.check import check_mission
from m2pem.fleet.default_fleet import fleet_for
from tests.engine.notation import mission
from tests.fleet.test_shortage import FORK, fork, task
from tests.verify.allocator import offers_all


def same(text: str) -> list[Finding]:
    read = mission(text)
    found = check_mission(read, fleet_for(read), offers_all)
    return [each for each in found if each.rule == "same-vehicle"]


def test_two_branches_that_name_one_vehicle_are_a_warning_at_the_later_task() -> None:
    (finding,) = same(fork("uav1", "uav2", "uav1"))
    assert (finding.severity, finding.element) == (Severity.WARNING, "C")
    assert "uav1 may still do A at that time" in finding.message
    assert "RESOURCE_UNAVAILABLE" in finding.message
    assert "one after the other" in finding.remedy


def test_branches_with_vehicles_of_their_own_are_fine() -> None:
    assert same(fork("uav1", "uav2", "uav3")) == []


def test_a_task_that_waits_for_the_vehicle_is_fine() -> None:
    assert same(fork("uav1", "uav1;wait=unlimited")) == []


def test_a_payload_works_beside_its_vehicle_but_not_beside_itself() -> None:
    picture = "do zoom uav1/camera"
    beside = fork("uav1", "uav1").replace("do drive_stop uav1", picture, 1)
    assert same(beside) == []
    (finding,) = same(beside.replace("do drive_stop uav1", picture))
    assert "uav1/camera may still do A" in finding.message


IN_TURN = f"""
{FORK.replace("parallel", "{0}")}
{task("A", "uav1")}
{task("B", "uav1")}
{{1}}
"""


@pytest.mark.parametrize(
    ("gateway", "flows"),
    [("parallel", "f -> A -> B -> j"), ("exclusive", "f -> A -> j\nf -> B -> j")],
)
def test_tasks_in_turn_and_ways_that_exclude_each_other_are_fine(gateway: str, flows: str) -> None:
    assert same(IN_TURN.format(gateway, flows)) == []


def test_a_task_beside_a_non_interrupting_event_is_a_warning() -> None:
    event = (
        '<boundaryEvent id="t" attachedToRef="A" cancelActivity="false">timer PT1S</boundaryEvent>'
    )
    ways = "f -> A -> j\nt -> B -> e2"
    text = IN_TURN.format("parallel", f'{event}\n<endEvent id="e2"/>\n{ways}')
    assert [each.element for each in same(text)] == ["B"]
    assert same(text.replace('"false"', '"true"')) == []
