"""Vehicles and payloads with nodes beside each other, in virtual time: who is commanded."""

from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from ros_double import DoubleDriver, DoubleStation, Dynamics, at

from m2pem.api import BehaviorState, Connection, GeoPosition, ResourceId, VehicleState
from m2pem.api.clock import run_virtual
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

V, PTZ, GPR = ResourceId("ugv1"), ResourceId("ugv1/ptz"), ResourceId("ugv1/gpr")
START_US = 1_767_225_600_000_000
FAR = {"target": at(600.0, 0.0), "speed": 5.0}

Main = Callable[[ArbiterHarness, dict[ResourceId, Dynamics]], Awaitable[None]]


def play(main: Main, bus: Bus | None = None) -> None:
    """With a vehicle, a payload that has a node, and one that is carried, no more."""
    vehicle = {"namespace": "/ugv1"}
    node = {**vehicle, "driver": "m2pem", "namespace": "/ugv1/ptz"}
    connections = {
        V: Connection(V, "ground", vehicle),
        PTZ: Connection(PTZ, "ground", node),
        GPR: Connection(GPR, "ground", vehicle, detector=True),
    }

    async def run(clock) -> None:
        bodies = {V: Dynamics(), PTZ: Dynamics()}
        arbiter = RosArbiter(
            connections,
            replace(context(clock), bus=bus or Bus()),
            lambda setup: DoubleDriver(setup, bodies[setup.connection.resource]),
            lambda installation: DoubleStation(bodies, installation),
        )
        async with ArbiterHarness(arbiter, clock) as bench:
            await main(bench, bodies)

    run_virtual(run, START_US)


def begun(bodies: dict[ResourceId, Dynamics]) -> tuple[int, int]:
    return bodies[V].begun, bodies[PTZ].begun


def test_a_payload_is_commanded_itself_while_its_vehicle_drives() -> None:
    async def main(bench: ArbiterHarness, bodies: dict[ResourceId, Dynamics]) -> None:
        await bench.start("r1.b1", "goto", V, **FAR)
        await bench.start("r1.b2", "ptz_track", PTZ, target=at(10.0, 0.0))
        await bench.running("r1.b1")
        await bench.running("r1.b2")
        assert begun(bodies) == (1, 1)
        await bench.arbiter.cancel("r1.b2", 1)
        assert (await bench.ended("r1.b2", 10.0)).state is BehaviorState.CANCELLED
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING
        assert bodies[V].called("end") == []

    play(main)


def test_a_behavior_of_a_vehicle_may_hold_its_payload_which_is_told_nothing() -> None:
    async def main(bench: ArbiterHarness, bodies: dict[ResourceId, Dynamics]) -> None:
        await bench.start("r1.b1", "goto", V, PTZ, GPR, **FAR)
        await bench.running("r1.b1")
        assert begun(bodies) == (1, 0)
        await bench.start("r1.b2", "zoom", PTZ, level=2.0)
        assert (await bench.ended("r1.b2", 5.0)).code == "RESOURCE_UNAVAILABLE"
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10.0)).state is BehaviorState.CANCELLED
        assert bodies[PTZ].called("end") == []

    play(main)


def test_a_vehicle_drives_on_when_a_payload_that_it_holds_is_not_heard() -> None:
    async def main(bench: ArbiterHarness, bodies: dict[ResourceId, Dynamics]) -> None:
        await bench.start("r1.b1", "goto", V, PTZ, **FAR)
        await bench.running("r1.b1")
        bodies[PTZ].linked = False
        await bench.clock.sleep(10.0)
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING

    play(main)


@pytest.mark.parametrize(
    ("behavior", "resource", "reason"),
    [
        ("goto", PTZ, "ugv1/ptz has no behavior 'goto'; its vehicle is to have a role"),
        ("goto", GPR, "goto takes one vehicle or payload, not 0"),
        ("zoom", V, "ugv1 has no behavior 'zoom'"),
        ("zoom", GPR, "ugv1/gpr has no behavior 'zoom'"),
    ],
)
def test_what_cannot_do_it_is_not_commanded(
    behavior: str, resource: ResourceId, reason: str
) -> None:
    async def main(bench: ArbiterHarness, bodies: dict[ResourceId, Dynamics]) -> None:
        parameters = FAR if behavior == "goto" else {"level": 2.0}
        await bench.start("r1.b1", behavior, resource, **parameters)
        report = await bench.ended("r1.b1", 5.0)
        assert report.state is BehaviorState.REJECTED
        assert reason in report.reason
        assert begun(bodies) == (0, 0)

    play(main)


def test_a_payload_is_told_where_its_vehicle_is_also_while_it_does_nothing() -> None:
    bus = Bus()

    async def main(bench: ArbiterHarness, bodies: dict[ResourceId, Dynamics]) -> None:
        state = VehicleState(V, bench.clock.now_us(), GeoPosition(38.0, -77.0, 5.0))
        bus.publish(state)
        await bench.clock.sleep(2.0)
        assert set(bodies[PTZ].shown) == {state}
        assert len(bodies[PTZ].shown) >= 5
        assert bodies[V].shown == []

    play(main, bus)
