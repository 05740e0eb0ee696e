"""m2pem at a terminal, where keys are pressed: a pseudo-terminal that is its controlling one."""

import os
import re
import select
import time
from pathlib import Path
from typing import Self

from tests.command_line import REPOSITORY
from tests.preloaded import preloaded

CTRL_C = b"\x03"
PATIENCE_S = 60.0
"""Longer than anything takes here, on a machine that does much else."""


class Terminal:
    """A program whose standard error, and if wanted output, is a terminal. Close it at the end.

    `shown` is what the terminal was told to show so far; `results` the file that standard output
    goes to, if it does not go to the terminal.
    """

    def __init__(
        self,
        folder: Path,
        *words: str | Path,
        results: Path | None = None,
        **environment: str,
    ) -> None:
        self.shown = ""
        self._ours, theirs = os.openpty()
        output = results.open("wb") if results is not None else None
        here = {name: value for name, value in os.environ.items() if not name.startswith("XDG_")}
        variables = {"HOME": str(folder), "TERM": "xterm", "PYTHONPATH": str(REPOSITORY)}
        self.process = preloaded().start(
            [*map(str, words)],
            folder,
            {**here, **variables, **environment},
            (theirs, output.fileno() if output is not None else theirs, theirs),
            at_terminal=True,
        )
        os.close(theirs)
        if output is not None:
            output.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._ours)

    def press(self, keys: bytes) -> None:
        os.write(self._ours, keys)

    def until(self, pattern: str) -> re.Match[str]:
        """Read until the pattern is shown."""
        deadline = time.monotonic() + PATIENCE_S
        while not (found := re.search(pattern, self.shown)):
            assert self._read(deadline), f"ended without {pattern!r}: {self.shown}"
        return found

    def rest(self) -> int:
        """Read to the end: the exit status."""
        deadline = time.monotonic() + PATIENCE_S
        while self._read(deadline):
            pass
        return self.process.wait(PATIENCE_S)

    def _read(self, deadline: float) -> bool:
        ready, _, _ = select.select([self._ours], [], [], max(deadline - time.monotonic(), 0))
        assert ready, f"nothing more came in {PATIENCE_S:.0f} s: {self.shown}"
        try:
            more = os.read(self._ours, 65_536)
        except OSError:  # the last that had it open has ended
            return False
        self.shown += more.decode(errors="replace")
        return bool(more)
