"""What a fleet file says at `faces: {cot: ...}`."""

import re
import ssl
import stat
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from m2pem.api import Dimension, FaceSettings, Fleet
from m2pem.errors import PluginError
from m2pem_plugin_cot.contact import Contact
from m2pem_plugin_cot.received import MAX_NAME

SCHEMES = ("udp", "tcp", "tls")
KNOWN = (
    *("url", "listen", "interface", "rate", "stale", "types", "receive", "tls"),
    *("callsign", "chat"),
)
TYPE = re.compile(r"[a-z](-[A-Za-z0-9.]+)+")


@dataclass(frozen=True, slots=True)
class Address:
    """Where events go to, or come from."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.scheme}://{self.host}:{self.port}"


@dataclass(frozen=True, slots=True)
class Settings:
    """`url`: where events go; over TCP and TLS they also come from there. `listen`: a UDP address
    from which they come. `interface`: of multicast, an address of this host. `period_s`: between
    two events of a vehicle. `stale_s`: for how long an event is valid. `types`: of Cursor on Target
    by vehicle, where they are not those of its domain. `receive`: whether events become geometries.
    `contact`: as which m2pem is known; None: as none.
    """

    url: Address
    listen: Address | None
    interface: str
    period_s: float
    stale_s: float
    receive: bool
    types: dict[str, str] = field(default_factory=dict)
    tls: ssl.SSLContext | None = None
    contact: Contact | None = None


def read_settings(given: FaceSettings, fleet: Fleet) -> Settings:
    """Read the settings of the face.

    Raises:
        PluginError: one is wrong; it names the key.
    """
    given.refuse_others(KNOWN)
    url = _address(given, "url", SCHEMES)
    if url is None:
        raise given.error("url", "it is missing: udp://, tcp:// or tls:// with host and port")
    listen = _address(given, "listen", ("udp",))
    if listen is not None and url.scheme != "udp":
        raise given.error("listen", f"events come from {url} itself; only a udp:// url needs it")
    receive = given.flag("receive", False)
    if receive and url.scheme == "udp" and listen is None:
        raise given.error("receive", "over UDP it needs `listen: udp://HOST:PORT`, too")
    if receive and not fleet.handed_over:
        raise given.error(
            "receive", "the fleet has no `handed_over`: it names the geometries that may come in"
        )
    rate_hz = given.quantity("rate", 1.0, Dimension.FREQUENCY, 0.01, 20.0)
    stale_s = given.quantity("stale", 30.0, Dimension.DURATION, 1.0, 86_400.0)
    if stale_s <= 1.0 / rate_hz:
        raise given.error("stale", f"{stale_s:g} s is no longer than a period of the rate")
    return Settings(
        url,
        listen,
        given.text("interface", "127.0.0.1"),
        1.0 / rate_hz,
        stale_s,
        receive,
        _types(given, fleet),
        _tls(given, fleet) if url.scheme == "tls" else None,
        _contact(given, fleet, url),
    )


def _contact(given: FaceSettings, fleet: Fleet, url: Address) -> Contact | None:
    callsign, chat = given.text("callsign", ""), given.flag("chat", False)
    if chat and not callsign:
        raise given.error("chat", "it needs a `callsign`: answers are sent to a contact")
    if chat and url.scheme != "tls":
        raise given.error("chat", "it needs a tls:// url: over UDP and TCP anyone could answer")
    if callsign and not (callsign.isprintable() and len(callsign) <= MAX_NAME):
        raise given.error("callsign", f"{callsign!r} is no callsign: at most {MAX_NAME} characters")
    return Contact(f"m2pem.{fleet.name}.contact", callsign, chat) if callsign else None


def _address(given: FaceSettings, key: str, schemes: tuple[str, ...]) -> Address | None:
    text = given.text(key, "")
    if not text:
        return None
    try:
        read = urlsplit(text)
        scheme, host, port = read.scheme, read.hostname, read.port
    except ValueError:
        scheme, host, port = "", None, None
    if scheme not in schemes or not host or not port or read.path not in ("", "/"):
        example = f"{schemes[0]}://127.0.0.1:{4242 if schemes[0] == 'udp' else 8087}"
        raise given.error(key, f"{text!r} is no address such as {example} ({', '.join(schemes)})")
    return Address(scheme, host, port)


def _types(given: FaceSettings, fleet: Fleet) -> dict[str, str]:
    inner = given.inner("types", "{rover1: a-f-G-E-V}")
    inner.refuse_others([*fleet.vehicles])
    types = {name: inner.text(name, "") for name in inner.values}
    for name, text in types.items():
        if not TYPE.fullmatch(text):
            raise inner.error(name, f"{text!r} is no type of Cursor on Target, such as a-f-G-E-V")
    return types


def _tls(given: FaceSettings, fleet: Fleet) -> ssl.SSLContext:
    """Mutual TLS, as TAK servers want it: both sides have a certificate."""
    inner = given.inner("tls", "{ca: ca.pem, certificate: m2pem.pem, key: m2pem.key}")
    inner.refuse_others(("ca", "certificate", "key"))
    files = {}
    for key in ("ca", "certificate", "key"):
        text = inner.text(key, "")
        if not text:
            raise inner.error(key, "it is missing: a PEM file, relative to the fleet file")
        file = files[key] = Path(fleet.file).parent / Path(text).expanduser()
        if not file.is_file():
            raise inner.error(key, f"there is no file {file}")
    if (mode := stat.S_IMODE(files["key"].stat().st_mode)) & 0o077:
        problem = f"others may read {files['key']} (mode {mode:04o}): chmod 600 {files['key']}"
        raise inner.error("key", problem)
    try:
        context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH, cafile=str(files["ca"]))
        context.load_cert_chain(files["certificate"], files["key"])
    except (OSError, ssl.SSLError) as error:
        raise PluginError(f"{inner.path}: {error}") from error
    return context
