"""The arbiters of a fleet: which one serves which resource, and what it offers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from m2pem.api.arbiter import Arbiter, ArbiterContext, Connection
from m2pem.model.catalogue import BehaviorSpec, ResourceId
from m2pem.model.geometry import Area
from m2pem.resources.fleet import Fleet
from m2pem.resources.graph import ResourceGraph

SIMULATED = "sim"
"""The arbiter that serves everything in a simulated fleet."""


class ArbiterPlugins(Protocol):
    """The part of the plugin manager that is needed here."""

    def arbiter(self, name: str) -> Callable[..., Arbiter]:
        """The factory registered under a name; raises PluginError when there is none."""
        ...


class FleetArbiters:
    """One object per registered name, built from the fleet. Building needs no connection.

    `simulated`: every arbiter is replaced by the simulated one; `settings` are then added to the
    connection of every resource.

    Raises:
        PluginError: the fleet names an arbiter that no plugin provides.
    """

    def __init__(
        self,
        fleet: Fleet,
        plugins: ArbiterPlugins,
        context: ArbiterContext,
        *,
        simulated: bool = False,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        self.fleet = fleet
        extra = dict(settings or {})
        area = fleet.geometries.get(fleet.fence)
        fence = area if isinstance(area, Area) else None
        connections: dict[str, dict[ResourceId, Connection]] = {}
        for vehicle in fleet.vehicles.values():
            name = SIMULATED if simulated else vehicle.arbiter
            connections.setdefault(name, {})[vehicle.id] = Connection(
                vehicle.id,
                vehicle.domain.value,
                {**vehicle.settings, **extra},
                vehicle.behaviors,
                lost_after_s=vehicle.lost_after_s,
                failsafe=vehicle.failsafe,
                fence=fence,
                sitl=vehicle.sitl,
            )
        for payload in fleet.payloads.values():
            name = SIMULATED if simulated else payload.arbiter
            owner = fleet.vehicles[payload.vehicle]
            connections.setdefault(name, {})[payload.id] = Connection(
                payload.id,
                owner.domain.value,
                {**payload.settings, **extra},
                payload.behaviors,
                detector=payload.detector,
                lost_after_s=owner.lost_after_s,
                failsafe=owner.failsafe,
                fence=fence,
                sitl=owner.sitl,
            )
        self.nothing_is_real = all(
            name == SIMULATED or connection.sitl
            for name, group in connections.items()
            for connection in group.values()
        )
        self.by_name: dict[str, Arbiter] = {
            name: plugins.arbiter(name)(group, context) for name, group in connections.items()
        }
        self._of: dict[ResourceId, Arbiter] = {
            resource: self.by_name[name]
            for name, group in connections.items()
            for resource in group
        }
        self.graph = ResourceGraph(fleet, self.offered)

    def of(self, resource: ResourceId) -> Arbiter:
        """The arbiter that serves a resource."""
        return self._of[resource]

    def offered(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What the arbiter offers on a resource, before the fleet's `behaviors` list."""
        return self._of[resource].catalogue(resource)

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """What every resource can do in this fleet."""
        return {resource: self.graph.offers(resource) for resource in self._of}

    @property
    def resources(self) -> Sequence[ResourceId]:
        """Every vehicle and payload."""
        return tuple(self._of)
