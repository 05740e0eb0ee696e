"""What the one-shot commands share: they ask an executive that runs on this host, and end."""

from typing import Any

import click

by_option = click.option(
    "--by", metavar="NAME", help="Who asks, for the journal  [default: user@host]"
)


def steer(journal_url: str | None, run: str, method: str, by: str | None, **params: Any) -> None:
    """Call a method of the executive that drives the run.

    Raises:
        OperatorError: it refused, or none drives the run.
        UnusableError: the journal is in memory.
    """
    from m2pem.api.operator import operator_name
    from m2pem.cli.journals import url_of
    from m2pem.cli.options import UnusableError
    from m2pem.control_socket.client import ask_driver
    from m2pem.journal import file_of

    path = file_of(url_of(journal_url))
    if path is None:
        raise UnusableError("a journal in memory has no place where its executive could be found")
    ask_driver(path, run, method, by=by or operator_name(), **params)
