"""Ground stations that MAVSDK runs, one for each URL, and the links opened through them."""

import asyncio
import contextlib
import socket
from collections.abc import Callable, Sequence
from typing import Any
from weakref import WeakKeyDictionary

from m2pem.api import Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION
from m2pem_plugin_mavlink.mavsdk_driver import library
from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.url import SocketUrl, Url, Way, parse_url


class GroundStation:
    """A ground station of MAVSDK, between `open` and `close`. `source`: the address that it sends
    from."""

    def __init__(self, url: Url, source: Address) -> None:
        self.url = url
        self.source = source
        self.links: list[MavsdkLink] = []
        self._mavsdk: Any = None
        self._systems: dict[int, Any] = {}
        self._search: asyncio.Task[None] | None = None

    def join(self, link: MavsdkLink) -> None:
        """Attach a link as soon as MAVSDK has found its vehicle."""
        self.links.append(link)
        system = self._systems.get(link.address.system)
        if system is not None:
            link.attach(system)

    async def open(self) -> None:
        """Listen.

        Raises:
            PluginError: the URL cannot be opened, or there is no MAVSDK.
        """
        mavsdk = library.require()
        if isinstance(self.url, SocketUrl) and self.url.way is Way.UDP_IN:
            _refuse_if_taken(self.url)
        library.read_log()
        self._mavsdk = mavsdk.Mavsdk(mavsdk.Configuration.create_manual(*self.source, True))
        found = self._mavsdk.on_new_system()
        # Begun before the connection, so that no system is missed.
        self._search = asyncio.get_running_loop().create_task(self._attach(found))
        await asyncio.sleep(0)
        try:
            await self._mavsdk.add_any_connection(str(self.url))
        except library.failure() as error:
            await self.close()
            reason = library.reason(error)
            raise PluginError(f"{self.url}: MAVSDK cannot open it: {reason}") from error

    async def close(self) -> None:
        """Close everything, after all links are closed: no thread and no socket is left."""
        if self._search is not None:
            self._search.cancel()
            await asyncio.gather(self._search, return_exceptions=True)
        if self._mavsdk is not None:
            # In a thread, as it waits for its own threads. Other MAVSDK objects are kept until
            # then: one that were collected, and thereby destroyed, at the same time would abort the
            # process.
            await asyncio.get_running_loop().run_in_executor(None, self._mavsdk.destroy)
            self._mavsdk = None
            library.leave_log()
        self.links.clear()
        self._systems.clear()

    async def _attach(self, found: Any) -> None:
        """Attach the links of the systems that are found."""
        async with contextlib.aclosing(found):
            async for _ in found:
                for system in await self._mavsdk.get_systems():
                    id_ = await system.get_system_id()
                    if id_ in self._systems:
                        continue
                    self._systems[id_] = system
                    for link in self.links:
                        if link.address.system == id_:
                            link.attach(system)


def _refuse_if_taken(url: SocketUrl) -> None:
    """Raise an error if the port is in use: MAVSDK would share it, and receive nothing, or half."""
    family = socket.AF_INET6 if ":" in url.host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((url.host, url.port))
    except OSError as error:
        raise PluginError(f"{url}: cannot listen there: {error.strerror or error}") from error


async def open_mavsdk_link(
    address: Address,
    urls: Sequence[str],
    clock: Clock,
    source: Address = GROUND_STATION,
    may_send: Callable[[], bool] = lambda: True,
) -> MavsdkLink:
    """Open a link to a vehicle; see `link.routed_link.open_link`.

    Raises:
        PluginError: there is no MAVSDK, the URL is wrong or cannot be opened, or there is more than
            one: MAVSDK would send everything to all of them.
    """
    if len(urls) != 1:
        raise PluginError(f"`driver: mavsdk` takes one URL, not {len(urls)}")
    loop = asyncio.get_running_loop()
    stations = _ground_stations.get(loop)
    if stations is None:
        stations = _ground_stations[loop] = _GroundStations()
    link = await stations.join(address, parse_url(urls[0]), source, clock)
    link.may_send = may_send
    return link


class _GroundStations:
    """The ground stations of an event loop."""

    def __init__(self) -> None:
        self._open: dict[tuple[Url, Address], GroundStation] = {}
        self._changing = asyncio.Lock()

    async def join(self, address: Address, url: Url, source: Address, clock: Clock) -> MavsdkLink:
        async with self._changing:
            station = self._open.get((url, source))
            if station is None:
                station = GroundStation(url, source)
                await station.open()
                self._open[url, source] = station
            link = MavsdkLink(address, clock, lambda: self._leave(station, link))
            station.join(link)
            return link

    async def _leave(self, station: GroundStation, link: MavsdkLink) -> None:
        async with self._changing:
            station.links.remove(link)
            if not station.links:
                del self._open[station.url, station.source]
                await station.close()


_ground_stations: WeakKeyDictionary[asyncio.AbstractEventLoop, _GroundStations] = (
    WeakKeyDictionary()
)
