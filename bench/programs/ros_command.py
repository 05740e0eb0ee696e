"""From `MissionControl` to a ROS vehicle: how soon its node's callback has the first command.

python -m bench.programs.ros_command memory|sqlite <vehicles> <n>

An executive with the ROS arbiter, over DDS on 127.0.0.1, and a process of as many vehicles with
nodes in plain rclpy, which tell of themselves ten times a second meanwhile. One after the other, n
times: a signal lets a token of one mission go to a task that commands `goto`, each time on another
vehicle; then n pauses (`pause_`) of another mission, in which a vehicle is on its way and is held.
The time begins in another thread, with the wish to call `MissionControl`, and ends when rclpy calls
the node's callback of `command`.
"""

import asyncio
import json
import sys
import tempfile
from pathlib import Path

from bench.measured import Stopwatch
from bench.programs.commanding import Operator, Orders, on_its_way, percentiles, signalled
from bench.programs.ros_stage import Vehicles, fleet, own_domain
from bench.programs.stage import Plugins, opened
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import Journal

RATE_HZ = 10.0
START, HOLD, RESUME = 1, 3, 4
ORDERS = Orders((START,), (HOLD,), (RESUME,))


async def measure(
    journal: Journal, domain: int, count: int, times: int, vehicles: Vehicles
) -> dict[str, float]:
    """Signal and pause."""
    watch = Stopwatch()
    async with Executive(fleet(count, domain), journal, Plugins(), SystemClock()) as running:
        operator = Operator(running, vehicles.received, ORDERS)
        way = await running.control.start(on_its_way())
        await asyncio.to_thread(operator.wait_for_the_way)
        run = await running.control.start(signalled(count))
        notices = running.control.subscribe(run, size=100_000)
        with watch:
            sent = await asyncio.to_thread(operator.signals, run, notices, count, times)
            paused = await asyncio.to_thread(operator.pauses, way, times)
    await journal.close()
    spent = {"cpu_percent": 100 * watch.cpu_s / watch.wall_s}
    return spent | percentiles(sent, paused, 50, 95)


def main() -> None:
    """The command."""
    kind, *numbers = sys.argv[1:]
    count, times = map(int, numbers)
    with (
        tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch,
        own_domain() as domain,
        Vehicles(domain, count, RATE_HZ) as vehicles,
    ):
        vehicles.listen()
        journal = opened(kind, Path(scratch))
        print(json.dumps(asyncio.run(measure(journal, domain, count, times, vehicles))))


if __name__ == "__main__":
    main()
