"""m2pem as people run it: executives and simulated vehicles in processes of their own, over DDS."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import m2pem_plugin_ros
from m2pem_plugin_ros import loopback

import m2pem

AMPLE_S = 60.0
"""So long may take what another process does, on a computer with much to do."""

LOOK_EVERY_S = 0.02
STOP_WITHIN_S = 20.0
SOURCES = (
    Path(m2pem.__file__).parents[1],
    Path(m2pem_plugin_ros.__file__).parents[1],
    Path(m2pem_plugin_ros.__file__).parents[3] / "ocu" / "mocu",
)

Record = dict[str, Any]


def until(true: Callable[[], Any], what: Callable[[], object], within_s: float = AMPLE_S) -> Any:
    """Wait until something is so; `what` says what there is instead."""
    deadline_s = time.monotonic() + within_s
    while not (value := true()):
        if time.monotonic() > deadline_s:
            raise AssertionError(f"not within {within_s:g} s: {what()}")
        time.sleep(LOOK_EVERY_S)
    return value


class Program:
    """A process; what it has printed is in `lines` and `errors`."""

    def __init__(self, words: list[str], folder: Path, environment: dict[str, str]) -> None:
        self.lines: list[str] = []
        self.errors: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, *words],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._readers = [
            threading.Thread(target=_read, args=(pipe, lines), daemon=True)
            for pipe, lines in (
                (self.process.stdout, self.lines),
                (self.process.stderr, self.errors),
            )
        ]
        for reader in self._readers:
            reader.start()

    @property
    def records(self) -> list[Record]:
        """What it has printed as JSON."""
        return [json.loads(line) for line in list(self.lines) if line.startswith("{")]

    def those(self, name: str, **fields: object) -> list[Record]:
        """The records of that name that have these fields."""
        wanted = {"record": name, **fields}.items()
        return [each for each in self.records if wanted <= each.items()]

    def until_record(self, name: str, count: int = 1, **fields: object) -> Record:
        """Wait until so many such records were printed; the last of them."""
        self.until(lambda: len(self.those(name, **fields)) >= count)
        return self.those(name, **fields)[-1]

    def until_line(self, text: str) -> None:
        """Wait until it has printed that, or said it on standard error."""
        self.until(lambda: any(text in line for line in [*self.lines, *self.errors]))

    def until(self, true: Callable[[], Any], within_s: float = AMPLE_S) -> Any:
        """Wait for something that it does."""

        def come() -> Any:
            ended = self.process.poll() is not None
            value = true()
            assert value or not ended, f"it has ended: {self.said}"
            return value

        return until(come, lambda: self.said, within_s)

    @property
    def said(self) -> str:
        """The last of what it printed, for people."""
        return "\n".join([f"({self.process.poll()})", *self.lines[-15:], *self.errors[-15:]])

    def type(self, line: str) -> None:
        """What an operator types."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def rest(self, within_s: float = AMPLE_S) -> int:
        """Wait for its end, and read all that it printed; its exit status."""
        try:
            status = self.process.wait(within_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"it does not end within {within_s:g} s: {self.said}") from None
        for reader in self._readers:
            reader.join()
        return status

    def kill(self) -> None:
        """End it as a power failure would."""
        self.process.kill()
        self.rest()

    def end(self) -> None:
        """Have it end, if it has not ended."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(STOP_WITHIN_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
        self.rest()
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()


def _read(pipe: Any, lines: list[str]) -> None:
    for line in pipe:
        lines.append(line.rstrip("\n"))


class Programs:
    """m2pem in a ROS domain, with a home, a working folder and a journal of its own."""

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder = folder
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("XDG_")},
            **loopback.environment(domain),
            "HOME": str(folder),
            "PYTHONPATH": os.pathsep.join(map(str, (*SOURCES, folder))),
        }
        self._started: list[Program] = []

    def m2pem(self, *words: object, **environment: str) -> Program:
        """Start it."""
        return self.python("-m", "m2pem", *words, **environment)

    def python(self, *words: object, **environment: str) -> Program:
        """Start a Python program."""
        variables = {**self.environment, **environment}
        self._started.append(Program([str(word) for word in words], self.folder, variables))
        return self._started[-1]

    def run(self, mission: Path, fleet: Path, speed: float, **environment: str) -> Program:
        """Start an executive that runs a mission and prints its records."""
        words = ("--fleet", fleet, "--speed", f"{speed:g}", "--ocu", "none", "--format", "json")
        return self.m2pem("run", mission, *words, **environment)

    def simulate(self, fleet: Path, speed: float, *words: object) -> Program:
        """Start the simulated vehicles of a fleet, and wait until they are there."""
        vehicles = self.m2pem("sim", "ros", "--fleet", fleet, "--speed", f"{speed:g}", *words)
        vehicles.until_line("ready")
        return vehicles

    def install(self, name: str, code: str) -> None:
        """Install a plugin of m2pem, for what is started from now on."""
        module = f"m2pem_plugin_{name}"
        (self.folder / f"{module}.py").write_text(f"from m2pem import hookimpl\n{code}")
        info = self.folder / f"{module}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: m2pem-plugin-{name}\nVersion: 1.0\n"
        )
        (info / "entry_points.txt").write_text(f"[m2pem]\n{name} = {module}\n")

    def end(self) -> None:
        """Leave nothing running; those that were started last end first."""
        for program in reversed(self._started):
            program.end()


@contextmanager
def programs(folder: Path, domain: int) -> Iterator[Programs]:
    """For a fixture."""
    made = Programs(folder, domain)
    try:
        yield made
    finally:
        made.end()
