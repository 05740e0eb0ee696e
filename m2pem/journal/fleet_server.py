"""Which executive serves a fleet: on a journal, one at a time."""

import os
import shlex
import socket
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec

from m2pem.errors import FleetServedError
from m2pem.journal.postgres_address import without_password


@dataclass(frozen=True, slots=True)
class FleetServer:
    """An executive that serves a fleet. `pid` 0: it has just begun, and is not known yet.

    `digest`: of the fleet's content, see `digest_of`; "": not known. `page`: the address of its web
    page; "": it has none. `left_s`: for how long its lease lasts if it is not renewed, in seconds;
    None: it has none.
    """

    host: str = ""
    pid: int = 0
    command: str = ""
    digest: str = ""
    page: str = ""
    left_s: float | None = None

    @property
    def is_here(self) -> bool:
        """Whether it is on this host."""
        return self.host in ("", socket.gethostname())

    def __str__(self) -> str:
        if not self.pid:
            return "another executive, which has just begun,"
        return f"process {self.pid} on {self.host} ({self.command})"

    def refusal(self, fleet: str) -> FleetServedError:
        """Return the error of another executive that wants to serve the fleet, too."""
        return FleetServedError(
            f"{self} serves {fleet} already: on a journal, one executive serves a fleet"
        )


def this_process(digest: str, page: str) -> FleetServer:
    """How others name this executive."""
    return FleetServer(socket.gethostname(), os.getpid(), command_line(), digest, page)


def command_line() -> str:
    """The command line of this process, as a person would type it; never a password."""
    program = Path(sys.argv[0])
    name = "m2pem" if program.name in ("m2pem", "__main__.py") else str(program)
    return without_password(shlex.join([name, *sys.argv[1:]]))


def encode(server: FleetServer) -> bytes:
    """Write it as JSON."""
    return msgspec.json.encode(asdict(server))


def decode(text: bytes) -> FleetServer:
    """Read what `encode` wrote; what is no such text is an executive that has just begun."""
    try:
        return msgspec.json.decode(text, type=FleetServer)
    except msgspec.DecodeError:
        return FleetServer()
