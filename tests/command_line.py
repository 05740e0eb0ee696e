"""The command line as people use it: as a process of its own, with pipes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[1]
MISSION = REPOSITORY / "missions" / "vignette1.bpmn"
FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
ANSWERS = REPOSITORY / "missions" / "answers"

Record = dict[str, Any]


@dataclass
class Program:
    """A running m2pem. What it has printed so far is in `lines`."""

    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)

    def type(self, line: str) -> None:
        """What an operator types."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def end_input(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()

    def until(self, wanted: Callable[[str], bool]) -> str:
        """Read until a line is printed that is wanted."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
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

    def send(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        """Kill it, and read what it had printed."""
        self.process.kill()
        self.rest()

    def rest(self) -> tuple[int, str]:
        """Read to the end: its exit status, and what it said on standard error."""
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        # Not `communicate`, which overlooks what `until` has read ahead.
        self.lines += self.process.stdout.read().splitlines()
        errors = self.process.stderr.read()
        return self.process.wait(), errors

    @property
    def records(self) -> list[Record]:
        return [json.loads(line) for line in self.lines]


class CommandLine:
    """m2pem with a home and a working folder of its own."""

    def __init__(self, folder: Path, environment: dict[str, str] | None = None) -> None:
        self.folder = folder
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("XDG_")},
            "HOME": str(folder),
            "PYTHONPATH": str(REPOSITORY),
            **(environment or {}),
        }
        self._started: list[Program] = []

    def start(self, *words: str | Path, **environment: str) -> Program:
        """Start it, with pipes for everything."""
        process = subprocess.Popen(
            [sys.executable, "-m", "m2pem", *map(str, words)],
            cwd=self.folder,
            env={**self.environment, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._started.append(Program(process))
        return self._started[-1]

    def run(self, *words: str | Path, **environment: str) -> tuple[int, str, str]:
        """Run it to its end with no input: exit status, standard output, standard error."""
        done = subprocess.run(
            [sys.executable, "-m", "m2pem", *map(str, words)],
            cwd=self.folder,
            env={**self.environment, **environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout, done.stderr

    def end(self) -> None:
        """Leave nothing running."""
        for program in self._started:
            if program.process.poll() is None:
                program.process.kill()
            program.process.wait()
            for pipe in (program.process.stdin, program.process.stdout, program.process.stderr):
                if pipe is not None:
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
