"""Browsers without a screen, in a process of their own: what they get of a run, and how late.

python -m bench.programs.web_browsers <address with its token> <run> [readers] [stalled]

Readers (2) take in all that they are sent; stalled ones (1) never read: they ask for the run, and
connect again when they are disconnected. Ends with the run. The answer is about the reader that
lags most.
"""

import asyncio
import json
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from http.client import HTTPConnection
from typing import Any
from urllib.parse import urlsplit

import msgspec
import websockets

US = 1_000_000
LIMIT_S = 300.0

_decode = msgspec.json.Decoder().decode


@dataclass(slots=True)
class Browser:
    """What one has received. Latencies in ms: of frames, and of the newest event in each."""

    address: str
    secrets: dict[str, str]
    run: str
    frames: int = 0
    urgent: int = 0
    events: int = 0
    began: float = 0.0
    ended: float = 0.0
    started_us: int = 0
    frame_ms: list[float] = field(default_factory=list)
    event_ms: list[float] = field(default_factory=list)
    hits: dict[tuple[str, str], int] = field(default_factory=dict)

    async def connect(self) -> websockets.ClientConnection:
        """Open the WebSocket, and watch the run."""
        base = self.address.rstrip("/")
        socket = await websockets.connect(
            f"{base.replace('http', 'ws', 1)}/api/live",
            additional_headers=self.secrets,
            origin=websockets.Origin(base),
            compression=None,
            max_size=None,
            close_timeout=0.2,
        )
        await socket.send(json.dumps({"type": "watch", "run": self.run}))
        return socket

    async def look(self) -> None:
        """Read until the run has ended, and all of it was received."""
        socket = await self.connect()
        final: int | None = None
        async for text in socket:
            message = _decode(text)
            kind = message["type"]
            if kind in ("snapshot", "frame"):
                self._take(message)
                await socket.send(json.dumps({"type": "ack", "seq": message["seq"]}))
            elif kind != "log":
                self.urgent += 1
            if kind == "run" and message["run"]["run"] == self.run and message["run"]["ended_us"]:
                final = message["run"]["records"]
            if final is not None and self.events >= final:
                break
        self.ended = time.perf_counter()
        await socket.close()

    def _take(self, message: dict[str, Any]) -> None:
        now_us = time.time_ns() // 1000
        self.events = message["events"]
        newest = 0.0
        for process, elements in message.get("elements", {}).items():
            for element, state in elements.items():
                self.hits[process, element] = state["hits"]
                newest = max(newest, state["last"])
        if message["type"] == "snapshot":
            self.began = time.perf_counter()
            (self.started_us,) = (
                each["started_us"] for each in message["runs"] if each["run"] == self.run
            )
            return
        self.frames += 1
        self.frame_ms.append((now_us - self.started_us) / 1000 - message["t"] * 1000)
        if newest:
            self.event_ms.append((now_us - self.started_us) / 1000 - newest * 1000)

    async def stand_still(self) -> None:
        """Never read; come again when let go."""
        while True:
            socket = await self.connect()
            socket.transport.pause_reading()
            # As long as whoever serves it has patience, and a moment.
            await asyncio.sleep(11)
            socket.transport.abort()
            with suppress(websockets.ConnectionClosed):
                await socket.wait_closed()


def sign_in(url: str) -> dict[str, str]:
    """Use the token up; the headers of a request of the session."""
    parts = urlsplit(url)
    body = json.dumps({"token": parts.query.removeprefix("token=")})
    connection = HTTPConnection(parts.hostname or "", parts.port)
    said = {"Content-Type": "application/json", "Origin": f"{parts.scheme}://{parts.netloc}"}
    connection.request("POST", "/api/session", body, said)
    answer = connection.getresponse()
    cookie = answer.headers["set-cookie"].partition(";")[0]
    secrets = {"Cookie": cookie, "M2pem-Key": json.load(answer)["key"]}
    connection.close()
    return secrets


def percentile(values: list[float], share: float) -> float:
    """Of values in any order."""
    return sorted(values)[min(len(values) - 1, int(len(values) * share))] if values else 0.0


async def watch(url: str, run: str, readers: int, stalled: int) -> dict[str, Any]:
    """All of them; the answer."""
    address, secrets = url.partition("?")[0], sign_in(url)
    quick = [Browser(address, secrets, run) for _ in range(readers)]
    stalling = [
        asyncio.create_task(Browser(address, secrets, run).stand_still()) for _ in range(stalled)
    ]
    async with asyncio.timeout(LIMIT_S):
        await asyncio.gather(*(each.look() for each in quick))
    for each in stalling:
        each.cancel()
    await asyncio.gather(*stalling, return_exceptions=True)
    return {
        "frames_per_s": min(each.frames / (each.ended - each.began) for each in quick),
        "events": min(each.events for each in quick),
        "hits": min(sum(each.hits.values()) for each in quick),
        "frame_p50_ms": max(percentile(each.frame_ms, 0.5) for each in quick),
        "frame_p99_ms": max(percentile(each.frame_ms, 0.99) for each in quick),
        "event_p50_ms": max(percentile(each.event_ms, 0.5) for each in quick),
        "event_p99_ms": max(percentile(each.event_ms, 0.99) for each in quick),
    }


if __name__ == "__main__":
    words = sys.argv[1:]
    counts = [int(each) for each in words[2:]] or [2, 1]
    print(json.dumps(asyncio.run(watch(words[0], words[1], counts[0], counts[1]))))
