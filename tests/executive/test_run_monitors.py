"""Runs are monitored for the requirements of their missions."""

import asyncio
from collections.abc import Callable
from typing import Any
from xml.sax.saxutils import quoteattr

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.bpmn import parse_mission
from m2pem.engine import inputs
from m2pem.engine.inputs import Input, MonitoredRequirement, PromptAnswer, StartRun
from m2pem.engine.records import (
    ErrorThrown,
    Record,
    RequirementDecided,
    RequirementLeftOpen,
    RequirementMonitored,
    RequirementVerdict,
)
from m2pem.engine.run import MissionRun
from m2pem.errors import MissionError
from m2pem.fleet.fleet import dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader

from .conftest import START_US, World, fleet, mission, question, sequence

VIOLATED, SATISFIED = RequirementVerdict.VIOLATED, RequirementVerdict.SATISFIED
ORDER = "!active(Second) W completed(First)"


def asking(*requirements: str) -> bytes:
    """Two questions, one after the other, with requirements (their attributes)."""
    inside = "".join(f"<m2pem:requirement {each}/>" for each in requirements)
    body = sequence(("First", question("First")), ("Second", question("Second")))
    start = '<startEvent id="S"/>'
    return mission(
        body.replace(start, f"<extensionElements>{inside}</extensionElements>{start}", 1)
    )


def requirement(id_: str, formula: str, more: str = "") -> str:
    return f'id="{id_}" ltl={quoteattr(formula)} {more}'


def decided(records: list[Record]) -> dict[str, RequirementVerdict]:
    return {each.requirement: each.verdict for each in records if type(each) is RequirementDecided}


def left_open(records: list[Record]) -> dict[str, str]:
    return {each.requirement: each.because for each in records if type(each) is RequirementLeftOpen}


async def answered(world: World, source: bytes) -> RunStatus:
    """Start it, answer both questions, and wait for the end."""
    control = world.executive.control
    run = await control.start(source)
    for _ in range(2):
        while not control.prompts():
            await world.clock.sleep(0.1)
        await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
    return (await control.wait(run)).status


def test_verdicts_are_recorded_when_they_are_certain(play: Callable[..., Any]) -> None:
    source = asking(
        requirement("order", ORDER),
        requirement("one", "[] count(active(First), active(Second)) &lt;= 1".replace("&lt;", "<")),
        requirement("ends", "<> ended(completed)"),
        requirement("left", "[] !active(First)", 'monitor="false"'),
    )

    async def story(world: World) -> list[Record]:
        assert await answered(world, source) is RunStatus.COMPLETED
        return world.seen

    seen = play(story)
    monitored = [each.requirement for each in seen if type(each) is RequirementMonitored]
    assert monitored == ["order", "one", "ends"]
    assert decided(seen) == {"order": SATISFIED, "one": VIOLATED, "ends": SATISFIED}
    kinds = [type(each).__name__ for each in seen]
    assert (
        kinds.index("RequirementDecided")
        < kinds.index("RunEnded")
        < kinds.index("RequirementDecided", kinds.index("RunEnded"))
    )


def test_a_violation_is_an_alert_and_may_be_an_error_of_the_mission(
    play: Callable[..., Any],
) -> None:
    source = asking(requirement("safe", "[] !active(Second)", 'onViolation="error:UNSAFE"'))

    async def story(world: World) -> tuple[RunStatus, list[str], list[Record]]:
        control = world.executive.control
        alerts: list[str] = []

        async def watch() -> None:
            async for event in control.subscribe():
                if isinstance(event, Alert):
                    alerts.append(f"{event.code}: {event.text}")

        watching = asyncio.ensure_future(watch())
        await world.clock.sleep(0.1)
        run = await control.start(source)
        await world.clock.sleep(0.1)
        await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
        summary = await control.wait(run)
        await world.clock.sleep(0.1)
        watching.cancel()
        assert "UNSAFE" in summary.detail
        return summary.status, alerts, world.seen

    status, alerts, seen = play(story)
    assert status is RunStatus.FAILED
    violated = "REQUIREMENT_VIOLATED: requirement safe is violated: Never 'Second' is active"
    assert alerts[0] == f"{violated} ('Second' is active)"
    assert [each.code for each in seen if type(each) is ErrorThrown] == ["UNSAFE"]


def test_a_run_that_an_operator_stops_leaves_open_what_is_not_certain(
    play: Callable[..., Any],
) -> None:
    source = asking(requirement("ends", "<> completed(Second)"))

    async def story(world: World) -> list[Record]:
        run = await world.executive.control.start(source)
        await world.executive.control.stop(run, by="anna")
        await world.executive.control.wait(run)
        return world.seen

    seen = play(story)
    assert decided(seen) == {}
    assert left_open(seen) == {"ends": "the run was stopped"}


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        (requirement("r", "[] !active(Secnd)"), "did you mean 'Second'"),
        (requirement("r", "[] true", 'onViolation="signal:S"'), "the mission has no signal 'S'"),
        (requirement("r", "[] true", 'onViolation="stop"'), "write error:CODE or signal:ID"),
        (requirement("r", "[] true", 'onViolation="error:"'), "onViolation: 'error:' is neither"),
        (
            requirement("r", "[] true", 'monitor="false" onViolation="error:E"'),
            "onViolation: runs are not monitored for it (monitor is false), so a violation throws",
        ),
        (requirement("r", "[] true", 'monitor="no"'), "monitor='no' is neither true nor false"),
    ],
)
def test_a_mission_whose_requirements_cannot_be_read_does_not_start(
    play: Callable[..., Any], attributes: str, message: str
) -> None:
    async def story(world: World) -> str:
        with pytest.raises(MissionError) as raised:
            await world.executive.control.start(asking(attributes))
        return str(raised.value)

    assert message in play(story)


def left_behind(
    source: bytes,
    *given: Input,
    formula: str = "[]!active(Second)",
    vehicles: tuple[str, ...] = ("ugv1",),
) -> MemoryJournal:
    """A journal in which run r1 got `inputs`, and then its executive died; it has no verdict."""

    async def write() -> MemoryJournal:
        journal = MemoryJournal()
        used = fleet(*vehicles)
        number = await journal.create(RunHeader("m.bpmn", source, "P", dump(used)))
        run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), used, number)
        required = MonitoredRequirement("safe", formula, "Never.")
        for item in (StartRun("P", requirements=(required,)), *given):
            step = run.receive(item, START_US)
            await journal.append(
                [Entry(number, 1, step.seq, START_US, step.t_us, item, tuple(step.records))]
            )
        await journal.release(number)
        return journal

    return asyncio.run(write())


def test_a_verdict_that_was_not_recorded_before_a_crash_is_recorded_after_it(
    play: Callable[..., Any],
) -> None:
    source = mission(sequence(("First", question("First")), ("Second", question("Second"))))

    async def story(world: World) -> list[Record]:
        await world.executive.resume("r1")
        await world.clock.sleep(1)
        return world.seen

    answer = PromptAnswer("p1", "yes")
    recorded = inputs.RequirementDecided("safe", VIOLATED, 0)
    for given, expected in (((answer,), {"safe": VIOLATED}), ((answer, recorded), {})):
        journal = left_behind(source, *given)
        seen = play(story, "ugv1", journal=journal, start_us=START_US + 60_000_000)
        assert decided(seen) == expected
