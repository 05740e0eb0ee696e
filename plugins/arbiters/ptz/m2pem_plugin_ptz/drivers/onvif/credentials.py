"""User and password of a camera, from a file that nobody else may read.

YAML (`user: operator`, `password: secret`), or INI with these two in one section.
"""

import configparser
import os
import shlex
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from m2pem.errors import PluginError

LONGEST = 64 * 1024
"""Bytes; a longer file is something else."""

OTHERS = stat.S_IRWXG | stat.S_IRWXO
EXAMPLE = "two lines, user: NAME and password: SECRET"


@dataclass(frozen=True, slots=True)
class Credentials:
    """Of one account."""

    user: str
    password: str = field(repr=False)


def read_credentials(path: Path) -> Credentials:
    """Read the file.

    Raises:
        PluginError: it is not there, others may read it, or it is something else.
    """
    text = _read(path)
    try:
        values = _ini(text) if text.lstrip().startswith("[") else YAML(typ="safe").load(text)
    except (YAMLError, configparser.Error):
        # Not with its cause: that quotes the line, and the password may stand in it.
        raise PluginError(f"{path}: this is neither YAML nor INI: {EXAMPLE}") from None
    if not isinstance(values, Mapping):
        raise PluginError(f"{path}: user and password are missing: {EXAMPLE}")
    found = []
    for key in ("user", "password"):
        value = values.get(key)
        if isinstance(value, bool) or not isinstance(value, str | int) or not str(value):
            raise PluginError(f"{path}: `{key}` is missing or no text (use quotes): {EXAMPLE}")
        found.append(str(value))
    return Credentials(found[0], found[1])


def _read(path: Path) -> str:
    try:
        # What is no file must not be waited for.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise PluginError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        mode = os.fstat(handle).st_mode
        if not stat.S_ISREG(mode):
            raise PluginError(f"{path}: this is no file; it should hold {EXAMPLE}")
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
        raise PluginError(f"{path}: this is no short text: it should hold {EXAMPLE}") from None


def _ini(text: str) -> Mapping[str, str]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    sections = parser.sections()
    return dict(parser[sections[0]]) if len(sections) == 1 else {}
