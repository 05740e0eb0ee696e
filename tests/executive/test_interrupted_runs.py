"""Operators' requests between the connection to the vehicles and the taking up of interrupted runs;
and what interrupted runs take of each other."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import RunStatus
from m2pem.bpmn import parse_mission
from m2pem.bpmn.one_task import PROCESS, one_task
from m2pem.engine.inputs import BehaviorReported, ControlTaken, Input, StartRun
from m2pem.engine.run import MissionRun
from m2pem.errors import BusyError, NotDrivenError, OperatorError
from m2pem.fleet.fleet import Fleet, dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, World, behavior, fleet, mission, sequence, task

DRIVE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))
ELSEWHERE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv2"))))
BY_NEED = mission(sequence(("Drive", task("Drive", "requires='true' wait='unlimited'"))))
VEHICLES = fleet("ugv1", "ugv2")
OUTAGE_US = 60_000_000
START = StartRun("P")
POINT = {"type": "Point", "coordinates": [-77.3, 38.1]}


async def leave(
    journal: MemoryJournal,
    source: bytes,
    *inputs: Callable[[str], Input],
    start: StartRun = START,
    of: Fleet = VEHICLES,
) -> str:
    """Leave a run behind that got `inputs`, each made with the run's number, a second apart."""
    run = await journal.create(RunHeader("m.bpmn", source, start.process, dump(of)))
    mission_run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), of, run)
    for second, make in enumerate((lambda _: start, *inputs)):
        item, at_us = make(run), START_US + second * 1_000_000
        step = mission_run.receive(item, at_us)
        await journal.append([Entry(run, 1, step.seq, at_us, step.t_us, item, tuple(step.records))])
    await journal.release(run)
    return run


def accepted(run: str) -> Input:
    return BehaviorReported(f"{run}.b1", 1, BehaviorState.ACCEPTED)


def running(run: str) -> Input:
    return BehaviorReported(f"{run}.b1", 2, BehaviorState.RUNNING, native_ref="native")


def after_a_crash(play: Any, story: Any, *left: tuple[bytes, ...]) -> Any:
    """Play `story(world, runs)` on an executive that has connected, and has taken up nothing."""

    async def leave_all() -> tuple[MemoryJournal, list[str]]:
        journal = MemoryJournal()
        return journal, [await leave(journal, *each) for each in left]

    journal, runs = asyncio.run(leave_all())

    async def all_of_it(world: World) -> Any:
        world.executive.supervisor.interrupted.expect(runs)
        for run in runs:
            known = BehaviorReport(f"{run}.b1", 2, BehaviorState.RUNNING)
            if any(item is running for item in left[runs.index(run)]):
                world.fake.known[known.id] = known
        return await story(world, runs)

    return play(all_of_it, fleet=VEHICLES, journal=journal, start_us=START_US + OUTAGE_US)


async def until_ended(world: World, run: str) -> Any:
    """Wait for the end of a run that may not be claimed yet."""
    while run not in world.executive.supervisor.runners:
        await world.clock.sleep(0.1)
    return await world.executive.control.wait(run)


def test_a_request_to_a_run_that_is_just_taken_up_says_so(play):
    async def story(world: World, runs):
        with pytest.raises(NotDrivenError, match="r1 was interrupted, and is just taken up"):
            await world.executive.control.wait(*runs)

    after_a_crash(play, story, (DRIVE, accepted, running))


@pytest.mark.parametrize("source", [DRIVE, BY_NEED], ids=["named", "by need"])
def test_no_run_begins_before_interrupted_runs_have_their_vehicles_again(play, source):
    async def story(world: World, runs):
        control = world.executive.control
        with pytest.raises(OperatorError, match="r1 was interrupted, and is just taken up"):
            await control.start(source)
        assert [line.run for line in await world.journal.runs()] == ["r1"]
        await world.executive.resume_all(runs)
        if source is DRIVE:
            with pytest.raises(BusyError, match="run r1 uses ugv1"):
                await control.start(source)
            return
        begun = await control.start(source)
        await world.fake.until_called("start", f"{begun}.b1")
        assert world.fake.requests[f"{begun}.b1"].resources == ("ugv2",)

    after_a_crash(play, story, (DRIVE, accepted, running))


def test_runs_begin_again_though_an_interrupted_run_cannot_be_taken_up(play):
    async def story(world: World, runs):
        refused = await world.executive.resume_all(["r7", *runs])
        assert "there is no run r7" in str(refused["r7"])
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.executive.control.wait("r1")
        assert await world.executive.control.start(DRIVE)

    after_a_crash(play, story, (DRIVE, accepted, running))


OTHER = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv2"))))
BOTH_DRIVE = ((DRIVE, accepted, running), (OTHER, accepted, running))


def test_a_task_that_waits_gets_nothing_of_runs_that_are_taken_up_after_its_own(play):
    async def story(world: World, runs):
        await world.executive.resume_all(runs)
        await world.clock.sleep(5.0)
        assert world.fake.count("start") == 0
        world.fake.report("r2.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("start", "r1.b1")
        assert world.fake.requests["r1.b1"].resources == ("ugv1",)

    after_a_crash(play, story, (BY_NEED,), *BOTH_DRIVE)


def test_a_start_that_was_not_sent_is_refused_if_a_run_taken_up_later_has_its_vehicle(play):
    async def story(world: World, runs):
        await world.executive.resume_all(runs)
        summary = await world.executive.control.wait("r1")
        assert "RESOURCE_UNAVAILABLE" in summary.detail
        assert "r2.b1" in summary.detail
        assert world.fake.count("start") == 0

    after_a_crash(play, story, (DRIVE,), *BOTH_DRIVE)


@pytest.mark.parametrize("of_all", [True, False])
def test_stop_counts_for_a_run_that_is_not_taken_up_yet(play, of_all):
    async def story(world: World, runs):
        control = world.executive.control
        if of_all:
            assert await control.stop_all(by="anna", reason="smoke") == runs
        else:
            await control.stop("r1", by="anna", reason="smoke")
        await world.executive.resume_all(runs)
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        summary = await control.wait("r1")
        assert summary.status is RunStatus.STOPPED
        assert "smoke" in summary.detail
        assert world.fake.count("start") == 0

    after_a_crash(play, story, (DRIVE, accepted, running))


def test_stop_of_all_counts_for_a_run_that_is_found_to_be_interrupted_only_then(play):
    async def story(world: World, runs):
        world.executive.supervisor.interrupted.expect(())  # an executive still drove it
        assert await world.executive.control.stop_all(by="anna", reason="smoke") == []
        await world.executive.resume_all(runs)
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        assert (await world.executive.control.wait("r1")).status is RunStatus.STOPPED

    after_a_crash(play, story, (DRIVE, accepted, running))


def test_what_operators_take_before_a_run_is_taken_up_is_taken_from_it(play):
    async def story(world: World, runs):
        await world.executive.control.take("ugv1", by="anna")
        await world.executive.resume_all(runs)
        await world.fake.until_called("cancel", "r1.b1")
        assert world.executive.runner("r1").run.state.taken == {"ugv1": "anna"}

    after_a_crash(play, story, (DRIVE, accepted, running))


@pytest.mark.parametrize("knows_first", [True, False])
def test_what_an_operator_has_taken_goes_on_with_what_the_operator_commands_there(
    play, knows_first
):
    source, _ = one_task(BehaviorType.VEHICLE, ResourceId("ugv1"), "drive_stop", {})
    journal = MemoryJournal()

    async def leave_both() -> tuple[str, str]:
        async def leave_mission() -> str:
            taken = ControlTaken(ResourceId("ugv1"), "anna")
            return await leave(journal, ELSEWHERE, accepted, running, lambda _: taken)

        async def leave_direct() -> str:
            start = StartRun(PROCESS, {}, "anna")
            return await leave(journal, source, accepted, running, start=start)

        first = await (leave_mission if knows_first else leave_direct)()
        second = await (leave_direct if knows_first else leave_mission)()
        return (second, first) if knows_first else (first, second)

    direct, mission_run = asyncio.run(leave_both())

    async def story(world: World) -> Any:
        control = world.executive.control
        for run in (direct, mission_run):
            known = BehaviorReport(f"{run}.b1", 2, BehaviorState.RUNNING)
            world.fake.known[known.id] = known
        assert not await world.executive.resume_all([*sorted((direct, mission_run))])
        world.fake.report(f"{direct}.b1", BehaviorState.SUCCEEDED)
        ended = await control.wait(direct)
        again = await control.execute_behavior("ugv1", "drive_stop", by="anna")
        refused = await control.wait(await control.start(DRIVE, even_if_busy=True))
        return ended, await control.holders(), again, refused

    ended, holders, again, refused = play(
        story, fleet=VEHICLES, journal=journal, start_us=START_US + OUTAGE_US
    )
    assert ended.status is RunStatus.COMPLETED
    assert holders["ugv1"] == "anna"
    assert again
    assert "anna" in refused.detail


def test_who_commanded_a_behavior_before_a_restart_replaces_it_after_it(play):
    source, _ = one_task(BehaviorType.VEHICLE, ResourceId("ugv1"), "drive_stop", {})
    journal = MemoryJournal()
    start = StartRun(PROCESS, {}, "anna")
    run = asyncio.run(leave(journal, source, accepted, running, start=start))

    async def story(world: World) -> Any:
        control = world.executive.control
        world.fake.known[f"{run}.b1"] = BehaviorReport(f"{run}.b1", 2, BehaviorState.RUNNING)
        assert not await world.executive.resume_all([run])
        with pytest.raises(BusyError, match="does for anna what it was asked for"):
            await control.execute_behavior("ugv1", "drive_stop", by="ben")
        asked = asyncio.create_task(control.execute_behavior("ugv1", "drive_stop", by="anna"))
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        return await asked, await control.wait(run)

    later, before = play(story, fleet=VEHICLES, journal=journal, start_us=START_US + OUTAGE_US)
    assert later != run
    assert "replaced by a later request" in before.detail


def test_a_run_knows_the_geometries_that_were_handed_over_before_it_was_taken_up(play):
    async def story(world: World, runs):
        await world.executive.control.set_geometry("Route", POINT, by="anna")
        await world.executive.resume_all(runs)
        await world.clock.sleep(1.0)
        assert dict(world.executive.runner("r1").run.state.geometries["Route"]) == POINT

    after_a_crash(play, story, (DRIVE, accepted, running))


@pytest.mark.parametrize("unanswered", ["r1.b1", "r2.b1", "r1.b1 r2.b1"])
@pytest.mark.parametrize("of_all", [True, False])
@pytest.mark.parametrize("after_s", [0.0, 0.5])
def test_a_stop_waits_no_ten_seconds_for_a_vehicle_that_does_not_answer(
    play, unanswered, of_all, after_s
):
    """Of all runs, or of the second one, which is taken up after the first one."""

    async def story(world: World, runs):
        query, control = world.fake.query, world.executive.control

        async def asked(behavior: str, native_ref: str | None) -> BehaviorReport:
            if behavior in unanswered:
                await asyncio.Event().wait()  # it never answers
            return await query(behavior, native_ref)

        world.fake.query = asked
        taking_up = asyncio.create_task(world.executive.resume_all(runs))
        await world.clock.sleep(after_s)
        stopped_us = world.clock.now_us()
        if of_all:
            assert await control.stop_all(by="anna") == runs
        else:
            await control.stop("r2", by="anna")
        if "r2.b1" not in unanswered:
            await world.fake.until_called("cancel", "r2.b1")
            world.fake.report("r2.b1", BehaviorState.CANCELLED)
        ended = await until_ended(world, "r2")
        assert ended.status is RunStatus.STOPPED
        assert world.clock.now_us() - stopped_us < 2_000_000
        assert world.fake.count("start") == 0
        await taking_up
        is_soon = world.clock.now_us() - stopped_us < 2_000_000
        assert is_soon is (of_all or unanswered == "r2.b1")
        assert of_all or world.fake.count("cancel", "r1.b1") == 0

    after_a_crash(play, story, (DRIVE, accepted, running), (ELSEWHERE, accepted, running))


def test_a_run_that_is_stopped_while_others_are_taken_up_commands_nothing_new(play):
    """Its task waits for a vehicle, which it would get before the run that has it is known."""

    async def story(world: World, runs):
        query, control = world.fake.query, world.executive.control

        async def asked(behavior: str, native_ref: str | None) -> BehaviorReport:
            await world.clock.sleep(5.0)
            return await query(behavior, native_ref)

        world.fake.query = asked
        taking_up = asyncio.create_task(world.executive.resume_all(runs))
        await world.clock.sleep(0.5)
        await control.stop("r1", by="anna")
        assert (await until_ended(world, "r1")).status is RunStatus.STOPPED
        assert world.executive.supervisor.availability.holder(ResourceId("ugv1")) is None
        with pytest.raises(OperatorError, match="just taken up"):
            await control.start(OTHER)
        await taking_up
        assert world.fake.count("start") == 0
        assert world.executive.supervisor.availability.holder(ResourceId("ugv1")) == "r2.b1"

    after_a_crash(play, story, (BY_NEED,), (DRIVE, accepted, running))


def test_what_is_not_there_is_said_in_a_whole_sentence(play):
    async def story(world: World):
        with pytest.raises(OperatorError) as refused:
            await world.executive.control.take("zz", by="anna")
        assert str(refused.value) == (
            "the fleet has no 'zz'; known vehicles and payloads: ugv1, ugv2"
        )
        run = await world.executive.control.start(DRIVE)
        await world.executive.control.stop(run)
        await world.executive.control.wait(run)
        with pytest.raises(NotDrivenError, match=r"r9 is not driven.*it drives: none"):
            await world.executive.control.pause("r9")

    play(story, fleet=VEHICLES)


def test_a_schedule_that_is_just_read_is_said_so(play):
    async def story(world: World):
        with pytest.raises(OperatorError, match="`m2pem serve` is one that does"):
            await world.executive.control.schedule(DRIVE)
        world.executive.announce_schedule()
        with pytest.raises(OperatorError, match=r"has just begun.* try again in a few seconds"):
            await world.executive.control.schedule(DRIVE)
        await world.executive.load_schedule()
        world.executive.serve_schedule()
        with pytest.raises(OperatorError, match="unattended"):  # the next thing that it asks for
            await world.executive.control.schedule(DRIVE)

    play(story, fleet=VEHICLES)
