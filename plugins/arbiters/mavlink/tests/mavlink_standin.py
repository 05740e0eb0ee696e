"""A program that stands in for ArduPilot's: started as they are, it simulates one vehicle.

It understands the options that `m2pem sitl` gives, and refuses others, as ArduPilot does. Its
parameters are those of the files of `--defaults`, with EKF_READY_S for when it knows where it is.
"""

import argparse
import asyncio
import os
import sys
from pathlib import Path

from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

KINDS = {"quad": Kind.COPTER, "rover": Kind.ROVER, "motorboat": Kind.BOAT}


def write_standin(path: Path, parameters: str = "EKF_READY_S 0.5\n") -> Path:
    """A program `path` that runs this module, and the parameters beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    python = f"#!{sys.executable}\nimport sys\nsys.path[:] = {sys.path!r}\n"
    path.write_text(f"{python}import mavlink_standin\nmavlink_standin.main()\n", encoding="utf-8")
    path.chmod(0o755)
    path.with_name(f"{path.name}.parm").write_text(parameters, encoding="utf-8")
    return path


def main() -> None:
    """Be started as ArduPilot is."""
    options = argparse.ArgumentParser(allow_abbrev=False)
    options.add_argument("-w", action="store_true")
    options.add_argument("-I", type=int)
    for name in ("model", "speedup", "sysid", "home", "defaults"):
        options.add_argument(f"--{name}", required=True)
    for number in range(9):
        options.add_argument(f"--serial{number}", default="tcp:0")
    given = options.parse_args()
    parameters = dict(
        line.split()
        for file in given.defaults.split(",")
        for line in Path(file).read_text(encoding="utf-8").splitlines()
    )
    print(f"pid {os.getpid()}, model {given.model}, in {Path.cwd()}", flush=True)
    if "DIES" in parameters:
        sys.exit(f"PANIC: no such board {parameters['DIES']}")
    kind, host, port = given.serial0.split(":")
    assert kind == "udpclient"
    latitude, longitude, altitude, _ = map(float, given.home.split(","))
    spec = VehicleSpec(
        KINDS[given.model],
        system=int(given.sysid),
        home=Location(latitude, longitude, altitude),
        estimator_s=float(parameters["EKF_READY_S"]),
    )
    asyncio.run(_simulate(Simulator([spec], speed=float(given.speedup), to=(host, int(port)))))


async def _simulate(simulator: Simulator) -> None:
    async with simulator as vehicles:
        await vehicles.stopped()
