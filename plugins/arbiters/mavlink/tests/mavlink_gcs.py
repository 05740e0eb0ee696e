"""Ground stations for tests of the face, by pymavlink: an independent other end."""

import asyncio
import math
import re
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.face.face import MavlinkFace
from mavlink_mavsdk_world import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem import load_fleet
from m2pem.api import FaceSettings, MissionControl
from m2pem.testing.harness import run_executive

WITHIN_S = 60.0
HOME = (38.1075, -77.3192)

FLEET = """
version: 1
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
fence: field
areas: {field: field.geojson}
routes: {round: round.geojson}
vehicles:
  rover1: {domain: ground, arbiter: sim, connection: {home: [38.1075, -77.3192]}}
  uav1:
    domain: air
    arbiter: sim
    connection: {home: [38.1080, -77.3192]}
    payloads: {eye: {arbiter: sim, behaviors: [ptz_point_at, take_picture]}}
  rover2: {domain: ground, arbiter: sim, connection: {home: [38.1070, -77.3192]}}
"""

FIELD = (
    '{"type": "Polygon", "coordinates": [[[-77.33, 38.10], [-77.31, 38.10], [-77.31, 38.12],'
    " [-77.33, 38.12], [-77.33, 38.10]]]}"
)
ROUND = (
    '{"type": "LineString", "coordinates": [[-77.3190, 38.1075], [-77.3180, 38.1075],'
    " [-77.3180, 38.1085]]}"
)


def write_fleet(folder: Path, text: str = FLEET) -> Path:
    """Write a fleet with its geometries."""
    (folder / "field.geojson").write_text(FIELD, encoding="utf-8")
    (folder / "round.geojson").write_text(ROUND, encoding="utf-8")
    file = folder / "fleet.yaml"
    file.write_text(text, encoding="utf-8")
    return file


class GroundStation(asyncio.DatagramProtocol):
    """Sends to a face and keeps all that it sends, in order."""

    def __init__(self, system: int, component: int) -> None:
        self.mav = dialect.MAVLink(self, system, component)
        self.parser = dialect.MAVLink(None, system, component)
        self.parser.robust_parsing = True
        self.received: list[Any] = []
        self.raw: list[bytes] = []
        self._news = asyncio.Event()

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def write(self, frame: bytes) -> None:
        self.transport.sendto(frame)

    def error_received(self, _: Exception) -> None:
        """No face listens yet, or any more."""

    def datagram_received(self, data: bytes, _: Any) -> None:
        self.raw.append(data)
        self.received += self.parser.parse_buffer(data) or ()
        self._news.set()

    async def beat(self) -> None:
        while True:
            self.mav.heartbeat_send(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            await asyncio.sleep(0.3)

    async def hears(
        self,
        name: str | tuple[str, ...],
        true: Callable[[Any], bool] = lambda _: True,
        since: int = 0,
    ) -> Any:
        """Wait for a message of one of some types; `since`: the number of messages before it."""
        names = (name,) if isinstance(name, str) else name
        async with asyncio.timeout(WITHIN_S):
            while True:
                for message in self.received[since:]:
                    if message.get_type() in names and true(message):
                        return message
                self._news.clear()
                await self._news.wait()

    async def gets(self, frame: bytes) -> None:
        """Wait for a frame with these bytes."""
        async with asyncio.timeout(WITHIN_S):
            while frame not in self.raw:
                self._news.clear()
                await self._news.wait()

    async def command(self, system: int, command: int, *params: float, component: int = 1) -> int:
        """Send COMMAND_LONG; the result that is not IN_PROGRESS."""
        since = len(self.received)
        padded = [*params, *[0.0] * (7 - len(params))]
        self.mav.command_long_send(system, component, command, 0, *padded)
        return await self.result(system, command, since)

    async def go_to(self, system: int, place: tuple[float, float], up: float = math.nan) -> int:
        """Send DO_REPOSITION; `up`: the altitude above home."""
        since = len(self.received)
        frame, command = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, dialect.MAV_CMD_DO_REPOSITION
        x, y = round(place[0] * 1e7), round(place[1] * 1e7)
        self.mav.command_int_send(system, 1, frame, command, 0, 0, -1, 1, 0, math.nan, x, y, up)
        return await self.result(system, command, since)

    async def result(self, system: int, command: int, since: int) -> int:
        """Wait for the acknowledgement."""
        acknowledged = await self.hears(
            "COMMAND_ACK",
            lambda each: (
                each.get_srcSystem() == system
                and each.command == command
                and each.result != dialect.MAV_RESULT_IN_PROGRESS
            ),
            since,
        )
        return int(acknowledged.result)

    def texts(self) -> list[str]:
        """The texts, with their chunks joined."""
        joined: list[str] = []
        for each in self.received:
            if each.get_type() == "STATUSTEXT":
                text = each.text.rstrip("\0")
                if each.chunk_seq:
                    joined[-1] += text
                else:
                    joined.append(text)
        return joined

    async def told(self, *parts: str) -> None:
        """Wait for a text with all parts."""
        async with asyncio.timeout(WITHIN_S):
            while True:
                if any(all(part in text for part in parts) for text in self.texts()):
                    return
                self._news.clear()
                await self._news.wait()


@asynccontextmanager
async def ground_station(
    port: int, system: int = 254, component: int = 190
) -> AsyncIterator[GroundStation]:
    """A ground station that sends to a port of this machine."""
    loop = asyncio.get_running_loop()
    transport, station = await loop.create_datagram_endpoint(
        lambda: GroundStation(system, component), remote_addr=("127.0.0.1", port)
    )
    beating = loop.create_task(station.beat())
    try:
        yield station
    finally:
        beating.cancel()
        transport.close()


@asynccontextmanager
async def stalled_station(port: int) -> AsyncIterator[socket.socket]:
    """A TCP connection to a port of this machine whose receiver does not read. It and the kernel of
    the sender keep little, so that the sender's own bound is soon reached."""
    with socket.socket() as stalled:
        stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stalled.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, 536)
        stalled.setblocking(False)
        await asyncio.get_running_loop().sock_connect(stalled, ("127.0.0.1", port))
        yield stalled


async def messages_dropped(name: str, caplog: pytest.LogCaptureFixture) -> int:
    """Wait until the log says that a station is gone; how many messages to it were dropped."""
    said = re.compile(rf"ground station {re.escape(name)} is gone; (\d+) messages to it")
    async with asyncio.timeout(WITHIN_S):
        while not (found := said.search(caplog.text)):  # noqa: ASYNC110  # the log has no event
            await asyncio.sleep(0.05)
    return int(found[1])


@asynccontextmanager
async def served(control: MissionControl, **settings: Any) -> AsyncIterator[None]:
    """Serve the face."""
    face = MavlinkFace(control, FaceSettings("mavlink", settings))
    serving = asyncio.create_task(face.serve())
    try:
        yield
        if serving.done():
            serving.result()
    finally:
        serving.cancel()
        await asyncio.wait([serving])


@asynccontextmanager
async def gateway(
    folder: Path, *, speed: float = 1.0, fleet: str = FLEET, also: str = "", **settings: Any
) -> AsyncIterator[tuple[MissionControl, int]]:
    """An executive with a face, and the face's port. `also`: another URL of it."""
    port = free_port()
    own = f"udpin://127.0.0.1:{port}"
    settings.setdefault("url", [own, also] if also else own)
    loaded = load_fleet(str(write_fleet(folder, fleet)))
    async with (
        run_executive(loaded, speed=speed) as control,
        served(control, **settings),
    ):
        yield control, port
