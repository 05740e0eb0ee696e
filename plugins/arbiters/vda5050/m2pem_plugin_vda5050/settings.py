"""The settings of a vehicle that speaks VDA 5050, in the fleet file (docs/vda5050.md)."""

import re
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from m2pem.api import Connection, ConnectionReader, Dimension, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_vda5050.catalogue import OwnBehavior, read_own_behaviors
from m2pem_plugin_vda5050.messages import SPOKEN, Factsheet, MessageError, decode, other_version

ARBITER = "vda5050"
DOMAINS = ("ground",)
PORTS = {"mqtt": 1883, "mqtts": 8883}
VERSIONS = re.compile(r"(1\.1|2\.[01])(\.\d+)?")
_LEVEL = re.compile(r"[^/+#$\s]+")
_SERIAL = re.compile(r"[A-Za-z0-9_.:-]+")
MOST_RELEASED = 10_000


@dataclass(frozen=True, slots=True)
class BrokerSettings:
    """An MQTT broker and how to connect to it. Vehicles with equal ones share a connection."""

    url: str
    host: str
    port: int
    tls: bool = False
    user: str = ""
    password_file: str = ""
    ca: str = ""
    certificate: str = ""
    key: str = ""


@dataclass(frozen=True, slots=True)
class MapSettings:
    """The map of a vehicle. `origin`: latitude and longitude in degrees; None: that of the fleet.
    `rotation_rad`: of its x axis, counter-clockwise from east."""

    id: str
    origin: tuple[float, float] | None = None
    rotation_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Settings:
    """The connection of a vehicle.

    `released_nodes`: how many nodes ahead of the vehicle are released; 0: all. `deviation_m`: how
    near it comes to a waypoint. `start_deviation_m`: the same for the first node of an order, where
    the vehicle stands. `cancel_timeout_s`: how long it may take to stop after a cancel.
    """

    broker: BrokerSettings
    manufacturer: str
    serial_number: str
    map: MapSettings
    interface: str = "uagv"
    version: str = "2.1.0"
    released_nodes: int = 0
    deviation_m: float = 0.5
    start_deviation_m: float = 1.0
    cancel_timeout_s: float = 30.0
    own_behaviors: tuple[OwnBehavior, ...] = ()
    factsheet: Factsheet | None = None
    sim: Mapping[str, Any] = field(default_factory=dict)

    @property
    def prefix(self) -> str:
        """The topics of the vehicle, without the last level."""
        return f"{self.interface}/v{self.version[0]}/{self.manufacturer}/{self.serial_number}"

    @property
    def other_prefixes(self) -> tuple[str, ...]:
        """Where a vehicle is if it speaks another major version; 3.0 suggests `vda5050`."""
        ends = [*((self.interface, f"v{major}") for major in (1, 2, 3)), ("vda5050", "v3")]
        prefixes = [f"{'/'.join(end)}/{self.manufacturer}/{self.serial_number}" for end in ends]
        return tuple(each for each in dict.fromkeys(prefixes) if each != self.prefix)

    @property
    def address(self) -> str:
        """What names the vehicle, on all hosts."""
        return f"mqtt {self.broker.host}:{self.broker.port} {self.prefix}"


_KEYS = (
    *("url", "user", "password_file", "tls", "interface", "version", "manufacturer"),
    *("serial_number", "map", "released_nodes", "deviation", "start_deviation"),
    *("cancel_timeout", "own_behaviors", "factsheet", "sim"),
)


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """Read the settings of all vehicles; payloads have none of their own.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read(connection)
        for resource, connection in connections.items()
        if "/" not in resource
    }
    reached: dict[str, ResourceId] = {}
    for resource, settings in read.items():
        if (other := reached.setdefault(settings.address, resource)) != resource:
            problem = f"{other} has the same, at the same broker"
            raise ConnectionReader(resource, {}).error("serial_number", problem)
    return read


def _read(connection: Connection) -> Settings:
    resource = connection.resource
    if connection.domain not in DOMAINS:
        raise PluginError(
            f"{resource}: domain: the arbiter '{ARBITER}' commands vehicles of the domain "
            f"{DOMAINS[0]}, not {connection.domain}"
        )
    reader = ConnectionReader(resource, connection.settings)
    reader.refuse_others(_KEYS)
    version = str(reader.values.get("version", "2.1.0"))
    if not VERSIONS.fullmatch(version):
        raise reader.error("version", f"{version!r} is none of 1.1.0, 2.0.0 and 2.1.0: {SPOKEN}")
    version = version if version.count(".") == 2 else f"{version}.0"
    factsheet = _factsheet(reader, connection.folder)
    return Settings(
        _broker(reader, connection.folder),
        _level(reader, "manufacturer", None),
        _level(reader, "serial_number", None, _SERIAL),
        _map(reader),
        _level(reader, "interface", "uagv"),
        version,
        reader.whole("released_nodes", 0, 0, MOST_RELEASED),
        reader.quantity("deviation", 0.5, Dimension.DISTANCE, 0.0, 100.0),
        reader.quantity("start_deviation", 1.0, Dimension.DISTANCE, 0.0, 100.0),
        reader.quantity("cancel_timeout", 30.0, Dimension.DURATION, 1.0, 3600.0),
        read_own_behaviors(resource, reader.values.get("own_behaviors"), version, factsheet),
        factsheet,
        reader.inner("sim", "{heading: 60 deg}").values,
    )


def _file(reader: ConnectionReader, key: str, folder: Path) -> str:
    """Return the path of a file, which may be named relative to the fleet file; "": none."""
    name = reader.text(key, "")
    return str(folder / Path(name).expanduser()) if name else ""


def _broker(reader: ConnectionReader, folder: Path) -> BrokerSettings:
    example = "such as mqtt://127.0.0.1:1883, or mqtts://broker.example.org"
    if "url" not in reader.values:
        raise reader.error("url", f"it is missing: write the MQTT broker, {example}")
    url = reader.text("url", "")
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise reader.error("url", f"{url!r} is not the URL of a broker, {example}") from None
    if parts.scheme not in PORTS or not parts.hostname or parts.path not in ("", "/"):
        raise reader.error("url", f"{url!r} is not the URL of a broker, {example}")
    if parts.username or parts.password:
        raise reader.error("url", "write `user` and `password_file` in place of a password here")
    tls = reader.inner("tls", "{ca: /etc/m2pem/ca.pem}")
    tls.refuse_others(("ca", "certificate", "key"))
    if "tls" in reader.values and parts.scheme != "mqtts":
        raise reader.error("tls", "it is for brokers whose `url` begins with mqtts://")
    if ("certificate" in tls.values) != ("key" in tls.values):
        raise tls.error("certificate", "`certificate` and `key` belong together")
    if "password_file" in reader.values and "user" not in reader.values:
        raise reader.error("password_file", "a password needs a `user`")
    return BrokerSettings(
        url,
        parts.hostname,
        port or PORTS[parts.scheme],
        parts.scheme == "mqtts",
        reader.text("user", ""),
        _file(reader, "password_file", folder),
        _file(tls, "ca", folder),
        _file(tls, "certificate", folder),
        _file(tls, "key", folder),
    )


def _level(
    reader: ConnectionReader, key: str, default: str | None, pattern: re.Pattern[str] = _LEVEL
) -> str:
    value = reader.values.get(key, default)
    if value is None:
        raise reader.error(key, "it is missing: VDA 5050 has it in each topic of the vehicle")
    if isinstance(value, int) and not isinstance(value, bool):
        raise reader.error(key, f"{value} is a number; write it as a text: '{value}'")
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise reader.error(key, f"{value!r} cannot be a part of an MQTT topic of VDA 5050")
    return value


def _map(reader: ConnectionReader) -> MapSettings:
    example = "{id: hall1, origin: {lat: 38.1, lon: -77.3}, rotation: 30 deg}"
    inner = reader.inner("map", example)
    inner.refuse_others(("id", "origin", "rotation"))
    if "id" not in inner.values:
        raise reader.error("map", f"it has no `id`, that of the vehicle's map, such as {example}")
    origin: tuple[float, float] | None = None
    if "origin" in inner.values:
        place = inner.inner("origin", "{lat: 38.1, lon: -77.3}")
        place.refuse_others(("lat", "lon"))
        for key in ("lat", "lon"):
            if key not in place.values:
                raise place.error(key, "it is missing: WGS-84 degrees")
        origin = place.number("lat", 0.0, -90.0, 90.0), place.number("lon", 0.0, -180.0, 180.0)
    rotation = inner.quantity("rotation", 0.0, Dimension.ANGLE, -6.3, 6.3)
    return MapSettings(inner.text("id", ""), origin, rotation)


def _factsheet(reader: ConnectionReader, folder: Path) -> Factsheet | None:
    if "factsheet" not in reader.values:
        return None
    file = Path(_file(reader, "factsheet", folder))
    try:
        content = file.read_bytes()
    except OSError as error:
        raise reader.error("factsheet", f"{file}: {error.strerror}") from None
    try:
        return decode(content, Factsheet)
    except MessageError as error:
        if version := other_version(content):
            problem = f"{file} is one of VDA 5050 {version}: {SPOKEN}"
            raise reader.error("factsheet", problem) from None
        raise reader.error("factsheet", f"{file} is no factsheet of VDA 5050: {error}") from None


def read_password(broker: BrokerSettings) -> str | None:
    """Return the first line of the password file; None if there is none.

    Raises:
        PluginError: it cannot be read, or others than its owner may read it.
    """
    if not broker.password_file:
        return None
    file = Path(broker.password_file)
    private(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    if not lines or not lines[0]:
        raise PluginError(f"{file}: its first line has no password")
    return lines[0]


def private(file: Path) -> None:
    """Check that a file can be read, by its owner alone.

    Raises:
        PluginError: it is not so.
    """
    try:
        mode = stat.S_IMODE(file.stat().st_mode)
        with file.open("rb"):
            pass
    except OSError as error:
        raise PluginError(f"{file}: {error.strerror}") from None
    if mode & 0o077:
        raise PluginError(f"{file}: others may read it (mode {mode:04o}): chmod 600 {file}")
