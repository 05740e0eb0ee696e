"""The line of each property and requirement, printed while `m2pem verify` searches."""

import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from m2pem.cli.notes import ERASE, shows_progress
from m2pem.verify.properties.results import Result
from m2pem.verify.report.text import Paint, result_lines

AFTER_S = 0.5
"""The lines of a shorter search are printed together, in the order of the properties."""


class ResultLines:
    """Prints the lines of results as soon as they are certain.

    `names`: of all properties and requirements, in their order. `printed`: those with a line.
    """

    def __init__(self, names: Sequence[str], paint: Paint, *, strict: bool) -> None:
        self.printed: set[str] = set()
        self._names = list(names)
        self._width = max(map(len, names))
        self._paint, self._strict = paint, strict
        self._held: list[Result] = []
        self._from_s = time.monotonic() + AFTER_S

    def decided(self, result: Result) -> None:
        """Print the line of a result, now or when the search has taken long enough."""
        self._held.append(result)
        self.look()

    def look(self) -> None:
        """Print what is held, if it is time."""
        if not self._held or time.monotonic() < self._from_s:
            return
        with _without_interruption():
            if shows_progress():
                print(ERASE, end="", file=sys.stderr, flush=True)
            for result in sorted(self._held, key=lambda each: self._names.index(each.property)):
                for line in result_lines(result, self._width, self._paint, strict=self._strict):
                    click.echo(line)
                self.printed.add(result.property)
            sys.stdout.flush()
            self._held.clear()


@contextmanager
def _without_interruption() -> Iterator[None]:
    """Let Ctrl-C wait until a line is printed and noted, so that it is not printed again."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
