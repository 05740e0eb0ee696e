"""One question to a running executive, for commands that ask and end."""

import socket
from pathlib import Path
from typing import Any

from m2pem.control_socket.place import ControlSocketError, live_sockets
from m2pem.control_socket.protocol import Request, line, result_of
from m2pem.errors import NotDrivenError, OperatorError

TIMEOUT_S = 10.0


def ask(path: Path, method: str, **params: Any) -> Any:
    """Call a method of the executive that listens at `path`.

    Raises:
        OperatorError: it refused.
        ControlSocketError: it is gone, or does not answer.
    """
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(TIMEOUT_S)
        try:
            caller.connect(str(path))
            caller.sendall(line(Request("2.0", method, params, id=1)))
            with caller.makefile("rb") as answers:
                return result_of(answers.readline())
        except OSError as error:
            raise ControlSocketError(f"the executive at {path} does not answer: {error}") from error


def ask_driver(journal: Path, run: str, method: str, **params: Any) -> Any:
    """Call a method of the executive that drives `run`, among those on the journal.

    Raises:
        OperatorError: it refused, or none drives the run.
        ControlSocketError: it is gone, or does not answer.
    """
    driven: list[str] = []
    for path in live_sockets(journal):
        try:
            return ask(path, method, run=run, **params)
        except NotDrivenError as error:
            driven.append(str(error))
    if driven:
        raise OperatorError("; ".join(driven))
    raise OperatorError(
        f"no executive with the journal {journal} is running here; "
        "name the journal of the one you mean with --journal"
    )
