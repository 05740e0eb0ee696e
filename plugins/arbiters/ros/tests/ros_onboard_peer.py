"""Vehicles with an m2pem node each, in a process of their own: `ros_onboard_peer.py SPEED NAME...`.

What drives them is a script. SIGUSR1 makes their vehicles unheard; SIGTERM ends the nodes.
"""

import asyncio
import signal
import sys

from m2pem_plugin_ros.drivers.driver import DriverEvents
from m2pem_plugin_ros.onboard.node import OnboardNode
from m2pem_plugin_ros.onboard.target_bus import TargetBus
from m2pem_plugin_ros.runtime import RosRuntime
from ros_scripted_driver import ScriptedDriver

from m2pem.api.clock import SystemClock


async def main(speed: float, names: list[str]) -> None:
    drivers: list[ScriptedDriver] = []

    clock = SystemClock(speed)
    targets = TargetBus()

    def make_driver(told: DriverEvents) -> ScriptedDriver:
        drivers.append(ScriptedDriver(told, targets, clock))
        return drivers[-1]

    def deafen() -> None:
        for driver in drivers:
            driver.deaf = True

    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGTERM, ended.set)
    loop.add_signal_handler(signal.SIGUSR1, deafen)
    async with RosRuntime("peer") as ros:
        nodes = [
            OnboardNode(ros, name, f"/{name}", make_driver, clock=clock, bus=targets)
            for name in names
        ]
        for node in nodes:
            await node.open()
        print("ready", flush=True)
        await ended.wait()
        for node in nodes:
            await node.close()


asyncio.run(main(float(sys.argv[1]), sys.argv[2:]))
