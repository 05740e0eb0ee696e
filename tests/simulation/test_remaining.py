"""Simulated vehicles report what is left of routes and surveys."""

from collections.abc import Awaitable, Callable, Mapping
from itertools import pairwise

import pytest

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock, run_virtual
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import resolve
from m2pem.geo.local_frame import LocalFrame
from m2pem.geo.polyline import Polyline
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Route
from m2pem.mission.values import Value
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing.contracts.arbiter_harness import ORIGIN, START_US, ArbiterHarness, context

UAV = ResourceId("uav")
FRAME = LocalFrame(ORIGIN)
ROUTE = Route(
    tuple((*FRAME.to_latlon(place), None) for place in ((0.0, 100.0), (100.0, 100.0), (100.0, 0.0)))
)
SIDES = [(0.0, 0.0), (200.0, 0.0), (200.0, 100.0), (0.0, 100.0), (0.0, 0.0)]
AREA = Area((tuple((*FRAME.to_latlon(place), None) for place in SIDES),))


def fly(main: Callable[[ArbiterHarness, SimArbiter], Awaitable[None]]) -> None:
    async def run(clock: Clock) -> None:
        arbiter = SimArbiter({UAV: Connection(UAV, "air", {"altitude": "30 m"})}, context(clock))
        async with ArbiterHarness(arbiter, clock) as bench:
            await main(bench, arbiter)

    run_virtual(run, START_US)


def left_m(remaining: Mapping[str, Value]) -> float:
    spec = SHARED["single_vehicle_routing", BehaviorType.VEHICLE]
    route = resolve(spec, remaining, lambda _: None, ())["route"]
    assert isinstance(route, Route)
    return Polyline(FRAME.to_local(each[:2]) for each in route.waypoints).length_m


def said(bench: ArbiterHarness) -> list[Mapping[str, Value]]:
    return [each.remaining for each in bench.of("r1.b1") if each.remaining is not None]


def test_a_route_is_reported_every_five_percent() -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", UAV, route=ROUTE)
        end = await bench.ended("r1.b1", 100)
        lengths = [left_m(each) for each in said(bench)]
        assert 17 <= len(lengths) <= 19
        assert all(a - b == pytest.approx(10.0, abs=2.0) for a, b in pairwise(lengths))
        assert end.remaining is None

    fly(main)


def test_a_broken_link_leaves_what_was_seen_last() -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", UAV, route=ROUTE)
        assert await bench.until(lambda: len(said(bench)) >= 5, 100)
        await bench.clock.sleep(0.4)
        seen = arbiter.sight(UAV)
        assert seen is not None
        assert seen.position is not None
        arbiter.lose_link(UAV)
        end = await bench.ended("r1.b1", 100)
        assert end.state is BehaviorState.LOST
        assert end.remaining is not None
        east, _ = FRAME.to_local((seen.position.latitude_deg, seen.position.longitude_deg))
        assert left_m(end.remaining) == pytest.approx(200.0 - east - 100.0 * (east == 0), abs=60)
        assert left_m(end.remaining) < left_m(said(bench)[4])

    fly(main)


def test_a_held_vehicle_has_not_come_farther() -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", UAV, route=ROUTE)
        assert await bench.until(lambda: len(said(bench)) >= 3, 100)
        await arbiter.hold(UAV)
        await bench.clock.sleep(20)
        held = len(said(bench))
        assert held <= 4
        await arbiter.adjust("r1.b1", 1, {"speed": 2.0})
        await arbiter.resume(UAV)
        await bench.ended("r1.b1", 200)
        lengths = [left_m(each) for each in said(bench)]
        assert all(a > b for a, b in pairwise(lengths))
        assert len(lengths) > held + 10

    fly(main)


def test_what_is_left_of_a_survey_is_surveyed_by_another_start() -> None:
    """Twice the first half, and the whole takes as long as once."""

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "area_survey", UAV, area=AREA, spacing=20.0)
        await bench.until(lambda: len(said(bench)) >= 9, 300)
        cut_us = bench.clock.now_us()
        rest = said(bench)[-1]
        await bench.ended("r1.b1", 300)
        left_us = bench.clock.now_us() - cut_us
        spec = SHARED["area_survey", BehaviorType.VEHICLE]
        begun_us = bench.clock.now_us()
        values = resolve(spec, rest, lambda _: None, ())
        await bench.start("r1.b2", "area_survey", UAV, **values)
        end = await bench.ended("r1.b2", 300)
        assert end.state is BehaviorState.SUCCEEDED
        took_us = bench.clock.now_us() - begun_us
        assert took_us == pytest.approx(left_us, rel=0.4), "and the way to where it begins"

    fly(main)


def test_a_route_in_a_loop_is_never_less() -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", UAV, route=ROUTE, loop=True)
        await bench.clock.sleep(200)
        assert not said(bench)

    fly(main)
