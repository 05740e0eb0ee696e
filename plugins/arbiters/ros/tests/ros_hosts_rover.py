"""A simulated rover with an m2pem node on board, which a host of its own commands over DDS.

    python ros_hosts_rover.py DOMAIN

It answers each line at its standard input with how often it has begun to move, and its speed in
m/s.
"""

import asyncio
import sys

from m2pem_plugin_ros.settings import Settings
from m2pem_plugin_ros.simulator.dynamics import Chassis
from m2pem_plugin_ros.simulator.simulation import Simulation
from m2pem_plugin_ros.simulator.specification import VehicleSpec

from m2pem.api.foreground import Lines

FAST = Chassis(speed_m_s=6.0, acceleration_m_s2=3.0)


async def main(domain: int) -> None:
    rover = VehicleSpec("ugv1", Settings("/ugv1"), chassis=FAST)
    async with Simulation([rover], domain_id=domain) as simulation:
        print("ready", flush=True)
        async for _ in Lines():
            body = simulation["ugv1"].vehicle.body
            print(body.motions, body.twist.forward_m_s, flush=True)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
