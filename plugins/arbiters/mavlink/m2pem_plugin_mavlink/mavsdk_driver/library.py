"""The package mavsdk: whether it is there, and where its log goes."""

import asyncio
import importlib
import logging
from importlib.metadata import PackageNotFoundError, version
from types import ModuleType

from m2pem.errors import PluginError

INSTALL = "pip install 'm2pem-plugin-mavlink[mavsdk]'"

_LEVELS = (logging.DEBUG, logging.DEBUG, logging.WARNING, logging.ERROR)
"""Of its levels debug, info, warning and error; its info is of interest to its makers."""

_readers: dict[logging.Logger, asyncio.AbstractEventLoop] = {}


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
    """One of its plugins."""
    return require(f"mavsdk.asyncio.plugins.{name}")


def failure() -> type[Exception]:
    """What its calls raise."""
    error: type[Exception] = require("mavsdk.exceptions").MavsdkError
    return error


def reason(error: Exception) -> str:
    """Why a call failed, for people."""
    result = getattr(error, "result", None)
    return str(error) if result is None else result.name.lower().replace("_", " ")


def read_log(logger: logging.Logger) -> None:
    """From now on its log goes to this logger, in this event loop, and not to the terminal."""
    log = require("mavsdk.logging")
    if not _readers:
        log.log_subscribe(_take)
    _readers[logger] = asyncio.get_running_loop()


def leave_log(logger: logging.Logger) -> None:
    """Its log goes to this logger no more."""
    _readers.pop(logger, None)


def _take(level: int, message: str, file: str | None, line: int) -> bool:
    # Called in MAVSDK's threads: logging there would make threads of Python of them.
    for logger, loop in tuple(_readers.items()):
        try:
            loop.call_soon_threadsafe(logger.log, _LEVELS[level], "MAVSDK: %s", message)
        except RuntimeError:  # the loop is closed
            _readers.pop(logger, None)
    return True
