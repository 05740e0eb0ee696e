"""A host of simulated vehicles.

    python zenoh_host_process.py PORT FOLDER SPEED ACTION:AFTER_S LOST_AFTER_S ROUND_TRIP_S CONNECT

It connects to an endpoint, or listens at the port if that is "".
It obeys lines at its standard input: "cut VEHICLE", "mend VEHICLE" (the link from the host to the
vehicle), "effects VEHICLE" (how many motions it has begun).
"""

import asyncio
import logging
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import hosted_simulation

from m2pem.api import (
    ArbiterContext,
    CutOffPolicy,
    HostedArbiter,
    ResourceId,
    SystemClock,
    WhenCutOff,
)
from m2pem.simulation.arbiters import SimArbiter
from m2pem.telemetry.bus import Bus

ORIGIN = (38.1075, -77.3192, 60.0)


async def main(hosted: HostedArbiter, folder: Path, speed: float, connect: Sequence[str]) -> None:
    made: list[SimArbiter] = []

    def make(context: ArbiterContext) -> SimArbiter:
        made.append(SimArbiter(hosted.connections, context))
        return made[-1]

    def obey(words: list[str]) -> None:
        what, vehicle = words[0], ResourceId(words[1])
        arbiter = made[-1]
        match what:
            case "cut":
                print(arbiter.lose_link(vehicle), flush=True)
            case "mend":
                print(arbiter.restore_link(vehicle), flush=True)
            case "effects":
                begun = [each for each in arbiter.effects if each.kind == "start"]
                print(sum(each.resource == vehicle for each in begun), flush=True)

    loop = asyncio.get_running_loop()

    def read() -> None:
        for line in sys.stdin:
            loop.call_soon_threadsafe(obey, line.split())

    threading.Thread(target=read, daemon=True).start()
    context = ArbiterContext(SystemClock(speed), Bus(), logging.getLogger("host"), ORIGIN)
    ready = lambda line: print(line, flush=True)  # noqa: E731
    served = [replace(hosted, make=make)]
    await ZenohHosts().serve(served, context, folder, connect=connect, ready=ready)


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    action, _, after = sys.argv[4].partition(":")
    policy = CutOffPolicy(WhenCutOff(action), float(after))
    port, folder = int(sys.argv[1]), Path(sys.argv[2])
    speed, lost_after_s, round_trip_s = float(sys.argv[3]), float(sys.argv[5]), float(sys.argv[6])
    hosted = hosted_simulation(port, folder, policy, lost_after_s, round_trip_s)
    asyncio.run(main(hosted, folder, speed, [each for each in sys.argv[7:] if each]))
