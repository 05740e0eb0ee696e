"""The settings of an ONVIF camera in the fleet file, and the file with user and password."""

import configparser
import os
import shlex
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from m2pem.api import ConnectionReader, Dimension, ResourceId
from m2pem.errors import PluginError

KEYS = ("host", "port", "credentials", "profile", "timeout", "calls", "invert")
AXES = ("pan", "tilt")


@dataclass(frozen=True, slots=True)
class OnvifSettings:
    """`credentials`: the file with user and password; None if the camera needs none. `profile`:
    token or name of the media profile; "" for the first one that turns. `timeout_s`: of one call.
    `calls_s`: most calls per second. `inverted`: axes that run the other way."""

    host: str
    port: int = 80
    credentials: Path | None = None
    profile: str = ""
    timeout_s: float = 2.0
    calls_s: float = 16.0
    inverted: frozenset[str] = frozenset()

    @property
    def address(self) -> str:
        """Host and port, as text."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"


def read_onvif(resource: ResourceId, own: Mapping[str, Any]) -> OnvifSettings:
    """Read the settings of one camera. Keys of its vehicle are ignored.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    reader = ConnectionReader(resource, own)
    reader.refuse_misspelled(KEYS)
    host = own.get("host")
    if not isinstance(host, str) or not host.strip() or "/" in host:
        raise reader.error("host", "an ONVIF camera needs its name or IP address")
    return OnvifSettings(
        host.strip().strip("[]"),
        reader.whole("port", 80, 1, 65535),
        _path(reader),
        reader.text("profile", "").strip(),
        reader.quantity("timeout", 2.0, Dimension.DURATION, 0.1, 60.0),
        reader.number("calls", 16.0, 2, 100),
        _inverted(reader),
    )


def _path(reader: ConnectionReader) -> Path | None:
    for key in ("user", "username", "password"):
        if key in reader.values:
            raise reader.error(
                key,
                "many people read fleet files: write user and password into a separate file, and "
                "name it as connection.credentials",
            )
    text = reader.text("credentials", "").strip()
    return Path(text).expanduser() if text else None


def _inverted(reader: ConnectionReader) -> frozenset[str]:
    value = reader.values.get("invert", [])
    axes = [value] if isinstance(value, str) else value
    if not isinstance(axes, list) or not all(axis in AXES for axis in axes):
        raise reader.error("invert", f"{value!r} are none of the axes pan, tilt")
    return frozenset(axes)


LONGEST = 64 * 1024
"""In bytes. A file with a password is shorter."""

OTHERS = stat.S_IRWXG | stat.S_IRWXO
EXAMPLE = "two lines, user: NAME and password: SECRET"


@dataclass(frozen=True, slots=True)
class Credentials:
    user: str
    password: str = field(repr=False)


def read_credentials(path: Path) -> Credentials:
    """Read user and password from a file that only its owner may read: YAML (`user: operator`,
    `password: secret`), or INI with these two in one section.

    Raises:
        PluginError: the file is missing, other users may read it, or its content is invalid.
    """
    text = _read_file(path)
    try:
        values = _ini(text) if text.lstrip().startswith("[") else YAML(typ="safe").load(text)
    except (YAMLError, configparser.Error):
        # Raised without its cause, which quotes the line: the password may be in it.
        raise PluginError(f"{path}: the file is neither YAML nor INI; write {EXAMPLE}") from None
    if not isinstance(values, Mapping):
        raise PluginError(f"{path}: user and password are missing; write {EXAMPLE}")
    found = []
    for key in ("user", "password"):
        value = values.get(key)
        if isinstance(value, bool) or not isinstance(value, str | int) or not str(value):
            raise PluginError(
                f"{path}: `{key}` is missing or not a text (use quotes); write {EXAMPLE}"
            )
        found.append(str(value))
    return Credentials(found[0], found[1])


def _read_file(path: Path) -> str:
    try:
        # Opening a FIFO would block.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise PluginError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        mode = os.fstat(handle).st_mode
        if not stat.S_ISREG(mode):
            raise PluginError(f"{path}: this is not a file; it should hold {EXAMPLE}")
        if mode & OTHERS:
            raise PluginError(
                f"{path}: others may read this password (mode {stat.S_IMODE(mode):04o}): "
                f"chmod 600 {shlex.quote(str(path))}"
            )
        content = os.read(handle, LONGEST + 1)
    finally:
        os.close(handle)
    try:
        if len(content) > LONGEST:
            raise ValueError
        return content.decode()
    except ValueError:
        raise PluginError(f"{path}: this is not a short text; it should hold {EXAMPLE}") from None


def _ini(text: str) -> Mapping[str, str]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    sections = parser.sections()
    return dict(parser[sections[0]]) if len(sections) == 1 else {}
