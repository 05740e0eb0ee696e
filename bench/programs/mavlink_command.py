"""From `MissionControl` to the wire: how soon a MAVLink vehicle's socket has the first command.

python -m bench.programs.mavlink_command memory|sqlite <vehicles> <messages a second of each> <n>

An executive with the MAVLink arbiter, over UDP, and as many vehicles that all stream meanwhile. One
after the other, n times: a signal lets a token of one mission go to a task that commands `goto`,
each time on another vehicle; then n pauses (`pause_`) of another mission, in which a vehicle is on
its way and is held. The time begins in another thread, with the wish to call `MissionControl`, and
ends when the vehicle's socket has the first command, by the kernel's time stamp. Needs Linux.
"""

import asyncio
import json
import random
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Coroutine
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from statistics import quantiles
from typing import Any

from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.url import parse_url

from bench.graphs import file
from bench.measured import Stopwatch
from bench.programs.mavlink_rovers import APART_DEG, REPOSITION, SET_MODE, address, place, started
from bench.programs.stage import Plugins, flows, opened
from m2pem.api import Notice
from m2pem.engine.records import TokenEntered
from m2pem.executive.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import Journal
from m2pem.model.catalogue import ResourceId
from m2pem.model.geometry import Point
from m2pem.resources.fleet import Domain, Fleet, Vehicle

URL = "udpin://127.0.0.1:0"
PAUSED = 0
"""The vehicle that is on its way, and is paused; the others get signals."""

PAUSE_S = 0.02
PATIENCE_S = 10.0


def fleet(count: int) -> Fleet:
    """Rovers v0, v1 and so on, and points p0, p1 and so on: their places, but for the one far from
    the vehicle that is to be on its way."""
    points = {f"p{number}": Point((*place(number), None)) for number in range(count)}
    latitude, longitude = place(PAUSED)
    points[f"p{PAUSED}"] = Point((latitude + 10 * APART_DEG, longitude, None))
    settings = [{"url": URL, "system_id": address(number).system} for number in range(count)]
    vehicles = [
        Vehicle(ResourceId(f"v{number}"), Domain.GROUND, "mavlink", each)
        for number, each in enumerate(settings)
    ]
    return Fleet("bench", "bench.yaml", {each.id: each for each in vehicles}, geometries=points)


def going(number: int) -> str:
    """A task that commands a vehicle to go to its point."""
    return (
        f'<scriptTask id="b{number}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="goto">'
        f'<m2pem:properties><m2pem:property name="target" value="p{number}"/></m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="driver" vehicle="v{number}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def signalled(count: int) -> bytes:
    """For each vehicle but the first: its signal has it go, again and again."""
    numbers = range(PAUSED + 1, count)
    roots = "".join(f'<signal id="go{number}" name="go{number}"/>' for number in numbers)
    events = "".join(
        f'<intermediateCatchEvent id="c{number}"><signalEventDefinition signalRef="go{number}"/>'
        f"</intermediateCatchEvent>{going(number)}"
        for number in numbers
    )
    loops = flows(
        ["start", "fork"], *(["fork", f"c{each}", f"b{each}", f"c{each}"] for each in numbers)
    )
    return file(
        f'{roots}<process id="SIGNALLED" isExecutable="true"><startEvent id="start"/>'
        f'<parallelGateway id="fork"/>{events}{loops}</process>'
    )


def on_its_way() -> bytes:
    """One vehicle goes far."""
    return file(
        '<process id="ON_ITS_WAY" isExecutable="true"><startEvent id="start"/>'
        f'{going(PAUSED)}<endEvent id="end"/>{flows(["start", f"b{PAUSED}", "end"])}</process>'
    )


class Operator:
    """Calls `MissionControl` from a thread of its own, and waits for what the vehicles get."""

    def __init__(self, running: Executive, pipe: Connection) -> None:
        self._control = running.control
        self._pipe = pipe
        self._loop = asyncio.get_running_loop()
        self._rng = random.Random(5)

    def wait_for_the_way(self) -> None:
        """Wait until the vehicle of the other mission has been sent off."""
        self._expect(PAUSED, SET_MODE, REPOSITION)

    def signals(
        self, run: str, notices: AsyncIterator[Notice], vehicles: int, times: int
    ) -> list[float]:
        """Milliseconds from each signal to the command."""
        took_ms = []
        for number in range(times):
            vehicle = PAUSED + 1 + number % (vehicles - 1)
            wish = self._control.signal(f"go{vehicle}", run=run)
            took_ms.append(self._command(wish, vehicle, SET_MODE, REPOSITION))
            self._call(self._back(notices, f"c{vehicle}"))
        return took_ms

    def pauses(self, run: str, times: int) -> list[float]:
        """Milliseconds from each pause to the command."""
        took_ms = []
        for _ in range(times):
            took_ms.append(self._command(self._control.pause(run), PAUSED, SET_MODE))
            self._command(self._control.resume(run), PAUSED, SET_MODE, REPOSITION)
        return took_ms

    def _command(self, wish: Coroutine[Any, Any, None], vehicle: int, *commands: int) -> float:
        time.sleep(self._rng.uniform(0, PAUSE_S))
        wished_ns = time.time_ns()
        asked = asyncio.run_coroutine_threadsafe(wish, self._loop)
        first_ns = self._expect(vehicle, *commands)
        asked.result(PATIENCE_S)
        return (first_ns - wished_ns) / 1e6

    def _expect(self, vehicle: int, *commands: int) -> int:
        """When the first of these commands came; no other vehicle is steered meanwhile."""
        came = [self._receive() for _ in commands]
        found = [(number, command) for number, command, _ in came]
        assert found == [(vehicle, command) for command in commands], found
        return came[0][2]

    def _receive(self) -> tuple[int, int, int]:
        assert self._pipe.poll(PATIENCE_S), "a command did not come"
        found: tuple[int, int, int] = self._pipe.recv()
        return found

    def _call(self, wish: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(wish, self._loop).result(PATIENCE_S)

    async def _back(self, notices: AsyncIterator[Notice], element: str) -> None:
        async for notice in notices:
            record = getattr(notice, "record", None)
            if isinstance(record, TokenEntered) and record.element == element:
                return


async def measure(
    journal: Journal, count: int, times: int, rovers: BaseProcess, pipe: Connection
) -> dict[str, float]:
    """Signal and pause."""
    # The arbiter uses the same endpoint; whoever opens it first knows its port before.
    link = await open_link(address(PAUSED), [URL], SystemClock())
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, UdpEndpoint)
    pipe.send(endpoint.port)
    watch = Stopwatch()
    async with Executive(fleet(count), journal, Plugins(MavlinkArbiter), SystemClock()) as running:
        operator = Operator(running, pipe)
        way = await running.control.start(on_its_way())
        await asyncio.to_thread(operator.wait_for_the_way)
        run = await running.control.start(signalled(count))
        notices = running.control.subscribe(run, size=100_000)
        with watch:
            sent = await asyncio.to_thread(operator.signals, run, notices, count, times)
            paused = await asyncio.to_thread(operator.pauses, way, times)
    pipe.send("stop")
    await asyncio.to_thread(rovers.join)
    await link.close()
    await journal.close()
    figures = {"cpu_percent": 100 * watch.cpu_s / watch.wall_s}
    for name, took_ms in (("", sent), ("pause_", paused)):
        cuts = quantiles(took_ms, n=100)
        figures |= {f"{name}p50_ms": cuts[49], f"{name}p99_ms": cuts[98]}
    return figures


def main() -> None:
    """The command."""
    kind, *numbers = sys.argv[1:]
    count, rate_hz, times = map(int, numbers)
    rovers, pipe = started(count, rate_hz)
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        journal = opened(kind, Path(scratch))
        print(json.dumps(asyncio.run(measure(journal, count, times, rovers, pipe))))


if __name__ == "__main__":
    main()
