"""Run Spin, a C compiler, and the checker that Spin writes, in a temporary folder.

Spin writes a program in C for each model. tcc compiles it in an instant. gcc takes longer than its
optimization saves, unless the search is long: then gcc compiles the same code while the search
runs, and the optimized checker starts again. Every program is ended when its time is over, and when
a person interrupts.
"""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from m2pem.errors import InternalError, M2pemError

LONG_SEARCH_S = 2.0
"""Seconds after which a search is worth compiling with optimization."""
_COMPILE_S = 120.0
_QUICK = "tcc"
_THOROUGH = ("gcc", "cc", "clang")
_POLL_S = 0.02
_AS_WRITTEN = ("-o1", "-o2")
"""Keep variables that are never read in the states, so that states are counted as they are."""
_ENDING_S = 10.0
"""Seconds that a checker may take to print its summary when it is ended."""


class SpinMissingError(M2pemError):
    """Spin, or a C compiler, is not installed."""

    exit_status = 2


class TooLongError(M2pemError):
    """Spin, or a compiler, takes too long for a model."""


@dataclass(frozen=True, slots=True)
class Tools:
    """The programs. One of the compilers may be missing."""

    spin: str
    quick: str | None
    thorough: str | None

    @classmethod
    def find(cls) -> "Tools":
        """Find the programs on the path.

        Raises:
            SpinMissingError: a program is missing; says what to install.
        """
        spin = shutil.which("spin")
        quick = shutil.which(_QUICK)
        thorough = next((path for each in _THOROUGH if (path := shutil.which(each))), None)
        if spin is None:
            raise SpinMissingError(
                "Spin is not installed: install it (Debian and Ubuntu: `apt-get install spin tcc`),"
                " or leave out --engine spin"
            )
        if quick is None and thorough is None:
            raise SpinMissingError(
                "Spin needs a C compiler, and there is none: install one (Debian and Ubuntu: "
                "`apt-get install tcc`), or leave out --engine spin"
            )
        return cls(spin, quick, thorough)


@dataclass(frozen=True, slots=True)
class CheckerOutput:
    """The output of a checker. `ended`: why m2pem ended it, "" if it finished by itself."""

    text: str
    ended: str


Watching = Callable[[str, float], str]
"""Given the output so far, and the seconds: why to end the search, or ""."""


class CheckerFolder:
    """A temporary folder with a model's checker. Use it as a context manager."""

    MODEL = "mission.pml"

    def __init__(self, tools: Tools | None = None) -> None:
        self.tools = tools or Tools.find()
        self._folder = tempfile.TemporaryDirectory(prefix="m2pem-spin-")
        self.folder = Path(self._folder.name)
        # A compiler that is killed leaves its own temporary files behind.
        self._environment = {**os.environ, "TMPDIR": str(self.folder)}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._folder.cleanup()

    def generate(self, text: str) -> None:
        """Have Spin write the checker of a model."""
        for old in self.folder.iterdir():
            old.unlink()
        (self.folder / self.MODEL).write_text(text, encoding="utf-8")
        done = self._run([self.tools.spin, "-a", *_AS_WRITTEN, self.MODEL])
        if not (self.folder / "pan.c").exists() or "Error" in done:
            raise InternalError(f"Spin does not take the model: {done.strip()[-500:]}")

    def search(
        self, defines: Sequence[str], arguments: Sequence[str], watch: Watching
    ) -> CheckerOutput:
        """Compile the checker and run it until it finishes, or until `watch` ends it."""
        first = self.tools.quick or self.tools.thorough
        assert first is not None
        optimizing = "-O1" if first == self.tools.thorough else "-w"
        self._compile(first, optimizing, defines, "pan")
        better = self.tools.thorough if first == self.tools.quick else None
        running: list[subprocess.Popen[bytes]] = []
        try:
            return self._watch(running, better, defines, arguments, watch)
        finally:
            for each in running:
                _end(each)

    def _watch(
        self,
        running: list[subprocess.Popen[bytes]],
        better: str | None,
        defines: Sequence[str],
        arguments: Sequence[str],
        watch: Watching,
    ) -> CheckerOutput:
        began = time.monotonic()
        printed = self.folder / "printed"
        checker = self._start_checker(["./pan", *arguments], printed)
        running.append(checker)
        compiler: subprocess.Popen[bytes] | None = None
        try:
            while checker.poll() is None:
                try:
                    checker.wait(_POLL_S)
                    break
                except subprocess.TimeoutExpired:
                    pass
                seconds = time.monotonic() - began
                if ended := watch(_read(printed), seconds):
                    return self._sum_up(checker, printed, ended)
                if better and compiler is None and seconds > LONG_SEARCH_S:
                    command = [better, "-O2", "-w", *defines, "-o", "pan2", "pan.c"]
                    compiler = self._start(command, self.folder / "compiled")
                    running.append(compiler)
                elif compiler is not None and compiler.poll() == 0 and better:
                    better = None
                    _end(checker)
                    checker = self._start_checker(["./pan2", *arguments], printed)
                    running.append(checker)
        except KeyboardInterrupt:
            return self._sum_up(checker, printed, INTERRUPTED)
        return CheckerOutput(_read(printed), "")

    def _sum_up(self, checker: "subprocess.Popen[bytes]", printed: Path, why: str) -> CheckerOutput:
        """Interrupt a checker: it then prints what it has seen."""
        checker.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            checker.wait(_ENDING_S)
        return CheckerOutput(_read(printed), why)

    def trail(self, number: int = 0) -> str:
        """The steps to an error that the checker found, as Spin prints them; "" if there is none.

        `number`: from 1 on, if there are several.
        """
        file = f"{self.MODEL}{number or ''}.trail"
        if not (self.folder / file).exists():
            return ""
        return self._run([self.tools.spin, "-t", "-p", "-k", file, self.MODEL])

    def _compile(self, compiler: str, optimizing: str, defines: Sequence[str], to: str) -> None:
        said = self._run([compiler, optimizing, "-w", *defines, "-o", to, "pan.c"])
        if not (self.folder / to).exists():
            raise InternalError(f"{compiler} does not compile what Spin wrote: {said[-500:]}")

    def _run(self, command: Sequence[str]) -> str:
        try:
            done = subprocess.run(
                command,
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=_COMPILE_S,
                check=False,
                start_new_session=True,
            )
        except subprocess.TimeoutExpired:
            name = Path(command[0]).name
            raise TooLongError(f"{name} takes longer than {_COMPILE_S:.0f} s") from None
        return done.stdout.decode(errors="replace")

    def _start_checker(self, command: Sequence[str], printed: Path) -> "subprocess.Popen[bytes]":
        """Start a checker without the trails of the one before, which may have been ended while it
        wrote one of them."""
        for old in self.folder.glob("*.trail"):
            old.unlink()
        return self._start(command, printed)

    def _start(self, command: Sequence[str], printed: Path) -> "subprocess.Popen[bytes]":
        """Start a program in a session of its own: Ctrl-C reaches only this process, which then
        ends the program.
        """
        with printed.open("wb") as file:
            return subprocess.Popen(
                command,
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )


INTERRUPTED = "interrupted"


def _read(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace")


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a program with those that it started: a compiler is several programs."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
