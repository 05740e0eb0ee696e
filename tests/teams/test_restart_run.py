"""An executive dies while a team is at work, and another one takes its run up."""

import math
from collections.abc import Awaitable, Callable
from copy import deepcopy
from typing import Any

import pytest

from m2pem.api.runs import OpenPrompt, RunStatus
from m2pem.engine.records import BehaviorEnded
from m2pem.fleet.fleet import LostMemberPolicy
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState

from .carts import Yard
from .conftest import START_US, Play, World, area, one_task, route

ROADS = {"road": route((50, 0), (450, 0)), "bridge": route((50, 0), (150, 0))}
MARCH = one_task("road_following_formation", route="road", spacing="20 m", speed="5 m/s")
CROSS = one_task("bridge_crossing", route="bridge", spacing="10 m")
KINDS = pytest.mark.parametrize("arbiter", ["carts", "willing"])

Meanwhile = Callable[[Yard], None]


def column() -> Yard:
    return Yard(a=(0, 0), b=(-20, 0), c=(-40, 0))


def crash(
    play: Play,
    yard: Yard,
    mission: bytes,
    before: Callable[[World], Awaitable[None]],
    **options: Any,
) -> tuple[MemoryJournal, Yard]:
    """What is left when the executive dies: its journal, and the carts as they go."""
    journal = MemoryJournal()

    async def story(world: World) -> tuple[MemoryJournal, Yard]:
        run = await world.executive.control.start(mission)
        await before(world)
        left = deepcopy(journal), deepcopy(world.yard)
        await left[0].release(run)
        return left

    left: tuple[MemoryJournal, Yard] = play(
        story, yard, journal=journal, **{"geometries": ROADS, **options}
    )
    left[1].commands.clear()
    return left


def resume(
    play: Play, left: tuple[MemoryJournal, Yard], then: Callable[[World], Awaitable[Any]], **kw: Any
) -> Any:
    """Take the run up half a minute later; for the carts no time has passed."""

    async def story(world: World) -> Any:
        await world.executive.resume("r1")
        return await then(world)

    start_us = START_US + 90_000_000
    options = {"geometries": ROADS, **kw}
    return play(story, left[1], journal=left[0], start_us=start_us, **options)


async def to_the_end(world: World) -> tuple[RunStatus, list[BehaviorEnded]]:
    return (await world.executive.control.wait("r1")).status, world.ended()


async def asked(world: World) -> OpenPrompt:
    """Wait until the operator is asked."""
    async for notice in world.executive.control.subscribe("r1"):
        if isinstance(notice, OpenPrompt):
            return notice
    raise AssertionError("nothing was asked")


@KINDS
def test_members_that_go_on_are_marshalled_on_and_nothing_is_started_again(
    play: Play, arbiter: str
) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)

    async def then(world: World) -> Any:
        world.yard["b"].max_m_s = 1.0
        await world.clock.sleep(60)
        gap_m = world.yard["a"].place[0] - world.yard["b"].place[0]
        world.yard["b"].max_m_s = 15.0
        return gap_m, await to_the_end(world)

    left = crash(play, column(), MARCH, before, arbiter=arbiter)
    gap_m, (status, (ended,)) = resume(play, left, then, arbiter=arbiter)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert left[1].count("single_vehicle_routing") == 0
    assert gap_m < 70, "the lead has waited for the slow one"
    assert math.dist(left[1]["c"].place, (410, 0)) < 0.5


def test_what_ended_well_while_nobody_looked_is_a_success(play: Play) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)

    left = crash(play, column(), MARCH, before)
    for driven in left[1].driven.values():
        driven.cart.place, driven.cart.ahead = driven.cart.ahead[-1], []
        driven.became = BehaviorState.SUCCEEDED
    status, (ended,) = resume(play, left, to_the_end)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert left[1].commands == []


def test_a_bridge_is_crossed_on_by_the_one_who_was_on_it_and_then_by_the_rest(play: Play) -> None:
    async def before(world: World) -> None:
        await world.until(lambda: world.yard["b"].place[0] > 80)

    left = crash(play, column(), CROSS, before)
    status, (ended,) = resume(play, left, to_the_end)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    started = [name for what, name in left[1].commands if what == "single_vehicle_routing"]
    assert started == ["c"]


@pytest.mark.parametrize(
    ("decision", "status"),
    [("resume", RunStatus.COMPLETED), ("abort", RunStatus.STOPPED)],
)
def test_a_team_of_which_one_is_not_known_stands_and_the_operator_is_asked(
    play: Play, decision: str, status: RunStatus
) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)

    async def then(world: World) -> Any:
        notice = await asked(world)
        await world.clock.sleep(10)
        stand = [world.yard[name].stands for name in "abc"]
        await world.executive.control.answer("r1", notice.prompt, decision, by="anna")
        return notice.text, stand, await to_the_end(world)

    left = crash(play, column(), MARCH, before)
    left[1].driven["b"].goal, left[1]["b"].ahead = "", []
    text, stand, (became, (ended,)) = resume(play, left, then)
    assert "the part of b is UNKNOWN" in text
    assert stand == [True, True, True]
    assert became is status, ended
    if decision == "resume":
        assert ended.state is BehaviorState.SUCCEEDED
        started = [name for what, name in left[1].commands if what == "single_vehicle_routing"]
        assert started == ["b"], "the others go on from where they were"
        assert math.dist(left[1]["b"].place, (430, 0)) < 0.5
    else:
        assert ended.state is BehaviorState.CANCELLED
        assert left[1].count("cancel") == 2


def test_a_member_that_was_lost_before_is_not_asked_for(play: Play) -> None:
    policy = LostMemberPolicy.CONTINUE

    async def before(world: World) -> None:
        await world.clock.sleep(30)
        world.arbiter("carts").fail("b", "FAILED")
        await world.clock.sleep(10)

    left = crash(play, column(), MARCH, before, policy=policy)
    status, (ended,) = resume(play, left, to_the_end, policy=policy)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert ended.reason.startswith("without b (FAILED")


@KINDS
def test_a_member_that_the_marshal_had_halted_goes_on_with_the_others(
    play: Play, arbiter: str
) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)
        world.yard["c"].max_m_s = 0.1
        await world.until(lambda: world.yard["a"].halted and world.yard["a"].stands)

    left = crash(play, column(), MARCH, before, arbiter=arbiter)
    assert left[1]["a"].halted
    assert not left[1]["c"].halted
    left[1]["c"].max_m_s = 15.0
    status, (ended,) = resume(play, left, to_the_end, arbiter=arbiter)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert left[1].count("single_vehicle_routing") == 0


def test_a_team_that_was_held_as_a_whole_stands_until_an_operator_lets_it_go_on(play: Play) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)

    async def then(world: World) -> Any:
        notice = await asked(world)
        await world.clock.sleep(30)
        stand = [world.yard[name].stands for name in "abc"]
        await world.executive.control.answer("r1", notice.prompt, "resume", by="anna")
        return notice.text, stand, await to_the_end(world)

    left = crash(play, column(), MARCH, before)
    for name in "abc":
        left[1][name].halted = True
    text, stand, (status, (ended,)) = resume(play, left, then)
    assert "held, and the journal does not say why" in text
    assert stand == [True, True, True]
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert left[1].count("single_vehicle_routing") == 0


def test_a_part_that_failed_while_no_executive_ran_fails_the_team_and_stops_the_others(
    play: Play,
) -> None:
    async def before(world: World) -> None:
        await world.clock.sleep(40)

    left = crash(play, column(), MARCH, before)
    fail(left[1], "b")
    status, (ended,) = resume(play, left, to_the_end)
    assert (status, ended.state, ended.code) == (
        RunStatus.FAILED,
        BehaviorState.FAILED,
        "ROUTE_BLOCKED",
    )
    assert left[1].count("cancel") == 2
    assert [left[1][name].stands for name in "ac"] == [True, True]


def test_a_team_that_goes_on_without_lost_members_does_so_after_a_crash(play: Play) -> None:
    policy = LostMemberPolicy.CONTINUE

    async def before(world: World) -> None:
        await world.clock.sleep(40)

    left = crash(play, column(), MARCH, before, policy=policy)
    fail(left[1], "b")
    status, (ended,) = resume(play, left, to_the_end, policy=policy)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert ended.reason.startswith("without b (ROUTE_BLOCKED")
    assert left[1].count("single_vehicle_routing") == 0


@pytest.mark.parametrize("lost", ["before", "before, and silent since", "meanwhile"])
def test_pieces_of_a_lost_members_band_are_those_of_before_the_crash(play: Play, lost: str) -> None:
    policy = LostMemberPolicy.CONTINUE
    geometries = {"field": area((0, 0), (100, 0), (100, 90), (0, 90))}

    async def before(world: World) -> None:
        await world.clock.sleep(20)
        if lost != "meanwhile":
            world.arbiter("carts").fail("b", "FAILED")
            await world.clock.sleep(5)

    async def then(world: World) -> Any:
        east: set[int] = set()
        while not world.ended():
            for name in "ac":
                if abs(world.yard[name].place[0] - 50) < 5:
                    east.add(round(world.yard[name].place[1]))
            await world.clock.sleep(0.2)
        return east, await to_the_end(world)

    yard = Yard(a=(-10, 20), b=(-10, 45), c=(-10, 80))
    mission = one_task("area_survey", area="field", spacing="10 m")
    left = crash(play, yard, mission, before, policy=policy, geometries=geometries)
    if lost == "meanwhile":
        fail(left[1], "b")
    left[1].driven["b"].mute = "silent" in lost
    passes, (status, (ended,)) = resume(play, left, then, policy=policy, geometries=geometries)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert ended.reason.startswith("without b")
    assert left[1].count("single_vehicle_routing") == 2, "a piece for each of the others"
    for north in (35, 45, 55):
        assert any(abs(north - each) < 2 for each in passes), passes


def fail(yard: Yard, name: str) -> None:
    """A cart gives up while no executive runs."""
    driven = yard.driven[name]
    driven.became, driven.code, driven.cart.ahead = BehaviorState.FAILED, "ROUTE_BLOCKED", []
