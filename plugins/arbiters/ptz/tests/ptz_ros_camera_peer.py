"""A simulated camera in a process of its own: `name settings-as-json endless`."""

import asyncio
import json
import signal
import sys

from m2pem_plugin_ptz.drivers.ros.settings import read_settings
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.simulator.ros.camera import CameraSpec
from m2pem_plugin_ptz.simulator.ros.simulation import simulate

from m2pem.api import Connection, ResourceId, SystemClock

REACH = Reach((-2.8, 2.8), (-1.5, 0.8), zoom_max=10.0, rate_rad_s=2.0)
ENDLESS = Reach(tilt_rad=(-1.5, 0.8), rate_rad_s=2.0, endless=True)


async def main(name: str, settings: str, endless: str) -> None:
    connection = Connection(ResourceId(name), "ground", json.loads(settings))
    spec = CameraSpec(name, read_settings(connection), ENDLESS if endless == "yes" else REACH)
    ready = asyncio.Event()
    going = asyncio.create_task(simulate([spec], SystemClock(), None, ready.set))
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, going.cancel)
    await ready.wait()
    print("ready", flush=True)
    await asyncio.gather(going, return_exceptions=True)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
