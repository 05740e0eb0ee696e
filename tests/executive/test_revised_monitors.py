"""A revision carries the monitors of requirements over, begins new ones, and ends others."""

from collections.abc import Callable
from typing import Any

from m2pem.bpmn import parse_mission
from m2pem.engine import records as r
from m2pem.engine.inputs import PromptAnswer, Revise, StartRun
from m2pem.engine.records import RequirementVerdict
from m2pem.executive.loading import monitored_requirements
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

from .conftest import World, fleet, mission, question, sequence
from .test_recovery import left_behind, resumed
from .test_run_monitors import decided, requirement

VIOLATED, SATISFIED = RequirementVerdict.VIOLATED, RequirementVerdict.SATISFIED
AFTER_FIRST = requirement("after", "[](active(Third) -> !once(completed(First)))")
NEVER_THIRD = requirement("never", "[] !active(Third)")
ONCE_FIRST = requirement("fresh", "[](active(Third) -> !once(completed(First)))")
ENDS = requirement("ends", "<> ended(completed)")


def asking(names: str, *requirements: str) -> bytes:
    """Questions one after the other, with requirements (their attributes)."""
    inside = "".join(f"<m2pem:requirement {each}/>" for each in requirements)
    body = sequence(*((name, question(name)) for name in names.split()))
    start = '<startEvent id="S"/>'
    return mission(
        body.replace(start, f"<extensionElements>{inside}</extensionElements>{start}", 1)
    )


OLD = asking("First Second Third", AFTER_FIRST, NEVER_THIRD)


async def answer(world: World) -> None:
    control = world.executive.control
    while not control.prompts():
        await world.clock.sleep(0.1)
    (prompt,) = control.prompts()
    await control.answer(prompt.run, prompt.prompt, "yes", by="anna")
    await world.clock.sleep(0.1)


async def revised(world: World, run: str, source: bytes) -> str:
    control = world.executive.control
    plan = await control.plan_revision(run, source)
    await control.revise(run, source, plan.plan, by="anna")
    return str(plan)


def test_a_monitor_goes_on_with_what_it_knows(play: Callable[..., Any]) -> None:
    new = asking("First Second Third Fourth", AFTER_FIRST, ONCE_FIRST, ENDS)

    async def story(world: World) -> tuple[str, list[r.Record]]:
        run = await world.executive.control.start(OLD)
        await answer(world)
        said = await revised(world, run, new)
        for _ in range(3):
            await answer(world)
        await world.executive.control.wait(run)
        return said, world.seen

    said, seen = play(story)
    assert "requirement fresh: monitored from here on" in said
    assert "requirement ends: monitored from here on" in said
    assert "requirement never: no longer monitored" in said
    assert "requirement after" not in said
    # First was completed before `fresh` was monitored: only `after` has seen it.
    assert decided(seen) == {"after": VIOLATED, "fresh": SATISFIED, "ends": SATISFIED}
    dropped = [each.requirement for each in seen if type(each) is r.RequirementDropped]
    assert dropped == ["never"]


def test_another_formula_begins_at_the_revision_and_has_its_own_verdict(
    play: Callable[..., Any],
) -> None:
    other = requirement("never", "[] !active(Second)")
    new = asking("First Second Third", AFTER_FIRST, other)

    async def story(world: World) -> tuple[str, list[r.Record]]:
        run = await world.executive.control.start(OLD)
        await answer(world)  # Second is active now
        return await revised(world, run, new), world.seen

    said, seen = play(story)
    assert "requirement never: monitored from here on, with another formula" in said
    verdicts = [each for each in seen if type(each) is r.RequirementDecided]
    assert [(each.requirement, each.verdict) for each in verdicts] == [("never", VIOLATED)]
    assert verdicts[0].because == "'Second' is active"


def test_requirements_come_with_a_revision_where_there_were_none(
    play: Callable[..., Any],
) -> None:
    new = asking("First Second Third", NEVER_THIRD, requirement("now", "active(Second)"))

    async def story(world: World) -> list[r.Record]:
        run = await world.executive.control.start(asking("First Second Third"))
        await answer(world)
        await revised(world, run, new)
        await answer(world)
        return world.seen

    assert decided(play(story)) == {"now": SATISFIED, "never": VIOLATED}


def revision_to(source: bytes, plan: str, version: str) -> Revise:
    new = parse_mission(source, "m.bpmn", accepted=True)
    found = monitored_requirements(new, fleet("ugv1"), PluginManager(block=("all",)))
    return Revise(version, "m.bpmn", source, plan, requirements=found)


def test_a_resumed_run_has_the_monitors_of_its_revision(play: Callable[..., Any]) -> None:
    """Its executive died right after the revision was journaled."""
    new = asking("First Second Third Fourth", AFTER_FIRST, ENDS)
    plans = []

    async def find_plan(world: World) -> None:
        run = await world.executive.control.start(OLD)
        await answer(world)
        plans.append(await world.executive.control.plan_revision(run, new))

    play(find_plan, "ugv1")

    async def story(world: World) -> list[r.Record]:
        for _ in range(3):
            await answer(world)
        await world.executive.control.wait("r1")
        return world.seen

    old = parse_mission(OLD, "m.bpmn", accepted=True)
    at_start = monitored_requirements(old, fleet("ugv1"), PluginManager(block=("all",)))
    journal: MemoryJournal = left_behind(
        OLD,
        PromptAnswer("p1", "yes"),
        revision_to(new, plans[0].plan, plans[0].version),
        start=StartRun("P", requirements=at_start),
    )
    assert decided(resumed(play, journal, story)) == {"after": VIOLATED, "ends": SATISFIED}


def test_a_revision_monitors_again_after_all_was_decided(play: Callable[..., Any]) -> None:
    old = asking("First Second Third", requirement("first", "<> completed(First)"))
    late = requirement("late", "[](completed(First) -> [] !active(Second))")
    now = requirement("now", "[] !(active(Second) && once(completed(Second)))")
    third = requirement("third", "[] !active(Third)")
    new = asking(
        "First Second Third", requirement("first", "<> completed(First)"), late, now, third
    )

    async def story(world: World) -> list[r.Record]:
        run = await world.executive.control.start(old)
        await answer(world)
        assert decided(world.seen) == {"first": SATISFIED}
        await revised(world, run, new)
        await answer(world)
        await answer(world)
        await world.executive.control.wait(run)
        return world.seen

    # First is completed before the revision, so "late" is not about it.
    verdicts = {"first": SATISFIED, "late": SATISFIED, "now": SATISFIED, "third": VIOLATED}
    assert decided(play(story)) == verdicts
