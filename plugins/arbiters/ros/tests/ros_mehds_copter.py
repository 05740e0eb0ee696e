"""A simulated copter over MAVLink: `port speed`. Faults are lines of standard input."""

import asyncio
import sys

from m2pem_plugin_mavlink.simulator.faults import GRAMMAR, plan
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec

from m2pem.api.foreground import Lines

HOME = Location(38.107162, -77.319941, 60.0)
PARAMETERS = {"FS_GCS_ENABLE": 1.0, "FS_GCS_TIMEOUT": 20.0, "BATT_FS_LOW_ACT": 2.0}


async def main(port: int, speed: float) -> None:
    spec = VehicleSpec(home=HOME, parameters=PARAMETERS, estimator_s=6.0)
    async with Simulator([spec], speed=speed, to=("127.0.0.1", port)) as vehicles:
        print("ready", flush=True)
        async for line in Lines():
            plan(GRAMMAR.parse(line), vehicles[1].faults)
        await vehicles.stopped()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), float(sys.argv[2])))
