"""Preemption: the net follows what comes of it when other runs take what a task has."""

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from m2pem.cli.group import run_command_line
from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import check
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.engine.notation import xml
from tests.engine.random_missions import structured
from tests.verify.allocator import Allocator
from tests.verify.models import Walk
from tests.verify.random_needs import NEEDS, OPEN, branches_with_needs, fleet_of
from tests.verify.test_roles_by_need import LOSING, explained, play
from tests.verify.test_spin_agreement import one_answer, same

TASK = """
<startEvent id="s"/><endEvent id="e"/><endEvent id="o"/>
<scriptTask id="A">do {name} uav1</scriptTask>
<boundaryEvent id="b" attachedToRef="A">error {code}</boundaryEvent>
s -> A -> e
b -> o
"""


@pytest.mark.parametrize(
    ("name", "code", "may_fail"),
    [
        ("drive_stop", "FAILED", {"PREEMPTED", "LINK_LOST"}),
        ("drive_stop", "PREEMPTED", {"FAILED"}),
        ("land", "FAILED", {"LINK_LOST"}),
    ],
)
def test_a_task_may_be_preempted_unless_it_brings_its_vehicle_down(
    name: str, code: str, may_fail: set[str]
) -> None:
    mission = notation(TASK.format(name=name, code=code))
    fleet = replace(fleet_for(mission), preemption=True)
    report = check(mission, fleet)
    (handled,) = [each for each in report.results if each.property == "failures-handled"]
    assert {report.net.transitions[each.run[-1]].detail for each in handled.violations} == may_fail
    assert report.verdict is Verdict.HOLDS
    (alone,) = [
        each
        for each in check(mission, fleet_for(mission)).results
        if each.property == "failures-handled"
    ]
    assert len(alone.violations) == len(may_fail - {"PREEMPTED"})


def test_verify_says_what_it_assumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mission.bpmn"
    file.write_text(xml(TASK.format(name="drive_stop", code="FAILED")), encoding="utf-8")
    fleet = tmp_path / "fleet.yaml"
    for said, expected in (("", False), ("allocation: {preemption: true}\n", True)):
        text = "version: 1\nvehicles:\n  uav1: {domain: air, arbiter: sim}\n"
        fleet.write_text(text + said, encoding="utf-8")
        assert run_command_line(["verify", str(file), "--fleet", str(fleet)]) == 0
        out = capsys.readouterr().out
        assert ("note: the fleet allows preemption: " in out) is expected
        assert ("A may fail (PREEMPTED)" in out) is expected


@pytest.mark.parametrize("seed", range(12))
def test_the_net_can_do_what_the_engine_does_if_vehicles_are_taken(seed: int) -> None:
    dice = Random(seed)
    text = branches_with_needs(dice, LOSING) if seed % 2 else structured(dice, NEEDS)
    mission = notation(text)
    fleet = replace(fleet_of(mission), preemption=True)
    net = translate(mission, fleet, options=OPEN)
    for number in range(2):
        walk = Walk(mission, fleet, net, number, Allocator(fleet, Random(number)))
        lost = walk.go()
        assert not lost or explained(walk, net)


@pytest.mark.parametrize("seed", range(8))
def test_the_engine_follows_runs_in_which_vehicles_are_taken(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed), LOSING))
    fleet = replace(fleet_of(mission), preemption=True)
    report = check(mission, fleet, options=OPEN)
    played = 0
    for violation in as_data(findings_of(mission, report))["violations"]:
        ordered = violation["property"] == "one-behavior"
        if not ordered and not any(step["trigger"] == "timer" for step in violation["steps"]):
            play(mission, fleet, violation["steps"])
            played += 1
    assert played or report.verdict is not Verdict.VIOLATED


def test_spin_says_the_same() -> None:
    mission = notation(branches_with_needs(Random(3), LOSING[:2]))
    fleet = replace(fleet_of(mission), preemption=True)
    same(simplify(translate(mission, fleet, options=OPEN)))
    few = notation(TASK.format(name="drive_stop", code="FAILED"))
    one_answer(few, replace(fleet_for(few), preemption=True))
