"""What the one-shot commands share: they ask an executive that runs on this host, and end."""

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

by_option = click.option(
    "--by", metavar="NAME", help="Who asks, for the journal  [default: user@host]"
)


def steer(journal_url: str | None, run: str, method: str, by: str | None, **params: Any) -> None:
    """Call a method of the executive that drives the run.

    Raises:
        OperatorError: it refused, or none drives the run; then, what the run has left behind.
        UnusableError: the journal is in memory.
    """
    from m2pem.api.operator import operator_name
    from m2pem.control_socket.client import ask_driver
    from m2pem.errors import NotDrivenError

    path = _journal_file(journal_url)
    try:
        ask_driver(path, run, method, by=by or operator_name(), **params)
    except NotDrivenError as error:
        raise NotDrivenError(f"{error}{_left_behind(journal_url, path, run)}") from error


def steer_all(journal_url: str | None, method: str, by: str | None, **params: Any) -> list[str]:
    """Call a method of every executive on the journal, all at once; returns their answers together.

    Raises:
        OperatorError: an executive refused, or there is none.
        UnusableError: the journal is in memory.
    """
    from m2pem.api.operator import operator_name
    from m2pem.control_socket.client import ask_all
    from m2pem.errors import NotDrivenError

    path = _journal_file(journal_url)
    try:
        return ask_all(path, method, by=by or operator_name(), **params)
    except NotDrivenError as error:
        raise NotDrivenError(f"{error}{_left_behind(journal_url, path)}") from error


def _left_behind(journal_url: str | None, path: Path, run: str | None = None) -> str:
    """Lines on what interrupted runs have left behind: that of `run`, or (None) all."""
    from m2pem.cli.interrupted import interrupted_runs
    from m2pem.errors import M2pemError

    left = []
    if path.exists():
        with suppress(M2pemError):  # what the executive refused matters more
            left = asyncio.run(interrupted_runs(journal_url))
    return "".join(f"\n{each.as_text()}" for each in left if run in (None, each.run))


def _journal_file(journal_url: str | None) -> Path:
    from m2pem.cli.journals import url_of
    from m2pem.cli.options import UnusableError
    from m2pem.journal import file_of

    path = file_of(url_of(journal_url))
    if path is None:
        raise UnusableError("a journal in memory has no place where its executive could be found")
    return path
