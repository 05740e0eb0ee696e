"""A behavior is judged by what its vehicle was seen to do, whatever its arbiter reports."""

import asyncio
from typing import Any

from m2pem.api.commanded import Commanded
from m2pem.api.runs import Alert
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.engine.records import BehaviorEnded
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import World, behavior, mission, sequence

TARGET = (47.4, 8.5)
FLIES = mission(
    sequence(
        (
            "Fly",
            behavior(
                "Fly",
                "goto",
                "uav1",
                parameters='<m2pem:property name="target" value="[47.4, 8.5, 25]"/>',
            ),
        )
    )
)


def state(world: World, north_m: float, up_m: float = 25.0, **more: Any) -> VehicleState:
    """uav1 so far north of its target."""
    position = GeoPosition(TARGET[0] + north_m / 111_190, TARGET[1], 400.0 + up_m)
    now_us = world.clock.now_us()
    given: dict[str, Any] = {"armed": True, "velocity_enu_m_s": (0.0, 0.0, 0.0), **more}
    return VehicleState(ResourceId("uav1"), now_us, position, up_m, **given)


async def says(world: World, *states: VehicleState) -> None:
    for each in states:
        world.fake.say(each)
    await asyncio.sleep(0)
    await world.clock.sleep(0.5)


async def started(world: World, commanded: Commanded | None = None) -> str:
    """Start the mission; its behavior is running."""
    world.alerts = []  # type: ignore[attr-defined]
    world.executive.events.on_alert = world.alerts.append  # type: ignore[attr-defined]
    run = await world.executive.control.start(FLIES)
    await world.fake.until_called("start")
    await says(world, state(world, 500.0))
    world.fake.report(f"{run}.b1", BehaviorState.RUNNING, commanded=commanded)
    await world.clock.sleep(0.5)
    return f"{run}.b1"


def alerts_of(world: World) -> list[Alert]:
    return [each for each in world.alerts if each.code == "DEVIATION"]  # type: ignore[attr-defined]


async def end_of(world: World) -> BehaviorEnded:
    async with asyncio.timeout(60):
        while True:
            for record in world.seen:
                if isinstance(record, BehaviorEnded):
                    return record
            await world.clock.sleep(0.1)


def test_disarmed_in_the_air_ends_the_behavior_as_failed(play: Any) -> None:
    async def story(world: World) -> None:
        name = await started(world)
        await says(world, state(world, 300.0, armed=False))
        await world.fake.until_called("cancel", name)
        (alert,) = alerts_of(world)
        assert alert.text == "uav1: disarmed 25 m above home. goto is ended"
        assert alert.resources == ("uav1",)
        world.fake.report(name, BehaviorState.CANCELLED)
        end = await end_of(world)
        assert (end.state, end.code) == (BehaviorState.FAILED, "FAILED")
        assert end.reason == "uav1: disarmed 25 m above home"

    play(story, "uav1")


def test_a_success_far_from_the_target_is_incomplete(play: Any) -> None:
    async def story(world: World) -> None:
        name = await started(world)
        world.fake.report(name, BehaviorState.SUCCEEDED)
        await world.clock.sleep(1.0)
        assert not any(isinstance(each, BehaviorEnded) for each in world.seen)
        await says(world, state(world, 298.0))
        end = await end_of(world)
        assert (end.state, end.code) == (BehaviorState.FAILED, "INCOMPLETE")
        assert end.reason == "uav1: it is 298 m from its target"
        assert end.evidence["waypoints_passed"] == 0

    play(story, "uav1")


def test_a_success_that_overtakes_its_telemetry_counts(play: Any) -> None:
    async def story(world: World) -> None:
        name = await started(world)
        world.fake.report(name, BehaviorState.SUCCEEDED)
        await says(world, state(world, 2.0))
        end = await end_of(world)
        assert end.state is BehaviorState.SUCCEEDED
        assert end.evidence["waypoints_passed"] == 1
        assert end.evidence["ended"] == [47.400018, 8.5, 425.0]

    play(story, "uav1")


def test_a_success_without_telemetry_is_believed_and_said(play: Any) -> None:
    async def story(world: World) -> None:
        run = await world.executive.control.start(FLIES)
        await world.fake.until_called("start")
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING)
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        end = await end_of(world)
        assert end.state is BehaviorState.SUCCEEDED
        assert end.evidence == {"seen": False}

    play(story, "uav1")


def test_an_arbiter_says_what_is_commanded_instead(play: Any) -> None:
    """Its vehicle need not come near the target."""

    async def story(world: World) -> None:
        name = await started(world, Commanded())
        world.fake.report(name, BehaviorState.SUCCEEDED)
        assert (await end_of(world)).state is BehaviorState.SUCCEEDED

    play(story, "uav1")


def test_a_pilot_who_took_the_vehicle_is_not_cancelled_against(play: Any) -> None:
    async def story(world: World) -> None:
        name = await started(world)
        world.fake.report(name, BehaviorState.FAILED, "TAKEN_OVER", "a pilot flies it")
        end = await end_of(world)
        assert end.code == "TAKEN_OVER"
        await says(world, state(world, 300.0, armed=False))
        assert world.fake.count("cancel") == 0
        assert alerts_of(world) == []

    play(story, "uav1")


def test_after_a_cancel_nothing_is_compared_any_more(play: Any) -> None:
    async def story(world: World) -> None:
        name = await started(world)
        run = name.partition(".")[0]
        await world.executive.control.stop(run, by="anna")
        await world.fake.until_called("cancel", name)
        await says(world, state(world, 300.0, armed=False))
        assert alerts_of(world) == []
        world.fake.report(name, BehaviorState.CANCELLED)
        assert (await end_of(world)).state is BehaviorState.CANCELLED

    play(story, "uav1")
