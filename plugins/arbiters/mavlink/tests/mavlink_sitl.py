"""Real autopilots, simulated in the loop by their own makers' programs (docs/mavlink.md).

The programs are named by M2PEM_ARDUCOPTER, M2PEM_ARDUROVER and M2PEM_PX4. Each is started in a
folder of its own and speaks to a UDP port of this machine.
"""

import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

HOME = (47.397742, 8.545594, 488.0)
SPEED = 5
ENDED_WITHIN_S = 30


def free_port() -> int:
    """A UDP port of 127.0.0.1 that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


def program(variable: str) -> Path | None:
    """The program that an environment variable names."""
    named = os.environ.get(variable)
    return Path(named).resolve() if named else None


def ardupilot(binary: Path, model: str, instance: int, port: int) -> list[str]:
    """A command. Parameters are in `<binary>.parm`, if there is such a file."""
    latitude, longitude, altitude = HOME
    home = f"{latitude},{longitude + 0.0003 * instance},{altitude},0"
    command = [
        *(str(binary), "-w", "--model", model, "--speedup", str(SPEED), f"-I{instance}"),
        *("--sysid", str(instance + 1), "--home", home),
        *("--serial0", f"udpclient:127.0.0.1:{port}"),
    ]
    for other in (1, 2, 5, 6, 7, 8):
        command += [f"--serial{other}", "none:1"]
    parameters = binary.with_name(f"{binary.name}.parm")
    return [*command, "--defaults", str(parameters)] if parameters.exists() else command


def px4(binary: Path, instance: int, folder: Path) -> list[str]:
    """A command; the `etc` folder of its build stands beside the `bin` folder of the program."""
    etc = binary.parent.parent / "etc"
    return [str(binary), "-d", "-i", str(instance), "-w", str(folder), str(etc)]


PX4_ENVIRONMENT = {
    "PX4_SIMULATOR": "sihsim",
    "PX4_SIM_MODEL": "sihsim_quadx",
    "PX4_SIM_SPEED_FACTOR": str(SPEED),
}


@contextmanager
def running(
    commands: Sequence[Sequence[str]], folder: Path
) -> Iterator[list[subprocess.Popen[str]]]:
    """The programs, each in a folder of its own, with what they print in `output` there."""
    started: list[subprocess.Popen[str]] = []
    try:
        for number, command in enumerate(commands, 1):
            place = folder / str(number)
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir(parents=True)
            with (place / "output").open("w", encoding="utf-8") as output:
                started.append(
                    subprocess.Popen(
                        command,
                        cwd=place,
                        env={**os.environ, **PX4_ENVIRONMENT},
                        stdin=subprocess.DEVNULL,
                        stdout=output,
                        stderr=subprocess.STDOUT,
                        text=True,
                    )
                )
        yield started
    finally:
        for each in started:
            each.send_signal(signal.SIGCONT)  # one that was stopped does not end otherwise
            each.terminate()
        for each in started:
            try:
                each.wait(ENDED_WITHIN_S)
            except subprocess.TimeoutExpired:
                each.kill()
                each.wait()
