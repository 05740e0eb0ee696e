"""A task with a greater priority takes a vehicle from another run, where the fleet allows it."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import Alert, RunStatus
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import BehaviorPreempted, ResourcesChosen, ResourcesNotFree, StartRun
from m2pem.engine.records import (
    BehaviorRequested,
    ErrorThrown,
    ResourcesAllocated,
    WorkReassigned,
)
from m2pem.engine.run import MissionRun
from m2pem.errors import FleetError
from m2pem.fleet.fleet import dump, restore
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, World, fleet, flow, mission, question, sequence, task
from .test_allocator import both, one

SUCCEEDED, CANCELLED, RUNNING = (
    BehaviorState.SUCCEEDED,
    BehaviorState.CANCELLED,
    BehaviorState.RUNNING,
)

HIGH = "requires='true' priority='5'"

Story = Callable[[World], Awaitable[Any]]


@pytest.fixture
def preempting(play: Callable[..., Any]) -> Callable[..., Any]:
    def run(story: Story, *vehicles: str, **options: Any) -> Any:
        given = replace(fleet(*(vehicles or ("ugv1",))), preemption=True)
        return play(story, fleet=given, **options)

    return run


def caught(role: str, after: str = "") -> bytes:
    """A task whose PREEMPTED leads to another task, or to the end."""
    body = sequence(("Go", task("Go", role)))
    event = (
        '<boundaryEvent id="B" attachedToRef="Go"><errorEventDefinition errorRef="P1"/>'
        f"</boundaryEvent>{after}{flow('B', 'After' if after else 'E')}"
    )
    if after:
        event += flow("After", "E")
    error = '<error id="P1" errorCode="PREEMPTED"/>'
    return mission(error + body.replace("</process>", f"{event}</process>"))


async def low_and_high(world: World, low: bytes, high: bytes) -> tuple[str, str]:
    """Start a run, let its behavior run, and start another one with a greater priority."""
    first = await world.executive.control.start(low)
    await world.fake.until_called("start", f"{first}.b1")
    world.fake.report(f"{first}.b1", RUNNING)
    await world.clock.sleep(1)
    return first, await world.executive.control.start(high)


def begun(world: World) -> list[str]:
    return [each.subject for each in world.fake.calls if each.what == "start"]


def cancelled(world: World) -> list[str]:
    return [each.subject for each in world.fake.calls if each.what == "cancel"]


def test_the_lower_task_ends_with_preempted_before_the_other_begins(preempting):
    async def story(world: World):
        control = world.executive.control
        events = control.subscribe()
        low, high = await low_and_high(world, caught("requires='true'"), one(HIGH))
        await world.fake.until_called("cancel", f"{low}.b1")
        await world.clock.sleep(1)
        before = begun(world), (await control.holders())["ugv1"], await control.waiting()
        world.fake.report(f"{low}.b1", CANCELLED)
        await world.fake.until_called("start", f"{high}.b1")
        world.fake.report(f"{high}.b1", SUCCEEDED)
        ends = [(await control.wait(run)).status for run in (low, high)]
        async for event in events:
            if isinstance(event, Alert):
                return before, ends, event, list(world.seen)

    before, ends, alert, seen = preempting(story)
    started, holder, (waiting,) = before
    assert (started, holder) == (["r1.b1"], "r2.a1")
    assert waiting.reason == (
        "ugv1 is taken from Go of r1, whose priority is lower and which ends first"
    )
    assert ends == [RunStatus.COMPLETED] * 2
    (error,) = [each for each in seen if isinstance(each, ErrorThrown)]
    assert (error.code, error.caught_by) == ("PREEMPTED", "B")
    assert error.reason == "ugv1 goes to Go of r2, whose priority 5 is greater than 0"
    assert (alert.run, alert.code) == ("r1", "PREEMPTED")
    assert alert.text == f"Go is preempted: {error.reason}"
    choice = [each for each in seen if isinstance(each, ResourcesAllocated)][-1]
    assert choice.considered["roles"]["driver"]["candidates"][0]["held_by"] == "r1.b1"


def test_nothing_is_taken_where_the_fleet_does_not_allow_it(play):
    async def story(world: World):
        _, high = await low_and_high(world, one("requires='true'"), one(HIGH))
        return (await world.executive.control.wait(high)).status, cancelled(world)

    assert play(story, "ugv1") == (RunStatus.FAILED, [])


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ("requires='true' priority='5'", HIGH),  # an equal priority takes nothing
        ("requires='true' priority='6'", HIGH),
        ("vehicle='ugv1' priority='5'", "vehicle='ugv1' priority='5'"),
    ],
)
def test_only_a_strictly_greater_priority_takes_a_vehicle(preempting, low, high):
    async def story(world: World):
        _, second = await low_and_high(world, one(low), one(high))
        return (await world.executive.control.wait(second)).status, cancelled(world)

    assert preempting(story) == (RunStatus.FAILED, [])


def test_a_free_vehicle_is_taken_before_one_of_another_run(preempting):
    async def story(world: World):
        _, high = await low_and_high(world, one("requires='true'"), one(HIGH))
        await world.fake.until_called("start", f"{high}.b1")
        return [each.resources for each in world.seen if isinstance(each, BehaviorRequested)], (
            cancelled(world)
        )

    assert preempting(story, "ugv1", "ugv2") == ([("ugv1",), ("ugv2",)], [])


@pytest.mark.parametrize("named", ["vehicle='ugv1'", "requires='true'"])
def test_a_task_that_names_its_vehicle_has_priority_0(preempting, named):
    async def story(world: World):
        low, high = await low_and_high(world, caught(named), one("vehicle='ugv1' priority='1'"))
        await world.fake.until_called("cancel", f"{low}.b1")
        world.fake.report(f"{low}.b1", CANCELLED)
        await world.fake.until_called("start", f"{high}.b1")
        return begun(world)

    assert preempting(story) == ["r1.b1", "r2.b1"]


def test_the_handler_of_the_lower_run_does_not_get_the_vehicle_back_before(preempting):
    """Its next task names the vehicle: it is refused, and nothing is preempted in turn."""

    async def story(world: World):
        control = world.executive.control
        low_text = caught("requires='true'", after=task("After", "vehicle='ugv1'"))
        low, high = await low_and_high(world, low_text, one(HIGH))
        await world.fake.until_called("cancel", f"{low}.b1")
        await world.clock.sleep(5)
        world.fake.report(f"{low}.b1", CANCELLED)
        await world.fake.until_called("start", f"{high}.b1")
        status = (await control.wait(low)).status
        world.fake.report(f"{high}.b1", SUCCEEDED)
        await control.wait(high)
        return begun(world), status, [e for e in world.seen if isinstance(e, ErrorThrown)]

    started, status, errors = preempting(story)
    assert started == ["r1.b1", "r2.b1"]
    assert status is RunStatus.FAILED
    assert [each.code for each in errors] == ["PREEMPTED", "RESOURCE_UNAVAILABLE"]


def test_a_lower_task_that_waits_again_goes_on_with_the_rest_afterwards(preempting):
    async def story(world: World):
        control = world.executive.control
        low_text = one("requires='true' wait='unlimited' onLoss='reassign'")
        low, high = await low_and_high(world, low_text, one(HIGH))
        await world.fake.until_called("cancel", f"{low}.b1")
        world.fake.report(f"{low}.b1", CANCELLED)
        await world.fake.until_called("start", f"{high}.b1")
        await world.clock.sleep(5)
        world.fake.report(f"{high}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{low}.b2")
        world.fake.report(f"{low}.b2", SUCCEEDED)
        ends = [(await control.wait(run)).status for run in (low, high)]
        (work,) = [each for each in world.seen if isinstance(each, WorkReassigned)]
        return begun(world), ends, (work.code, work.excluded)

    assert preempting(story) == (
        ["r1.b1", "r2.b1", "r1.b2"],
        [RunStatus.COMPLETED] * 2,
        ("PREEMPTED", ()),
    )


def test_a_vehicle_that_returns_by_itself_is_taken_by_nobody(preempting):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(one("requires='true'"))
        await world.fake.until_called("start", f"{first}.b1")
        state = VehicleState(ResourceId("uav1"), START_US, GeoPosition(0.0, 0.0, 9.0), mode="RTL")
        world.fake.say(state)
        while world.executive.bus.latest(ResourceId("uav1")) is not state:
            await world.clock.sleep(0.01)
        high = await control.start(one(HIGH))
        return (await control.wait(high)).status, cancelled(world)

    assert preempting(story, "uav1") == (RunStatus.FAILED, [])


@pytest.mark.parametrize("name", ["return_to_launch", "land"])
def test_a_vehicle_on_its_way_down_is_taken_by_nobody(preempting, name):
    async def story(world: World):
        _, high = await low_and_high(world, one("requires='true'", name), one(HIGH))
        return (await world.executive.control.wait(high)).status, cancelled(world)

    assert preempting(story, "uav1") == (RunStatus.FAILED, [])


def test_what_an_operator_takes_meanwhile_goes_to_nobody(preempting):
    async def story(world: World):
        control = world.executive.control
        waits = one(f"{HIGH} wait='unlimited'")
        low, high = await low_and_high(world, caught("requires='true'"), waits)
        await world.fake.until_called("cancel", f"{low}.b1")
        await control.take("ugv1", by="anna")
        world.fake.report(f"{low}.b1", CANCELLED)
        await control.wait(low)
        await world.clock.sleep(5)
        before = begun(world)
        await control.give_back("ugv1", by="anna")
        await world.fake.until_called("start", f"{high}.b1")
        world.fake.report(f"{high}.b1", SUCCEEDED)
        await control.wait(high)
        return before, begun(world)

    assert preempting(story) == (["r1.b1"], ["r1.b1", "r2.b1"])


def test_a_run_that_is_stopped_while_it_takes_a_vehicle_leaves_it_free(preempting):
    async def story(world: World):
        control = world.executive.control
        low, high = await low_and_high(world, caught("requires='true'"), one(HIGH))
        await world.fake.until_called("cancel", f"{low}.b1")
        await control.stop(high)
        world.fake.report(f"{low}.b1", CANCELLED)
        await control.wait(low)
        return await control.holders(), begun(world)

    assert preempting(story) == ({"ugv1": ""}, ["r1.b1"])


def test_a_vehicle_passes_up_by_priority_and_never_back(preempting):
    async def story(world: World):
        control = world.executive.control
        runs = [await control.start(caught("requires='true' wait='unlimited' priority='1'"))]
        await world.fake.until_called("start", f"{runs[0]}.b1")
        for priority in (2, 3):
            text = caught(f"requires='true' wait='unlimited' priority='{priority}'")
            runs.append(await control.start(text))
            await world.fake.until_called("cancel", f"{runs[-2]}.b1")
            world.fake.report(f"{runs[-2]}.b1", CANCELLED)
            await world.fake.until_called("start", f"{runs[-1]}.b1")
        await world.clock.sleep(5)
        return begun(world), cancelled(world)

    assert preempting(story) == (["r1.b1", "r2.b1", "r3.b1"], ["r1.b1", "r2.b1"])


def test_a_paused_run_keeps_its_vehicle(preempting):
    async def story(world: World):
        control = world.executive.control
        low = await control.start(one("requires='true'"))
        await world.fake.until_called("start", f"{low}.b1")
        await control.pause(low)
        high = await control.start(one(HIGH))
        return (await control.wait(high)).status, cancelled(world)

    assert preempting(story) == (RunStatus.FAILED, [])


def test_two_tasks_of_one_run_do_not_take_from_each_other(preempting):
    async def story(world: World):
        text = both("requires='true' wait='PT1M'", "requires='true' wait='PT1M' priority='2'")
        run = await world.executive.control.start(text)
        await world.fake.until_called("start", f"{run}.b1")
        await world.clock.sleep(5)
        return cancelled(world)

    assert preempting(story) == []


def test_the_inputs_of_the_journal_give_the_same_records_again(preempting):
    async def story(world: World):
        low, high = await low_and_high(world, caught("requires='true'"), one(HIGH))
        await world.fake.until_called("cancel", f"{low}.b1")
        world.fake.report(f"{low}.b1", CANCELLED)
        await world.fake.until_called("start", f"{high}.b1")
        world.fake.report(f"{high}.b1", SUCCEEDED)
        for run in (low, high):
            await world.executive.control.wait(run)
        return [[each async for each in world.journal.read(run)] for run in (low, high)]

    inputs = []
    vehicles = replace(fleet("ugv1"), preemption=True)
    sources = (caught("requires='true'"), one(HIGH))
    for source, entries in zip(sources, preempting(story), strict=True):
        mission_again = parse_mission(source, "m.bpmn", accepted=True)
        again = MissionRun(mission_again, restore(dump(vehicles)), entries[0].run)
        for entry in entries:
            assert tuple(again.receive(entry.input, entry.at_us).records) == entry.records
            inputs.append(entry.input)
    (preempted,) = [each for each in inputs if isinstance(each, BehaviorPreempted)]
    assert (preempted.behavior, preempted.resource, preempted.by) == ("r1.b1", "ugv1", "r2.a1")


def taking() -> MemoryJournal:
    """A journal in which r2 was taking a vehicle from r1 when their executive died."""

    async def write() -> MemoryJournal:
        journal, vehicles = MemoryJournal(), replace(fleet("ugv1"), preemption=True)
        chosen = ResourcesChosen("r1.a1", {"driver": ("ugv1",)}, {"roles": {}})
        lower = (StartRun("P"), chosen, BehaviorPreempted("r1.b1", "ugv1", "r2.a1", "for r2"))
        higher = (StartRun("P"), ResourcesNotFree("r2.a1", "it is taken from r1", {}))
        low = caught("requires='true'", after=question("After"))
        for source, inputs in ((low, lower), (one(HIGH), higher)):
            number = await journal.create(RunHeader("m.bpmn", source, "P", dump(vehicles)))
            run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), vehicles, number)
            for item in inputs:
                step = run.receive(item, START_US)
                await journal.append(
                    [Entry(number, 1, step.seq, START_US, step.t_us, item, tuple(step.records))]
                )
            await journal.release(number)
        return journal

    return asyncio.run(write())


def test_after_a_restart_the_vehicle_is_still_taken(preempting):
    async def story(world: World):
        control = world.executive.control
        world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 1, RUNNING)
        await world.executive.resume("r1")
        await world.executive.resume("r2")
        await world.fake.until_called("cancel", "r1.b1")
        await world.clock.sleep(1)
        before = begun(world)
        world.fake.report("r1.b1", CANCELLED)
        await world.fake.until_called("start", "r2.b1")
        world.fake.report("r2.b1", SUCCEEDED)
        return before, (await control.wait("r2")).status

    played = preempting(story, journal=taking(), start_us=START_US + 1_000_000)
    assert played == ([], RunStatus.COMPLETED)


def test_a_wrong_word_for_preemption_is_named_with_its_line(tmp_path):
    file = tmp_path / "fleet.yaml"
    vehicles = "vehicles: {ugv1: {domain: ground, arbiter: sim}}\n"
    file.write_text(f"version: 1\n{vehicles}allocation: {{preemption: yes}}\n", encoding="utf-8")
    with pytest.raises(FleetError) as refused:
        load_fleet(file)
    (finding,) = refused.value.findings
    assert (finding.line, finding.element) == (3, "allocation.preemption")
    file.write_text(f"version: 1\n{vehicles}allocation: {{preemption: true}}\n", encoding="utf-8")
    assert load_fleet(file).preemption
