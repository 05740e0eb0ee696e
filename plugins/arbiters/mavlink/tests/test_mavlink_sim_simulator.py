import asyncio
import socket
from collections.abc import AsyncIterator, Callable

import pytest
from m2pem_plugin_mavlink.simulator.server import Address
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect


class Listener(asyncio.DatagramProtocol):
    """Parses what comes, each vehicle for itself."""

    def __init__(self) -> None:
        self.received: list[object] = []
        self.parsers: dict[Address, object] = {}
        self.came = asyncio.Event()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: Address) -> None:
        parser = self.parsers.setdefault(addr, dialect.MAVLink(None))
        self.received += parser.parse_buffer(data) or []  # type: ignore[attr-defined]
        self.came.set()

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(40):
            while not condition():
                self.came.clear()
                await self.came.wait()

    def beats(self, system: int) -> int:
        return sum(
            m.get_srcSystem() == system and m.get_type() == "HEARTBEAT"  # type: ignore[attr-defined]
            for m in self.received
        )


@pytest.fixture
async def listener() -> AsyncIterator[Listener]:
    loop = asyncio.get_running_loop()
    _, protocol = await loop.create_datagram_endpoint(Listener, local_addr=("127.0.0.1", 0))
    yield protocol
    protocol.transport.close()  # type: ignore[attr-defined]


def address(listener: Listener) -> Address:
    where: Address = listener.transport.get_extra_info("sockname")
    return where


async def test_all_vehicles_send_to_one_port_from_ports_of_their_own(listener: Listener) -> None:
    specs = [VehicleSpec(system=1), VehicleSpec(Kind.ROVER, 2), VehicleSpec(Kind.BOAT, 3)]
    async with Simulator(specs, speed=20, to=address(listener)) as sim:
        await listener.until(lambda: all(listener.beats(n) >= 3 for n in (1, 2, 3)))
        assert set(listener.parsers) == {vehicle.address for vehicle in sim}
    assert len(listener.parsers) == 3


async def test_sequence_numbers_are_each_vehicles_own_and_have_no_gaps(listener: Listener) -> None:
    specs = [VehicleSpec(system=1), VehicleSpec(system=2)]
    async with Simulator(specs, speed=20, to=address(listener)):
        await listener.until(lambda: listener.beats(1) >= 5 and listener.beats(2) >= 5)
    numbers = [m.get_seq() for m in listener.received if m.get_srcSystem() == 2]  # type: ignore[attr-defined]
    assert numbers == list(range(len(numbers)))


async def test_simulated_time_passes_faster_but_not_faster_than_told(listener: Listener) -> None:
    async with Simulator([VehicleSpec()], speed=20, to=address(listener)) as sim:
        loop = asyncio.get_running_loop()
        start_s, start_sim_s = loop.time(), sim.now_s
        await listener.until(lambda: listener.beats(1) >= 15)
        factor = (sim.now_s - start_sim_s) / (loop.time() - start_s)
    assert 1 < factor < 21


async def test_junk_and_broken_frames_hurt_nobody(listener: Listener) -> None:
    async with Simulator([VehicleSpec()], speed=10, to=address(listener)) as sim:
        for junk in (b"\xfd" * 300, b"GET / HTTP/1.0\r\n", b"", b"\xfe\x09\x00" + bytes(8)):
            listener.transport.sendto(junk, sim[1].address)  # type: ignore[attr-defined]
        seen = listener.beats(1)
        await listener.until(lambda: listener.beats(1) > seen + 2)


async def test_a_port_where_nobody_listens_stops_nothing() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        nobody = free.getsockname()
    async with Simulator([VehicleSpec(estimator_s=1)], speed=50, to=nobody) as sim:
        async with asyncio.timeout(40):
            await sim.until(lambda: sim[1].autopilot.estimator.ready)


def test_two_vehicles_with_one_number_are_refused() -> None:
    with pytest.raises(ValueError, match="two vehicles have the system id 1"):
        Simulator([VehicleSpec(), VehicleSpec()])
