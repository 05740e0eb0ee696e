"""The package onvif: whether it is there, and what it may not touch."""

import importlib
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from m2pem.errors import PluginError

INSTALL = "pip install 'm2pem-plugin-ptz[onvif]'"
PROXIES = ("http_proxy", "https_proxy")


def require(module: str = "onvif.client") -> ModuleType:
    """Import a module of the package.

    Raises:
        PluginError: the package is not installed, or another one of the same name is.
    """
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("onvif", "zeep", "aiohttp"):
            raise
        raise PluginError(
            f"`driver: onvif` needs onvif-zeep-async 4.3 or newer: {INSTALL}"
        ) from error
    finally:
        # When it is imported, it has all loggers of the process write to the terminal.
        root.handlers[:] = handlers
        root.setLevel(level)
    if not hasattr(found, "DigestAuthMiddleware") and module == "onvif.client":
        raise PluginError(
            "`driver: onvif` needs onvif-zeep-async 4.3 or newer; another package has taken its "
            f"name, such as onvif-zeep: uninstall that, then {INSTALL}"
        )
    return found


@contextmanager
def kept_environment() -> Iterator[None]:
    """It takes proxies away from the whole process; here they are put back."""
    kept = {key: os.environ[key] for key in PROXIES if key in os.environ}
    try:
        yield
    finally:
        os.environ.update(kept)
