"""Checks of a host and of a running executive, as `m2pem doctor` and probes show them."""

import errno
import socket
from dataclasses import dataclass
from enum import StrEnum


class HealthStatus(StrEnum):
    """ERROR: it does not work like this. WARNING: it works, and may fail or mislead later."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class ExecutiveAddress:
    """Where an executive is. `page`: the address of its web page; "": it has none.

    `pid` 0: it has just begun, and is not known yet.
    """

    host: str
    pid: int
    page: str = ""

    def __str__(self) -> str:
        at = f" ({self.page})" if self.page else ""
        return f"process {self.pid} on {self.host}{at}"


@dataclass(frozen=True, slots=True)
class HealthCheck:
    """What was found about one thing. `remedy`: what to do about it; "" if it is right.

    `name` is short and stable: programs read it.
    """

    name: str
    status: HealthStatus
    message: str
    remedy: str = ""


def listening_check(name: str, host: str, port: int, kind: socket.SocketKind) -> HealthCheck:
    """Check that a program of this user can listen at an address, by doing so for a moment.

    `kind`: SOCK_DGRAM for UDP, SOCK_STREAM for TCP.
    """
    protocol = "UDP" if kind is socket.SOCK_DGRAM else "TCP"
    where = f"{protocol} {host}:{port}"
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=kind)[0]
        with socket.socket(family, kind) as listener:
            if kind is socket.SOCK_STREAM:  # a port of a program that has just ended is free
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            if kind is socket.SOCK_STREAM:
                listener.listen(1)
    except OSError as error:
        why = f"{where} cannot be opened: {error.strerror or error}"
        return HealthCheck(name, HealthStatus.ERROR, why, _port_remedy(error, protocol, port))
    return HealthCheck(name, HealthStatus.OK, f"{where} is free")


def _port_remedy(error: OSError, protocol: str, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        option = "-ulpn" if protocol == "UDP" else "-tlpn"
        return (
            f"ss {option} 'sport = :{port}' shows which program has it: end that one, or use "
            "another port. If it is an executive of m2pem, this host serves already"
        )
    if error.errno == errno.EADDRNOTAVAIL:
        return "this host does not have the address: `ip address` lists those that it has"
    if error.errno in (errno.EACCES, errno.EPERM):
        return "use a port of 1024 or above, which every user may open"
    if isinstance(error, socket.gaierror):
        return "write an IP address, or a name that this host can resolve"
    return "use another address"
