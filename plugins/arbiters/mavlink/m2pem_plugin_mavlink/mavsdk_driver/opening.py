"""Links through MAVSDK: `await open_mavsdk_link(address, urls, clock)`."""

import asyncio
from collections.abc import Sequence
from weakref import WeakKeyDictionary

from m2pem.api import Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION
from m2pem_plugin_mavlink.mavsdk_driver.ground_station import GroundStation
from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.url import Url, parse_url


async def open_mavsdk_link(
    address: Address, urls: Sequence[str], clock: Clock, source: Address = GROUND_STATION
) -> MavsdkLink:
    """Reach a vehicle; see `link.routed_link.open_link`.

    Raises:
        PluginError: there is no MAVSDK, the URL is wrong or cannot be opened, or there is more than
            one: MAVSDK would send everything to all of them.
    """
    if len(urls) != 1:
        raise PluginError(f"`driver: mavsdk` takes one URL, and has {len(urls)}")
    loop = asyncio.get_running_loop()
    stations = _stations.get(loop)
    if stations is None:
        stations = _stations[loop] = _Stations()
    return await stations.join(address, parse_url(urls[0]), source, clock)


class _Stations:
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


_stations: WeakKeyDictionary[asyncio.AbstractEventLoop, _Stations] = WeakKeyDictionary()
