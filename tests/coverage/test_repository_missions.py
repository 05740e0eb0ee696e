"""Each element, flow and end of the repository's missions is seen by a scenario, or named."""

from pathlib import Path

import pytest

from m2pem.coverage.report import coverage_problems
from m2pem.coverage.suite import Target, Wanted, find_targets, report_on
from m2pem.plugins import PluginManager

ROOT = Path(__file__).parents[2]
TARGETS = find_targets([ROOT / "missions", ROOT / "examples"])
CALLED = {ROOT / "examples/t21_processes_in_files/inspection.bpmn"}
"""Files without scenarios of their own: missions that have some call them."""


def test_all_missions_have_scenarios() -> None:
    assert {each.mission for each in TARGETS if each.scenarios is None} == CALLED
    assert len(TARGETS) > 35


@pytest.mark.parametrize(
    "target",
    [each for each in TARGETS if each.scenarios is not None],
    ids=lambda each: str(each.mission.relative_to(ROOT)),
)
def test_scenarios_pass_and_see_all_or_name_it(target: Target) -> None:
    report = report_on(target, Wanted(complete=True), PluginManager())
    assert {each.title: each.differences for each in report.outcomes if each.differences} == {}
    assert coverage_problems(report) == []
