"""A ground station that MAVSDK runs: one for each URL and event loop, for all its vehicles."""

import asyncio
import contextlib
import logging
import socket
from typing import Any

from m2pem.api import Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.mavsdk_driver import library
from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.url import SocketUrl, Way, parse_url


class GroundStation:
    """Between `open` and `close`. `source`: whom it sends as.

    Raises:
        PluginError: the URL is wrong.
    """

    def __init__(self, url: str, source: Address, clock: Clock, logger: logging.Logger) -> None:
        self.url = parse_url(url)
        self.source = source
        self._clock = clock
        self._logger = logger
        self._links: dict[int, MavsdkLink] = {}
        self._mavsdk: Any = None
        self._systems: dict[int, Any] = {}
        self._search: asyncio.Task[None] | None = None

    def link(self, address: Address) -> MavsdkLink:
        """The link of a vehicle, which is attached as soon as it is heard."""
        link = self._links.get(address.system)
        if link is None:
            link = self._links[address.system] = MavsdkLink(address, self._clock, self._logger)
            if address.system in self._systems:
                link.attach(self._systems[address.system])
        return link

    async def open(self) -> None:
        """Listen.

        Raises:
            PluginError: the URL cannot be opened, or there is no MAVSDK.
        """
        mavsdk = library.require()
        if isinstance(self.url, SocketUrl) and self.url.way is Way.UDP_IN:
            _refuse_if_taken(self.url)
        library.read_log(self._logger)
        configuration = mavsdk.Configuration.create_manual(*self.source, True)
        self._mavsdk = mavsdk.Mavsdk(configuration)
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
        """Close everything: no thread and no socket is left."""
        if self._search is not None:
            self._search.cancel()
            await asyncio.gather(self._search, return_exceptions=True)
        for link in self._links.values():
            await link.close()
        if self._mavsdk is not None:
            # In a thread, as it waits for its own. What else is MAVSDK's is held until then: were
            # it collected, and thereby destroyed, at the same time, the process would be aborted.
            await asyncio.get_running_loop().run_in_executor(None, self._mavsdk.destroy)
            self._mavsdk = None
        self._links.clear()
        self._systems.clear()
        library.leave_log(self._logger)

    async def _attach(self, found: Any) -> None:
        """Attach the links of the systems that are found."""
        async with contextlib.aclosing(found):
            async for _ in found:
                for system in await self._mavsdk.get_systems():
                    id_ = await system.get_system_id()
                    if id_ in self._systems:
                        continue
                    self._systems[id_] = system
                    if id_ in self._links:
                        self._links[id_].attach(system)


def _refuse_if_taken(url: SocketUrl) -> None:
    """MAVSDK shares a port with whoever else listens there, and then hears nothing, or half."""
    family = socket.AF_INET6 if ":" in url.host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((url.host, url.port))
    except OSError as error:
        raise PluginError(f"{url}: cannot listen there: {error.strerror or error}") from error
