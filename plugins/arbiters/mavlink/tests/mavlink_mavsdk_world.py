"""A scripted vehicle that MAVSDK hears over UDP, and what is around it."""

import asyncio
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.mavsdk_driver.ground_station import open_mavsdk_link
from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink
from m2pem_plugin_mavlink.protocol.messages import Address
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import SystemClock

GROUND = Address(255, 190)
ONE = Address(1, 1)
WITHIN_S = 40.0


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Scripted(asyncio.DatagramProtocol):
    """Sends a heartbeat as a copter with ArduPilot, and answers as `answers` say; `state` has all
    that came."""

    def __init__(self, port: int, system: int = 1) -> None:
        self.to = ("127.0.0.1", port)
        self.mav = dialect.MAVLink(self, system, 1)
        self.parser = dialect.MAVLink(None, system, 1)
        self.parser.robust_parsing = True
        self.received: list[Any] = []
        self.answers: dict[str, Callable[[Any], None]] = {"COMMAND_LONG": self.accept}
        self.news = asyncio.Event()

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def write(self, frame: bytes) -> None:
        self.transport.sendto(frame, self.to)

    def accept(self, message: Any, result: int = dialect.MAV_RESULT_ACCEPTED) -> None:
        self.mav.command_ack_send(message.command, result)

    def datagram_received(self, data: bytes, _: Any) -> None:
        for message in self.parser.parse_buffer(data) or ():
            self.received.append(message)
            self.news.set()
            answer = self.answers.get(message.get_type())
            if answer is not None:
                answer(message)

    async def beat(self) -> None:
        while True:
            self.mav.heartbeat_send(
                dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, 81, 4, 3
            )
            await asyncio.sleep(0.1)

    async def hears(self, true: Callable[[Any], bool]) -> Any:
        async with asyncio.timeout(WITHIN_S):
            while True:
                for message in self.received:
                    if true(message):
                        return message
                self.news.clear()
                await self.news.wait()


@asynccontextmanager
async def scripted(port: int, system: int = 1) -> AsyncIterator[Scripted]:
    loop = asyncio.get_running_loop()
    transport, vehicle = await loop.create_datagram_endpoint(
        lambda: Scripted(port, system), local_addr=("127.0.0.1", 0)
    )
    beating = loop.create_task(vehicle.beat())
    try:
        yield vehicle
    finally:
        beating.cancel()
        transport.close()


@asynccontextmanager
async def linked(url: str, *addresses: Address) -> AsyncIterator[list[MavsdkLink]]:
    links: list[MavsdkLink] = []
    try:
        for address in addresses or (ONE,):
            links.append(await open_mavsdk_link(address, [url], SystemClock(), GROUND))
        yield links
    finally:
        for link in links:
            await link.close()


async def until(true: Callable[[], bool], within_s: float = WITHIN_S) -> None:
    async with asyncio.timeout(within_s):
        while not true():  # noqa: ASYNC110  # what is waited for has no event
            await asyncio.sleep(0.01)


def native_threads() -> int:
    """Of the whole process, those of libraries too, but for those of the executor."""
    own = sum(each.name.startswith("asyncio_") for each in threading.enumerate())
    return sum(1 for _ in Path("/proc/self/task").iterdir()) - own


def threads_fall_to(number: int) -> bool:
    """Whether no more than so many are left; those of executors take a moment to end."""
    end_s = time.monotonic() + WITHIN_S
    while native_threads() > number and time.monotonic() < end_s:
        time.sleep(0.01)
    return native_threads() <= number


def open_files() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())
