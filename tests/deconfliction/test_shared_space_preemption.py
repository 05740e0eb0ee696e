"""A task takes a vehicle from another run only if there is space for what it does with it."""

from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.runs import RunStatus
from m2pem.engine.records import BehaviorRequested, ErrorThrown
from m2pem.fleet.fleet import Domain, OnConflict, SharedSpace

from .conftest import Play, World, task
from .sky import area
from .test_shared_space_run import GEOMETRIES, at, delays, status, waits

HOMES = {"one": (0.0, 0.0), "two": (100.0, 30.0), "three": (30.0, 0.0)}
"""One and three are west of the bridge (40 m to 60 m east), two is east of it."""

ASIDE = task("Aside", "goto", "one", target=at(0, 60), speed="0.5 m/s")
OCCUPY = task("Occupy", "goto", "three", target=at(100, -10), speed="0.5 m/s")
"""It goes over the bridge."""
BACK = task("Back", "goto", "two", target=at(20, -20), speed="2 m/s")


def over(role: str) -> tuple[str, str]:
    """One crosses the bridge, with priority 5."""
    element, text = task("Over", "goto", "one", target=at(100, 0), speed="2 m/s")
    return element, text.replace('vehicle="one"', f'{role} priority="5"')


def sharing(play: Play, story: Any, **space: Any) -> Any:
    policy = {
        "vertical_separation_m": None,
        "preemption": True,
        "shared_space": {"bridge": replace(SharedSpace("bridge", 1), **space)},
    }
    return play(story, HOMES, geometries=GEOMETRIES, policy=policy, ground=tuple(HOMES))


def requested(world: World) -> list[str]:
    return [each.behavior for each in world.seen if isinstance(each, BehaviorRequested)]


def errors(world: World) -> list[tuple[str, str]]:
    return [(each.code, each.reason) for each in world.seen if isinstance(each, ErrorThrown)]


ROLES = ['vehicle="one"', "requires=\"vehicle.name == 'one'\""]


@pytest.mark.parametrize("role", ROLES)
def test_a_task_that_cannot_begin_takes_no_vehicle(play: Play, role: str) -> None:
    async def story(world: World) -> None:
        low = await world.begin(ASIDE)
        occupying = await world.begin(OCCUPY)
        await world.under_way(low)
        await world.under_way(occupying)
        high = await world.begin(over(role))
        assert await status(world, high) is RunStatus.FAILED
        ((code, reason),) = errors(world)
        assert code == "RESOURCE_UNAVAILABLE"
        assert "; one is not taken: one would enter bridge (capacity 1) at enu [" in reason
        assert "taken by three, which does r2.b1 (goto)" in reason
        assert await status(world, low) is RunStatus.COMPLETED
        assert requested(world) == ["r1.b1", "r2.b1"]

    sharing(play, story, on_conflict=OnConflict.REFUSE)


def test_a_task_that_may_wait_for_space_takes_the_vehicle_when_the_space_is_free(
    play: Play,
) -> None:
    async def story(world: World) -> None:
        low = await world.begin(ASIDE)
        occupying = await world.begin(OCCUPY)
        await world.under_way(low)
        await world.under_way(occupying)
        high = await world.begin(over('vehicle="one"'))
        await world.until(lambda: bool(delays(world)))
        assert "bridge (capacity 1)" in delays(world)[0].reason
        later = await world.begin(BACK)  # it wants the bridge, too, and asks later
        assert not errors(world)
        assert await status(world, high) is RunStatus.COMPLETED
        assert await status(world, low) is RunStatus.FAILED
        assert [code for code, _ in errors(world)] == ["PREEMPTED"]
        assert await status(world, later) is RunStatus.COMPLETED
        assert requested(world) == ["r1.b1", "r2.b1", "r3.b1", "r4.b1"]

    sharing(play, story)


def test_a_task_with_space_takes_the_vehicle_and_nobody_enters_before_it(play: Play) -> None:
    async def story(world: World) -> None:
        low = await world.begin(ASIDE)
        await world.under_way(low)
        high = await world.begin(over('vehicle="one"'))
        later = await world.begin(BACK)
        assert await status(world, high) is RunStatus.COMPLETED
        assert await status(world, low) is RunStatus.FAILED
        assert [code for code, _ in errors(world)] == ["PREEMPTED"]
        assert await status(world, later) is RunStatus.COMPLETED
        assert requested(world) == ["r1.b1", "r2.b1", "r3.b1"]
        assert any("which does r2." in each.reason for each in delays(world))

    sharing(play, story)


def test_a_task_that_takes_a_vehicle_gets_no_space_that_an_earlier_one_waits_for(
    play: Play,
) -> None:
    """Two waits for the bridge, and needs the gate behind it as well, which is free."""
    homes = {"one": (80.0, 40.0), "two": (100.0, 0.0), "three": (30.0, 0.0)}
    gate = area((75, -5), (85, -5), (85, 5), (75, 5))

    def with_priority(each: tuple[str, str], priority: int) -> tuple[str, str]:
        return each[0], each[1].replace("<m2pem:role ", f'<m2pem:role priority="{priority}" ')

    async def story(world: World) -> list[str]:
        for name, where in (("one", at(80, 90)), ("three", at(65, 0))):
            slowly = task("Slowly", "goto", name, target=where, speed="0.5 m/s")
            await world.under_way(await world.begin(slowly))
        both = task("Both", "goto", "two", target=at(0, 0), speed="2 m/s")
        earlier = await world.begin(with_priority(both, 9))
        await waits(world, earlier)
        through = task("Through", "goto", "one", target=at(80, -40), speed="2 m/s")
        later = await world.begin(with_priority(through, 5))
        for run in (earlier, later):
            assert await status(world, run) is RunStatus.COMPLETED
        return requested(world)

    policy = {
        "vertical_separation_m": None,
        "preemption": True,
        "shared_space": {name: SharedSpace(name, 1) for name in ("bridge", "gate")},
    }
    geometries = {**GEOMETRIES, "gate": gate}
    order = play(story, homes, geometries=geometries, policy=policy, ground=tuple(homes))
    assert order == ["r1.b1", "r2.b1", "r3.b1", "r4.b1"]


def test_of_vehicles_that_can_be_taken_one_with_space_is(play: Play) -> None:
    """Two would be nearer, but the way of two is blocked by three, which stands there."""

    async def story(world: World) -> None:
        for each in (ASIDE, task("Aside2", "goto", "two", target=at(100, 200), speed="0.5 m/s")):
            await world.under_way(await world.begin(each))
        element, text = task("Near", "goto", "two", target=at(45, 20), speed="2 m/s")
        role = "requires=\"vehicle.name != 'three'\" prefer=\"vehicle.name == 'two' ? 99 : 0\""
        near = element, text.replace('vehicle="two"', f'{role} priority="5"')
        high = await world.begin(near)
        assert await status(world, high) is RunStatus.COMPLETED
        assert [each.resources for each in world.seen if isinstance(each, BehaviorRequested)][
            -1
        ] == ("one",)

    policy = {
        "vertical_separation_m": None,
        "preemption": True,
        "surface_separation_m": {Domain.GROUND: 3.0},
        "on_conflict": OnConflict.REFUSE,
    }
    homes = {**HOMES, "three": (70.0, 24.0)}
    play(story, homes, policy=policy, ground=tuple(homes))
