"""A payload with a node of somebody's own, in plain rclpy, over real DDS."""

import asyncio
import math
from pathlib import Path

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.testing import Peer

from m2pem.api import (
    BehaviorState,
    Connection,
    GeoPosition,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

PEER = Path(__file__).with_name("ros_payload_peer.py")
WIPER = ResourceId("ugv1/wiper")
OWN = {
    "wipe_lens": {
        "parameters": {"times": {"kind": "count", "default": 1}},
        "writes": ["wiper.times", "wiper.broken"],
    }
}


async def test_an_own_node_is_commanded_and_heard_as_the_docs_say(ros_domain: int) -> None:
    settings = {
        "driver": "m2pem",
        "namespace": "/ugv1/wiper",
        "domain_id": ros_domain,
        "own_behaviors": OWN,
    }
    connection = Connection(WIPER, "air", settings, sitl=True)
    clock = SystemClock()
    lent = context(clock)
    with Peer(PEER, ros_domain, ["/ugv1/wiper", WIPER]):
        arbiter = RosArbiter({WIPER: connection}, lent)
        async with ArbiterHarness(arbiter, clock) as bench:
            await bench.start("r1.b1", "wipe_lens", WIPER, times=3)
            report = await bench.ended("r1.b1", 20.0)
            assert report.state is BehaviorState.SUCCEEDED
            assert report.outputs == {"wiper.times": 3}
            assert "output 'wiper.broken' was left out" in report.reason

            await bench.start("r1.b2", "zoom", WIPER, level=2.0)
            report = await bench.ended("r1.b2", 20.0)
            assert (report.state, report.reason) == (
                BehaviorState.REJECTED,
                "it wipes, and no more",
            )

            place = GeoPosition(38.5, -77.3192, 60.0)
            lent.bus.publish(VehicleState(ResourceId("ugv1"), clock.now_us(), place))

            def tells_where_it_is_carried() -> bool:
                state = bench.latest(WIPER)
                return isinstance(state, PayloadState) and state.zoom == pytest.approx(38.5)

            async with asyncio.timeout(20.0):
                assert await bench.until(tells_where_it_is_carried, 20.0)
            states = [s for s in bench.states if isinstance(s, PayloadState) and s.pan_rad]
            assert {s.pan_rad for s in states} <= {0.5, 5.0}, "another one's look is not its"
            assert all(s.tilt_rad is None for s in states), "what is infinite is not known"
            for state in states:
                heights = [corner.altitude_m for corner in state.footprint]
                assert heights == ([] if state.pan_rad == 5.0 else [1.0, 2.0, 3.0])
            assert not any(s.zoom is not None and math.isnan(s.zoom) for s in states)
