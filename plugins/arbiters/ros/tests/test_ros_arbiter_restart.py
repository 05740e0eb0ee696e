"""A new executive asks the vehicles before it begins anything."""

import asyncio

from m2pem_plugin_ros.checkpoint import (
    LONGEST_ROUTE,
    Checkpoint,
    decode_checkpoint,
    encode_checkpoint,
    goal_id,
)
from ros_play import FAR, JOURNAL, NEAR, A, B, play

from m2pem.api import BehaviorState, Route, VehiclePosition

RUNNING, UNKNOWN = BehaviorState.RUNNING, BehaviorState.UNKNOWN
CANCELLED, SUCCEEDED = BehaviorState.CANCELLED, BehaviorState.SUCCEEDED


async def begun(world, **parameters) -> str:
    """A behavior that goes on when its executive is gone; its reference."""
    async with world.connected() as bench:
        await bench.start("r1.b1", "goto", A, **{"target": FAR, **parameters})
        await bench.running("r1.b1")
        return bench.of("r1.b1")[-1].native_ref


def test_what_was_asked_before_comes_from_its_reference() -> None:
    async def main(world) -> None:
        reference = await begun(world, speed=3.0)
        async with world.connected() as bench:
            found = await bench.arbiter.query("r1.b1", reference)
            assert (found.state, found.native_ref) == (RUNNING, reference)
            ((_, order),) = world.bodies[A].called("look")
            assert order.goal == goal_id(JOURNAL, "r1.b1")
            assert order.request.parameters == {"target": FAR, "speed": 3.0}
            assert world.bodies[B].called("look") == []
            await bench.arbiter.cancel("r1.b1", 2)
            assert (await bench.ended("r1.b1", 10)).state is CANCELLED

    play(main)


def test_what_ended_meanwhile_is_told_with_its_end() -> None:
    async def main(world) -> None:
        reference = await begun(world, target=NEAR)
        async with world.connected() as bench:
            await bench.clock.sleep(60)
            found = await bench.arbiter.query("r1.b1", reference)
            assert (found.state, found.number) == (SUCCEEDED, 3)

    play(main)


def test_a_behavior_of_which_no_report_was_kept_is_found_on_its_vehicle() -> None:
    async def main(world) -> None:
        await begun(world)
        async with world.connected() as bench:
            assert (await bench.arbiter.query("r1.b1", None)).state is RUNNING
            await bench.start("r1.b1", "goto", A, epoch=2, target=FAR)
            await bench.clock.sleep(2)
            assert world.bodies[A].begun == 1
            await bench.start("r1.b2", "goto", A, epoch=2, target=FAR)
            end = await bench.ended("r1.b2", 5)
            assert end.code == "RESOURCE_UNAVAILABLE", "the vehicle is known to do r1.b1"

    play(main)


def test_a_start_of_what_was_asked_for_looks_first() -> None:
    async def main(world) -> None:
        await begun(world)
        body = world.bodies[A]
        body.answers_looks = False
        async with world.connected() as bench:
            asked_us = bench.clock.now_us()
            assert (await bench.arbiter.query("r1.b1", None)).state is UNKNOWN
            assert bench.clock.now_us() - asked_us <= 3_100_000
            body.answers_looks = True
            await bench.start("r1.b1", "goto", A, epoch=2, target=FAR)
            await bench.running("r1.b1")
            assert body.begun == 1
            await bench.arbiter.cancel("r1.b1", 2)
            assert (await bench.ended("r1.b1", 10)).state is CANCELLED

    play(main)


def test_what_no_vehicle_knows_is_begun_after_all() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            assert (await bench.arbiter.query("r1.b1", None)).state is UNKNOWN
            await bench.start("r1.b1", "goto", A, epoch=2, target=NEAR)
            assert (await bench.ended("r1.b1", 30)).state is SUCCEEDED
            assert world.bodies[A].begun == 1

    play(main)


def test_a_cancel_while_the_vehicle_is_looked_at_begins_nothing() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.arbiter.query("r1.b1", None)
            world.bodies[A].answers_looks = False
            start = asyncio.create_task(bench.start("r1.b1", "goto", A, target=FAR))
            await bench.clock.sleep(1)
            await bench.arbiter.cancel("r1.b1", 1)
            await start
            assert (await bench.ended("r1.b1", 10)).state is CANCELLED
            assert world.bodies[A].begun == 0

    play(main)


def test_a_vehicle_that_cannot_be_asked_gives_its_goal_up_for_the_next() -> None:
    async def main(world) -> None:
        reference = await begun(world)
        body = world.bodies[A]
        body.answers_looks = False
        async with world.connected() as bench:
            found = await bench.arbiter.query("r1.b1", reference)
            assert found.state is UNKNOWN
            assert found.reason == "a did not answer the query within 3 s"
            await bench.start("r1.b2", "goto", A, epoch=2, target=NEAR)
            await bench.running("r1.b2")
            (_, order) = body.called("begin")[-1]
            assert order.preempts == (goal_id(JOURNAL, "r1.b1"),)

    play(main)


def test_a_base_that_nobody_drove_is_not_asked_what_it_does() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            assert (await bench.arbiter.query("r1.b1", None)).state is UNKNOWN
            assert world.bodies[A].called("look") == []

    play(main, driver="base")


def test_a_vehicle_that_left_the_fleet_is_named() -> None:
    async def main(world) -> None:
        reference = encode_checkpoint(Checkpoint(("evsg9",), "goto", 1, {}))
        async with world.connected() as bench:
            found = await bench.arbiter.query("r1.b1", reference)
            assert (found.state, found.reason) == (UNKNOWN, "the vehicle 'evsg9' no longer exists")

    play(main)


def test_a_reference_says_all_but_long_routes() -> None:
    route = Route(((38.1, -77.3, None), (38.2, -77.4, 12.5)), "amsl")
    parameters = {
        "route": route,
        "target": VehiclePosition("evsg2"),
        "other": FAR,
        "speed": 2.5,
        "loop": True,
        "count": 3,
        "word": "line",
    }
    kept = Checkpoint(("evsg1", "evsg1/gpr"), "single_vehicle_routing", 7, parameters)
    assert decode_checkpoint(encode_checkpoint(kept)) == kept
    long = Route(((38.1, -77.3, None),) * (LONGEST_ROUTE + 1))
    kept = Checkpoint(("evsg1",), "single_vehicle_routing", 1, {"route": long, "speed": 1.0})
    assert decode_checkpoint(encode_checkpoint(kept)).parameters == {"speed": 1.0}


def test_a_reference_that_is_not_ours_says_nothing() -> None:
    foreign = ["", "{}", "[]", '{"v":1}', '{"v":1,"resources":3,"parameters":{}}', "x" * 100]
    assert {decode_checkpoint(text) for text in foreign} == {None}
