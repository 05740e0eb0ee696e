"""A session with one ONVIF camera, its errors, and the import of the package onvif."""

import asyncio
import importlib
import logging
import os
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.onvif.settings import Credentials, OnvifSettings

INSTALL = "pip install 'm2pem-plugin-ptz[onvif]'"
PROXIES = ("http_proxy", "https_proxy")


def require(module: str = "onvif.client") -> ModuleType:
    """Import and return a module of the package.

    Raises:
        PluginError: the package is missing, or another package has its name.
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
        # Its import makes all loggers of the process write to the terminal.
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
    """Keep the proxy variables of the process, which the package removes."""
    kept = {key: os.environ[key] for key in PROXIES if key in os.environ}
    try:
        yield
    finally:
        os.environ.update(kept)


class SilentError(CameraError): ...


class UnauthorizedError(CameraError):
    """The camera denied the user."""


class RefusedError(CameraError):
    """The camera answered with a fault, or with an invalid answer."""


def camera(settings: OnvifSettings) -> str:
    """Return the name of the camera for texts."""
    return f"the ONVIF camera at {settings.address}"


def silent_error(settings: OnvifSettings, error: BaseException) -> SilentError:
    """Make the error of a camera that did not answer."""
    if isinstance(error, TimeoutError):
        why = f"nothing within {settings.timeout_s:g} s"
    else:
        why = str(error) or type(error).__name__
    return SilentError(f"{camera(settings)} does not answer: {why}", "LINK_LOST")


def unauthorized_error(settings: OnvifSettings, user: str | None) -> UnauthorizedError:
    """Make the error of a wrong or missing user or password."""
    if user is None or settings.credentials is None:
        return UnauthorizedError(
            f"{camera(settings)} requires a user and a password: write them into a file, and name "
            "it as connection.credentials",
            "REJECTED",
        )
    return UnauthorizedError(
        f"{camera(settings)} refuses user {user!r}: correct user or password in "
        f"{settings.credentials}, or what the user may do in the camera",
        "REJECTED",
    )


def translate_error(
    error: Exception, operation: str, settings: OnvifSettings, user: str | None
) -> CameraError:
    """Translate an error of the library for the operator."""
    import aiohttp  # noqa: PLC0415  # comes with the library
    import zeep.exceptions  # noqa: PLC0415

    if isinstance(error, CameraError):
        return error
    if isinstance(
        error, TimeoutError | aiohttp.ClientConnectionError | aiohttp.ClientPayloadError | OSError
    ):
        return silent_error(settings, error)
    if isinstance(error, zeep.exceptions.Fault):
        if require("onvif.util").is_auth_error(error):
            return unauthorized_error(settings, user)
        return RefusedError(f"{camera(settings)} refuses {operation}: {fault_text(error)}")
    if isinstance(error, zeep.exceptions.TransportError) and error.status_code in (401, 403):
        return unauthorized_error(settings, user)
    # zeep 4.3.3 raises AttributeError for a text, such as the page of an HTTP error.
    text = "no XML" if isinstance(error, AttributeError) else " ".join(str(error).split())[:200]
    return RefusedError(f"{camera(settings)} answers {operation} with invalid ONVIF: {text}")


def fault_text(fault: Any) -> str:
    """Return the text and the codes of a fault."""
    codes = [str(getattr(code, "localname", code)) for code in fault.subcodes or ()]
    text = " ".join(str(fault.message or "").split())[:200]
    return f"{text} ({', '.join(codes)})" if codes else text or "no reason given"


MEDIA2 = "http://www.onvif.org/ver20/media/wsdl"
NAMESPACES = {
    "media": "http://www.onvif.org/ver10/media/wsdl",
    "media2": MEDIA2,
    "ptz": "http://www.onvif.org/ver20/ptz/wsdl",
    "recording": "http://www.onvif.org/ver10/recording/wsdl",
}


class Session:
    """A session with one camera, which is opened and closed once. All calls raise CameraError.

    A lost connection needs a new session, as the clock of the camera may have changed.
    """

    def __init__(self, settings: OnvifSettings, credentials: Credentials | None) -> None:
        self.settings = settings
        self.credentials = credentials
        self._camera: Any = None
        self._media2: Any = None
        self._ahead = timedelta(0)

    @property
    def user(self) -> str | None:
        """The user, if there is one."""
        return None if self.credentials is None else self.credentials.user

    @property
    def _password(self) -> str:
        return "" if self.credentials is None else self.credentials.password

    @property
    def camera_time(self) -> datetime:
        """The time of the camera's clock."""
        return datetime.now(UTC) + self._ahead

    async def open(self) -> None:
        """Connect. The time of the camera is read first, as its passwords are valid for seconds
        only."""
        onvif = require()
        with kept_environment():
            self._camera = onvif.ONVIFCamera(
                self.settings.host,
                self.settings.port,
                self.user or "",
                self._password,
                no_cache=True,
            )
        await self._read_clock()
        # Made here, as the library drops the time difference when it requests the services.
        await self._camera.create_devicemgmt_service()
        await self._bounded("GetServices", self._camera.update_xaddrs)
        found = self._camera.xaddrs
        self._camera.xaddrs = {uri: self.near(url) for uri, url in found.items()}
        self._camera.dt_diff = self._ahead

    async def close(self) -> None:
        if self._media2 is not None:
            await self._media2.close()
        if self._camera is not None:
            await self._camera.close()

    def has(self, service: str) -> bool:
        """Return whether the camera has a service of `NAMESPACES`."""
        return NAMESPACES[service] in self._camera.xaddrs

    async def call(self, service: str, operation: str, **arguments: object) -> Any:
        """Call an operation."""
        proxy = await self._service(service)
        name = operation if self.credentials is not None else f"authless_{operation}"
        return await self._bounded(operation, lambda: getattr(proxy, name)(arguments))

    def near(self, url: str) -> str:
        """Return a URL of the camera with the host of the fleet. Another host may not be reachable,
        and must not get the password."""
        parts = urlsplit(url)
        if parts.hostname == self.settings.host:
            return url
        return urlunsplit(parts._replace(netloc=self.settings.address))

    async def _service(self, name: str) -> Any:
        if name == "media2":
            if self._media2 is None:
                self._media2 = await self._open_media2()
            return self._media2
        if name != "devicemgmt" and not self.has(name):
            raise RefusedError(f"{camera(self.settings)} has no {name} service")
        return await self._camera.create_onvif_service(name)

    async def _open_media2(self) -> Any:
        service = require().ONVIFService(
            self._camera.xaddrs[MEDIA2],
            self.user or "",
            self._password,
            str(Path(__file__).with_name("media2.wsdl")),
            no_cache=True,
            dt_diff=self._ahead,
            binding_name=f"{{{MEDIA2}}}Media2Binding",
        )
        await service.setup()
        return service

    async def _read_clock(self) -> None:
        """Read the camera's clock, by which it checks passwords."""
        device = await self._camera.create_devicemgmt_service()
        before = datetime.now(UTC)
        try:
            said = await self._bounded(
                "GetSystemDateAndTime", lambda: device.authless_GetSystemDateAndTime({})
            )
        except RefusedError:
            said = await self._bounded(
                "GetSystemDateAndTime", lambda: device.GetSystemDateAndTime({})
            )
        middle = before + (datetime.now(UTC) - before) / 2
        self._ahead = _moment(said, middle) - middle
        self._camera.dt_diff = self._ahead
        # Services that were created before have the old time difference.
        await self._camera.services.pop(("devicemgmt", None)).close()

    async def _bounded(self, operation: str, ask: Callable[[], Awaitable[Any]]) -> Any:
        try:
            async with asyncio.timeout(self.settings.timeout_s):
                return await ask()
        except Exception as error:
            raise translate_error(error, operation, self.settings, self.user) from error


def _moment(said: Any, else_: datetime) -> datetime:
    """Return the time of the camera's clock in half seconds; `else_` if the camera does not report
    it."""
    utc: Any = getattr(said, "UTCDateTime", None)
    try:
        date, time = utc.Date, utc.Time
        whole = datetime(
            date.Year,
            date.Month,
            date.Day,
            time.Hour,
            time.Minute,
            min(time.Second, 59),
            tzinfo=UTC,
        )
    except (AttributeError, TypeError, ValueError):
        return else_
    return whole + timedelta(seconds=0.5)
