"""The other ends of links, played by pymavlink, and a clock that is turned by hand."""

import asyncio
import heapq
import itertools
from collections.abc import Callable
from typing import Any

from m2pem_plugin_mavlink.protocol.messages import Address
from pymavlink.dialects.v20 import ardupilotmega as dialect

GROUND_STATION = (255, 190)
WITHIN_S = 40.0


async def until(true: Callable[[], object]) -> None:
    """Wait for a condition."""
    async with asyncio.timeout(WITHIN_S):
        while not true():  # noqa: ASYNC110  # what is waited for tells nobody
            await asyncio.sleep(0.002)


class HandClock:
    """Time passes when `turn` says so; whoever waits for it is woken in order."""

    def __init__(self) -> None:
        self._now_us = 1_000_000_000
        self._waiting: list[tuple[int, int, asyncio.Future[None]]] = []
        self._numbers = itertools.count()

    def now_us(self) -> int:
        return self._now_us

    async def sleep(self, seconds: float) -> None:
        await self.sleep_until(self._now_us + round(seconds * 1_000_000))

    async def sleep_until(self, time_us: int) -> None:
        if time_us <= self._now_us:
            await asyncio.sleep(0)
            return
        woken = asyncio.get_running_loop().create_future()
        heapq.heappush(self._waiting, (time_us, next(self._numbers), woken))
        await woken

    def jump(self, seconds: float) -> None:
        """Let so much time pass in which nothing is done, as while a machine is suspended."""
        self._now_us += round(seconds * 1_000_000)

    async def turn(self, seconds: float) -> None:
        """Let so much time pass, and everybody do what is due."""
        end_us = self._now_us + round(seconds * 1_000_000)
        while self._waiting and self._waiting[0][0] <= end_us:
            time_us, _, woken = heapq.heappop(self._waiting)
            self._now_us = max(self._now_us, time_us)
            if not woken.done():
                woken.set_result(None)
            for _ in range(5):
                await asyncio.sleep(0)
        self._now_us = end_us


class FarEnd(asyncio.Protocol):
    """One end, as a vehicle's: what it has heard, and what it says; over UDP or TCP."""

    def __init__(self, system: int = 1, component: int = 1) -> None:
        self.mav = dialect.MAVLink(self, srcSystem=system, srcComponent=component)
        self.mav.robust_parsing = True
        self.received: list[Any] = []
        self.transport: Any = None
        self.to: Any = None

    @property
    def address(self) -> Address:
        return Address(self.mav.srcSystem, self.mav.srcComponent)

    def write(self, data: bytes) -> None:
        """For pymavlink."""
        if self.to is not None:
            self.transport.sendto(bytes(data), self.to)
        else:
            self.transport.write(bytes(data))

    def beat(self, mode: int = 0) -> None:
        self.mav.heartbeat_send(2, 3, 0, mode, 4)

    def acknowledge(self, command: int, result: int = 0) -> None:
        self.mav.command_ack_send(command, result)

    def names(self) -> list[str]:
        """Of what was heard, but for heartbeats."""
        return [each.get_type() for each in self.received if each.get_type() != "HEARTBEAT"]

    def beats(self) -> list[tuple[int, int]]:
        """Who has said that he is there."""
        return [
            (each.get_srcSystem(), each.get_srcComponent())
            for each in self.received
            if each.get_type() == "HEARTBEAT"
        ]

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        self.received += self.mav.parse_buffer(data) or ()

    def datagram_received(self, data: bytes, address: Any) -> None:
        self.to = address
        self.data_received(data)

    def error_received(self, error: OSError) -> None:
        """Nobody listens there, yet."""

    async def close(self) -> None:
        self.transport.close()
        await asyncio.sleep(0)


async def udp_end(port: int, system: int = 1, component: int = 1) -> FarEnd:
    """Sends to a port of ours from one of its own."""
    loop = asyncio.get_running_loop()
    end = FarEnd(system, component)
    await loop.create_datagram_endpoint(lambda: end, local_addr=("127.0.0.1", 0))
    end.to = ("127.0.0.1", port)
    return end


async def tcp_end(port: int, system: int = 1) -> FarEnd:
    """Connects to a port of ours."""
    end = FarEnd(system)
    await asyncio.get_running_loop().create_connection(lambda: end, "127.0.0.1", port)
    return end


class TcpServer:
    """Lets us connect; one end for each connection."""

    def __init__(self) -> None:
        self.ends: list[FarEnd] = []

    async def open(self, port: int = 0) -> int:
        ends = self.ends

        class Accepted(FarEnd):
            def connection_made(self, transport: Any) -> None:
                super().connection_made(transport)
                ends.append(self)

        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(Accepted, "127.0.0.1", port)
        opened: int = self._server.sockets[0].getsockname()[1]
        return opened

    async def close(self) -> None:
        self._server.close()
        for end in self.ends:
            await end.close()
