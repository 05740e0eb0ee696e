"""The package mavsdk: whether it is installed, and its log."""

import asyncio
import contextlib
import importlib
import logging
from collections import Counter
from importlib.metadata import PackageNotFoundError, version
from types import ModuleType
from typing import Any

from m2pem.errors import PluginError

INSTALL = "pip install 'm2pem-plugin-mavlink[mavsdk]'"

_LEVELS = (logging.DEBUG, logging.DEBUG, logging.WARNING, logging.ERROR)
"""Lowest level of MAVSDK's log that is read (debug, info, warning, error)."""

_readers: Counter[asyncio.AbstractEventLoop] = Counter()
_callbacks: list[Any] = []
"""Which MAVSDK calls as long as the process runs; it holds no reference itself."""

_logger = logging.getLogger(__name__)


def require(module: str = "mavsdk.asyncio") -> ModuleType:
    """Import a module of the package.

    Raises:
        PluginError: the package is not installed, or cannot be used here.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "mavsdk":
            raise
        raise PluginError(f"`driver: mavsdk` needs MAVSDK 4.1 or newer: {_missing()}") from error
    except Exception as error:  # its shared library lacks what this machine has, or is not there
        raise PluginError(f"MAVSDK is installed, but does not load here: {error}") from error


def _missing() -> str:
    try:
        found = version("mavsdk")
    except PackageNotFoundError:
        return f"{INSTALL}, or leave `driver` out"
    return f"version {found} is installed; {INSTALL}, or leave `driver` out"


def plugin(name: str) -> ModuleType:
    """Import one of its plugins."""
    return require(f"mavsdk.asyncio.plugins.{name}")


def failure() -> type[Exception]:
    """Return the class of its errors."""
    error: type[Exception] = require("mavsdk.exceptions").MavsdkError
    return error


def reason(error: Exception) -> str:
    """Return why a call failed, for people."""
    result = getattr(error, "result", None)
    return str(error) if result is None else result.name.lower().replace("_", " ")


def read_log() -> None:
    """Send its log to the logger of this module, in this event loop, instead of the terminal;
    undone by `leave_log`."""
    # Its `log_subscribe` would print texts that are not UTF-8, which vehicles may send.
    log = require("mavsdk.logging")
    if not _callbacks:
        _callbacks.append(log.LogCallback(_take))
    log._cmavsdk_lib.mavsdk_log_subscribe(_callbacks[0], None)
    _readers[asyncio.get_running_loop()] += 1


def leave_log() -> None:
    """Undo one `read_log`."""
    loop = asyncio.get_running_loop()
    _readers[loop] -= 1
    if not _readers[loop]:
        del _readers[loop]


def _take(level: int, message: bytes | None, _file: Any, _line: int, _data: Any) -> bool:
    # Called in MAVSDK's threads: logging there would make threads of Python of them.
    text = (message or b"").decode("utf-8", "replace")
    for loop in tuple(_readers):
        with contextlib.suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(_logger.log, _LEVELS[level], "MAVSDK: %s", text)
            break
    return True
