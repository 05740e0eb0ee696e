"""Runs in which a condition on unknown data becomes true can be played to the engine."""

from typing import Any

import pytest

from m2pem.engine import records as r
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.check import check
from m2pem.verify.conformance_run import ConformanceRun, NotPlayableError, data_for
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from tests.engine.notation import mission

CATCH = """
<startEvent id="s"/><intermediateCatchEvent id="c">conditional {}</intermediateCatchEvent>
<endEvent id="bad">error E1</endEvent>
s -> c -> bad
"""
BOUNDARY = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
<boundaryEvent id="c" attachedToRef="ask">conditional {}</boundaryEvent>
<endEvent id="bad">error E1</endEvent>
s -> ask -> e
c -> bad
"""
TWICE = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
<boundaryEvent id="c" attachedToRef="ask" cancelActivity="false">conditional {}</boundaryEvent>
<endEvent id="ec"/>
s -> ask -> e
c -> ec
"""
HANDLER = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
s -> ask -> e
<subProcess id="h" triggeredByEvent="true"><startEvent id="c">conditional {}</startEvent>
<endEvent id="bad">error E1</endEvent>
c -> bad
</subProcess>
"""
BEHIND = """
<startEvent id="s"/><eventBasedGateway id="g"/>
<intermediateCatchEvent id="c">conditional {}</intermediateCatchEvent>
<intermediateCatchEvent id="t">timer PT5S</intermediateCatchEvent>
<endEvent id="bad">error E1</endEvent><endEvent id="e"/>
s -> g
g -> c -> bad
g -> t -> e
"""
OTHER = """
<process id="MAIN" isExecutable="true"><startEvent id="s"/><userTask id="ask">ask on</userTask>
<endEvent id="e"/>
s -> ask -> e
</process>
<process id="OTHER" isExecutable="true"><startEvent id="c">conditional {}</startEvent>
<endEvent id="bad">error E1</endEvent>
c -> bad
</process>
"""
COMES_TRUE = {
    "element": "c",
    "trigger": "condition",
    "detail": "",
    "data": {},
    "writes": {},
    "actions": [],
}
"""A step of a report in which the condition comes true."""
CONDITIONS = ("zone.clear", "wind > 7.5", "mode in ['hold', 'land']", "a > b and not c")


def violating_run(text: Mission) -> list[dict[str, Any]]:
    report = as_data(findings_of(text, check(text)))
    found = [each for each in report["violations"] if each["property"] == "errors-caught"]
    assert len(found) == 1
    steps: list[dict[str, Any]] = found[0]["steps"]
    assert "condition" in {step["trigger"] for step in steps}
    return steps


def played(text: Mission, steps: list[dict[str, Any]]) -> ConformanceRun:
    player = ConformanceRun(text, fleet_for(text), "MAIN")
    for step in steps:
        player.play(step)
    assert player.undone == []
    return player


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("shape", [CATCH, BOUNDARY, HANDLER, BEHIND, OTHER])
def test_a_condition_becomes_true_in_the_engine_when_the_run_says_so(
    shape: str, condition: str
) -> None:
    text = mission(shape.format(condition))
    player = played(text, violating_run(text))
    records = [record for step in player.steps for record in step.records]
    written = {record.key for record in records if isinstance(record, r.DataWritten)}
    assert written
    assert written <= {"zone.clear", "wind", "mode", "a", "b", "c"}
    (came,) = [record for record in records if isinstance(record, r.EventTriggered)]
    assert records.index(came) > max(
        n for n, record in enumerate(records) if isinstance(record, r.DataWritten)
    )
    assert player.run.state.detail.startswith("error E1")


def test_what_does_not_interrupt_is_seen_false_before_it_comes_again() -> None:
    text = mission(TWICE.format("zone.clear"))
    player = played(text, [COMES_TRUE, COMES_TRUE])
    values = [
        record.value
        for step in player.steps
        for record in step.records
        if isinstance(record, r.DataWritten) and record.key == "zone.clear"
    ]
    assert values == [True, False, True]


def test_a_condition_that_no_value_makes_true_is_told() -> None:
    text = mission(CATCH.format("a == 1 and a == 2"))
    player = ConformanceRun(text, fleet_for(text), "MAIN")
    with pytest.raises(NotPlayableError, match="no data was found for the condition of c"):
        player.play(COMES_TRUE)


def test_a_condition_that_is_not_awaited_is_told() -> None:
    text = mission(BOUNDARY.format("zone.clear"))
    player = ConformanceRun(text, fleet_for(text), "MAIN")
    player.play({**COMES_TRUE, "element": "ask", "trigger": "answer", "detail": "on"})
    with pytest.raises(NotPlayableError, match="no condition of c is awaited now"):
        player.play(COMES_TRUE)


def test_as_few_names_as_can_be_are_written() -> None:
    text = mission(CATCH.format("a > b and not c"))
    condition = next(iter(text.elements["c"].definitions)).condition  # type: ignore[attr-defined]
    store = {"a": 1, "b": 5, "c": False}
    assert set(data_for([(condition, True)], store.get) or {}) in ({"a"}, {"b"})
    assert data_for([(condition, False)], store.get) == {}
    assert set(data_for([(condition, True)], store.get, known={"a"}) or {}) == {"b"}
    assert data_for([(condition, True)], {**store, "c": True}.get, known={"c"}) is None
