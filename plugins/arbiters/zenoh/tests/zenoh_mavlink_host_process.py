"""A host with two simulated MAVLink rovers, over UDP.

    python zenoh_mavlink_host_process.py PORT FOLDER SPEED ACTION:AFTER_S LOST_AFTER_S ...

FOLDER/ports has the UDP port of the first rover; the second one has the next. It obeys lines at its
standard input: "cut VEHICLE", "effects VEHICLE".
"""

import asyncio
import logging
import sys
import threading
from pathlib import Path

from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_mavlink import AT_HOME, NUMBERS, hosted_rovers

from m2pem.api import ArbiterContext, ResourceId, SystemClock, offset
from m2pem.telemetry.bus import Bus


def rovers() -> list[VehicleSpec]:
    places = {number: offset(AT_HOME, 0.0, 20.0 * number) for number in NUMBERS.values()}
    return [
        VehicleSpec(Kind.ROVER, system=number, home=Location(*place, 488.0), estimator_s=1.0)
        for number, place in places.items()
    ]


async def main(port: int, folder: Path, speed: float) -> None:
    first = int((folder / "ports").read_text())
    simulator = Simulator(rovers(), speed=speed, to=None, listen=("127.0.0.1", first))

    def obey(what: str, vehicle: str) -> None:
        truth = simulator[NUMBERS[ResourceId(vehicle)]]
        if what == "cut":
            truth.port.outward.carry = truth.port.inward.carry = lambda *_: None  # type: ignore[method-assign,assignment]
            print("cut", flush=True)
        else:
            print(truth.motions + truth.missions_begun + truth.takeoffs, flush=True)

    loop = asyncio.get_running_loop()

    def read() -> None:
        for line in sys.stdin:
            loop.call_soon_threadsafe(obey, *line.split())

    def ready(line: str) -> None:
        print(line, flush=True)

    threading.Thread(target=read, daemon=True).start()
    context = ArbiterContext(
        SystemClock(speed), Bus(), logging.getLogger("host"), (*AT_HOME, 488.0)
    )
    async with simulator:
        hosted = hosted_rovers(port, first)
        await ZenohHosts().serve([hosted], context, folder, ready=ready)


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    asyncio.run(main(int(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])))
