"""Starting a program of an autopilot: its command, environment and files, and its process."""

import asyncio
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from m2pem_plugin_mavlink.sitl.programs import ArduPilotProgram, Frame, Px4Program

SERIALS = (0, 1, 2, 5, 6, 7, 8)
"""The serial ports of ArduPilot that would wait for connections from everywhere without an option
of their own: SERIAL3 and SERIAL4 have the simulated GPS receivers. The first ones speak MAVLink."""

MAVLINK_SERIALS = 3
OWN_PARAMETERS = "m2pem.parm"


@dataclass(frozen=True, slots=True)
class Start:
    """The start position of a vehicle: WGS-84 degrees, metres above mean sea level, degrees from
    true north, clockwise. `speed`: simulated seconds per second."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    heading_deg: float = 0.0
    speed: float = 1.0


@dataclass(frozen=True, slots=True)
class Launch:
    """The command of one program, in a folder of its own. `files`: the first content of the folder,
    by name; `environment`: variables in addition to those of m2pem."""

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def ardupilot_launch(
    name: str,
    program: ArduPilotProgram,
    frame: Frame,
    start: Start,
    *,
    instance: int,
    system_id: int,
    ports: Sequence[int],
    parameters: Mapping[str, float] | None = None,
) -> Launch:
    """Start ArduPilot, which sends to `ports` of 127.0.0.1 (three at most), and waits for no
    connection. `instance` must differ between programs of a machine. `parameters` go before those
    of the program."""
    files = {file.name: file.read_text(encoding="utf-8") for file in program.parameters}
    if parameters:
        files[OWN_PARAMETERS] = "".join(
            f"{parameter} {value:g}\n" for parameter, value in parameters.items()
        )
    home = (start.latitude_deg, start.longitude_deg, start.altitude_m, start.heading_deg)
    command = (
        *(str(program.path), "-w", "--model", frame.name, "--speedup", f"{start.speed:g}"),
        *(f"-I{instance}", "--sysid", str(system_id)),
        *("--home", ",".join(f"{value:.10g}" for value in home)),
        *("--defaults", ",".join(files)),
        *_serials(ports),
    )
    return Launch(name, command, {}, files)


def _serials(ports: Sequence[int]) -> Iterator[str]:
    for number, serial in enumerate(SERIALS):
        to = f"udpclient:127.0.0.1:{ports[number]}" if number < len(ports) else f"none:{serial}"
        yield from (f"--serial{serial}", to)


def px4_launch(
    name: str,
    program: Px4Program,
    model: str,
    start: Start,
    *,
    instance: int,
    folder: Path,
    parameters: Mapping[str, float] | None = None,
) -> Launch:
    """Start PX4 with its own simulation (SIH). Its system id is `instance` + 1, and it sends to
    `px4_port(instance)`; `folder`: where it is started."""
    environment = {
        "PX4_SIMULATOR": "sihsim",
        "PX4_SIM_MODEL": model,
        "PX4_SIM_SPEED_FACTOR": f"{start.speed:g}",
        "PX4_HOME_LAT": f"{start.latitude_deg:.10g}",
        "PX4_HOME_LON": f"{start.longitude_deg:.10g}",
        "PX4_HOME_ALT": f"{start.altitude_m:.10g}",
        "PX4_HOME_YAW": f"{start.heading_deg:.10g}",
        **{f"PX4_PARAM_{key}": f"{value:g}" for key, value in (parameters or {}).items()},
    }
    command = (str(program.path), "-d", "-i", str(instance), "-w", str(folder), str(program.etc))
    return Launch(name, command, environment)


def px4_port(instance: int) -> int:
    """Return the port of an instance of PX4 for programs such as m2pem (its API link)."""
    return 14540 + instance if instance < 10 else 14549


OUTPUT = "output"
"""The file with what a program prints."""

ENDS_WITHIN_S = 10.0
"""Seconds between SIGTERM and SIGKILL."""

LOOK_EVERY_S = 0.2
LAST_LINES = 12
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


@dataclass(frozen=True, slots=True)
class Program:
    """A started program."""

    name: str
    process: subprocess.Popen[bytes]
    folder: Path

    def how_it_ended(self) -> str:
        """Return how the program ended, with the last lines that it printed."""
        status = self.process.poll()
        if status is None:
            return f"{self.name} (pid {self.process.pid}) runs"
        how = f"with status {status}" if status >= 0 else f"by {signal.Signals(-status).name}"
        said = (self.folder / OUTPUT).read_text(encoding="utf-8", errors="replace").splitlines()
        lines = "".join(f"\n    {line}" for line in said[-LAST_LINES:])
        return f"{self.name} (pid {self.process.pid}) has ended {how}; " + (
            f"it printed last:{lines}" if lines else "it printed nothing"
        )


@contextmanager
def running(launches: Iterable[Launch], folder: Path) -> Iterator[list[Program]]:
    """Run the programs in `folder` / their names, then end them: SIGTERM, then SIGKILL. They also
    end with this process.

    Raises:
        OSError: a folder is there already, or a program cannot be started; none is left running.
    """
    programs: list[Program] = []
    try:
        for launch in launches:
            programs.append(_start(launch, folder / launch.name))
        yield programs
    finally:
        _end(programs)


async def first_to_end(programs: Sequence[Program]) -> Program:
    """Wait until one of the programs has ended."""
    while True:
        for program in programs:
            if program.process.poll() is not None:
                return program
        await asyncio.sleep(LOOK_EVERY_S)


def _start(launch: Launch, folder: Path) -> Program:
    folder.mkdir(parents=True)
    for name, text in launch.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    with (folder / OUTPUT).open("wb") as output:
        process = subprocess.Popen(
            launch.command,
            cwd=folder,
            env={**os.environ, **launch.environment},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C of a terminal is for m2pem, which ends them
            preexec_fn=_end_with_parent,  # noqa: PLW1509  # it takes no lock
        )
    return Program(launch.name, process, folder)


def _end_with_parent() -> None:
    """Make the kernel end this process with its parent (Linux): after an m2pem that was killed, no
    vehicle continues to send to its port."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _end(programs: Sequence[Program]) -> None:
    running_ones = [each for each in programs if each.process.poll() is None]
    for each in running_ones:
        _signal(each, signal.SIGTERM)
        _signal(each, signal.SIGCONT)  # a stopped process does not end otherwise
    until_s = time.monotonic() + ENDS_WITHIN_S
    for each in running_ones:
        with suppress(subprocess.TimeoutExpired):
            each.process.wait(max(until_s - time.monotonic(), 0.0))
        if each.process.poll() is None:
            _signal(each, signal.SIGKILL)
            each.process.wait()


def _signal(program: Program, number: signal.Signals) -> None:
    """Signal the process group of a program: PX4 has a shell for its start script."""
    with suppress(ProcessLookupError):
        os.killpg(program.process.pid, number)
