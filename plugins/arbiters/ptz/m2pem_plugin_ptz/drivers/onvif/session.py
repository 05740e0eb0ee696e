"""A conversation with one ONVIF camera: its services, and every call bounded in time.

It is made anew when the camera was away: it may have another clock then.
"""

import asyncio
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from m2pem_plugin_ptz.drivers.onvif.credentials import Credentials
from m2pem_plugin_ptz.drivers.onvif.onvif_zeep import kept_environment, require
from m2pem_plugin_ptz.drivers.onvif.settings import OnvifSettings
from m2pem_plugin_ptz.drivers.onvif.troubles import RefusedError, camera, translated

MEDIA2 = "http://www.onvif.org/ver20/media/wsdl"
NAMESPACES = {
    "media": "http://www.onvif.org/ver10/media/wsdl",
    "media2": MEDIA2,
    "ptz": "http://www.onvif.org/ver20/ptz/wsdl",
    "recording": "http://www.onvif.org/ver10/recording/wsdl",
}


class Session:
    """Opened once, closed once. All calls raise CameraError."""

    def __init__(self, settings: OnvifSettings, credentials: Credentials | None) -> None:
        self.settings = settings
        self.credentials = credentials
        self._camera: Any = None
        self._media2: Any = None
        self._ahead = timedelta(0)

    @property
    def user(self) -> str | None:
        """As whom it speaks."""
        return None if self.credentials is None else self.credentials.user

    @property
    def _password(self) -> str:
        return "" if self.credentials is None else self.credentials.password

    @property
    def camera_time(self) -> datetime:
        """What the camera's clock shows."""
        return datetime.now(UTC) + self._ahead

    async def open(self) -> None:
        """Ask for the camera's time first, for its passwords are good for seconds only."""
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
        await self._bounded("GetServices", self._camera.update_xaddrs)
        found = self._camera.xaddrs
        self._camera.xaddrs = {uri: self.near(url) for uri, url in found.items()}
        # The library forgot it when it asked for the services.
        self._camera.dt_diff = self._ahead

    async def close(self) -> None:
        """Hang up."""
        if self._media2 is not None:
            await self._media2.close()
        if self._camera is not None:
            await self._camera.close()

    def has(self, service: str) -> bool:
        """Whether the camera has such a service; one of `NAMESPACES`."""
        return NAMESPACES[service] in self._camera.xaddrs

    async def call(self, service: str, operation: str, **arguments: object) -> Any:
        """Ask the camera."""
        proxy = await self._service(service)
        name = operation if self.credentials is not None else f"authless_{operation}"
        return await self._bounded(operation, lambda: getattr(proxy, name)(arguments))

    def near(self, url: str) -> str:
        """An address that the camera names: on another host than the fleet's, it is one that cannot
        be reached from here, and that may not get the password."""
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
        """A camera whose clock is wrong takes passwords that are made by its clock."""
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
        # What was made before does not know of it.
        await self._camera.services.pop(("devicemgmt", None)).close()

    async def _bounded(self, operation: str, ask: Callable[[], Awaitable[Any]]) -> Any:
        try:
            async with asyncio.timeout(self.settings.timeout_s):
                return await ask()
        except Exception as error:
            raise translated(error, operation, self.settings, self.user) from error


def _moment(said: Any, else_: datetime) -> datetime:
    """The camera's clock, which counts whole seconds; some do not say it."""
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
