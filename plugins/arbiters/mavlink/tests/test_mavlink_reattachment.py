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

from m2pem.api import BehaviorReport, BehaviorState, Point
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import context

GOTO = {"target": Point((*at(200.0, 0.0), None))}


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

    async def run(clock) -> None:
        def bench() -> Bench:
            lent, bodies = context(clock), {V: body}
            made = MavlinkArbiter(connections(bodies), lent, lambda *_: DoubleStation(bodies, lent))
            bench = Bench(made, clock)
            bench.bodies, bench.bus = bodies, lent.bus
            return bench

        body.stuck = {call}
        async with bench() as before:
            await before.start("r1.b1", behavior, V, **parameters)
            while call not in before.told:
                await clock.sleep(0.1)
            (accepted,) = before.of("r1.b1")
        body.stuck = set()
        meanwhile(body)
        await clock.sleep(after_s)
        async with bench() as after:
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


def test_a_reference_of_an_earlier_release_is_read() -> None:
    kept = decode_checkpoint(
        '{"v":1,"vehicle":"v","behavior":"takeoff","parameters":{"altitude":20.0},"memory":{}}'
    )
    assert kept is not None
    assert kept.before is None
