"""Vehicles with an m2pem node each, in a process of their own: `ros_onboard_peer.py NAME...`.

What drives them is a script. SIGUSR1 makes their vehicles unheard; SIGTERM ends the nodes.
"""

import asyncio
import signal
import sys
from typing import Any, cast

from m2pem.api import ResourceId
from m2pem.executive.clock import SystemClock
from m2pem_plugin_ros.onboard import Aboard, Onboard
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import Settings
from ros_scripted_driver import ScriptedDriver


async def main(names: list[str]) -> None:
    drivers: list[ScriptedDriver] = []

    def make_driver(seat: Any) -> ScriptedDriver:
        drivers.append(ScriptedDriver(seat))
        return drivers[-1]

    def deafen() -> None:
        for driver in drivers:
            driver.deaf = True

    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGTERM, ended.set)
    loop.add_signal_handler(signal.SIGUSR1, deafen)
    async with RosRuntime("peer") as ros:
        nodes = []
        for name in names:
            aboard = Aboard(
                ResourceId(name),
                Settings(f"/{name}"),
                SystemClock(),
                (38.0, -77.0, 60.0),
                cast("Any", None),
            )
            nodes.append(Onboard(ros, aboard, make_driver))
            await nodes[-1].open()
        print("ready", flush=True)
        await ended.wait()
        for node in nodes:
            await node.close()


asyncio.run(main(sys.argv[1:]))
