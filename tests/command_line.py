"""The command line as people use it: as a process of its own, with pipes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, TextIO

from tests.preloaded import Preloaded, Process, preloaded

REPOSITORY = Path(__file__).parents[1]
MISSION = REPOSITORY / "missions" / "vignette1.bpmn"
FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
ANSWERS = REPOSITORY / "missions" / "answers"

BLOCKING = """
import asyncio, signal, time

def block():
    time.sleep(3600)

def soon(*_):
    asyncio.get_running_loop().call_soon_threadsafe(block)

signal.signal(signal.SIGUSR1, soon)
"""
"""A plugin that blocks the event loop of its process after a signal."""

Record = dict[str, Any]
AnyProcess = Process | subprocess.Popen[bytes]


@dataclass
class Program:
    """A running m2pem. What it has printed so far is in `lines`."""

    process: AnyProcess
    stdin: TextIO
    stdout: TextIO
    stderr: TextIO
    lines: list[str] = field(default_factory=list)

    def type(self, line: str) -> None:
        """What an operator types."""
        self.stdin.write(f"{line}\n")
        self.stdin.flush()

    def end_input(self) -> None:
        self.stdin.close()

    def until(self, wanted: Callable[[str], bool]) -> str:
        """Read until a line is printed that is wanted."""
        for line in self.stdout:
            self.lines.append(line.rstrip("\n"))
            if wanted(self.lines[-1]):
                return self.lines[-1]
        raise AssertionError(f"it ended before that line came: {self.lines} {self.rest()}")

    def until_text(self, text: str) -> str:
        return self.until(lambda line: text in line)

    def until_record(self, name: str, **fields: object) -> Record:
        """Read until a record is printed that has these fields."""

        def wanted(line: str) -> bool:
            record = json.loads(line)
            return {"record": name, **fields}.items() <= record.items()

        found: Record = json.loads(self.until(wanted))
        return found

    def until_said(self, text: str) -> str:
        """Read standard error until a line of it has this text."""
        for line in self.stderr:
            if text in line:
                return line
        raise AssertionError(f"it ended before it said {text!r}: {self.rest()}")

    def send(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        """Kill it, and read what it had printed."""
        self.process.kill()
        self.rest()

    def rest(self) -> tuple[int, str]:
        """Read to the end: its exit status, and what it said on standard error."""
        # Not `communicate`, which overlooks what `until` has read ahead.
        self.lines += self.stdout.read().splitlines()
        errors = self.stderr.read()
        return self.process.wait(), errors

    @property
    def records(self) -> list[Record]:
        return [json.loads(line) for line in self.lines]


class CommandLine:
    """m2pem with a home and a working folder of its own.

    `forked_from`: the process from which m2pem is forked; None: the one that all tests share.
    """

    def __init__(
        self,
        folder: Path,
        environment: dict[str, str] | None = None,
        forked_from: Preloaded | None = None,
    ) -> None:
        self.folder = folder
        self._forked_from = forked_from
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("XDG_")},
            "HOME": str(folder),
            "PYTHONPATH": str(REPOSITORY),
            **(environment or {}),
        }
        self._started: list[Program] = []

    def start(self, *words: str | Path, **environment: str) -> Program:
        """Start it, with pipes for everything."""
        (stdin, ours), (out, stdout), (err, stderr) = os.pipe(), os.pipe(), os.pipe()
        process = self._start(words, environment, (stdin, stdout, stderr))
        for theirs in (stdin, stdout, stderr):
            os.close(theirs)
        pipes = os.fdopen(ours, "w"), os.fdopen(out), os.fdopen(err)
        self._started.append(Program(process, *pipes))
        return self._started[-1]

    def start_other(self, *command: str | Path) -> Program:
        """Start another program as this one, with pipes for everything."""
        pipe = subprocess.PIPE
        pipes = {"stdin": pipe, "stdout": pipe, "stderr": pipe}
        words = [*map(str, command)]
        process = subprocess.Popen(words, cwd=self.folder, env=self.environment, text=True, **pipes)
        self._started.append(Program(process, process.stdin, process.stdout, process.stderr))
        return self._started[-1]

    def start_on(self, inside: Sequence[str], *words: str | Path) -> Program:
        """Start it after the words that lead to another host (`bench.network`); none: to this."""
        if not inside:
            return self.start(*words)
        return self.start_other(*inside, sys.executable, "-m", "m2pem", *words)

    def run(self, *words: str | Path, **environment: str) -> tuple[int, str, str]:
        """Run it to its end with no input: exit status, standard output, standard error."""
        with (
            Path(os.devnull).open() as nothing,
            TemporaryFile("w+") as output,
            TemporaryFile("w+") as errors,
        ):
            streams = nothing.fileno(), output.fileno(), errors.fileno()
            status = self._start(words, environment, streams).wait()
            output.seek(0)
            errors.seek(0)
            return status, output.read(), errors.read()

    def _start(
        self,
        words: Sequence[str | Path],
        environment: dict[str, str],
        streams: tuple[int, int, int],
    ) -> AnyProcess:
        variables = {**self.environment, **environment}
        if any(name.startswith("PYTHON") and name != "PYTHONPATH" for name in environment):
            # Python itself reads these when it starts.
            return subprocess.Popen(
                [sys.executable, "-m", "m2pem", *map(str, words)],
                **dict(zip(("stdin", "stdout", "stderr"), streams, strict=True)),
                cwd=self.folder,
                env=variables,
            )
        return (self._forked_from or preloaded()).start(
            [*map(str, words)], self.folder, variables, streams
        )

    def end(self) -> None:
        """Leave nothing running."""
        for program in self._started:
            if program.process.poll() is None:
                program.process.kill()
            program.process.wait()
            for pipe in (program.stdin, program.stdout, program.stderr):
                pipe.close()


def command_line(folder: Path) -> Iterator[CommandLine]:
    """For a fixture."""
    made = CommandLine(folder)
    yield made
    made.end()


def fleet_with_state(folder: Path) -> tuple[Path, Path]:
    """A copy of the fleet of vignette 1 that keeps its vehicles in a file: both."""
    state = folder / "vehicles.state"
    shutil.copytree(FLEET.parent, folder / "fleets")
    fleet = folder / "fleets" / FLEET.name
    text = fleet.read_text(encoding="utf-8")
    fleet.write_text(text.replace("connection: {", f"connection: {{state: {state}, "))
    return fleet, state


def install_plugin(folder: Path, name: str, code: str) -> dict[str, str]:
    """A plugin in a folder of its own; answers with the environment that has it."""
    module = f"m2pem_plugin_{name}"
    (folder / f"{module}.py").write_text(f"from m2pem import hookimpl\n{code}")
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: m2pem-plugin-{name}\nVersion: 1.0\n"
    )
    (info / "entry_points.txt").write_text(f"[m2pem]\n{name} = {module}\n")
    return {"PYTHONPATH": f"{REPOSITORY}{os.pathsep}{folder}"}
