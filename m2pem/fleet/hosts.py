"""Hosts: other computers on which the arbiters of vehicles run, beside their vehicles."""

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class WhenCutOff(StrEnum):
    """What a host does with a behavior while it has no contact with the executive."""

    CONTINUE = "continue"
    HOLD = "hold"
    END = "end"


@dataclass(frozen=True, slots=True)
class CutOffPolicy:
    """What the host of a vehicle does once it has had no contact for `after_s` seconds.

    `behaviors`: what is done with behaviors of these names, in place of `action`.
    """

    action: WhenCutOff = WhenCutOff.HOLD
    after_s: float = 10.0
    behaviors: Mapping[str, WhenCutOff] = field(default_factory=dict)

    def of(self, behavior: str) -> WhenCutOff:
        """Return what is done with behaviors of this name."""
        return self.behaviors.get(behavior, self.action)


@dataclass(frozen=True, slots=True)
class Host:
    """A computer that runs the arbiters of vehicles.

    `connect`: endpoints ("tls/10.0.0.7:7447") to which the executive connects; `listen`: where the
    executive listens, if the host connects to it. `telemetry_hz`: states of one resource in a
    second, at most. `round_trip_s`: the longest usual time from a request to its answer.
    `ca`, `certificate`, `key`: files of TLS (PEM). `credentials`: a file of lines "user:password".
    "": there is none.
    """

    name: str
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    telemetry_hz: float = 4.0
    round_trip_s: float = 1.0
    ca: str = ""
    certificate: str = ""
    key: str = ""
    credentials: str = ""
    line: int = 0


_ENDPOINT = re.compile(r"(tcp|tls)/(\[[0-9a-fA-F:]+\]|[^\s\[\]/:]+):([0-9]{1,5})")


def endpoint_problem(endpoint: str, *, authenticated: bool) -> tuple[str, str]:
    """Return what is wrong with an endpoint, and the remedy; ("", "") if nothing is.

    `authenticated`: the end that listens has a certificate; the other has one, or a password.
    """
    found = _ENDPOINT.fullmatch(endpoint)
    if found is None or not 0 < int(found[3]) < 65536:
        return f"'{endpoint}' is no endpoint", "write tls/ADDRESS:PORT, or tcp/127.0.0.1:PORT"
    protocol, address = found[1], found[2].strip("[]")
    if _is_loopback(address):
        return "", ""
    if protocol != "tls" or not authenticated:
        return (
            f"'{endpoint}' is no address of this host alone, and anyone there could command",
            "write tls/ for tcp/, with 'tls: {ca, certificate, key}'; or use 127.0.0.1",
        )
    return "", ""


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"
