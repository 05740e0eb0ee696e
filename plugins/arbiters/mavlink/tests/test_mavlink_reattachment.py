"""After a restart: what a vehicle shows not to have begun, and what only looks like it."""

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.checkpoint import decode_checkpoint
from m2pem_plugin_mavlink.reattachment import SOON_S
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_double import Body, DoubleStation, at, connections
from mavlink_play import START_US, Bench, V

from m2pem.api import BehaviorReport, BehaviorRequest, BehaviorState, Clock, Point, Route
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import context

GOTO = {"target": Point((*at(200.0, 0.0), None))}
WAY = Route(tuple((*at(east, 0.0), 20.0) for east in (50.0, 300.0, 600.0)))


def benches(body: Body, clock: Clock) -> Bench:
    """A new arbiter for a vehicle, as after a restart."""
    lent, bodies = context(clock), {V: body}
    made = MavlinkArbiter(connections(bodies), lent, lambda *_: DoubleStation(bodies, lent))
    bench = Bench(made, clock)
    bench.bodies, bench.bus = bodies, lent.bus
    return bench


def asked_after(
    body: Body,
    call: str,
    behavior: str,
    meanwhile: Callable[[Body], None] = lambda _: None,
    *,
    after_s: float = 2.0,
    then: Callable[[Bench, BehaviorReport], Awaitable[None]] | None = None,
    **parameters: Any,
) -> BehaviorReport:
    """Close an arbiter whose vehicle never gets a call of its driver; what the next one answers."""
    found: list[BehaviorReport] = []

    async def run(clock: Clock) -> None:
        body.stuck = {call}
        async with benches(body, clock) as before:
            await before.start("r1.b1", behavior, V, **parameters)
            while call not in before.told:
                await clock.sleep(0.1)
            (accepted,) = before.of("r1.b1")
        body.stuck = set()
        meanwhile(body)
        await clock.sleep(after_s)
        async with benches(body, clock) as after:
            found.append(await after.arbiter.query("r1.b1", accepted.native_ref))
            if then is not None:
                await then(after, found[0])

    run_virtual(run, START_US)
    assert found[0].state is BehaviorState.UNKNOWN
    return found[0]


@pytest.mark.parametrize(
    ("body", "call", "behavior", "parameters"),
    [
        (Body(), "take_off", "takeoff", {"altitude": 100.0}),
        (Body().fly(), "go_to", "goto", GOTO),
        (Body("ground"), "go_to", "goto", GOTO),
        (Body().fly(), "return_home", "return_to_launch", {}),
    ],
)
def test_a_vehicle_that_is_as_it_was_has_not_begun_and_can_be_started(
    body, call, behavior, parameters
) -> None:
    body.east = 50.0 if behavior == "return_to_launch" else 0.0

    async def then(bench: Bench, found: BehaviorReport) -> None:
        assert "has not begun" in found.reason
        body.calls.clear()
        await bench.start("r1.b1", behavior, V, **parameters)
        assert (await bench.ended("r1.b1", 600)).state is BehaviorState.SUCCEEDED
        assert bench.told.count(call) == 1

    assert asked_after(body, call, behavior, then=then, **parameters).not_begun


def test_a_vehicle_that_was_made_ready_has_not_begun() -> None:
    def ready(body: Body) -> None:
        body.armed, body.mode = True, FlightMode.GUIDED

    assert asked_after(Body(), "take_off", "takeoff", ready, altitude=20.0).not_begun


def armed(body: Body) -> None:
    body.armed = True


def disarmed(body: Body) -> None:
    body.armed = False


def switched(body: Body) -> None:
    body.mode = FlightMode.MANUAL


def carried(body: Body) -> None:
    body.north = 10.0


@pytest.mark.parametrize(
    ("body", "meanwhile"),
    [
        (Body(), armed),
        (Body(mode=FlightMode.GUIDED, armed=True), disarmed),
        (Body(), switched),
        (Body(), carried),
    ],
)
def test_what_a_person_may_have_changed_is_no_sign_that_it_has_not_begun(body, meanwhile) -> None:
    assert not asked_after(body, "take_off", "takeoff", meanwhile, altitude=20.0).not_begun


def test_nobody_expects_a_takeoff_that_was_accepted_long_ago() -> None:
    found = asked_after(Body(), "take_off", "takeoff", after_s=SOON_S + 1.0, altitude=20.0)
    assert not found.not_begun


def test_an_actuator_leaves_nothing_to_see() -> None:
    found = asked_after(Body(), "command", "deploy", actuator="9", value=1000.0)
    assert not found.not_begun


def flown_again(
    *, begun: bool, meanwhile: Callable[[Body], None] = lambda _: None, after_s: float = 0.0
) -> BehaviorReport:
    """A vehicle on its way to the last waypoint of a route flies the same route again; m2pem is
    closed before it has sent anything, or (`begun`) once the vehicle is on its way again. What the
    next arbiter answers."""
    found: list[BehaviorReport] = []
    body = Body().fly()

    async def run(clock: Clock) -> None:
        async with benches(body, clock) as before:
            await before.start("r1.b1", "single_vehicle_routing", V, route=WAY)
            await before.until(lambda: body.current == 2, 300)
            body.stuck = set() if begun else {"upload"}
            request = BehaviorRequest(
                "r1.b2", 1, "single_vehicle_routing", {"route": WAY}, (V,), {}, ("r1.b1",)
            )
            await before.arbiter.start(request)
            if begun:
                await before.running("r1.b2")
                await before.until(lambda: body.current == 0, 10)
            else:
                await before.until(lambda: before.told.count("upload") == 2, 10)
            accepted = before.of("r1.b2")[0]
        body.stuck = set()
        meanwhile(body)
        await clock.sleep(after_s)
        async with benches(body, clock) as after:
            found.append(await after.arbiter.query("r1.b2", accepted.native_ref))

    run_virtual(run, START_US)
    return found[0]


def test_the_same_route_from_before_is_not_taken_for_the_one_that_was_to_begin() -> None:
    found = flown_again(begun=False)
    assert found.state is BehaviorState.UNKNOWN, "its first waypoints would be skipped"
    assert not found.not_begun


def test_a_route_that_was_flown_before_and_has_begun_again_goes_on() -> None:
    assert flown_again(begun=True).state is BehaviorState.RUNNING


def test_a_route_that_was_completed_before_is_not_taken_for_completed_again() -> None:
    def at_the_end(body: Body) -> None:
        body.east, body.north, body.reached = 600.0, 0.0, 2

    assert flown_again(begun=False, meanwhile=at_the_end).state is BehaviorState.UNKNOWN


def test_a_reference_of_an_earlier_release_is_read() -> None:
    kept = decode_checkpoint(
        '{"v":1,"vehicle":"v","behavior":"takeoff","parameters":{"altitude":20.0},"memory":{}}'
    )
    assert kept is not None
    assert kept.before is None
