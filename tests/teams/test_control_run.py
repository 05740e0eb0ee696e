"""A team behavior is one to the mission: cancelled, paused, refused and failed as one."""

import math
from typing import Any

import pytest

from m2pem.api.arbiter import Limits
from m2pem.api.runs import RunStatus
from m2pem.engine.records import BehaviorEnded, BehaviorProgressed
from m2pem.fleet.fleet import Domain, Fleet, LostMemberPolicy, Team, Vehicle
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse

from .carts import ORIGIN, CartArbiter, Yard
from .conftest import Play, World, area, one_task, route

ROAD = {"road": route((50, 0), (450, 0)), "field": area((0, 0), (200, 0), (200, 90), (0, 90))}
MARCH = one_task("road_following_formation", route="road", spacing="20 m", speed="5 m/s")
KINDS = pytest.mark.parametrize("arbiter", ["carts", "willing"])
GO_ON = LostMemberPolicy.CONTINUE


def column() -> Yard:
    """Three carts one after the other, the lead first."""
    return Yard(a=(0, 0), b=(-20, 0), c=(-40, 0))


async def under_way(world: World, seconds: float = 30.0) -> str:
    """A march that has gone on for a while."""
    run = await world.executive.control.start(MARCH)
    await world.clock.sleep(seconds)
    assert all(not world.yard[name].stands for name in "abc")
    return run


async def until_over(world: World, run: str) -> tuple[RunStatus, BehaviorEnded]:
    summary = await world.executive.control.wait(run)
    (ended,) = world.ended()
    return summary.status, ended


@KINDS
def test_the_journal_has_one_accepted_one_running_and_one_end(play: Play, arbiter: str) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(MARCH)
        return await until_over(world, run), world.seen

    (status, ended), seen = play(story, column(), arbiter=arbiter, geometries=ROAD)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    progress = [(each.number, each.state) for each in seen if isinstance(each, BehaviorProgressed)]
    assert progress == [(1, BehaviorState.ACCEPTED), (2, BehaviorState.RUNNING)]


def test_members_that_another_executive_drives_are_held_by_a_stop(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        await world.arbiter("carts").cancel(f"{run}.b9", 5)  # of the executive with epoch 5
        await world.executive.control.stop(run)
        await world.until(lambda: world.yard.count("hold") == 3)
        return world.executive.runner(run).replaced, world.yard.count("cancel")

    assert play(story, column(), geometries=ROAD) == (True, 0)


@KINDS
def test_stopping_the_run_stops_every_member_before_the_behavior_has_ended(
    play: Play, arbiter: str
) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        await world.executive.control.stop(run)
        while not world.ended():
            await world.clock.sleep(0.05)
        stand = [world.yard[name].stands for name in "abc"]
        return await until_over(world, run), stand

    yard = column()
    (status, ended), stand = play(story, yard, arbiter=arbiter, geometries=ROAD)
    assert (status, ended.state) == (RunStatus.STOPPED, BehaviorState.CANCELLED)
    assert stand == [True, True, True]
    assert [yard.count("cancel", name) for name in "abc"] == [1, 1, 1]


@KINDS
def test_a_paused_team_stands_and_nobody_is_told_anything_until_the_run_goes_on(
    play: Play, arbiter: str
) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        await world.executive.control.pause(run)
        await world.clock.sleep(5)
        places = [world.yard[name].place for name in "abc"]
        said = len(world.yard.commands)
        await world.clock.sleep(300)
        assert [world.yard[name].place for name in "abc"] == places
        assert len(world.yard.commands) == said
        await world.executive.control.resume(run)
        await world.clock.sleep(5)
        assert not world.yard["a"].stands
        return await until_over(world, run)

    yard = column()
    status, ended = play(story, yard, arbiter=arbiter, geometries=ROAD)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert math.dist(yard["c"].place, (410, 0)) < 0.5


@KINDS
def test_a_pause_while_the_marshal_has_one_waiting_does_not_let_it_go(
    play: Play, arbiter: str
) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(MARCH)
        await world.until(lambda: world.yard["b"].halted)
        await world.executive.control.pause(run)
        await world.clock.sleep(10)
        await world.executive.control.resume(run)
        await world.clock.sleep(0.15)
        assert world.yard["b"].halted, "it stands nearer to the lead than half of the spacing"
        assert world.yard.count("resume", "b") == 0
        assert world.yard.count("resume", "c") == 1
        return await until_over(world, run)

    # b is beside the lead, and must let it go ahead first.
    yard = Yard(a=(0, 0), b=(0, 3), c=(-40, 0))
    status, _ = play(story, yard, arbiter=arbiter, geometries=ROAD)
    assert status is RunStatus.COMPLETED


@KINDS
def test_a_member_that_refuses_fails_the_team_when_the_others_stand(
    play: Play, arbiter: str
) -> None:
    async def story(world: World) -> Any:
        world.yard.driven["c"].refuses = "its doors are open"
        run = await world.executive.control.start(MARCH)
        while not world.ended():
            await world.clock.sleep(0.05)
        stand = [world.yard[name].stands for name in "abc"]
        return await until_over(world, run), stand

    (status, ended), stand = play(story, column(), arbiter=arbiter, geometries=ROAD)
    assert (status, ended.state, ended.code) == (
        RunStatus.FAILED,
        BehaviorState.FAILED,
        "REJECTED",
    )
    assert "c: its doors are open" in ended.reason
    assert stand == [True, True, True]


@pytest.mark.parametrize("code", ["ROUTE_BLOCKED", "TAKEN_OVER"])
def test_a_member_that_fails_stops_the_others_and_the_code_is_its_own(
    play: Play, code: str
) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        world.arbiter("carts").fail("b", code)
        while not world.ended():
            await world.clock.sleep(0.05)
        stand = [world.yard[name].stands for name in "abc"]
        return await until_over(world, run), stand

    # Who was taken over fails the team whatever its policy says.
    policy = GO_ON if code == "TAKEN_OVER" else LostMemberPolicy.STOP
    yard = column()
    (_, ended), stand = play(story, yard, geometries=ROAD, policy=policy)
    assert (ended.state, ended.code) == (BehaviorState.FAILED, code)
    assert ended.reason.startswith("b: ")
    assert stand == [True, True, True]


def test_a_silent_member_stops_the_team_with_link_lost(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        world.yard.driven["b"].mute = True
        return await until_over(world, run)

    yard = column()
    _, ended = play(story, yard, geometries=ROAD, watch_links=True)
    assert (ended.state, ended.code) == (BehaviorState.FAILED, "LINK_LOST")
    assert ended.reason.startswith("b: ")
    assert yard["a"].stands
    assert yard["c"].stands


@pytest.mark.parametrize("watch_links", [True, False])
@pytest.mark.parametrize("victim", ["a", "b"])
def test_a_team_may_go_on_without_a_lost_member_and_closes_its_gap(
    play: Play, victim: str, watch_links: bool
) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        world.yard.driven[victim].mute = True
        front, back = (name for name in "abc" if name != victim)
        await world.clock.sleep(40)
        gap = math.dist(world.yard[front].place, world.yard[back].place)
        return await until_over(world, run), gap

    yard = column()
    (status, ended), gap = play(story, yard, geometries=ROAD, policy=GO_ON, watch_links=watch_links)
    assert (status, ended.state) == (RunStatus.COMPLETED, BehaviorState.SUCCEEDED)
    assert ended.reason.startswith(f"without {victim} (LINK_LOST")
    assert 10 < gap < 36, "one spacing, not two; those that went around may lag a little"
    assert math.dist(yard["c"].place, (410, 0)) < 0.5


def test_a_team_that_has_lost_all_its_members_has_failed(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        for name in "abc":
            world.arbiter("carts").fail(name, "BATTERY_LOW")
            await world.clock.sleep(2)
        return await until_over(world, run)

    _, ended = play(story, column(), geometries=ROAD, policy=GO_ON)
    assert (ended.state, ended.code) == (BehaviorState.FAILED, "BATTERY_LOW")


def test_others_survey_what_a_lost_member_has_left(play: Play) -> None:
    async def story(world: World) -> Any:
        trails: list[tuple[float, float]] = []
        run = await world.executive.control.start(
            one_task("area_survey", area="field", spacing="10 m")
        )
        for _ in range(100):
            await world.clock.sleep(0.1)
        world.arbiter("carts").fail("b", "FAILED")
        lost_at = world.yard["b"].place
        while not world.ended():
            trails += [world.yard[name].place for name in "ac"]
            await world.clock.sleep(0.2)
        return await until_over(world, run), trails, lost_at

    yard = Yard(a=(-10, 20), b=(-10, 45), c=(-10, 80))
    (_, ended), trails, lost_at = play(story, yard, geometries=ROAD, policy=GO_ON)
    assert ended.state is BehaviorState.SUCCEEDED
    assert lost_at[0] < 60, "it had hardly begun"
    for north in (35, 45, 55):
        assert min(math.dist((100, north), place) for place in trails) < 5.5
    assert yard.count("single_vehicle_routing") == 5, "both others take a piece of it"


def test_a_member_who_is_slow_is_waited_for(play: Play) -> None:
    async def story(world: World) -> Any:
        world.yard["b"].max_m_s = 1.5
        run = await world.executive.control.start(MARCH)
        gaps = []
        while not world.ended():
            gaps.append(world.yard["a"].place[0] - world.yard["b"].place[0])
            await world.clock.sleep(0.5)
        return await until_over(world, run), gaps

    (_, ended), gaps = play(story, column(), geometries=ROAD)
    assert ended.state is BehaviorState.SUCCEEDED
    assert max(gaps) < 20 + 2 * 10 + 15
    assert min(gaps) >= 10


@pytest.mark.parametrize("policy", list(LostMemberPolicy))
def test_a_low_battery_is_dealt_with_by_the_policy(play: Play, policy: LostMemberPolicy) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        world.yard.driven["b"].battery = 0.1
        return await until_over(world, run)

    yard = column()
    _, ended = play(story, yard, geometries=ROAD, policy=policy, watch_links=True)
    assert yard.count("cancel", "b") == 1
    assert yard["b"].stands
    assert yard["b"].place[0] < 400
    if policy is GO_ON:
        assert ended.state is BehaviorState.SUCCEEDED
        assert ended.reason.startswith("without b (BATTERY_LOW")
    else:
        assert (ended.state, ended.code) == (BehaviorState.FAILED, "BATTERY_LOW")


def test_a_member_that_does_not_stop_is_named(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await under_way(world)
        world.yard.driven["b"].mute = True
        await world.executive.control.stop(run)
        return await until_over(world, run)

    # Its arbiter does not say that it is lost before it is given up.
    CartArbiter.bounds = Limits(lost_after_s=100.0, cancel_timeout_s=8.0)
    try:
        _, ended = play(story, column(), geometries=ROAD)
    finally:
        CartArbiter.bounds = Limits()
    assert (ended.state, ended.code) == (BehaviorState.LOST, "TIMEOUT")
    assert ended.reason == "b did not end in time when cancelled"


def test_a_rehearsal_in_which_nobody_tells_where_it_is_comes_to_its_end() -> None:
    vehicles = {
        ResourceId(name): Vehicle(ResourceId(name), domain, "sim", {"altitude": "30 m"})
        for name, domain in (("ugv", Domain.GROUND), ("uav", Domain.AIR))
    }
    crew = Team("crew", tuple(vehicles), ResourceId("ugv"))
    fleet = Fleet("f", "f.yaml", vehicles, {}, {"crew": crew}, ROAD, ORIGIN)
    result = rehearse(MARCH, fleet, plugins=PluginManager(block=("all",)))
    assert result.summary.status is RunStatus.COMPLETED, result.records[-5:]
