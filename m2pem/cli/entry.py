"""Runs the command line: every way in which it can end becomes a message and an exit status."""

import logging
import os
import sys
from collections.abc import Sequence

import click

from m2pem.cli.group import cli
from m2pem.errors import M2pemError
from m2pem.findings import escaped

STOPPED = 130
"""Exit status when an operator stopped it (a shell's 128 + SIGINT)."""


def run_command_line(arguments: Sequence[str] | None = None) -> int:
    """Carry out a command line (that of the process by default); returns the exit status.

    0 well, 1 failed, 2 unusable input, 130 stopped. No exception comes out but with `--debug`.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        result = cli.main(words, prog_name="m2pem", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        return STOPPED
    except BrokenPipeError:
        ignore_closed_stdout()
        return 1
    except M2pemError as error:
        if _debugging():
            logging.getLogger("m2pem").exception("it ended with this error")
        click.echo(f"m2pem: {escaped(str(error), keep=chr(10))}", err=True)
        return error.exit_status
    except Exception as error:
        if _debugging():
            raise
        what = " ".join(f"{type(error).__name__}: {error}".split())
        click.echo(
            f"m2pem: this is a bug in m2pem: {what}\n"
            "Please report it, with what `m2pem --debug` and the same command print.",
            err=True,
        )
        return 1
    return result if isinstance(result, int) else 0


def ignore_closed_stdout() -> None:
    """Nobody reads what is printed any more; the interpreter must not complain at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


def _debugging() -> bool:
    return logging.getLogger("m2pem").isEnabledFor(logging.DEBUG)
