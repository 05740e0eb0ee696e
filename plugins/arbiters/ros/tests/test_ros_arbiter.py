"""What the arbiter does beyond the contract: with vehicles that fall silent, lie and break."""

import logging
from uuid import uuid4

import pytest
from m2pem_plugin_ros.checkpoint import goal_id, run_id
from m2pem_plugin_ros.drivers.driver import Health, Outcome
from ros_double import Dynamics, at
from ros_play import FAR, JOURNAL, NEAR, A, B, play

from m2pem.api import (
    BehaviorState,
    GeoPosition,
    LinkState,
    PayloadState,
    ResourceId,
    VehiclePosition,
    VehicleState,
)
from m2pem.errors import StaleCommandError

FAILED, LOST, RUNNING = BehaviorState.FAILED, BehaviorState.LOST, BehaviorState.RUNNING
CANCELLED, SUCCEEDED = BehaviorState.CANCELLED, BehaviorState.SUCCEEDED


# --- what vehicles are told -----------------------------------------------------------------------


def test_an_order_names_its_goal_and_run_for_ever() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=NEAR)
            await bench.running("r1.b1")
        ((_, order),) = world.bodies[A].called("begin")
        assert order.goal == goal_id(JOURNAL, "r1.b1")
        assert order.run == run_id(JOURNAL, "r1.b1") == run_id(JOURNAL, "r1.b7")

    play(main)


def test_what_preempts_names_the_goals_that_it_takes_over_from() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            await bench.start("r1.b2", "goto", A, target=FAR, preempts=("r1.b1",))
            await bench.running("r1.b2")
        (_, order) = world.bodies[A].called("begin")[-1]
        assert order.preempts == (goal_id(JOURNAL, "r1.b1"),)

    play(main)


def test_a_behavior_is_adjusted_on_the_way() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            assert bench.arbiter.capabilities.adjusts
            await bench.start("r1.b1", "goto", A, target=at(1000.0, 0.0), speed=1.0)
            await bench.running("r1.b1")
            await bench.arbiter.adjust("r1.b1", 1, {"speed": float("nan")})
            with pytest.raises(StaleCommandError, match="epoch 1 was seen"):
                await bench.arbiter.adjust("r1.b1", 0, {"speed": 7.0})
            await bench.arbiter.adjust("r9.b9", 1, {"speed": 7.0})
            assert world.bodies[A].called("adjust") == []
            await bench.arbiter.adjust("r1.b1", 1, {"speed": 50.0})
            assert (await bench.ended("r1.b1", 30)).state is SUCCEEDED
            await bench.arbiter.adjust("r1.b1", 1, {"speed": 5.0})
            assert len(world.bodies[A].called("adjust")) == 1

    play(main)


def test_a_takeover_is_told_to_every_vehicle() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.arbiter.fence("r1", 3)
            for name in (A, B):
                assert world.bodies[name].called("claim") == [("claim", run_id(JOURNAL, "r1"), 3)]
            with pytest.raises(StaleCommandError, match="epoch 3 was seen"):
                await bench.start("r1.b1", "goto", A, epoch=2, target=NEAR)

    play(main)


def test_a_refusal_by_a_vehicle_is_reported_with_the_newer_epoch() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            events = world.bodies[A].driver.setup.events
            events.superseded("of another journal", 7)
            events.superseded(str(run_id(JOURNAL, "r1")), 7)
            assert await bench.until(lambda: bench.of("r1.b1")[-1].epoch == 7, 5)
            with pytest.raises(StaleCommandError, match="epoch 7 was seen"):
                await bench.arbiter.cancel("r1.b1", 1)

    play(main)


def test_a_disowned_vehicle_goes_on_and_can_be_held() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            await bench.arbiter.disown("r1")
            await bench.clock.sleep(10)
            body = world.bodies[A]
            assert (body.called("end"), body.called("hold")) == ([], [])
            assert len(body.called("forget")) == 1
            await bench.arbiter.hold(A)
            assert len(body.called("hold")) == 1

    play(main)


def test_a_vehicle_with_a_node_is_shown_its_target_while_it_goes_there() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            shown = world.bodies[A].shown
            await bench.start("r1.b1", "follow", A, target=VehiclePosition("b"))
            await bench.running("r1.b1")
            await bench.clock.sleep(1)
            assert shown == [], "nothing is known of b"
            state = VehicleState(B, bench.clock.now_us(), GeoPosition(38.0, -77.0, 5.0))
            world.context.bus.publish(state)
            await bench.clock.sleep(2)
            assert 9 <= len(shown) <= 11, "five times a second"
            assert set(shown) == {state}
            await bench.arbiter.cancel("r1.b1", 1)
            await bench.ended("r1.b1", 10)
            told = len(shown)
            await bench.clock.sleep(2)
            assert len(shown) == told

    play(main, {A: Dynamics(east=-900.0), B: Dynamics()})


def test_the_fleet_says_what_a_vehicle_may_do() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=NEAR)
            end = await bench.ended("r1.b1", 5)
            assert end.state is BehaviorState.REJECTED
            assert "does not allow a the behavior 'goto'" in end.reason

    play(main, behaviors=("drive_stop",))


def test_a_drivers_refusal_is_a_rejection() -> None:
    async def main(world) -> None:
        world.bodies[A].refuses = "its pose is not known yet"
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=NEAR)
            end = await bench.ended("r1.b1", 5)
            assert (end.state, end.reason) == (BehaviorState.REJECTED, "its pose is not known yet")

    play(main)


# --- silence --------------------------------------------------------------------------------------


def test_a_vehicle_that_is_heard_again_is_usable_and_gives_its_old_goal_up() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            body = world.bodies[A]
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            body.linked = False
            assert (await bench.ended("r1.b1", 4.0)).state is LOST
            assert body.called("forget")
            assert bench.latest(A).link is LinkState.LOST
            body.linked = True
            await bench.until(lambda: bench.latest(A).link is LinkState.CONNECTED, 2)
            await bench.start("r1.b2", "goto", A, target=NEAR)
            assert (await bench.ended("r1.b2", 200)).state is SUCCEEDED
            (_, order) = body.called("begin")[-1]
            assert order.preempts == (goal_id(JOURNAL, "r1.b1"),)

    play(main)


def test_a_vehicle_that_returns_is_not_free_until_it_has_acknowledged() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            body = world.bodies[A]
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            body.linked, body.stops = False, False
            assert (await bench.ended("r1.b1", 4.0)).state is LOST
            body.linked = True
            await bench.until(lambda: bench.latest(A).link is LinkState.CONNECTED, 2)
            why = await bench.arbiter.reclaim(A)
            assert "has not acknowledged the cancel of r1.b1 and HOLD" in why
            assert body.called("end") == [("end", goal_id(JOURNAL, "r1.b1"))]
            assert body.held
            body.stops = True
            assert await bench.arbiter.reclaim(A) == ""
            assert body.goal is None

    play(main)


def test_a_vehicle_that_returns_with_nothing_of_ours_is_left_alone() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.clock.sleep(1)
            world.bodies[A].linked = False
            await bench.until(lambda: bench.latest(A).link is LinkState.LOST, 5)
            world.bodies[A].linked = True
            await bench.until(lambda: bench.latest(A).link is LinkState.CONNECTED, 2)
            assert await bench.arbiter.reclaim(A) == ""
            assert not world.bodies[A].called("end")
            assert not world.bodies[A].called("hold")

    play(main)


def test_a_lost_vehicle_is_told_of_once() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            world.bodies[A].linked = False
            await bench.clock.sleep(30)
            lost = [s for s in bench.states if s.resource == A and s.link is LinkState.LOST]
            assert len(lost) == 1

    play(main)


def test_a_vehicle_that_was_never_heard_is_lost_and_does_not_hold_up_the_others(caplog) -> None:
    async def main(world) -> None:
        world.bodies[A].linked = False
        async with world.connected() as bench:
            assert "a: no message from the vehicle yet" in caplog.text
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.start("r1.b2", "goto", B, target=NEAR)
            assert (await bench.ended("r1.b1", 4.0)).state is LOST
            assert (await bench.ended("r1.b2", 10)).state is SUCCEEDED
            assert bench.latest(A).link is LinkState.LOST

    play(main)


# --- cancels --------------------------------------------------------------------------------------


def test_a_vehicle_that_does_not_stop_is_a_failure_within_the_bound_and_can_be_used_again() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            world.bodies[A].stops = False
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            await bench.arbiter.cancel("r1.b1", 1)
            end = await bench.ended("r1.b1", bench.arbiter.limits(A).cancel_timeout_s)
            assert (end.state, end.code) == (FAILED, "TIMEOUT")
            await bench.start("r1.b2", "goto", A, target=NEAR)
            await bench.running("r1.b2", 5)
            (_, order) = world.bodies[A].called("begin")[-1]
            assert order.preempts == (goal_id(JOURNAL, "r1.b1"),)

    play(main)


# --- what drivers say that is not so --------------------------------------------------------------


def test_goals_that_nobody_gave_are_ignored_and_logged_at_a_bounded_rate(caplog) -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.start("r1.b2", "goto", B, target=FAR)
            await bench.running("r1.b1")
            await bench.running("r1.b2")
            events = world.bodies[A].driver.setup.events
            for _ in range(5000):
                events.progress(uuid4())
                events.ended(uuid4(), Outcome(SUCCEEDED))
            events.ended(goal_id(JOURNAL, "r1.b2"), Outcome(SUCCEEDED))
            await bench.clock.sleep(2)
            assert bench.states_of("r1.b1")[-1] is RUNNING
            assert bench.states_of("r1.b2")[-1] is RUNNING, "it is not a's to end"

    with caplog.at_level(logging.WARNING):
        play(main)
    assert len([r for r in caplog.records if "was not sent" in r.message]) == 5


def test_an_end_that_is_none_is_ignored_and_a_second_one_changes_nothing() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.running("r1.b1")
            events, goal = world.bodies[A].driver.setup.events, goal_id(JOURNAL, "r1.b1")
            events.ended(goal, Outcome(BehaviorState.ACCEPTED))
            events.ended(goal, Outcome(BehaviorState.UNKNOWN))
            events.ended(goal, Outcome(FAILED, "ROUTE_BLOCKED", "a wall"))
            events.ended(goal, Outcome(SUCCEEDED))
            events.progress(goal)
            await bench.clock.sleep(1)
            assert [(r.state, r.code) for r in bench.of("r1.b1")[2:]] == [(FAILED, "ROUTE_BLOCKED")]

    play(main)


def test_a_vehicle_that_is_done_at_once_was_running_all_the_same() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=at(0.0, 0.0))
            goal = goal_id(JOURNAL, "r1.b1")
            world.bodies[A].driver.setup.events.ended(goal, Outcome(SUCCEEDED))
            await bench.ended("r1.b1", 1)
            assert bench.states_of("r1.b1") == [BehaviorState.ACCEPTED, RUNNING, SUCCEEDED]

    play(main)


# --- drivers that break ---------------------------------------------------------------------------


@pytest.mark.parametrize("what", ["begin", "end"])
def test_a_driver_that_breaks_fails_its_behavior_and_no_other(what: str) -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            world.bodies[A].raises = {what}
            await bench.start("r1.b2", "goto", B, target=at(60.0, 0.0))
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.arbiter.cancel("r1.b1", 1)
            end = await bench.ended("r1.b1", 5)
            assert end.state is FAILED
            assert f"{what} is broken" in end.reason
            assert (await bench.ended("r1.b2", 60)).state is SUCCEEDED

    play(main)


def test_a_driver_that_breaks_in_everything_else_stops_nobody() -> None:
    async def main(world) -> None:
        body = world.bodies[A]
        body.raises = {"hold", "resume", "adjust", "forget", "health", "close"}
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR)
            await bench.start("r1.b2", "goto", B, target=FAR)
            await bench.running("r1.b1")
            await bench.arbiter.hold(A)
            await bench.arbiter.resume(A)
            await bench.arbiter.adjust("r1.b1", 1, {"speed": 2.0})
            body.linked = False
            assert (await bench.ended("r1.b1", 4)).state is LOST
            before = len(bench.states)
            await bench.clock.sleep(2)
            assert any(state.resource == B for state in bench.states[before:])

    play(main)


def test_a_driver_that_does_not_open_refuses_and_stops_nobody() -> None:
    async def main(world) -> None:
        world.bodies[A].raises = {"open"}
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=NEAR)
            end = await bench.ended("r1.b1", 5)
            assert end.state is BehaviorState.REJECTED
            assert "open is broken" in end.reason
            await bench.start("r1.b2", "goto", B, target=NEAR)
            await bench.running("r1.b2")

    play(main)


# --- telemetry ------------------------------------------------------------------------------------


def test_a_state_says_how_the_vehicle_is() -> None:
    async def main(world) -> None:
        body = world.bodies[A]
        body.health = Health("autonomous", True, ("arm locked",), 0.5)
        body.battery = 0.9
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=FAR, speed=2.0)
            await bench.running("r1.b1")
            await bench.clock.sleep(5)
            state = bench.latest(A)
            assert state.mode == "autonomous"
            assert state.ready is True
            assert state.not_ready_reasons == ("arm locked",)
            assert state.battery_fraction == 0.5, "the vehicle's own word"
            assert state.behavior == "goto"
            assert state.velocity_enu_m_s == pytest.approx((2.0, 0.0, 0.0))
            body.health, body.errors = Health("autonomous", True), ("motor: hot",)
            await bench.clock.sleep(1)
            state = bench.latest(A)
            assert (state.ready, state.not_ready_reasons) == (False, ("motor: hot",))
            assert state.battery_fraction == 0.9

    play(main)


def test_payloads_have_the_link_of_their_vehicle() -> None:
    gpr = ResourceId("a/gpr")

    async def main(world) -> None:
        async with world.connected() as bench:
            assert bench.arbiter.catalogue(gpr) == ()
            await bench.clock.sleep(2)
            assert bench.latest(gpr) == PayloadState(gpr, bench.latest(gpr).time_us)
            world.bodies[A].linked = False
            await bench.clock.sleep(5)
            assert bench.latest(gpr).link is LinkState.LOST

    play(main, carried=(gpr,))
