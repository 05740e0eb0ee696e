"""Real autopilots, simulated in the loop by their own makers' programs (docs/mavlink.md).

The programs are named by M2PEM_ARDUCOPTER, M2PEM_ARDUROVER and M2PEM_PX4. Each is started in a
folder of its own, as `m2pem sitl` starts it, and speaks to a UDP port of this machine.
"""

import os
import socket
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from m2pem_plugin_mavlink.sitl.launch import Launch, Start, ardupilot_launch, px4_launch, running
from m2pem_plugin_mavlink.sitl.programs import FRAMES, ardupilot_program, find_px4

__all__ = [
    "HOME",
    "MOUNT",
    "SPEED",
    "Launch",
    "ardupilot",
    "first_instance",
    "free_port",
    "program",
    "programs_folder",
    "px4",
    "running",
    "until_ready",
]

HOME = (47.397742, 8.545594, 488.0)
SPEED = 5
MOUNT: Mapping[str, float] = MappingProxyType(
    {
        **{"MNT1_TYPE": 1, "SERVO9_FUNCTION": 6, "SERVO10_FUNCTION": 7, "SERVO11_FUNCTION": 8},
        **{"MNT1_YAW_MIN": -160, "MNT1_YAW_MAX": 160, "MNT1_PITCH_MIN": -90, "MNT1_PITCH_MAX": 25},
        "MNT1_DEFLT_MODE": 1,
    }
)
"""A mount of ArduPilot that three servos turn (docs: ArduPilot, "Servo Gimbal"). While nothing
commands it, it looks ahead, and not where the stick of a pilot points it."""


def free_port() -> int:
    """A UDP port of 127.0.0.1 that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


def program(variable: str) -> Path | None:
    """The program that an environment variable names, or a link to it."""
    named = os.environ.get(variable)
    return Path(named).absolute() if named else None


def programs_folder(folder: Path, *names: str) -> Path:
    """Make a folder with links to programs: "arducopter" is what M2PEM_ARDUCOPTER names."""
    folder.mkdir()
    for name in names:
        named = program(f"M2PEM_{name.upper()}")
        assert named is not None, name
        (folder / name).symlink_to(named)
    return folder


def first_instance(programs: int) -> int:
    """The number of the first of so many programs; tests run side by side (pytest -n)."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    return programs * worker


def ardupilot(
    binary: Path,
    model: str,
    instance: int,
    port: int | Sequence[int],
    system_id: int | None = None,
    parameters: Mapping[str, float] = MappingProxyType({}),
) -> Launch:
    """Of a frame of ArduPilot; `system_id` is `instance` + 1 if left out."""
    frame = FRAMES[model]
    system = system_id or instance + 1
    return ardupilot_launch(
        f"{model}{instance}",
        ardupilot_program(binary, frame),
        frame,
        _start(system - 1),
        instance=instance,
        system_id=system,
        ports=[port] if isinstance(port, int) else port,
        parameters=parameters,
    )


def px4(
    binary: Path,
    instance: int,
    folder: Path,
    model: str = "sihsim_quadx",
    speed: float = SPEED,
) -> Launch:
    """A model of PX4's own simulation, to be run in `folder`; the `etc` folder of its build is
    beside the `bin` folder of the program."""
    name = f"px4-{instance}"
    return px4_launch(
        name,
        find_px4(binary.parent.parent),
        model,
        _start(instance, speed),
        instance=instance,
        folder=folder / name,
    )


def until_ready(process: subprocess.Popen[str]) -> list[str]:
    """What `m2pem sitl` prints until its vehicles are ready, line by line."""
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line.rstrip("\n"))
        if lines[-1] == "ready":
            return lines
    raise AssertionError((lines, process.communicate()))


def _start(instance: int, speed: float = SPEED) -> Start:
    latitude, longitude, altitude = HOME
    return Start(latitude, longitude + 0.0003 * instance, altitude, speed=speed)
