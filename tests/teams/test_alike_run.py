"""A behavior of vehicles that a mission has several do, on arbiters that take one vehicle each."""

from typing import Any

import pytest

from m2pem.api.runs import RunStatus
from m2pem.mission.catalogue import BehaviorState
from tests.executive.conftest import mission, sequence

from .carts import FRAME, Yard
from .conftest import Play, World


def all_do(name: str, *vehicles: str, **parameters: str) -> bytes:
    given = "".join(f'<m2pem:property name="{k}" value="{v}"/>' for k, v in parameters.items())
    roles = "".join(f'<m2pem:role name="{each}" vehicle="{each}"/>' for each in vehicles)
    task = (
        '<scriptTask id="Task"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{name}"><m2pem:properties>{given}</m2pem:properties>'
        f"<m2pem:resources>{roles}</m2pem:resources></m2pem:behavior></extensionElements>"
        "</scriptTask>"
    )
    return mission(sequence(("Task", task)))


def far(east_m: float) -> str:
    latitude, longitude = FRAME.to_latlon((east_m, 0.0))
    return f"[{latitude}, {longitude}]"


@pytest.mark.parametrize("arbiter", ["carts", {"a": "carts", "b": "willing", "c": "sim"}])
def test_each_vehicle_does_it_and_it_is_one_behavior(play: Play, arbiter: Any) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(all_do("drive_stop", "a", "b", "c"))
        return await world.executive.control.wait(run), world.ended()

    yard = Yard(a=(0, 0), b=(-15, 0), c=(-30, 0))
    summary, ended = play(story, yard, arbiter=arbiter)
    assert summary.status is RunStatus.COMPLETED
    assert [end.state for end in ended] == [BehaviorState.SUCCEEDED]
    carts = "abc" if arbiter == "carts" else "ab"
    assert {name for _, name in yard.commands} == set(carts)


def test_a_team_that_acts_alike_needs_no_positions(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(all_do("drive_stop", "a", "b"))
        await world.until(lambda: yard.count("drive_stop") == 2, within_s=1.0)
        await world.executive.control.stop(run)
        return await world.executive.control.wait(run)

    yard = Yard(a=(0, 0), b=(-15, 0))
    for driven in yard.driven.values():
        driven.mute = True
    assert play(story, yard).status is RunStatus.STOPPED


def test_when_one_fails_the_others_stop_and_it_has_failed(play: Play) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(all_do("goto", "a", "b", target=far(500.0)))
        await world.until(lambda: yard["a"].speed_m_s > 1 and yard["b"].speed_m_s > 1)
        world.arbiter("carts").fail("b", "ROUTE_BLOCKED")
        return await world.executive.control.wait(run), world.ended()

    yard = Yard(a=(0, 0), b=(-15, 0))
    summary, ended = play(story, yard)
    assert summary.status is RunStatus.FAILED
    assert [(end.state, end.code) for end in ended] == [(BehaviorState.FAILED, "ROUTE_BLOCKED")]
    assert yard["a"].stands


def test_a_pause_holds_all_of_them_and_a_stop_ends_all(play: Play) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        run = await control.start(all_do("goto", "a", "b", target=far(500.0)))
        await world.until(lambda: yard["a"].speed_m_s > 1 and yard["b"].speed_m_s > 1)
        await control.pause(run)
        await world.until(lambda: yard["a"].stands and yard["b"].stands)
        await control.resume(run)
        await world.until(lambda: yard["a"].speed_m_s > 1 and yard["b"].speed_m_s > 1)
        await control.stop(run)
        return await control.wait(run)

    yard = Yard(a=(0, 0), b=(-15, 0))
    assert play(story, yard).status is RunStatus.STOPPED
    assert yard["a"].stands
    assert yard["b"].stands
