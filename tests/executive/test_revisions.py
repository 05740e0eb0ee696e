"""Running missions are revised on an executive: what is commanded, refused and kept."""

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import RunStatus
from m2pem.engine.inputs import Revise
from m2pem.engine.records import MissionRevised
from m2pem.errors import MissionError, OperatorError
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission, version_of_files

from .conftest import World, behavior, mission, question, sequence
from .test_recovery import left_behind, resumed

SUCCEEDED = BehaviorState.SUCCEEDED
STOP = ("Stop", behavior("Stop", "drive_stop", "ugv1"))
FIRST = mission(sequence(("Go", behavior("Go", "drive_stop", "ugv1"))))
TWO = mission(sequence(("Go", behavior("Go", "drive_stop", "ugv1")), STOP))
ASK = mission(sequence(("Ask", question("Ask"))))


async def begun(world: World, source: bytes = FIRST) -> str:
    run = await world.executive.control.start(source)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report(f"{run}.b1", BehaviorState.RUNNING)
    await world.clock.sleep(0.1)
    return run


def test_a_task_is_added_and_the_vehicle_goes_on(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        plan = await control.plan_revision(run, TWO)
        assert plan.is_possible
        assert "new: script task Stop" in plan.changes
        assert "all that is active stays" in str(plan)
        await control.revise(run, TWO, plan.plan, by="anna")
        assert world.fake.count("cancel") == 0
        now = await control.mission(run)
        assert isinstance(now, Mission)
        assert now.source == TWO
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        summary = await control.wait(run)
        revised = next(each for each in world.seen if isinstance(each, MissionRevised))
        return summary, revised

    summary, revised = play(story, "ugv1")
    assert summary.status is RunStatus.COMPLETED
    assert revised.by == "anna"
    assert revised.version == version_of_files(TWO, ())


def test_a_removed_task_is_refused_and_its_token_moved(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world, mission(sequence(STOP)))
        plan = await control.plan_revision(run, ASK)
        assert not plan.is_possible
        assert plan.refusals[0].element == "Stop"
        assert plan.refusals[0].resources == ("ugv1",)
        assert plan.refusals[0].labels == ("end event E", "user task Ask")
        assert "refused: a token is on script task Stop" in str(plan)
        with pytest.raises(OperatorError, match="it can go to E, Ask, or end"):
            await control.revise(run, ASK, plan.plan)
        plan = await control.plan_revision(run, ASK, moves={"Stop": "Ask"})
        await control.revise(run, ASK, plan.plan, moves={"Stop": "Ask"})
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, "yes")
        return await control.wait(run)

    assert play(story, "ugv1").status is RunStatus.COMPLETED


def test_a_plan_that_holds_no_more_is_refused(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world, TWO)
        changed = TWO.replace(b'"Stop"', b'"Halt"')
        plan = await control.plan_revision(run, changed)
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{run}.b2")
        with pytest.raises(OperatorError, match="a token is on script task Stop"):
            await control.revise(run, changed, plan.plan)
        with pytest.raises(OperatorError, match="look at the new plan"):
            await control.revise(run, changed, plan.plan, moves={"Stop": "Halt"})

    play(story, "ugv1")


def test_a_plan_names_what_others_have_of_what_it_needs(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        other = await control.start(mission(sequence(("Drive", behavior("Drive", "hold", "ugv2")))))
        await world.fake.until_called("start", f"{other}.b1")
        await control.take("ugv3", by="anna")
        tasks = [
            (name, behavior(name, "hold", resource))
            for name, resource in (("Look", "ugv2"), ("Help", "ugv3"), ("Stay", "ugv1"))
        ]
        go = ("Go", behavior("Go", "drive_stop", "ugv1"))
        plan = await control.plan_revision(run, mission(sequence(go, *tasks)))
        assert plan.is_possible
        then = "the task ends with error RESOURCE_UNAVAILABLE, unless that is free when it starts"
        assert plan.busy == (
            f"script task Look needs ugv2, which Drive of {other} has now: {then}",
            f"script task Help needs ugv3, which operator anna has now: {then}",
        )
        assert f"  busy: {plan.busy[0]}" in str(plan)
        waits = mission(sequence(go, *tasks[:1])).replace(
            b'vehicle="ugv2"', b'vehicle="ugv2" m2pem:wait="PT5M"'
        )
        plan = await control.plan_revision(run, waits)
        assert plan.busy == (
            f"script task Look needs ugv2, which Drive of {other} has now: the task waits until "
            "that is free, as long as its limit lets it",
        )

    play(story, "ugv1", "ugv2", "ugv3")


def test_a_run_goes_back_to_a_version_that_it_has_had(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        plan = await control.plan_revision(run, TWO)
        await control.revise(run, TWO, plan.plan, by="anna")
        first, last = await control.versions(run)
        assert (first.version, first.seq) == (version_of_files(FIRST, ()), 1)
        assert (last.version, last.by) == (plan.version, "anna")
        files = await control.version_files(run, first.version)
        plan = await control.plan_revision(run, files)
        await control.revise(run, files, plan.plan, by="bert")
        assert [each.by for each in (await control.versions(run))[1:]] == ["anna", "bert"]
        world.fake.report(f"{run}.b1", SUCCEEDED)
        summary = await control.wait(run)
        assert len(await control.versions(run)) == 3, "also when it has ended"
        with pytest.raises(OperatorError, match="r1 has not had version 'x'; it has had "):
            await control.version_files(run, "x")
        with pytest.raises(OperatorError, match="the journal has no run r9"):
            await control.versions("r9")
        return summary

    assert play(story, "ugv1").status is RunStatus.COMPLETED


def test_a_version_that_does_not_fit_the_fleet_is_refused(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        wrong = FIRST.replace(b'vehicle="ugv1"', b'vehicle="ugv7"')
        plan = await control.plan_revision(run, wrong)
        assert not plan.is_possible
        assert any("ugv7" in str(each) for each in plan.findings)
        with pytest.raises(MissionError, match="cannot run with fleet"):
            await control.revise(run, wrong, plan.plan)
        with pytest.raises(MissionError):
            await control.plan_revision(run, b"no BPMN")

    play(story, "ugv1")


def test_a_run_that_has_ended_and_one_behavior_are_not_revised(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await control.wait(run)
        with pytest.raises(OperatorError, match="only a run that is under way is revised"):
            await control.plan_revision(run, TWO)
        one = await control.execute_behavior("ugv1", "drive_stop")
        with pytest.raises(OperatorError, match="is one behavior that was commanded"):
            await control.plan_revision(one, TWO)

    play(story, "ugv1")


def test_a_paused_run_commands_nothing_before_it_goes_on(play):
    async def story(world: World):
        control = world.executive.control
        run = await begun(world)
        await control.pause(run)
        other = FIRST.replace(b"drive_stop", b"hold")
        plan = await control.plan_revision(run, other)
        assert [each.kind for each in plan.effects] == ["restarts"]
        await control.revise(run, other, plan.plan)
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await world.clock.sleep(5)
        assert world.fake.count("start") == 1
        await control.resume(run)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        return await control.wait(run)

    assert play(story, "ugv1").status is RunStatus.COMPLETED


def revision(source: bytes, plan: str) -> Revise:
    return Revise(version_of_files(source, ()), "new.bpmn", source, plan)


def test_a_resume_goes_on_with_the_version_that_held(play):
    """Its executive died right after the revision was journaled."""
    plans = []

    async def find_plan(world: World):
        run = await begun(world)
        plans.append((await world.executive.control.plan_revision(run, TWO)).plan)

    play(find_plan, "ugv1")

    async def story(world: World):
        control = world.executive.control
        assert (await control.mission("r1")).source == TWO
        await world.fake.until_called("query", "r1.b1")
        world.fake.report("r1.b1", SUCCEEDED)
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        return await control.wait("r1")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    journal = left_behind(FIRST, revision(TWO, plans[0]))
    assert resumed(play, journal, story, known=known).status is RunStatus.COMPLETED


def test_a_resume_cancels_what_the_revision_replaced(play):
    """Its executive died before it could command anything of it."""
    other = FIRST.replace(b"drive_stop", b"hold")
    plans = []

    async def find_plan(world: World):
        run = await begun(world)
        plans.append((await world.executive.control.plan_revision(run, other)).plan)

    play(find_plan, "ugv1")

    async def story(world: World):
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        return await world.executive.control.wait("r1")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    journal = left_behind(FIRST, revision(other, plans[0]))
    assert resumed(play, journal, story, known=known).status is RunStatus.COMPLETED
