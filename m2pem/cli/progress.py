"""A progress bar for long work, on standard error, for a person who looks."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

import click

Progress: TypeAlias = Callable[[int], None]
"""Called with how much more has been done."""

LONG = 10_000
"""Less than this is done before anybody has read the bar."""


@contextmanager
def progress(label: str, length: int, *, shown: bool = True) -> Iterator[Progress]:
    """A bar that fills within the block; none when it is short work or nobody looks."""
    if not shown or length < LONG or not sys.stderr.isatty():
        yield lambda _: None
        return
    with click.progressbar(length=length, label=label, file=sys.stderr) as bar:
        yield bar.update
