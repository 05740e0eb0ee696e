"""The engine executes a counterexample before it is shown: what it does not follow is doubted."""

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import check
from m2pem.verify.confirmation import Confirmation
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from m2pem.verify.translate import Options
from tests.engine.notation import mission

COUNTS = """
<startEvent id="s"/><scriptTask id="I">n = 0</scriptTask><exclusiveGateway id="m"/>
<scriptTask id="A">n = n + 1</scriptTask><exclusiveGateway id="x" default="d"/>
<endEvent id="e"/><endEvent id="bad">error E1</endEvent><exclusiveGateway id="y" default="w"/>
s -> I -> m -> A -> x
x -> m if n < 60
d: x -> y
y -> e if n == 60
w: y -> bad
"""
"""It counts further than values are followed."""
FREE = """
<startEvent id="s"/><exclusiveGateway id="x"/><endEvent id="e"/>
<endEvent id="bad">error E1</endEvent>
s -> x
x -> e
x -> bad
"""
UNKNOWN = """
<startEvent id="s"/><exclusiveGateway id="x" default="d"/><endEvent id="e"/>
<endEvent id="bad">error E1</endEvent>
s -> x
d: x -> e
x -> bad if wind > 5
"""


@pytest.mark.parametrize("text", [FREE, UNKNOWN], ids=["no condition", "unknown data"])
def test_the_engine_takes_the_flows_of_a_run_where_the_mission_leaves_that_open(text: str) -> None:
    (caught,) = [each for each in check(mission(text)).results if each.property == "errors-caught"]
    assert caught.verdict is Verdict.VIOLATED
    assert not caught.violations[0].doubt


def test_an_alarm_that_the_engine_does_not_follow_is_not_certain() -> None:
    found = findings_of(mission(COUNTS), report := check(mission(COUNTS)))
    (caught,) = [each for each in report.results if each.property == "errors-caught"]
    assert caught.verdict is Verdict.MAY_BE_VIOLATED
    assert "the run of the engine has" in caught.covered
    assert found.exit_status == 4
    doubts = [v["doubt"] for v in as_data(found)["violations"] if v["property"] == "errors-caught"]
    assert doubts[0] == caught.covered


TWICE = """
<startEvent id="s"/><exclusiveGateway id="m"/><endEvent id="e"/>
<userTask id="A">ask a<loop loopMaximum="2"> </loop></userTask>
s -> m -> A -> e
s -> m
"""
"""Two tokens work in one loop, whose rounds are counted once."""


def test_no_end_is_said_to_be_out_of_reach_for_certain_where_the_engine_goes_on() -> None:
    results = {each.property: each for each in check(mission(TWICE)).results}
    assert results["no-deadlock"].verdict is Verdict.MAY_BE_VIOLATED
    for name in ("can-complete", "completes-if-fair"):
        assert results[name].verdict is not Verdict.VIOLATED


def test_a_run_that_the_mission_does_not_have_is_doubted() -> None:
    text = mission(FREE)
    report = check(text)
    (caught,) = [each for each in report.results if each.property == "errors-caught"]
    run = caught.violations[0].run
    confirmation = Confirmation(text, fleet_for(text), None, Options())
    assert confirmation.doubt(report.net, run) == ""
    completes = [n for n, each in enumerate(report.net.transitions) if each.element == "MAIN"]
    assert confirmation.doubt(report.net, [*run[:-1], *completes]) != ""
