"""Many ROS vehicles in one executive: what it costs to hear them, and whether each is heard.

python -m bench.programs.ros_fleet <vehicles> <Hz> <s>

The vehicles are a process of their own, with nodes in plain rclpy; each publishes odometry and its
status so many times a second, over DDS on 127.0.0.1. Figures: CPU of a core, memory, states that
arrive on the fleet bus a second, and the longest time without one of the same vehicle.
"""

import asyncio
import json
import sys
import time

from bench.measured import Stopwatch, peak_kb
from bench.programs.ros_stage import Vehicles, fleet, own_domain
from bench.programs.stage import Plugins
from m2pem.api import LinkState, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal

PATIENCE_S = 60.0
WAITING = 100_000


class Heard:
    """When states came, by vehicle."""

    def __init__(self, running: Executive) -> None:
        self._states = running.bus.subscribe(WAITING)
        self.first_s: dict[str, float] = {}
        self.last_s: dict[str, float] = {}
        self.count = 0
        self.longest_s = 0.0

    async def listen(self) -> None:
        """Until cancelled."""
        async for state in self._states:
            if isinstance(state, VehicleState) and state.link is not LinkState.LOST:
                now_s = time.perf_counter()
                self.first_s.setdefault(state.resource, now_s)
                before_s = self.last_s.get(state.resource, now_s)
                self.longest_s = max(self.longest_s, now_s - before_s)
                self.last_s[state.resource] = now_s
                self.count += 1

    def begin(self) -> None:
        """Count from now on."""
        self.count, self.longest_s = 0, 0.0
        self.last_s = dict.fromkeys(self.last_s, time.perf_counter())

    def end(self) -> None:
        """The silence of who is silent at the end counts too."""
        silent_s = time.perf_counter() - min(self.last_s.values())
        self.longest_s = max(self.longest_s, silent_s)


async def until_all(heard: Heard, count: int) -> None:
    """Wait until each vehicle was heard once."""
    async with asyncio.timeout(PATIENCE_S):
        while len(heard.first_s) < count:  # noqa: ASYNC110  # who listens tells nobody
            await asyncio.sleep(0.01)


async def measure(domain: int, count: int, seconds: float) -> dict[str, float]:
    """Hear them."""
    journal = MemoryJournal()
    watch = Stopwatch()
    async with Executive(fleet(count, domain), journal, Plugins(), SystemClock()) as running:
        heard = Heard(running)
        listening = asyncio.create_task(heard.listen())
        await until_all(heard, count)
        heard.begin()
        with watch:
            await asyncio.sleep(seconds)
        heard.end()
        listening.cancel()
    return {
        "states_per_s": heard.count / watch.wall_s,
        "longest_s": heard.longest_s,
        "cpu_percent": 100 * watch.cpu_s / watch.wall_s,
        "peak_mb": peak_kb() / 1024,
    }


def main() -> None:
    """The command."""
    count, rate_hz, seconds = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    with own_domain() as domain, Vehicles(domain, count, rate_hz):
        print(json.dumps(asyncio.run(measure(domain, count, seconds))))


if __name__ == "__main__":
    main()
