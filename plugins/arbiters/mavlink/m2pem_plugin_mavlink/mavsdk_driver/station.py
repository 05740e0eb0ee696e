"""A ground station that MAVSDK runs: one for each URL and event loop, for all its vehicles."""

import asyncio
import contextlib
import logging
from typing import Any

from m2pem.api import Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.mavsdk_driver import library
from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink
from m2pem_plugin_mavlink.protocol.messages import Address


class Station:
    """Between `open` and `close`. `source`: whom it sends as."""

    def __init__(self, url: str, source: Address, clock: Clock, logger: logging.Logger) -> None:
        self.url = url
        self.source = source
        self._clock = clock
        self._logger = logger
        self._links: dict[int, MavsdkLink] = {}
        self._mavsdk: Any = None
        self._systems: list[Any] = []
        self._search: asyncio.Task[None] | None = None

    def link(self, system_id: int) -> MavsdkLink:
        """The link of a vehicle, which is attached when it is heard."""
        if system_id not in self._links:
            self._links[system_id] = MavsdkLink(system_id, self._clock, self._logger)
        return self._links[system_id]

    async def open(self) -> None:
        """Listen.

        Raises:
            PluginError: the URL cannot be opened, or there is no MAVSDK.
        """
        mavsdk = library.require()
        library.read_log(self._logger)
        configuration = mavsdk.Configuration.create_manual(*self.source, True)
        self._mavsdk = mavsdk.Mavsdk(configuration)
        found = self._mavsdk.on_new_system()
        # Begun before the connection, so that no system is missed.
        self._search = asyncio.get_running_loop().create_task(self._attach(found))
        await asyncio.sleep(0)
        try:
            await self._mavsdk.add_any_connection(self.url)
        except library.failure() as error:
            await self.close()
            raise PluginError(
                f"{self.url}: MAVSDK cannot open it: {library.reason(error)}"
            ) from error

    async def close(self) -> None:
        """Close everything: no thread and no socket is left."""
        if self._search is not None:
            self._search.cancel()
            await asyncio.gather(self._search, return_exceptions=True)
        for link in self._links.values():
            await link.close()
        if self._mavsdk is not None:
            # In a thread, as it waits for its own. What else is MAVSDK's is held until then: it must
            # not be collected, and thereby destroyed, at the same time.
            await asyncio.get_running_loop().run_in_executor(None, self._mavsdk.destroy)
            self._mavsdk = None
        self._links.clear()
        self._systems.clear()
        library.leave_log(self._logger)

    async def _attach(self, found: Any) -> None:
        """Attach the links of the systems that are found."""
        async with contextlib.aclosing(found):
            async for _ in found:
                systems = await self._mavsdk.get_systems()
                self._systems += systems
                for system in systems:
                    link = self._links.get(await system.get_system_id())
                    if link is not None and not link.attached:
                        link.attach(system)
