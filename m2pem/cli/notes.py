"""Notes and the progress of long work, on standard error. `m2pem --quiet` turns both off.

Errors, alerts and all that concerns vehicles are no notes: they are printed in any case.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

import click

AFTER_S = 2.0
"""Shorter work shows no progress."""
BETWEEN_S = 0.2
ERASE = "\r\033[K"

Show: TypeAlias = Callable[[Callable[[], str]], None]
"""Called often; calls its argument for the text, when it is time to show one."""


def is_quiet() -> bool:
    """Whether the command line has `--quiet`."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.find_root().params.get("quiet"))


def note(text: str) -> None:
    """Print a note, unless the command line has `--quiet`."""
    if not is_quiet():
        say(text, logging.INFO)


def say(text: str, level: int = logging.ERROR) -> None:
    """Print a text of m2pem to standard error; a line of the log if that is JSON."""
    handlers = logging.getLogger("m2pem").handlers
    if handlers and getattr(handlers[0].formatter, "makes_json", False):
        text = text.removeprefix("m2pem: ")
        handlers[0].handle(logging.LogRecord("m2pem", level, "", 0, "%s", (text,), None))
    else:
        print(text, file=sys.stderr, flush=True)


def shows_progress() -> bool:
    """Whether a person may look: standard error is a terminal, and there is no `--quiet`."""
    return sys.stderr.isatty() and not is_quiet()


@contextmanager
def progress_line(*, wanted: bool = True) -> Iterator[Show]:
    """Show on one line how far work is within the block, if it takes long; erase it in the end.

    `wanted` False: the results themselves show it.
    """
    if not (wanted and shows_progress()):
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
