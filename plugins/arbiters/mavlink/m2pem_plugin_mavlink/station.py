"""The vehicles of a fleet behind links of our own."""

from collections.abc import Mapping

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.foreign import TakeoverWatch
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION, RoutedLink, open_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.settings import Settings
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle


class LinkedStation:
    """Implements `m2pem_plugin_mavlink.arbiter.Station`; `lost_after_s`: of each vehicle."""

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        settings: Mapping[ResourceId, Settings],
        context: ArbiterContext,
        lost_after_s: Mapping[ResourceId, float],
    ) -> None:
        self._connections = connections
        self._settings = settings
        self._context = context
        self._lost_after_s = lost_after_s
        self._links: list[RoutedLink] = []
        self._vehicles: dict[ResourceId, Vehicle] = {}

    async def open(self) -> Mapping[ResourceId, Vehicle]:
        """Open the endpoints, and listen.

        Raises:
            PluginError: a URL is wrong, or an endpoint cannot be opened; nothing stays open.
        """
        try:
            for resource, settings in self._settings.items():
                await self._reach(resource, settings)
        except BaseException:
            await self.close()
            raise
        return self._vehicles

    async def _reach(self, resource: ResourceId, settings: Settings) -> None:
        clock = self._context.clock
        address = Address(settings.system_id, settings.component_id)
        source = Address(settings.gcs_system_id, GROUND_STATION.component)
        try:
            link = await open_link(address, settings.urls, clock, source)
        except PluginError as error:
            raise PluginError(f"{resource}: connection.url: {error}") from error
        self._links.append(link)
        vehicle = Vehicle(
            resource,
            self._connections[resource].domain,
            link,
            clock,
            lost_after_s=self._lost_after_s[resource],
            logger=self._context.logger,
        )
        self._vehicles[resource] = vehicle
        vehicle.open()

    def watch(self, vehicle: Vehicle) -> TakeoverWatch:
        """What notices that somebody else steers; not open yet."""
        return TakeoverWatch(vehicle, self._settings[vehicle.resource].gcs_system_id)

    async def close(self) -> None:
        """Close all that was opened."""
        for vehicle in self._vehicles.values():
            await vehicle.close()
        for link in self._links:
            await link.close()
        self._vehicles, self._links = {}, []
