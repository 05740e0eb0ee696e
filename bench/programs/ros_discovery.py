"""How soon an executive and ROS vehicles find each other, over DDS on 127.0.0.1.

python -m bench.programs.ros_discovery <vehicles>

`all_s`: the vehicles are there; from the beginning of the arbiter's `connect` until each was heard.
`late_s`: with another executive, one more vehicle comes; from when it begins to make its node until
that has its first command, which a mission gives it as soon as the executive hears it.
"""

import asyncio
import json
import sys
import time
from collections.abc import Mapping
from typing import Any

from bench.programs.commanding import signalled
from bench.programs.ros_fleet import PATIENCE_S, Heard, until_all
from bench.programs.ros_stage import Vehicles, fleet, own_domain
from bench.programs.stage import Plugins
from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal

RATE_HZ = 10.0


async def found_s(domain: int, count: int) -> float:
    """Seconds from `connect` until all were heard."""
    began_s: list[float] = []
    plugins = Plugins()

    def timed(connections: Mapping[ResourceId, Connection], context: ArbiterContext) -> Any:
        arbiter: Any = plugins.arbiter("ros")(connections, context)
        connect = arbiter.connect

        async def connect_now() -> None:
            began_s.append(time.perf_counter())
            await connect()

        arbiter.connect = connect_now
        return arbiter

    vehicles = fleet(count, domain)
    async with Executive(vehicles, MemoryJournal(), Plugins(timed), SystemClock()) as running:
        heard = Heard(running)
        listening = asyncio.create_task(heard.listen())
        await until_all(heard, count)
        listening.cancel()
    return max(heard.first_s.values()) - began_s[0]


async def late_s(domain: int, count: int) -> float:
    """Seconds from the beginning of one more vehicle until its first command."""
    vehicles = fleet(count + 1, domain)
    loop = asyncio.get_running_loop()
    async with Executive(vehicles, MemoryJournal(), Plugins(), SystemClock()) as running:
        heard = Heard(running)
        listening = asyncio.create_task(heard.listen())
        await until_all(heard, count)
        run = await running.control.start(signalled(count + 1))

        async def command() -> None:
            await until_all(heard, count + 1)
            await running.control.signal(f"go{count}", run=run)

        def come() -> float:
            commanding = asyncio.run_coroutine_threadsafe(command(), loop)
            with Vehicles(domain, 1, RATE_HZ, count) as late:
                late.listen()
                commanding.result(PATIENCE_S)
                _, _, came_ns = late.received()
            return (came_ns - late.began_ns) / 1e9

        took_s = await asyncio.to_thread(come)
        listening.cancel()
    return took_s


def main() -> None:
    """The command."""
    count = int(sys.argv[1])
    with own_domain() as domain, Vehicles(domain, count, RATE_HZ):
        figures = {
            "all_s": asyncio.run(found_s(domain, count)),
            "late_s": asyncio.run(late_s(domain, count)),
        }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
