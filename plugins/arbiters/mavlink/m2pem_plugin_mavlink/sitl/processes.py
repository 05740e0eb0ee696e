"""Programs that run until they are ended, each in a folder of its own."""

import asyncio
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from m2pem_plugin_mavlink.sitl.launch import Launch

OUTPUT = "output"
"""The file with what a program prints."""

ENDS_WITHIN_S = 10.0
"""A program that has not ended so long after SIGTERM gets SIGKILL."""

LOOK_EVERY_S = 0.2
LAST_LINES = 12
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


@dataclass(frozen=True, slots=True)
class Program:
    """A program that was started."""

    name: str
    process: subprocess.Popen[bytes]
    folder: Path

    def how_it_ended(self) -> str:
        """For people: how, and the last lines of what it printed."""
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
    """The programs, in `folder` / their names, until they are ended: SIGTERM, then SIGKILL. They
    end with this process, too, however it ends.

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
    """Have the kernel end this process with the one that has started it (Linux): an m2pem that is
    killed leaves no vehicle behind that goes on sending to its port."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _end(programs: Sequence[Program]) -> None:
    running_ones = [each for each in programs if each.process.poll() is None]
    for each in running_ones:
        _signal(each, signal.SIGTERM)
        _signal(each, signal.SIGCONT)  # one that was stopped does not end otherwise
    until_s = time.monotonic() + ENDS_WITHIN_S
    for each in running_ones:
        with suppress(subprocess.TimeoutExpired):
            each.process.wait(max(until_s - time.monotonic(), 0.0))
        if each.process.poll() is None:
            _signal(each, signal.SIGKILL)
            each.process.wait()


def _signal(program: Program, number: signal.Signals) -> None:
    """To its process group, as PX4 has a shell for its start script; it has one of its own."""
    with suppress(ProcessLookupError):
        os.killpg(program.process.pid, number)
