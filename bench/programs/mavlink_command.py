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
import sys
import tempfile
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.url import parse_url

from bench.measured import Stopwatch
from bench.programs.commanding import (
    PATIENCE_S,
    PAUSED,
    Got,
    Operator,
    Orders,
    on_its_way,
    percentiles,
    signalled,
)
from bench.programs.mavlink_rovers import APART_DEG, REPOSITION, SET_MODE, address, place, started
from bench.programs.stage import Plugins, opened
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal import Journal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point

URL = "udpin://127.0.0.1:0"
ORDERS = Orders((SET_MODE, REPOSITION), (SET_MODE,), (SET_MODE, REPOSITION))


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


def received(pipe: Connection) -> Got:
    """What a vehicle got next."""
    assert pipe.poll(PATIENCE_S), "a command did not come"
    found: Got = pipe.recv()
    return found


async def measure(
    journal: Journal, count: int, times: int, rovers: BaseProcess, pipe: Connection
) -> dict[str, float]:
    """Signal and pause."""
    # The arbiter uses the same endpoint; whoever opens it first knows its port before.
    link = await open_link(address(PAUSED), [URL], SystemClock())
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, UdpEndpoint)
    pipe.send([endpoint.port])
    watch = Stopwatch()
    async with Executive(fleet(count), journal, Plugins(MavlinkArbiter), SystemClock()) as running:
        operator = Operator(running, lambda: received(pipe), ORDERS)
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
    spent = {"cpu_percent": 100 * watch.cpu_s / watch.wall_s}
    return spent | percentiles(sent, paused, 50, 99)


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
