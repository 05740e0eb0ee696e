"""A base in another process, driven over real DDS."""

import asyncio
import logging
import math
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace

import pytest
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.settings import Bounds
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_base_bench import AMPLE_S, BASE, Bench, bench, geo, point, route, until

from m2pem.api import Area, BehaviorState, GeoPosition, ResourceId, VehiclePosition, VehicleState
from m2pem.api.clock import SystemClock

SPEED = 4.0
"""Of time: the peer and the driver's clock run so much faster than the world."""


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain:
        yield domain


@pytest.fixture(scope="module")
def peer(domain: int) -> Iterator[Peer]:
    with Peer(BASE, domain, ["/ugv1", "plain", str(SPEED)]) as peer:
        yield peer


@pytest.fixture
async def base(domain: int, peer: Peer) -> AsyncIterator[Bench]:
    async with bench(domain, "/ugv1", SystemClock(SPEED)) as made:
        yield made


async def test_a_route_is_driven_to_its_end(base: Bench) -> None:
    order = base.begin("single_vehicle_routing", route=route((6, 0), (6, 5)), speed=1.5)
    assert await base.ending(order) == Outcome(BehaviorState.SUCCEEDED)
    assert math.dist(base.place, (6, 5)) < 0.5
    assert base.goals == [order.goal]
    await until(lambda: base.said)
    assert max(forward for forward, _ in base.said) <= 1.5 + 1e-9
    await until(lambda: base.heard_count > 10)


async def test_goto_ends_within_the_tolerance_and_points_as_asked(base: Bench) -> None:
    order = base.begin("goto", target=point(-4, 3), heading=math.pi / 2, tolerance=0.3)
    assert base.driver.health.mode == "auto"
    assert (await base.ending(order)).state is BehaviorState.SUCCEEDED
    assert math.dist(base.place, (-4, 3)) < 0.4
    assert base.where.pose is not None
    assert abs(base.where.pose.yaw_rad) < math.radians(10)
    assert base.driver.health.mode == "standby"


async def test_a_base_that_is_dragged_out_of_the_fence_is_stopped(domain: int, peer: Peer) -> None:
    corners = ((-5, -5), (5, -5), (5, 5), (-5, 5), (-5, -5))
    fence = Area((tuple(geo(*corner) for corner in corners),))
    async with bench(domain, "/ugv1", SystemClock(SPEED), fence=fence) as base:
        order = base.begin("goto", target=point(40, 0))  # the arbiter would refuse it
        outcome = await base.ending(order)
        assert outcome.state is BehaviorState.FAILED
        assert outcome.reason.endswith("m outside the fleet's fence")
        assert 6.0 < base.place[0] < 30.0
        await until(lambda: base.said and base.said[-1] == (0.0, 0.0))


async def test_reverse_goes_straight_back(base: Bench) -> None:
    order = base.begin("reverse", distance=2.0, speed=0.4)
    assert (await base.ending(order)).state is BehaviorState.SUCCEEDED
    assert base.place[0] == pytest.approx(-2.0, abs=0.8)
    assert base.place[1] == pytest.approx(0.0, abs=0.2)


async def test_a_cancelled_base_stands_before_that_is_told(base: Bench) -> None:
    order = base.begin("goto", target=point(100, 0))
    await until(lambda: base.speed_m_s > 1.5)
    base.driver.end(order.goal)
    assert base.outcomes == []
    assert (await base.ending(order)).state is BehaviorState.CANCELLED
    assert abs(base.speed_m_s) < 0.1
    base.driver.end(order.goal)
    await until(lambda: len(base.outcomes) == 2)
    assert base.outcomes[0] == base.outcomes[1]


async def test_a_base_that_stands_is_left_to_others_after_a_while(base: Bench) -> None:
    await base.ending(base.begin("drive_stop"))
    await until(lambda: base.said)
    count = -1
    async with asyncio.timeout(AMPLE_S):
        while count != len(base.said):
            count = len(base.said)
            await base.clock.sleep(5.0)
    assert set(base.said) == {(0.0, 0.0)}


async def test_hold_keeps_the_order_and_resume_goes_on_with_it(base: Bench) -> None:
    order = base.begin("single_vehicle_routing", route=route((15, 0)))
    await until(lambda: base.place[0] > 3)
    base.driver.hold()
    await until(lambda: abs(base.speed_m_s) < 0.02)
    held = base.place[0]
    assert base.driver.health.mode == "hold"
    assert base.outcomes == []
    base.driver.resume()
    assert (await base.ending(order)).state is BehaviorState.SUCCEEDED
    assert held < 13
    assert math.dist(base.place, (15, 0)) < 0.5


async def test_a_new_order_takes_over_and_the_old_one_is_not_told_of(base: Bench) -> None:
    old = base.begin("goto", target=point(60, 0))
    await until(lambda: base.speed_m_s > 1.0)
    new = base.begin("goto", target=point(10, 3))
    assert (await base.ending(new)).state is BehaviorState.SUCCEEDED
    assert [goal for goal, _ in base.outcomes] == [new.goal]
    assert old.goal != new.goal


async def test_without_odometry_it_stands_and_goes_on_when_it_is_heard_again(base: Bench) -> None:
    order = base.begin("goto", target=point(20, 0))
    await until(lambda: base.speed_m_s > 1.0)
    await base.tell_base("mute")
    await until(lambda: base.where.age_s > 4.0)
    await until(lambda: base.said and base.said[-1] == (0.0, 0.0))
    assert base.driver.health.ready is False
    assert "odometry" in base.driver.health.not_ready_reasons[0]
    heard = base.heard_count
    await base.clock.sleep(1.0)
    assert base.heard_count == heard
    await base.tell_base("speak")
    await until(lambda: base.driver.health.ready)
    assert (await base.ending(order)).state is BehaviorState.SUCCEEDED


async def test_a_blocked_base_fails_with_route_blocked(base: Bench) -> None:
    await base.tell_base("block")
    order = base.begin("goto", target=point(30, 0))
    outcome = await base.ending(order)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "ROUTE_BLOCKED")


async def test_teleop_hands_the_stick_on_until_it_is_let_go(base: Bench) -> None:
    order = base.begin("teleop")
    assert base.driver.health.mode == "manual"
    await base.tell_base("stick 9.0 0.2")
    await until(lambda: base.speed_m_s > 1.5 and base.said)
    assert max(forward for forward, _ in base.said) <= 2.0
    await base.tell_base("stick off")
    await until(lambda: abs(base.speed_m_s) < 0.05)
    assert base.outcomes == []
    base.driver.end(order.goal)
    assert (await base.ending(order)).state is BehaviorState.CANCELLED


async def test_follow_stays_behind_a_vehicle_of_the_bus(base: Bench) -> None:
    began_us = base.clock.now_us()

    def leader() -> VehicleState:
        passed_s = (base.clock.now_us() - began_us) / 1e6
        latitude, longitude, _ = geo(8 + passed_s, 0)
        position = GeoPosition(latitude, longitude, 60.0)
        state = VehicleState(ResourceId("ugv2"), base.clock.now_us(), position, yaw_rad=0.0)
        return replace(state, velocity_enu_m_s=(1.0, 0.0, 0.0))

    base.bus.publish(leader())
    base.begin("follow", target=VehiclePosition("ugv2"), offset=5.0)

    def at_station() -> bool:
        base.bus.publish(leader())
        gap = 8 + (base.clock.now_us() - began_us) / 1e6 - base.place[0]
        return base.place[0] > 6 and abs(gap - 5.0) < 0.5 and abs(base.speed_m_s - 1.0) < 0.2

    await until(at_station)


async def test_somebody_else_who_commands_the_base_is_told_of_once(
    base: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    await base.tell_base("intrude")
    await until(lambda: base.ros.node.count_publishers("/ugv1/cmd_vel") == 2)
    order = base.begin("goto", target=point(12, 0))
    assert (await base.ending(order)).state is BehaviorState.SUCCEEDED
    warnings = [record for record in caplog.records if "others publish" in record.message]
    assert len(warnings) == 1
    assert "/ugv1/cmd_vel" in warnings[0].message


async def test_what_cannot_be_done_is_refused(base: Bench) -> None:
    def refusal(behavior: str, **parameters: object) -> str:
        return base.driver.refusal(base.order(behavior, **parameters).request)  # type: ignore[arg-type]

    assert "at most 100 km" in refusal("goto", target=point(0, 300_000))
    assert "waypoint" in refusal("single_vehicle_routing", route=route())
    assert "ugv9 has sent no position" in refusal("follow", target=VehiclePosition("ugv9"))
    assert "another vehicle" in refusal("follow", target=VehiclePosition("ugv1"))
    assert "cannot do 'orbit'" in refusal("orbit", target=point(0, 0))
    assert refusal("goto", target=point(0, 5)) == ""


async def test_after_a_restart_only_a_reached_place_is_told(base: Bench) -> None:
    done, far = base.order("goto", target=point(0, 0.2)), base.order("goto", target=point(9, 0))
    there_and_back = base.order("single_vehicle_routing", route=route((0, 0), (9, 0), (0, 0)))
    assert (await base.driver.query(done)).state is BehaviorState.SUCCEEDED
    assert (await base.driver.query(far)).state is BehaviorState.UNKNOWN
    assert (await base.driver.query(there_and_back)).state is BehaviorState.UNKNOWN
    base.driver.begin(far)
    assert (await base.driver.query(far)).state is BehaviorState.RUNNING
    assert (await base.ending(far)).state is BehaviorState.SUCCEEDED
    assert (await base.driver.query(far)).state is BehaviorState.SUCCEEDED


async def test_nothing_is_sent_for_a_vehicle_that_is_forgotten(base: Bench) -> None:
    base.begin("goto", target=point(30, 0))
    await until(lambda: base.said and base.said[-1][0] > 0)
    await until(lambda: base.speed_m_s > 1.0 and base.where.age_s < 1.0)
    base.driver.abandon()
    await until(lambda: abs(base.speed_m_s) < 0.05)  # of itself: nobody commands it any more
    said = len(base.said)
    await base.clock.sleep(4.0)
    assert len(base.said) == said
    assert base.said[-1][0] > 0
    assert base.outcomes == []


async def test_a_driver_that_closes_leaves_the_base_standing(base: Bench, domain: int) -> None:
    async with bench(domain, "/ugv1", SystemClock(SPEED)) as closing:
        closing.begin("goto", target=point(30, 0))
        await until(lambda: base.speed_m_s > 1.0)
    await until(lambda: base.said and base.said[-1] == (0.0, 0.0))


async def test_stamped_commands_of_a_base_with_a_turning_circle(domain: int) -> None:
    bounds = Bounds(turn_radius_m=1.5, acceleration_m_s2=2.0)
    with Peer(BASE, domain, ["/fleet/boat", "stamped", str(SPEED)]):
        async with bench(
            domain, "/fleet/boat", SystemClock(SPEED), stamped=True, bounds=bounds
        ) as base:
            order = base.begin("single_vehicle_routing", route=route((5, 0), (5, 5)))
            assert (await base.ending(order)).state is BehaviorState.SUCCEEDED
            assert math.dist(base.place, (5, 5)) < 0.5
            assert all(abs(turning) * 1.5 <= abs(forward) + 1e-9 for forward, turning in base.said)
