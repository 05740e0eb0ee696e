"""The progress of long work: a line on the standard error of a terminal, erased in the end."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

AFTER_S = 2.0
"""Shorter work shows no progress."""
BETWEEN_S = 0.2
ERASE = "\r\033[K"

Show: TypeAlias = Callable[[Callable[[], str]], None]
"""Called often; calls its argument for the text, when it is time to show one."""


@contextmanager
def progress_line() -> Iterator[Show]:
    """Show how far work is within the block, if it takes long and standard error is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    next_s = time.monotonic() + AFTER_S
    shown = False

    def show(text: Callable[[], str]) -> None:
        nonlocal next_s, shown
        now_s = time.monotonic()
        if now_s >= next_s:
            next_s, shown = now_s + BETWEEN_S, True
            _write(f"{ERASE}{text()}")

    try:
        yield show
    finally:
        if shown:
            _write(ERASE)


def share(done: int, total: int, what: str) -> str:
    """Say how much of a known amount is done: "12,000 of 50,000 records (24 %)"."""
    return f"{done:,} of {total:,} {what} ({100 * done // max(total, 1)} %)"


def _write(text: str) -> None:
    print(text, end="", file=sys.stderr, flush=True)
