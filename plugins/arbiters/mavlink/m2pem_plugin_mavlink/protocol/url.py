"""URLs of vehicles, in the notation of MAVSDK.

udpin://HOST:PORT          listen; many vehicles may send here, and are answered where they are
udpout://HOST:PORT         send to one address, and receive its answers
tcpin://HOST:PORT          let vehicles connect
tcpout://HOST:PORT         connect, and again whenever the connection breaks
serial://PATH[:BAUDRATE]   a serial line: serial:///dev/ttyACM0:57600
"""

import re
from dataclasses import dataclass
from difflib import get_close_matches
from enum import StrEnum
from typing import TypeAlias

from m2pem.errors import PluginError

DEFAULT_BAUDRATE = 57_600
HIGHEST_BAUDRATE = 4_000_000


class UrlError(PluginError):
    """A URL that cannot be used; the message gives the remedy."""


class Way(StrEnum):
    """How a socket gets its peers."""

    UDP_IN = "udpin"
    UDP_OUT = "udpout"
    TCP_IN = "tcpin"
    TCP_OUT = "tcpout"


@dataclass(frozen=True, slots=True)
class SocketUrl:
    """`host` is a name or an IP address; one of IPv6 is without its brackets."""

    way: Way
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.way}://{host}:{self.port}"


@dataclass(frozen=True, slots=True)
class SerialUrl:
    """A serial line, 8 bits, no parity, one stop bit, no flow control."""

    path: str
    baudrate: int = DEFAULT_BAUDRATE

    def __str__(self) -> str:
        return f"serial://{self.path}:{self.baudrate}"


Url: TypeAlias = SocketUrl | SerialUrl

_SERIAL = "serial"
_SCHEMES = (*(str(way) for way in Way), _SERIAL)
_PARTS = re.compile(
    r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*):(?P<slashes>/{0,2})(?P<rest>.*)", re.DOTALL
)
_PLACE = re.compile(
    r"(?P<host>\[[0-9A-Fa-f:.%\w]+\]|[^:/?#\s\[\]]*)(?::(?P<port>[^/:]*))?(?P<more>/?)"
)
_DEVICE = re.compile(r"(?P<path>/dev/[^,:\s]+|COM\d+)(?:[,:](?P<baudrate>\d+))?")


def chooses_port(url: Url) -> bool:
    """Return whether the port is 0: the kernel then chooses another one for each process."""
    return isinstance(url, SocketUrl) and url.port == 0


def parse_url(text: str) -> Url:
    """Read a URL.

    Raises:
        UrlError: it cannot be used.
    """
    text = text.strip()
    if device := _DEVICE.fullmatch(text):
        meant = SerialUrl(device["path"], int(device["baudrate"] or DEFAULT_BAUDRATE))
        raise UrlError(f"{text}: a serial line is written {meant}")
    parts = _PARTS.fullmatch(text)
    if parts is None:
        raise UrlError(f"{text!r} is not a URL: write, for example, udpin://127.0.0.1:14550")
    scheme, rest = parts["scheme"].lower(), parts["rest"]
    if scheme not in _SCHEMES:
        raise UrlError(f"{text}: {_meant(scheme, rest)}")
    if parts["slashes"] != "//":
        raise UrlError(f"{text}: did you mean {scheme}://{parts['slashes'] + rest}?")
    return _serial(text, rest) if scheme == _SERIAL else _socket(text, Way(scheme), rest)


def _meant(scheme: str, rest: str) -> str:
    if scheme in ("udp", "tcp", "udpcast", "udpbcast"):
        kind = scheme[:3]
        return f"did you mean {kind}in://{rest} (to listen) or {kind}out://{rest} (to send there)?"
    if near := get_close_matches(scheme, _SCHEMES, n=1):
        return f"did you mean {near[0]}://{rest}?"
    return f"'{scheme}' is none of {', '.join(_SCHEMES)}"


def _socket(text: str, way: Way, rest: str) -> SocketUrl:
    place = _PLACE.fullmatch(rest)
    if place is None:
        raise UrlError(f"{text}: write a host and a port after {way}://, as in 127.0.0.1:14550")
    if not place["host"]:
        one = f"{way}://127.0.0.1:{place['port'] or 14550}"
        if way in (Way.UDP_IN, Way.TCP_IN):
            every = f"{way}://0.0.0.0:{place['port'] or 14550}"
            raise UrlError(
                f"{text}: no host; {one} listens on this machine only, {every} on all its addresses"
            )
        raise UrlError(f"{text}: no host; did you mean {one}?")
    try:
        place["host"].encode("idna")
    except UnicodeError:
        raise UrlError(f"{text}: '{place['host']}' is not a host name") from None
    if place["port"] is None or not re.fullmatch(r"[0-9]{1,5}", place["port"]):
        raise UrlError(f"{text}: its port must be a number, as in {way}://{place['host']}:14550")
    port = int(place["port"])
    # A listener may ask for any free port; nothing can be sent to port 0.
    lowest = 0 if way in (Way.UDP_IN, Way.TCP_IN) else 1
    if not lowest <= port <= 65535:
        raise UrlError(f"{text}: its port must be from {lowest} to 65535")
    return SocketUrl(way, place["host"].strip("[]"), port)


def _serial(text: str, rest: str) -> SerialUrl:
    path, colon, last = rest.rpartition(":")
    if not colon:
        path, last = rest, str(DEFAULT_BAUDRATE)
    elif not last.isdecimal():
        # Paths under /dev/serial/by-path have colons of their own.
        if "/" not in last and not last[:1].isdecimal():
            raise UrlError(f"{text}: its baudrate must be a number, as in serial://{path}:57600")
        path, last = rest, str(DEFAULT_BAUDRATE)
    if not path:
        raise UrlError(f"{text}: no device; did you mean serial:///dev/ttyACM0:57600?")
    if path.startswith("dev/"):
        raise UrlError(f"{text}: did you mean serial:///{path}:{last}?")
    baudrate = int(last)
    if not 1 <= baudrate <= HIGHEST_BAUDRATE:
        raise UrlError(f"{text}: its baudrate must be from 1 to {HIGHEST_BAUDRATE}")
    return SerialUrl(path, baudrate)
