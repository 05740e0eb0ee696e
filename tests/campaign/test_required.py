"""Campaigns say how likely requirements are satisfied, and count violations as failures."""

from pathlib import Path

import pytest

from m2pem.campaign.campaign import run_campaign
from m2pem.campaign.report import report_of
from m2pem.campaign.report_files import markdown_lines
from m2pem.campaign.runs import Order
from m2pem.campaign.statistics import SequentialTest, is_good, requirements
from m2pem.errors import OperatorError
from tests.campaign.conftest import MakeOrder, sequence

QUICK = '<m2pem:requirement id="quick" ltl="&lt;&gt;[0 s, 22 s] ended(completed)"/>'
BEGUN = '<m2pem:requirement id="begun" ltl="&lt;&gt; completed(A)"/>'


def mission() -> bytes:
    """Task A takes 10 s, and B 5 to 15 s: where none fails, B ends within 22 s in 7 of 10 runs."""
    inside = f"<extensionElements>{QUICK}{BEGUN}</extensionElements><startEvent"
    return sequence("A", "B").replace(b"<startEvent", inside.encode(), 1)


def quick(order: MakeOrder, *ids: str, seed: int = 7) -> Order:
    return order(seed, mission=mission(), required=ids)


def test_a_known_probability_of_a_requirement_lies_in_its_interval(order: MakeOrder) -> None:
    inside = 0
    for seed in range(10):
        found = requirements(run_campaign(quick(order, seed=seed), 60).rows)
        satisfied = found["quick"].satisfied
        assert satisfied.count + found["quick"].violated.count == 60
        inside += satisfied.low <= 0.8 * 0.9 * 0.7 <= satisfied.high
    assert inside >= 8


def test_a_violation_of_what_is_required_is_a_failure(order: MakeOrder) -> None:
    rows = run_campaign(quick(order, "quick"), 60).rows
    late = [row for row in rows if row["requirement.quick"] == "violated"]
    assert any(row["outcome"] == "completed" for row in late)
    assert [row for row in rows if not is_good(row)] == late
    plain = run_campaign(quick(order), 60).rows
    assert sum(map(is_good, plain)) > sum(map(is_good, rows))
    test = SequentialTest(0.3, 0.5, 0.05, 0.05)
    assert run_campaign(quick(order, "quick"), 2000, test=test, chunk=10).decision == "p1"
    assert run_campaign(quick(order), 2000, test=test, chunk=10).decision == "p0"


def test_the_report_has_each_requirement(order: MakeOrder) -> None:
    lines = markdown_lines(report_of(run_campaign(quick(order, "quick"), 20)))
    assert "## Requirements" in lines
    assert any(line.startswith("| quick (required) | ") for line in lines)
    assert any(line.startswith("| begun | ") for line in lines)


def test_another_requirement_is_another_campaign(order: MakeOrder, folder: Path) -> None:
    run_campaign(quick(order), 5, folder=folder)
    with pytest.raises(OperatorError, match="differs in: required"):
        run_campaign(quick(order, "quick"), 5, folder=folder, resume=True)


def test_a_requirement_that_is_not_there_is_refused(order: MakeOrder) -> None:
    with pytest.raises(OperatorError, match="no requirement 'quik' to monitor; did you mean"):
        quick(order, "quik")


def test_telemetry_in_the_argument_of_a_pattern_is_looked_at(order: MakeOrder) -> None:
    asked = (
        '<m2pem:requirement id="flat" pattern="absence">'
        '<m2pem:arg name="what" value="battery(uav1) &gt; 1 %"/></m2pem:requirement>'
    )
    inside = f"<extensionElements>{asked}</extensionElements><startEvent"
    source = sequence("A", "B").replace(b"<startEvent", inside.encode(), 1)
    rows = run_campaign(order(mission=source), 3).rows
    assert [row["requirement.flat"] for row in rows] == ["violated"] * 3
