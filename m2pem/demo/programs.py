"""The programs that a demonstration starts: vehicles, an executive, an operator."""

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType

from m2pem.errors import OperatorError

ENDS_WITHIN_S = 30.0
"""A program that runs on so long after SIGTERM gets SIGKILL."""


class Programs:
    """Programs that end with the `with` block, the one that was started last first.

    An executive is started after its vehicles. So it ends before them and leaves them in good
    order. Ctrl-C in a terminal interrupts the demonstration alone, which then ends its programs.
    """

    def __init__(self, variables: Mapping[str, str] | None = None) -> None:
        self._environment = {**os.environ, **(variables or {})}
        self._processes: list[subprocess.Popen[str]] = []

    def __enter__(self) -> "Programs":
        signal.signal(signal.SIGTERM, _interrupt)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for process in reversed(self._processes):
            process.terminate()
            try:
                process.wait(ENDS_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, words: Sequence[str | Path], ready: str = "", quiet: bool = False) -> None:
        """Start a program in the background; return when it has printed the line `ready`.

        Lines before that line are printed, unless `quiet`; lines after it are not.

        Raises:
            OperatorError: the program ended before it printed the line.
        """
        output = subprocess.PIPE if ready else (subprocess.DEVNULL if quiet else None)
        process = self._popen(words, output)
        if not ready:
            return
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            if line.rstrip("\n") == ready:
                # A program that writes into a full pipe waits for ever.
                threading.Thread(target=process.stdout.read, daemon=True).start()
                return
        raise OperatorError(
            f"'{' '.join(map(str, words))}' ended with status {process.wait()} before it was ready"
        )

    def collect(self, words: Sequence[str | Path], ready: str) -> "Collected":
        """Start a program and wait for its line `ready`; its later output is kept.

        Raises:
            OperatorError: the program ended before it printed the line.
        """
        process = self._popen(words, subprocess.PIPE)
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            if line.rstrip("\n") == ready:
                return Collected(process)
        raise OperatorError(f"'{' '.join(map(str, words))}' ended with status {process.wait()}")

    def run(self, words: Sequence[str | Path]) -> int:
        """Run a program in the foreground, and return its exit status."""
        process = subprocess.Popen(list(map(str, words)), env=self._environment)
        try:
            return process.wait()
        except BaseException:
            process.send_signal(signal.SIGINT)
            process.wait(ENDS_WITHIN_S)
            raise

    def _popen(self, words: Sequence[str | Path], output: int | None) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            list(map(str, words)),
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            text=True,
            preexec_fn=_ignore_interrupts,  # noqa: PLW1509  # it takes no lock
        )
        self._processes.append(process)
        return process


class Collected:
    """The output of a program that runs until it has measured what it is to measure."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        self._lines.extend(self._process.stdout)

    def finish(self) -> int:
        """Wait for the end of the program, print its output, and return its exit status."""
        status = self._process.wait()
        self._reader.join()
        print("".join(self._lines), end="", flush=True)
        return status


def m2pem(*words: str | Path) -> list[str]:
    """Return the words of a command of m2pem, for this Python."""
    return [sys.executable, "-m", "m2pem", *map(str, words)]


def copy_once(source: Path, folder: Path) -> None:
    """Copy a file into a folder, unless the folder has one of that name."""
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / source.name).exists():
        shutil.copy(source, folder)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
