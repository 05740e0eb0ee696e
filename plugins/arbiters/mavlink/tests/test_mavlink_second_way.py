"""Frames of a vehicle that come twice, at once and late over a second way to the same port; or in
pieces, from a bridge that cuts them."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import mavlink_sitl as sitl
import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_simulated import AMPLE_S, at, specs

from m2pem.api import BehaviorState, Clock, Connection, Point, ResourceId, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context
from m2pem.testing.loopback import run_on_loopback

V1 = ResourceId("v1")
SPEED = 10.0


class Ways(asyncio.DatagramProtocol):
    """One side of a router: `other` sends to the vehicle. What comes from there goes to the arbiter
    at once, and again `late_s` of the event loop later; or, if that is 0, once in pieces of 40
    bytes."""

    def __init__(self, late_s: float) -> None:
        self.late_s = late_s
        self._uncut = b""
        self.other: Any = None
        self._arbiter: Any = None

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._arbiter = addr
        self.other.sendto(data)

    def from_vehicle(self, data: bytes) -> None:
        if self._arbiter is not None and not self.late_s:
            data = self._uncut + data
            while len(data) >= 40:
                self._transport.sendto(data[:40], self._arbiter)
                data = data[40:]
            self._uncut = data
        elif self._arbiter is not None:
            self._transport.sendto(data, self._arbiter)
            loop = asyncio.get_running_loop()
            loop.call_later(self.late_s, self._again, data, self._arbiter)

    def _again(self, data: bytes, to: Any) -> None:
        if not self._transport.is_closing():
            self._transport.sendto(data, to)


class Inner(asyncio.DatagramProtocol):
    def __init__(self, ways: Ways) -> None:
        self._ways = ways

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._ways.from_vehicle(data)


@asynccontextmanager
async def two_ways(late_s: float, vehicle: tuple[str, int]) -> AsyncIterator[int]:
    """Between a vehicle and an arbiter; the port for the arbiter."""
    loop = asyncio.get_running_loop()
    outer, ways = await loop.create_datagram_endpoint(
        lambda: Ways(late_s), local_addr=("127.0.0.1", 0)
    )
    ways.other, _ = await loop.create_datagram_endpoint(lambda: Inner(ways), remote_addr=vehicle)
    try:
        yield outer.get_extra_info("sockname")[1]
    finally:
        outer.close()
        ways.other.close()


def connection(domain: str, port: int) -> dict[ResourceId, Connection]:
    settings = {"url": f"udpout://127.0.0.1:{port}", "system_id": 1}
    return {V1: Connection(V1, domain, settings, lost_after_s=60.0, sitl=True)}


@pytest.mark.parametrize("late_s", [0.0, 1.4, 7.0, 24.0])
def test_a_copter_whose_frames_come_in_pieces_or_again_late_flies_on(late_s: float) -> None:
    async def main(clock: Clock) -> None:
        async with (
            Simulator(specs(Kind.COPTER), speed=SPEED, to=None) as simulator,
            two_ways(late_s / SPEED, simulator[1].address) as port,
            ArbiterHarness(MavlinkArbiter(connection("air", port), context(clock)), clock) as bench,
        ):
            for number, (behavior, given) in enumerate(
                [
                    ("takeoff", {"altitude": 10.0}),
                    ("goto", {"target": Point((*at(60, 30), 15.0), "relative")}),
                    ("change_altitude", {"altitude": 25.0}),
                    ("goto", {"target": Point((*at(0, 40), 15.0), "relative")}),
                    ("land", {}),
                ]
            ):
                await bench.start(f"r1.b{number}", behavior, V1, **given)
                end = await bench.ended(f"r1.b{number}", AMPLE_S)
                assert end.state is BehaviorState.SUCCEEDED, end

    run_on_loopback(main, SPEED)


@pytest.mark.parametrize(
    ("frame", "variable"),
    [
        pytest.param(*each, marks=pytest.mark.sitl(each[1]))
        for each in (("rover", "M2PEM_ARDUROVER"), ("quad", "M2PEM_ARDUCOPTER"))
    ],
)
@pytest.mark.parametrize("late_s", [0.0, 1.4, 24.0])
async def test_a_real_autopilot_whose_frames_come_in_pieces_or_again_late_goes_on(
    tmp_path: Path, frame: str, variable: str, late_s: float
) -> None:
    binary = sitl.program(variable)
    assert binary is not None
    domain, height_m = ("ground", None) if frame == "rover" else ("air", 15.0)
    port = sitl.free_port()
    clock = SystemClock(sitl.SPEED)
    loop = asyncio.get_running_loop()
    with sitl.running([sitl.ardupilot(binary, frame, 0, port)], tmp_path):
        async with listening(late_s / sitl.SPEED, port, loop) as inner:
            arbiter = MavlinkArbiter(connection(domain, inner), context(clock))
            async with ArbiterHarness(arbiter, clock) as bench:

                def ready() -> bool:
                    state = bench.latest(V1)
                    return isinstance(state, VehicleState) and state.ready is True

                assert await bench.until(ready, 600.0), bench.latest(V1)
                todo: list[tuple[str, dict[str, Any]]] = [
                    ("goto", {"target": Point((*at(*place), height_m), "relative")})
                    for place in ((30, 0), (30, 30), (0, 0))
                ]
                if frame == "quad":
                    todo = [("takeoff", {"altitude": 10.0}), *todo, ("land", {})]
                for number, (behavior, given) in enumerate(todo):
                    await bench.start(f"r1.b{number}", behavior, V1, **given)
                    end = await bench.ended(f"r1.b{number}", 400.0)
                    assert end.state is BehaviorState.SUCCEEDED, end


@asynccontextmanager
async def listening(
    late_s: float, port: int, loop: asyncio.AbstractEventLoop
) -> AsyncIterator[int]:
    """As `two_ways`, with a vehicle that sends to `port` first."""
    outer, ways = await loop.create_datagram_endpoint(
        lambda: Ways(late_s), local_addr=("127.0.0.1", 0)
    )

    class Vehicle(asyncio.DatagramProtocol):
        def connection_made(self, transport: Any) -> None:
            self.transport, self.address = transport, None
            ways.other = self

        def datagram_received(self, data: bytes, addr: Any) -> None:
            self.address = addr
            ways.from_vehicle(data)

        def sendto(self, data: bytes) -> None:
            if self.address is not None:
                self.transport.sendto(data, self.address)

    inner, _ = await loop.create_datagram_endpoint(Vehicle, local_addr=("127.0.0.1", port))
    try:
        yield outer.get_extra_info("sockname")[1]
    finally:
        outer.close()
        inner.close()
