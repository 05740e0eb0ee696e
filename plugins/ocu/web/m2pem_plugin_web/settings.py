"""The settings of this unit in environment variables."""

import ipaddress
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from m2pem.api import TERRAIN_FOLDER
from m2pem.errors import PluginError

HOST = "M2PEM_WEB_HOST"
PORT = "M2PEM_WEB_PORT"
NAMES = "M2PEM_WEB_NAMES"
"""Other names of this machine that browsers may use, separated by commas."""
MISSIONS = "M2PEM_WEB_MISSIONS"
USERS = "M2PEM_WEB_USERS"
CERTIFICATE = "M2PEM_WEB_CERT"
KEY = "M2PEM_WEB_KEY"
TILES = "M2PEM_WEB_TILES"
"""A file of image tiles for the map."""

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 8700
DEFAULT_MISSIONS = "missions"
LOCAL_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})


class SettingError(PluginError):
    """An environment variable has an invalid value."""

    exit_status = 2


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings. `port` 0: any free one. `users` None: the owner of the token signs in."""

    host: str = DEFAULT_HOST
    port: int = DEFAULT_PORT
    names: frozenset[str] = LOCAL_NAMES
    """Host names in requests that are accepted, without ports."""
    called: str = DEFAULT_HOST
    """The host name in printed addresses."""
    missions: Path = Path(DEFAULT_MISSIONS)
    users: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    tiles: Path | None = None
    terrain: Path | None = None

    @property
    def scheme(self) -> str:
        """`https` with a certificate, else `http`."""
        return "https" if self.certificate else "http"

    def address(self, port: int) -> str:
        """Return the address of the page at a port."""
        name = f"[{self.called}]" if ":" in self.called else self.called
        return f"{self.scheme}://{name}:{port}/"


def read_settings(environment: Mapping[str, str] = os.environ) -> Settings:
    """Read the settings from environment variables.

    Raises:
        SettingError: a variable has an invalid value, or two contradict each other.
    """

    def said(name: str) -> str:
        return environment.get(name, "").strip()

    def path(name: str) -> Path | None:
        return Path(said(name)).expanduser() if said(name) else None

    host = said(HOST).strip("[]") or DEFAULT_HOST
    more = [name.strip().strip("[]").lower() for name in said(NAMES).split(",") if name.strip()]
    settings = Settings(
        host=host,
        port=_port(said(PORT)),
        names=frozenset({*_names_of(host), *more}),
        called=more[0] if more and _is_unspecified(host) else host,
        missions=path(MISSIONS) or Path(DEFAULT_MISSIONS),
        users=path(USERS),
        certificate=path(CERTIFICATE),
        key=path(KEY),
        tiles=path(TILES),
        terrain=path(TERRAIN_FOLDER),
    )
    _refuse_what_is_unsafe(settings)
    return settings


def _port(text: str) -> int:
    if not text:
        return DEFAULT_PORT
    if not (text.isascii() and text.isdigit() and int(text) < 65536):
        raise SettingError(
            f"{PORT}={text!r} is not a port: write a number up to 65535, or 0 for any free one"
        )
    return int(text)


def _names_of(host: str) -> frozenset[str]:
    if is_loopback(host):
        return LOCAL_NAMES | {host.lower()}
    if _is_unspecified(host):
        return LOCAL_NAMES
    return frozenset({host.lower()})


def is_loopback(host: str) -> bool:
    """Return whether a host is a loopback address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _is_unspecified(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def _refuse_what_is_unsafe(settings: Settings) -> None:
    if (settings.certificate is None) != (settings.key is None):
        raise SettingError(f"{CERTIFICATE} and {KEY} go together: give both, or neither")
    for name, path in (
        (CERTIFICATE, settings.certificate),
        (KEY, settings.key),
        (TILES, settings.tiles),
    ):
        if path is not None and not path.is_file():
            raise SettingError(f"{name}={path}: the file does not exist")
    if settings.terrain is not None and not settings.terrain.is_dir():
        raise SettingError(f"{TERRAIN_FOLDER}={settings.terrain}: the folder does not exist")
    if is_loopback(settings.host):
        return
    missing = [
        what
        for what, there in (
            (f"TLS ({CERTIFICATE}, {KEY})", settings.certificate),
            (f"named users ({USERS}, created by `m2pem web add-user`)", settings.users),
        )
        if there is None
    ]
    if missing:
        raise SettingError(
            f"other machines can reach {HOST}={settings.host}: "
            f"that requires {' and '.join(missing)}"
        )
    if _is_unspecified(settings.host) and settings.names == LOCAL_NAMES:
        raise SettingError(
            f"{HOST}={settings.host} is every address of this machine: list in {NAMES} the names "
            "in the addresses of browsers, such as gcs1.example.org,10.0.0.5"
        )
