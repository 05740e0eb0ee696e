"""Opens the links to the vehicles of a fleet."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION, open_link
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.mavsdk_driver.ground_station import open_mavsdk_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.settings import Settings
from m2pem_plugin_mavlink.signing.key_file import SigningError
from m2pem_plugin_mavlink.vehicle.failsafe import FailsafeMonitor
from m2pem_plugin_mavlink.vehicle.takeover_monitor import TakeoverMonitor
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

_OPEN: Mapping[str, Callable[..., Awaitable[VehicleLink]]] = {
    "pymavlink": open_link,
    "mavsdk": open_mavsdk_link,
}


class MavlinkVehicleConnections:
    """Implements `m2pem_plugin_mavlink.arbiter.VehicleConnections`; `lost_after_s`: of each
    vehicle."""

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
        self._links: list[VehicleLink] = []
        self._vehicles: dict[ResourceId, Vehicle] = {}

    async def open(self) -> Mapping[ResourceId, Vehicle]:
        """Open the links.

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
            link = await _OPEN[settings.driver](
                address,
                settings.urls,
                clock,
                source,
                self._context.may_send,
                **({"signing": settings.signing} if settings.signing is not None else {}),
            )
        except SigningError as error:
            raise PluginError(f"{resource}: connection.signing: {error}") from error
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

    def watch(self, vehicle: Vehicle) -> TakeoverMonitor:
        return TakeoverMonitor(vehicle, self._settings[vehicle.resource].gcs_system_id)

    def failsafes(self, vehicle: Vehicle) -> FailsafeMonitor:
        word = self._connections[vehicle.resource].failsafe
        own = self._settings[vehicle.resource].gcs_system_id
        return FailsafeMonitor(vehicle, word, own)

    async def close(self) -> None:
        for vehicle in self._vehicles.values():
            await vehicle.close()
        await asyncio.gather(*(link.close() for link in self._links))
        self._vehicles, self._links = {}, []
