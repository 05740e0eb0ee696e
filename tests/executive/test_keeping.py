"""Vehicles that a run keeps between its tasks: who gets them meanwhile, and when they are free."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import BehaviorReported, ResourcesChosen, StartRun
from m2pem.engine.records import KeepingEnded
from m2pem.engine.run import MissionRun
from m2pem.fleet.fleet import dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.catalogue import BehaviorState
from tests.waiting_circle import GO

from .conftest import START_US, World, fleet, mission, question, sequence, task
from .test_allocator import one

SUCCEEDED = BehaviorState.SUCCEEDED
KEEP = "requires='true' store='who' keep='process'"


def kept_between(role: str = KEEP, later: str = "same='who'") -> bytes:
    """A task that keeps its vehicle, a user task, and a task that has it again."""
    go, back = task("Go", role), task("Back", later)
    return mission(sequence(("Go", go), ("Q", question("Q")), ("Back", back)))


async def to_question(world: World, source: bytes) -> str:
    """Start a run, and bring it to its user task between the two others."""
    run = await world.executive.control.start(source)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report(f"{run}.b1", SUCCEEDED)
    while not world.executive.control.prompts():
        await world.clock.sleep(0.1)
    return run


async def answer(world: World, run: str) -> None:
    (prompt,) = world.executive.control.prompts()
    await world.executive.control.answer(run, prompt.prompt, "yes", by="ops")


async def done(world: World, behavior: str) -> None:
    await world.fake.until_called("start", behavior)
    world.fake.report(behavior, SUCCEEDED)


def test_another_run_waits_until_the_process_has_ended(play):
    async def story(world: World):
        control = world.executive.control
        first = await to_question(world, kept_between())
        second = await control.start(one("requires='true' wait='unlimited'"))
        while not await control.waiting():
            await world.clock.sleep(0.1)
        (waiting,) = await control.waiting()
        held = (await control.holders())["ugv1"], await control.holder_labels()
        await answer(world, first)
        await done(world, f"{first}.b2")
        await done(world, f"{second}.b1")
        ends = [(await control.wait(run)).status for run in (first, second)]
        return waiting.reason, held, ends, await control.holders()

    reason, (holder, labels), ends, after = play(story, "ugv1")
    assert holder == "r1.k1"
    assert labels["r1.k1"] == "Go of r1, which keeps it until P ends"
    assert reason == f"role 'driver': ugv1 is held by {labels['r1.k1']} (r1.k1)"
    assert ends == [RunStatus.COMPLETED] * 2
    assert after == {"ugv1": ""}


def test_a_task_that_names_the_vehicle_gets_what_its_run_keeps(play):
    async def story(world: World):
        first = await to_question(world, kept_between(later="vehicle='ugv1'"))
        await answer(world, first)
        await done(world, f"{first}.b2")
        return (await world.executive.control.wait(first)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


def test_a_run_that_is_stopped_keeps_nothing(play):
    async def story(world: World):
        first = await to_question(world, kept_between())
        await world.executive.control.stop(first)
        await world.executive.control.wait(first)
        return await world.executive.control.holders()

    assert play(story, "ugv1") == {"ugv1": ""}


@pytest.mark.parametrize(("allowed", "status"), [(True, "COMPLETED"), (False, "FAILED")])
def test_a_task_with_a_greater_priority_takes_a_kept_and_idle_vehicle_if_the_fleet_allows_it(
    play: Callable[..., Any], allowed: bool, status: str
) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        events = control.subscribe()
        first = await to_question(world, kept_between())
        second = await control.start(one("requires='true' priority='5'"))
        if allowed:
            await done(world, f"{second}.b1")
        end = (await control.wait(second)).status
        alerts = []
        if allowed:
            async for event in events:
                if isinstance(event, Alert):
                    alerts.append(event)
                    break
        await answer(world, first)
        await done(world, f"{first}.b2")
        await control.wait(first)
        return end, alerts, [each for each in world.seen if isinstance(each, KeepingEnded)]

    end, alerts, ended = play(story, fleet=replace(fleet("ugv1"), preemption=allowed))
    assert end is RunStatus[status]
    why = "ugv1 goes to Go of r2, whose priority 5 is greater than 0"
    assert [each.text for each in alerts] == ([f"Go is preempted: {why}"] if allowed else [])
    assert [each.reason for each in ended] == [why if allowed else ""]


def test_runs_that_keep_what_the_other_waits_for_are_a_circle(play):
    catch = (
        '<intermediateCatchEvent id="Q"><signalEventDefinition signalRef="Sig"/>'
        "</intermediateCatchEvent>"
    )

    def source(mine: str, other: str) -> bytes:
        body = sequence(
            ("Go", task("Go", f"vehicle='{mine}' wait='unlimited' keep='process'")),
            ("Q", catch),
            ("Need", task("Need", f"vehicle='{other}' wait='unlimited'")),
        )
        return mission(f'<signal id="Sig" name="{GO}"/>{body}')

    async def story(world: World):
        control = world.executive.control
        events = control.subscribe()
        for mine, other in (("ugv1", "ugv2"), ("ugv2", "ugv1")):
            run = await control.start(source(mine, other))
            await done(world, f"{run}.b1")
            while (await control.holders())[mine] != f"{run}.k1":
                await world.clock.sleep(0.1)
        for run in ("r1", "r2"):
            await control.signal(GO, run=run)
        async for event in events:
            if isinstance(event, Alert):
                break
        await control.stop("r2")
        await done(world, "r1.b2")
        return event, (await control.wait("r1")).status

    alert, status = play(story, "ugv1", "ugv2")
    assert alert.code == "WAITING_CIRCLE"
    assert "Need of r1 (" in alert.text
    assert "waits for ugv2 (held by Go of r2 (" in alert.text
    assert "which keeps it until P ends" in alert.text
    assert "r1.k1" not in alert.text
    assert status is RunStatus.COMPLETED


def left_between_tasks() -> MemoryJournal:
    """The journal of an executive that was killed while a run kept a vehicle between two tasks."""
    source = kept_between()
    journal = MemoryJournal()

    async def write() -> None:
        number = await journal.create(
            RunHeader("m.bpmn", source, "P", dump(fleet("ugv1")), False, 1.0, START_US)
        )
        run = MissionRun(parse_mission(source, "m.bpmn"), fleet("ugv1"), number)
        inputs = [
            StartRun("P"),
            ResourcesChosen("r1.a1", {"driver": ("ugv1",)}, {}),
            BehaviorReported("r1.b1", 1, SUCCEEDED),
        ]
        for item in inputs:
            step = run.receive(item, START_US)
            await journal.append(
                [Entry(number, 1, step.seq, step.at_us, step.t_us, step.input, tuple(step.records))]
            )
        await journal.release(number)

    asyncio.run(write())
    return journal


def test_a_vehicle_is_still_kept_after_a_restart(play):
    async def story(world: World):
        control = world.executive.control
        await world.executive.resume("r1")
        second = await control.start(one("requires='true' wait='unlimited'"))
        while not await control.waiting():
            await world.clock.sleep(0.1)
        held = (await control.holders())["ugv1"]
        await answer(world, "r1")
        await done(world, "r1.b2")
        await done(world, f"{second}.b1")
        return held, [(await control.wait(run)).status for run in ("r1", second)]

    held, ends = play(story, "ugv1", journal=left_between_tasks(), start_us=START_US + 1_000_000)
    assert held == "r1.k1"
    assert ends == [RunStatus.COMPLETED] * 2
