"""A lost vehicle whose link is restored stops before it is free."""

import asyncio
from collections.abc import AsyncIterator

from m2pem.api.telemetry import LinkState, Telemetry, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.testing.fake_arbiter import Call

from .conftest import World, behavior, mission, sequence

DRIVE = mission(sequence(("B", behavior("B", "drive_stop", "ugv1"))))
UGV1 = ResourceId("ugv1")


def says(world: World, link: LinkState = LinkState.CONNECTED) -> None:
    world.fake.say(VehicleState(UGV1, world.clock.now_us(), ready=True, link=link))


async def lose(world: World) -> None:
    control = world.executive.control
    run = await control.start(DRIVE)
    await world.fake.until_called("start", f"{run}.b1")
    says(world, LinkState.LOST)
    assert "LINK_LOST" in (await control.wait(run)).detail


async def refusal(world: World) -> str:
    control = world.executive.control
    return (await control.wait(await control.start(DRIVE, even_if_busy=True))).detail


def latest(world: World) -> VehicleState:
    state = world.executive.bus.latest(UGV1)
    assert isinstance(state, VehicleState)
    return state


def test_a_vehicle_that_returns_is_told_to_stop_before_it_is_free(play):
    async def story(world: World):
        await lose(world)
        calls = len(world.fake.calls)
        world.fake.hangs.add("hold")
        says(world)
        await world.fake.until_called("hold", "ugv1")
        assert Call("cancel", "r1.b1") in world.fake.calls[calls:]
        refused = await refusal(world)
        says(world)
        await world.clock.sleep(0.1)
        assert latest(world).ready is False
        assert (
            "its link is restored, and it must first end r1.b1" in latest(world).not_ready_reasons
        )
        world.fake.hangs.clear()
        while world.fake.count("hold", "ugv1") < 2:
            says(world)
            await world.clock.sleep(1)
        assert latest(world).ready is True
        again = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start", f"{again}.b1")
        return refused

    assert "ugv1 is unavailable: its link is restored, and it must first end r1.b1" in play(
        story, "ugv1", watch_links=True
    )


def test_a_vehicle_that_cannot_be_told_is_told_again_and_not_free(play, caplog):
    async def story(world: World):
        await lose(world)
        world.fake.raises["hold"] = RuntimeError("the radio is broken")
        says(world)
        await world.fake.until_called("hold", "ugv1", 3)
        says(world)
        refused = await refusal(world)
        del world.fake.raises["hold"]
        await world.fake.until_called("hold", "ugv1", 4)
        return refused

    refused = play(story, "ugv1", watch_links=True)
    assert "it cannot be commanded to stop: RuntimeError: the radio is broken" in refused
    assert "ugv1: its link is restored, it has ended what it did before, and is free" in caplog.text


def test_a_vehicle_that_is_lost_again_meanwhile_is_told_when_it_returns(play):
    async def story(world: World):
        await lose(world)
        world.fake.hangs.add("hold")
        says(world)
        await world.fake.until_called("hold", "ugv1")
        for _ in range(8):  # heard for long enough to be lost once more
            await world.clock.sleep(0.5)
            says(world)
        says(world, LinkState.LOST)
        await world.clock.sleep(0.1)
        world.fake.hangs.clear()
        held = world.fake.count("hold", "ugv1")
        refused = await refusal(world)
        assert world.fake.count("hold", "ugv1") == held, (
            "nothing is sent to a vehicle without a link"
        )
        says(world)
        await world.fake.until_called("hold", "ugv1", held + 1)
        return refused

    assert "ugv1 is unavailable: lost: its arbiter lost the link" in play(
        story, "ugv1", watch_links=True
    )


def test_an_operator_who_took_it_meanwhile_is_not_held_up(play):
    async def story(world: World):
        await lose(world)
        await world.executive.control.take("ugv1", by="anna")
        says(world)
        await world.fake.until_called("cancel", "r1.b1")
        await world.clock.sleep(0.1)
        assert world.fake.count("hold", "ugv1") == 0
        return await refusal(world)

    assert "ugv1 is with anna" in play(story, "ugv1", watch_links=True)


def test_a_vehicle_that_is_given_back_while_it_is_lost_is_not_free(play):
    async def story(world: World):
        await lose(world)
        await world.executive.control.take("ugv1", by="anna")
        await world.executive.control.give_back("ugv1", by="anna")
        return await refusal(world)

    assert "ugv1 is unavailable: lost: " in play(story, "ugv1", watch_links=True)


def test_a_vehicle_of_which_nothing_comes_is_lost_for_all_who_follow_its_telemetry(play):
    async def story(world: World):
        control, seen = world.executive.control, []

        async def follow(states: AsyncIterator[Telemetry]) -> None:
            async for state in states:
                seen.append(state)

        following = asyncio.create_task(follow(control.telemetry()))
        await world.clock.sleep(0.1)
        says(world)
        run = await control.start(DRIVE)
        await world.fake.until_called("start", f"{run}.b1")
        assert "LINK_LOST" in (await control.wait(run)).detail
        reasons = ("lost: no telemetry for 3.0 s",)
        await world.clock.sleep(0.1)
        said = seen[-1]
        assert (said.link, said.ready, said.not_ready_reasons) == (LinkState.LOST, False, reasons)
        assert said.time_us == seen[0].time_us, "the time of its last position"
        later = control.telemetry()  # of a face that begins now
        assert await anext(later) == said
        assert (await control.statistics()).links[UGV1].state is LinkState.LOST
        world.executive.look()
        assert "LINK_LOST" in [each.code for each in await control.alerts()]
        says(world)
        await world.clock.sleep(0.1)
        assert (latest(world).link, latest(world).ready) == (LinkState.CONNECTED, True)
        assert (await control.statistics()).links[UGV1].state is LinkState.CONNECTED
        await world.clock.sleep(4)  # and is silent again, at once
        assert latest(world).link is LinkState.LOST
        assert "lost: " in await refusal(world)
        following.cancel()

    play(story, "ugv1", watch_links=True)


def test_a_vehicle_that_an_operator_has_is_lost_for_all_too(play):
    async def story(world: World):
        says(world)
        await world.executive.control.take("ugv1", by="anna")
        await world.clock.sleep(4)
        assert (latest(world).link, latest(world).ready) == (LinkState.LOST, False)
        says(world, LinkState.LOST)
        await world.clock.sleep(0.1)
        assert (latest(world).ready, latest(world).not_ready_reasons) == (False, ("lost",))

    play(story, "ugv1", watch_links=True)
