"""Roles by need and waiting tasks on an executive: who gets which vehicle, and when."""

import asyncio
from unittest.mock import Mock

import pytest

from m2pem.api.runs import LOGGED, Alert, RunStatus
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import Input, StartRun
from m2pem.engine.records import (
    AllocationDelayed,
    AllocationEnded,
    BehaviorRequested,
    ErrorThrown,
    ResourcesAllocated,
    RunEnded,
)
from m2pem.engine.run import MissionRun
from m2pem.errors import InternalError
from m2pem.executive.allocation_requests import AskedFor
from m2pem.fleet.fleet import dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.catalogue import BehaviorState, ResourceId
from tests.waiting_circle import GO, holding_and_waiting

from .conftest import START_US, World, fleet, flow, mission, question, sequence, task

SUCCEEDED = BehaviorState.SUCCEEDED


def one(role: str, name: str = "drive_stop", parameters: str = "") -> bytes:
    return mission(sequence(("Go", task("Go", role, name, parameters))))


def both(first: str, second: str, *, name: str = "drive_stop") -> bytes:
    """Two tasks that begin in one step."""
    return mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        f"{task('A', first, name)}{task('B', second, name)}{flow('S', 'F')}{flow('F', 'A')}"
        f"{flow('F', 'B')}</process>"
    )


TO_GATE = '<m2pem:property name="target" value="[0.01, 0.0, 0]"/>'

TAKEN_OVER_AND_WAITED_FOR = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
    f"""{task("A", "vehicle='ugv1'")}{task("C", "vehicle='ugv1'")}"""
    f"""{task("B", "requires='true' wait='unlimited'")}"""
    '<boundaryEvent id="T" attachedToRef="A"><timerEventDefinition><timeDuration>PT10S'
    "</timeDuration></timerEventDefinition></boundaryEvent>"
    f"{flow('S', 'F')}{flow('F', 'A')}{flow('F', 'B')}{flow('T', 'C')}</process>"
)
"""A timer interrupts task A, and task C gets its vehicle, for which task B waits."""


def state(vehicle: str, latitude_deg: float, battery: float = 1.0) -> VehicleState:
    place = GeoPosition(latitude_deg, 0.0, 0.0)
    return VehicleState(ResourceId(vehicle), START_US, place, battery_fraction=battery)


def given(world: World) -> dict[str, tuple[str, ...]]:
    """The resources of each task, by element, in the order of the records."""
    return {
        record.element: record.resources
        for record in world.seen
        if isinstance(record, BehaviorRequested)
    }


async def say(world: World, *states: VehicleState) -> None:
    for each in states:
        world.fake.say(each)
    while world.executive.bus.latest(states[-1].resource) is not states[-1]:
        await world.clock.sleep(0.01)


def test_the_nearest_vehicle_is_chosen_and_the_record_says_why(play):
    async def story(world: World):
        await say(world, state("ugv1", 0.0), state("ugv2", 0.009), state("ugv3", 0.0099, 0.1))
        control = world.executive.control
        run = await control.start(
            one("requires='vehicle.battery &gt; 0.2' store='who'", "goto", TO_GATE)
        )
        await world.fake.until_called("start")
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await control.wait(run)
        (record,) = [each for each in world.seen if isinstance(each, ResourcesAllocated)]
        return record, world.executive.runner(run).run.state.root

    record, _ = play(story, "ugv1", "ugv2", "ugv3")
    assert record.roles == {"driver": ("ugv2",)}
    role = record.considered["roles"]["driver"]
    chosen, other, excluded = role["candidates"]
    assert (chosen["resource"], other["resource"]) == ("ugv2", "ugv1")
    assert chosen["cost_s"] < other["cost_s"]
    assert excluded == {
        "resource": "ugv3",
        "excluded": "requires is false: vehicle.battery = 0.1",
    }


def test_tasks_that_begin_in_one_step_get_a_vehicle_each(play):
    async def story(world: World):
        run = await world.executive.control.start(both("requires='true'", "requires='true'"))
        await world.fake.until_called("start", times=2)
        for number in ("b1", "b2"):
            world.fake.report(f"{run}.{number}", SUCCEEDED)
        await world.executive.control.wait(run)
        return given(world)

    assert play(story, "ugv1", "ugv2") == {"A": ("ugv1",), "B": ("ugv2",)}


def test_tasks_that_begin_in_one_step_are_served_in_the_order_in_which_they_begin():
    tasks = "".join(
        task(f"T{number}", "requires='true' wait='unlimited'") + flow("F", f"T{number}")
        for number in range(11)
    )
    source = mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        f"{tasks}{flow('S', 'F')}</process>"
    )
    run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), fleet("ugv1"), "r1")
    run.receive(StartRun("P"), START_US)
    requests = sorted(run.state.allocations.values(), key=AskedFor(Mock()).look_at)
    assert [each.id for each in requests] == [f"r1.a{number}" for number in range(1, 12)]


def test_a_task_that_does_not_wait_fails_with_what_is_in_its_way(play):
    async def story(world: World):
        both_tasks = both("requires='true' wait='PT5M'", "requires='true'")
        run = await world.executive.control.start(both_tasks)
        summary = await world.executive.control.wait(run)
        errors = [each for each in world.seen if isinstance(each, ErrorThrown)]
        return summary, errors

    summary, (error,) = play(story, "ugv1")
    assert summary.status is RunStatus.FAILED
    assert error.code == "RESOURCE_UNAVAILABLE"
    assert error.reason == "role 'driver': ugv1 is held by A of r1 (r1.a1)"


def test_a_task_that_needs_two_and_does_not_wait_keeps_nothing_from_a_later_one(play):
    two = "requires='true'/><m2pem:role name='second' requires='true'"
    caught = '<boundaryEvent id="C" attachedToRef="A"><errorEventDefinition/></boundaryEvent>'

    async def story(world: World):
        control = world.executive.control
        for number, vehicle in enumerate(("ugv2", "ugv3"), 1):
            await control.start(one(f"vehicle='{vehicle}' wait='unlimited'"))
            await world.fake.until_called("start", f"r{number}.b1")
        source = both(two, "requires='true'").replace(b"</process>", f"{caught}</process>".encode())
        run = await control.start(source)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", SUCCEEDED)
        return (await control.wait(run)).status, given(world)["B"]

    assert play(story, "ugv1", "ugv2", "ugv3") == (RunStatus.COMPLETED, ("ugv1",))


@pytest.mark.parametrize("role", ["vehicle='ugv1'", "requires='true'"])
def test_two_runs_that_need_one_vehicle_complete_one_after_the_other(play, role):
    async def story(world: World):
        control = world.executive.control
        text = one(f"{role} wait='unlimited'")
        first = await control.start(text)
        await world.fake.until_called("start")
        second = await control.start(text)
        await world.clock.sleep(60)
        (delayed,) = [each for each in world.seen if isinstance(each, AllocationDelayed)]
        assert delayed.holders == {"ugv1": f"{first}.b1"}
        world.fake.report(f"{first}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{second}.b1")
        world.fake.report(f"{second}.b1", SUCCEEDED)
        return [(await control.wait(run)).status for run in (first, second)]

    assert play(story, "ugv1") == [RunStatus.COMPLETED] * 2


def test_the_greatest_priority_is_served_first_then_the_earliest(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(one("requires='true'"))
        await world.fake.until_called("start")
        waiting = [
            await control.start(one(f"requires='true' wait='unlimited' priority='{priority}'"))
            for priority in (0, 0, 5)
        ]
        served = []
        holder = first
        for _ in waiting:
            world.fake.report(f"{holder}.b1", SUCCEEDED)
            calls = len(served) + 2
            await world.fake.until_called("start", times=calls)
            holder = [each for each in world.fake.calls if each.what == "start"][-1].subject[:2]
            served.append(holder)
        world.fake.report(f"{holder}.b1", SUCCEEDED)
        for run in waiting:
            await control.wait(run)
        return served

    assert play(story, "ugv1") == ["r4", "r2", "r3"]


def test_a_wait_ends_when_its_time_is_up(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(one("requires='true'"))
        await world.fake.until_called("start")
        second = await control.start(one("requires='true' wait='PT30S'"))
        before_us = world.clock.now_us()
        summary = await control.wait(second)
        waited_s = (world.clock.now_us() - before_us) / 1e6
        ended = [each for each in world.seen if isinstance(each, AllocationEnded)]
        world.fake.report(f"{first}.b1", SUCCEEDED)
        return summary, waited_s, ended

    summary, waited_s, (ended,) = play(story, "ugv1")
    assert summary.status is RunStatus.FAILED
    assert waited_s == 30
    assert ended.code == "RESOURCE_UNAVAILABLE"
    assert "ugv1 is held by Go of r1 (r1.b1)" in ended.reason


def test_a_stopped_run_leaves_the_queue(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(one("requires='true'"))
        await world.fake.until_called("start")
        second = await control.start(one("requires='true' wait='unlimited'"))
        await control.stop(second)
        await control.wait(second)
        third = await control.start(one("requires='true' wait='unlimited'"))
        world.fake.report(f"{first}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{third}.b1")
        world.fake.report(f"{third}.b1", SUCCEEDED)
        return (await control.wait(third)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


def test_a_paused_run_gets_nothing_and_keeps_its_place(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(one("requires='true'"))
        await world.fake.until_called("start")
        second = await control.start(one("requires='true' wait='unlimited'"))
        await control.pause(second)
        third = await control.start(one("requires='true' wait='unlimited'"))
        world.fake.report(f"{first}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{third}.b1")
        await control.resume(second)
        world.fake.report(f"{third}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{second}.b1")
        world.fake.report(f"{second}.b1", SUCCEEDED)
        return (await control.wait(second)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


def test_a_vehicle_that_an_operator_gives_back_is_given_to_who_waits(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="ops")
        run = await control.start(one("requires='true' wait='unlimited'"))
        await world.clock.sleep(5)
        assert not world.fake.count("start")
        await control.give_back("ugv1", by="ops")
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", SUCCEEDED)
        return (await control.wait(run)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


@pytest.mark.parametrize(
    "role",
    [
        "requires=\"vehicle.name == 'ugv1'\" wait='PT10M'",
        "vehicle='ugv1' wait='PT10M'",
        "requires='true' wait='PT10M' onLoss='reassign'",
    ],
)
def test_a_vehicle_that_is_given_back_with_many_runs_open_is_chosen_once(play, role):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="ops")
        for _ in range(20):
            await control.start(mission(sequence(("Ask", question("Ask")))))
        run = await control.start(one(role))
        await world.clock.sleep(1)
        world.seen.clear()
        await control.give_back("ugv1", by="ops")
        await world.fake.until_called("start", f"{run}.b1")
        return world.seen

    seen = play(story, "ugv1")
    assert [each for each in seen if isinstance(each, AllocationDelayed)] == []
    assert len([each for each in seen if isinstance(each, ResourcesAllocated)]) == 1


def test_values_that_change_all_the_time_do_not_fill_the_journal(play):
    """It is journaled once that nothing is near enough, however often its distance changes."""

    async def story(world: World):
        await say(world, state("ugv1", 0.0))
        run = await world.executive.control.start(
            one("requires='vehicle.distance &lt; 50' wait='unlimited'", "goto", TO_GATE)
        )
        for step in range(1, 20):
            await world.clock.sleep(1)
            await say(world, state("ugv1", step / 2000))
        world.fake.say(state("ugv1", 0.01))
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await world.executive.control.wait(run)
        return [each for each in world.seen if isinstance(each, AllocationDelayed)]

    (delayed,) = play(story, "ugv1")
    assert delayed.reason == (
        "role 'driver': ugv1 is excluded (requires is false: vehicle.distance = 1105.74)"
    )


def test_a_later_role_means_the_same_vehicle(play):
    text = mission(
        sequence(
            ("A", task("A", "requires=\"vehicle.name == 'ugv2'\" store='who'")),
            ("B", task("B", "same='who'")),
            ("C", task("C", "requires='vehicle.name != who'")),
        )
    )

    async def story(world: World):
        run = await world.executive.control.start(text)
        for number in ("b1", "b2", "b3"):
            await world.fake.until_called("start", f"{run}.{number}")
            world.fake.report(f"{run}.{number}", SUCCEEDED)
        await world.executive.control.wait(run)
        return given(world)

    assert play(story, "ugv1", "ugv2") == {"A": ("ugv2",), "B": ("ugv2",), "C": ("ugv1",)}


def test_an_expression_of_a_wrong_type_is_the_tasks_error(play):
    async def story(world: World):
        source = one("requires='true' prefer='pace'")
        run = await world.executive.control.start(source, data={"pace": "fast"})
        summary = await world.executive.control.wait(run)
        return summary, [each for each in world.seen if isinstance(each, ErrorThrown)]

    summary, (error,) = play(story, "ugv1")
    assert summary.status is RunStatus.FAILED
    assert (error.code, error.reason) == (
        "EXPRESSION",
        "prefer gives the text 'fast', not a number of seconds, in 'pace'",
    )


def left_waiting(*inputs: Input) -> MemoryJournal:
    """A journal in which runs r1 and r2 wait for a vehicle, r2 since an earlier time, and their
    executive died."""

    async def write() -> MemoryJournal:
        journal, vehicles = MemoryJournal(), fleet("ugv1")
        source = one("requires='true' wait='unlimited'")
        for at_us in (START_US + 1_000_000, START_US):
            number = await journal.create(RunHeader("m.bpmn", source, "P", dump(vehicles)))
            run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), vehicles, number)
            for item in (StartRun("P"), *inputs):
                step = run.receive(item, at_us)
                await journal.append(
                    [Entry(number, 1, step.seq, at_us, step.t_us, item, tuple(step.records))]
                )
            await journal.release(number)
        return journal

    return asyncio.run(write())


def test_who_waited_is_served_after_a_restart_in_the_order_of_before(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="ops")
        await world.executive.resume("r1")
        await world.executive.resume("r2")
        await world.clock.sleep(1)
        await control.give_back("ugv1", by="ops")
        for run in ("r2", "r1"):
            await world.fake.until_called("start", f"{run}.b1")
            world.fake.report(f"{run}.b1", SUCCEEDED)
        return [(await control.wait(run)).status for run in ("r1", "r2")]

    played = play(story, "ugv1", journal=left_waiting(), start_us=START_US + 60_000_000)
    assert played == [RunStatus.COMPLETED] * 2


def test_runs_that_wait_for_each_other_are_told_and_one_can_be_stopped(play):
    async def story(world: World):
        control = world.executive.control
        alerts: list[Alert] = []
        events = control.subscribe()
        first = await control.start(holding_and_waiting("ugv1", "ugv2"))
        await world.fake.until_called("start", f"{first}.b1")
        second = await control.start(holding_and_waiting("ugv2", "ugv1"))
        await world.fake.until_called("start", f"{second}.b1")
        for run in (first, second):
            await control.signal(GO, run=run)
        async for event in events:
            if isinstance(event, Alert):
                alerts.append(event)
            if len(alerts) == 2:
                break
        took_us = world.clock.now_us() - START_US
        stopped = asyncio.ensure_future(control.stop(second))
        await world.fake.until_called("cancel", f"{second}.b1")
        world.fake.report(f"{second}.b1", BehaviorState.CANCELLED)
        await stopped
        await world.fake.until_called("start", f"{first}.b2")
        world.fake.report(f"{first}.b2", SUCCEEDED)
        await world.fake.until_called("cancel", f"{first}.b1")
        world.fake.report(f"{first}.b1", BehaviorState.CANCELLED)
        return alerts, took_us, (await control.wait(first)).status

    alerts, took_us, status = play(story, "ugv1", "ugv2")
    assert [alert.code for alert in alerts] == ["WAITING_CIRCLE"] * 2
    assert [alert.run for alert in alerts] == ["r1", "r2"]
    assert "Need of r1 (mission) waits for ugv2 (held by Hold of r2 (mission))" in alerts[0].text
    assert "Need of r2 (mission) waits for ugv1 (held by Hold of r1 (mission))" in alerts[0].text
    assert "`m2pem stop r2`" in alerts[0].text
    assert took_us < 1_000_000
    assert status is RunStatus.TERMINATED


PAIR = "name='pair' requires='true' count='2' wait='unlimited'"


def for_two(event: str = "", *roles: str) -> bytes:
    """One team task that waits for two vehicles, with a boundary event."""
    caught = f'<boundaryEvent id="X" attachedToRef="Two" {event}</boundaryEvent>' if event else ""
    return mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><scriptTask id="Two">'
        '<extensionElements><m2pem:behavior type="team" name="escort"><m2pem:properties>'
        f"{TO_GATE}</m2pem:properties><m2pem:resources>"
        f"{''.join(f'<m2pem:role {role}/>' for role in roles or (PAIR,))}</m2pem:resources>"
        f"</m2pem:behavior></extensionElements></scriptTask>{caught}{flow('S', 'Two')}</process>"
    )


async def keep_for_two_what_one_needs(world: World, source: bytes) -> tuple[str, str]:
    """Start a run that holds ugv1 until it has ugv2, which is kept for the task of another run."""
    control = world.executive.control
    holder = await control.start(holding_and_waiting("ugv1", "ugv2"))
    await world.fake.until_called("start", f"{holder}.b1")
    waits = await control.start(source)
    while not await control.waiting():
        await world.clock.sleep(0.1)
    await control.signal(GO, run=holder)
    return holder, waits


TIMER = "<timerEventDefinition><timeDuration>PT1M</timeDuration></timerEventDefinition>"


def test_a_task_of_a_paused_run_keeps_nothing(play):
    async def story(world: World):
        holder, waits = await keep_for_two_what_one_needs(world, for_two())
        while len(await world.executive.control.waiting()) < 2:
            await world.clock.sleep(0.1)
        await world.executive.control.pause(waits)
        async with asyncio.timeout(1):
            await world.fake.until_called("start", f"{holder}.b2")

    play(story, "ugv1", "ugv2")


EITHER = tuple(f"name='{name}' requires='true' wait='unlimited'" for name in ("left", "right"))


def test_a_task_whose_roles_share_what_is_free_is_told_how_many_are_missing(play):
    async def story(world: World):
        await keep_for_two_what_one_needs(world, for_two("", *EITHER))
        return (await world.executive.control.waiting())[0].reason

    held = "ugv1 is held by Hold of r1 (r1.b1), ugv2 is free"
    assert play(story, "ugv1", "ugv2") == f"the roles together: 1 of 2 free: {held}"


@pytest.mark.parametrize("source", [(), (f"cancelActivity='false'>{TIMER}",), ("", *EITHER)])
def test_a_vehicle_kept_for_a_task_that_waits_for_several_closes_a_circle(play, source):
    async def story(world: World):
        control = world.executive.control
        events = control.subscribe()
        holder, waits = await keep_for_two_what_one_needs(world, for_two(*source))
        async with asyncio.timeout(2):
            async for each in events:
                if isinstance(each, Alert):
                    break
        await control.stop(waits)
        await world.fake.until_called("start", f"{holder}.b2")
        return each, world.clock.now_us() - START_US

    alert, took_us = play(story, "ugv1", "ugv2")
    assert alert.code == "WAITING_CIRCLE"
    assert "Two of r2 (mission) waits for ugv1 (held by Hold of r1 (mission))" in alert.text
    assert "Need of r1 (mission) waits for ugv2 (kept for Two of r2 (mission))" in alert.text
    assert took_us < 2_000_000


def test_a_task_that_a_timer_ends_is_in_no_circle(play):
    async def story(world: World):
        events = world.executive.control.subscribe()
        holder, waits = await keep_for_two_what_one_needs(world, for_two(f">{TIMER}"))
        await world.fake.until_called("start", f"{holder}.b2")
        alerts = []
        async for each in events:
            alerts += [each.text] if isinstance(each, Alert) else []
            if isinstance(getattr(each, "record", None), RunEnded):
                return each.run == waits, alerts

    assert play(story, "ugv1", "ugv2") == (True, [])


def broken(*_: object, **__: object) -> None:
    raise ZeroDivisionError("a bug")


@pytest.mark.parametrize(
    "where",
    ["m2pem.executive.allocator.assign", "m2pem.executive.waiting_queue.RoleEvaluator.role"],
)
def test_an_exception_while_choosing_holds_the_runs_that_ask_and_tells_operators(
    play, monkeypatch, where
):
    async def story(world: World):
        control = world.executive.control
        events = control.subscribe()
        other = await control.start(one("vehicle='ugv2'"))
        await world.fake.until_called("start", f"{other}.b1")
        waits = await control.start(both("vehicle='ugv1'", "requires='true' wait='unlimited'"))
        await world.fake.until_called("start", f"{waits}.b1")
        await world.fake.until_called("hold", "ugv1")
        alert = None
        while not isinstance(alert, Alert) or alert.code == LOGGED:
            alert = await anext(events)
        world.fake.report(f"{other}.b1", SUCCEEDED)
        status = (await control.wait(other)).status
        with pytest.raises(InternalError, match="ZeroDivisionError: a bug"):
            await control.wait(waits)
        return alert, status, world.fake.count("hold", "ugv2")

    monkeypatch.setattr(where, broken)
    alert, status, held = play(story, "ugv1", "ugv2")
    assert (alert.run, alert.code) == ("r2", "RUN_HELD")
    assert "ZeroDivisionError: a bug. Commanded to hold: ugv1" in alert.text
    assert status is RunStatus.COMPLETED
    assert held == 0


def test_a_vehicle_that_a_task_takes_over_by_name_is_not_chosen_for_another_task_of_the_run(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(TAKEN_OVER_AND_WAITED_FOR)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        world.fake.report(f"{run}.b2", SUCCEEDED)
        await world.fake.until_called("start", f"{run}.b3")
        world.fake.report(f"{run}.b3", SUCCEEDED)
        return (await control.wait(run)).status, list(given(world))

    assert play(story, "ugv1") == (RunStatus.COMPLETED, ["A", "C", "B"])
