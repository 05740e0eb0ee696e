"""A simulated MAVLink copter, which a host of its own commands over UDP on its loopback.

    python ros_hosts_copter.py PORT

It answers each line at its standard input with what it has physically begun: takeoffs, motions and
missions; and its speed in m/s.
"""

import asyncio
import sys
import threading

from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

HOME = (38.1075, -77.3192, 60.0)


async def main(port: int) -> None:
    spec = VehicleSpec(
        Kind.COPTER,
        system=1,
        home=Location(*HOME),
        estimator_s=1.0,
        parameters={"FS_GCS_ENABLE": 0.0},
    )
    simulator = Simulator([spec], speed=1.0, to=None, listen=("127.0.0.1", port))
    loop = asyncio.get_running_loop()

    def tell() -> None:
        truth = simulator[1]
        begun = (truth.takeoffs, truth.motions, truth.missions_begun)
        print(*begun, truth.autopilot.body.ground_speed_mps, flush=True)

    def read() -> None:
        for _ in sys.stdin:
            loop.call_soon_threadsafe(tell)

    threading.Thread(target=read, daemon=True).start()
    async with simulator:
        print("ready", flush=True)
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
