"""The arbiters of a fleet: which one serves which resource, what it offers, and its connection."""

import json
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

from m2pem.api.arbiter import (
    Arbiter,
    ArbiterContext,
    BehaviorReport,
    Connection,
    detects,
    names_addresses,
)
from m2pem.api.capabilities import arbiter_capabilities, arbiter_problem
from m2pem.api.hosting import HostedArbiter
from m2pem.api.telemetry import Telemetry
from m2pem.errors import FleetError, PluginError
from m2pem.findings import Finding
from m2pem.fleet.fleet import SIMULATED, Fleet
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.plugins import Plugins
from m2pem.teams.capabilities import Capabilities

if TYPE_CHECKING:
    from m2pem.teams.arbiter import Teams


def _located(finding: Finding, fleet: Fleet) -> Finding:
    """An arbiter's finding about "vehicle.connection.key", with the fleet's file and line."""
    if finding.line:
        return finding
    resource = ResourceId(finding.element.partition(".connection.")[0])
    entry = fleet.vehicles.get(resource) or fleet.payloads.get(resource)
    return replace(finding, file=fleet.file, line=entry.line if entry else 0)


HOST_LINK = "zenoh"
"""The arbiter that represents those on other hosts."""


def _connections(fleet: Fleet) -> dict[tuple[str, str], dict[ResourceId, Connection]]:
    """The connections of each arbiter, by its name and the host that it runs on."""
    connections: dict[tuple[str, str], dict[ResourceId, Connection]] = {}
    for vehicle in fleet.vehicles.values():
        group = connections.setdefault((vehicle.arbiter, vehicle.host), {})
        group[vehicle.id] = Connection.of(fleet, vehicle.id)
    for payload in fleet.payloads.values():
        host = fleet.vehicles[payload.vehicle].host
        group = connections.setdefault((payload.arbiter, host), {})
        group[payload.id] = Connection.of(fleet, payload.id)
    return connections


def hosted_arbiters(fleet: Fleet, plugins: Plugins, host: str) -> list[HostedArbiter]:
    """Return the arbiters that run on a host of the fleet.

    Raises:
        PluginError: the fleet names an arbiter that no plugin provides.
    """
    return [
        HostedArbiter(
            fleet.name,
            fleet.hosts[host],
            name,
            group,
            {each: fleet.vehicles[_vehicle(each)].when_cut_off for each in group},
            partial(plugins.arbiter(name), group),
        )
        for (name, where), group in _connections(fleet).items()
        if where == host
    ]


def _vehicle(resource: ResourceId) -> ResourceId:
    return ResourceId(resource.partition("/")[0])


class FleetArbiters:
    """One object per registered name and host, built from the fleet. Building needs no connection.

    Raises:
        PluginError: the fleet names an arbiter that no plugin provides, or one that declares
            capabilities which it does not have.
        FleetError: an arbiter cannot use the settings of a resource.
    """

    def __init__(self, fleet: Fleet, plugins: Plugins, context: ArbiterContext) -> None:
        self.fleet = fleet
        found = _connections(fleet)
        self.nothing_is_real = all(
            name == SIMULATED or connection.sitl
            for (name, _), group in found.items()
            for connection in group.values()
        )
        connections = {_label(name, host): group for (name, host), group in found.items()}
        self.by_name: dict[str, Arbiter] = {}
        try:
            for (name, host), group in found.items():
                if not host:
                    self.by_name[name] = plugins.arbiter(name)(group, context)
            for host in fleet.hosts:
                for hosted in hosted_arbiters(fleet, plugins, host):
                    link = plugins.arbiter(HOST_LINK)
                    arbiter = link(hosted.connections, context, hosted)
                    self.by_name[_label(hosted.name, host)] = arbiter
        except FleetError as error:
            located = [_located(finding, fleet) for finding in error.findings]
            raise FleetError(error.what, located) from error
        for name, arbiter in self.by_name.items():
            if problem := arbiter_problem(arbiter):
                raise PluginError(f"arbiter {name!r}: {problem}")
        self._of: dict[ResourceId, Arbiter] = {
            resource: self.by_name[name]
            for name, group in connections.items()
            for resource in group
        }
        self._context = context
        self._connections = connections
        self._capabilities = Capabilities(fleet, self.of)
        self.graph = ResourceGraph(fleet, self.offered)

    @cached_property
    def teams(self) -> "Teams":
        """The arbiter of team behaviors that are made of behaviors of the members."""
        from m2pem.teams.arbiter import Teams  # noqa: PLC0415  # a check asks for offers alone

        return Teams(self.fleet, self.of, self._context, self._capabilities)

    @property
    def all(self) -> Mapping[str, Arbiter]:
        """Those of the fleet, and the one of teams whose members they serve."""
        apart = len(self.by_name) > 1 or any(map(_one_vehicle, self.by_name.values()))
        together = self.fleet.teams or (apart and len(self.fleet.vehicles) > 1)
        return {"teams": self.teams, **self.by_name} if together else self.by_name

    def serving(
        self, resources: Sequence[ResourceId], behavior: str, type_: BehaviorType
    ) -> Arbiter | None:
        """Who does a behavior on resources; None: they have different arbiters.

        A team behavior goes to the members' arbiter, if there is one that offers it for them all;
        else it is made of behaviors of the members. So is a behavior of vehicles that several are
        to do, where their arbiters take one vehicle each.
        """
        arbiters = dict.fromkeys(self.of(resource) for resource in resources)
        only = next(iter(arbiters)) if len(arbiters) == 1 else None
        if type_ is not BehaviorType.TEAM:
            together = len(resources) > 1 and all(each in self.fleet.vehicles for each in resources)
            apart = only is None or _one_vehicle(only)
            return self.teams if together and apart else only
        offers = only is not None and all(
            _has(only.catalogue(resource), behavior) for resource in resources
        )
        return only if offers else self.teams

    def holding(self, resource: ResourceId) -> Arbiter:
        """Who holds a resource, and lets it go on: its team while it is in one, else its own."""
        return self.teams if self.teams.marshals(resource) else self.of(resource)

    def host_of(self, resource: ResourceId) -> str:
        """The host on which the arbiter of a resource runs; "": in this process."""
        vehicle = self.fleet.vehicles.get(_vehicle(resource))
        return vehicle.host if vehicle is not None else ""

    def of(self, resource: ResourceId) -> Arbiter:
        """The arbiter that serves a resource."""
        return self._of[resource]

    def addresses(self) -> Mapping[ResourceId, tuple[str, Sequence[str]]]:
        """The name of each resource's arbiter, and what that connects to."""
        return {
            resource: (name, _addresses(self.by_name[name], connection))
            for name, group in self._connections.items()
            for resource, connection in group.items()
        }

    def offered(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What can be had of a resource, before the fleet's `behaviors` list: what its arbiter
        offers, and what teams can make of that."""
        own = tuple(self._of[resource].catalogue(resource))
        made = self._capabilities.together(resource)
        if not made:
            return own
        return (*own, *(spec for spec in made if not _has(own, spec.name)))

    @property
    def detectors(self) -> tuple[ResourceId, ...]:
        """The payloads that detect: the fleet marks them, or their arbiter knows it by their
        connection."""
        known = set(self.fleet.detectors)
        for arbiter in self.by_name.values():
            if detects(arbiter):
                known.update(arbiter.detectors)
        return tuple(payload for payload in self.fleet.payloads if payload in known)

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """What every resource can do in this fleet."""
        return {resource: self.graph.offers(resource) for resource in self._of}

    @property
    def resources(self) -> Sequence[ResourceId]:
        """Every vehicle and payload."""
        return tuple(self._of)


class FleetConnections:
    """Connects the arbiters of a fleet, and hands on what they report until `close`."""

    def __init__(
        self,
        arbiters: FleetArbiters,
        on_report: Callable[[BehaviorReport], Awaitable[None]],
        on_telemetry: Callable[[Telemetry], None],
    ) -> None:
        self._arbiters = arbiters
        self._on_report = on_report
        self._on_telemetry = on_telemetry

    async def connect(self) -> None:
        """Connect all arbiters, or none.

        Raises:
            PluginError: an arbiter cannot connect.
        """
        connected: list[Arbiter] = []
        for name, arbiter in self._arbiters.all.items():
            try:
                await arbiter.connect()
            except Exception as error:
                for other in connected:
                    await other.close()
                raise PluginError(f"arbiter {name} cannot connect: {error}") from error
            connected.append(arbiter)

    def listeners(self) -> Iterator[tuple[str, Callable[[], Awaitable[None]]]]:
        """What is to be awaited beside the runs, each with its name for the log."""
        for name, arbiter in self._arbiters.all.items():
            yield f"reports of {name}", partial(self._read_reports, arbiter)
            yield f"telemetry of {name}", partial(self._read_telemetry, arbiter)

    def lost_after_s(self, stretch: float) -> dict[ResourceId, float]:
        """After which silence the link of each vehicle is lost, `stretch` times as long.

        The fleet's bound counts, and on another host the way to it, which its arbiter adds.
        """
        bounds_s = {}
        for vehicle in self._arbiters.fleet.vehicles.values():
            own_s = self._arbiters.of(vehicle.id).limits(vehicle.id).lost_after_s
            stated_s = None if vehicle.host else vehicle.lost_after_s
            bounds_s[vehicle.id] = stretch * (stated_s or own_s)
        return bounds_s

    async def close(self) -> None:
        """Close all arbiters."""
        for arbiter in self._arbiters.all.values():
            await arbiter.close()

    async def _read_reports(self, arbiter: Arbiter) -> None:
        async for report in arbiter.reports():
            await self._on_report(report)

    async def _read_telemetry(self, arbiter: Arbiter) -> None:
        async for state in arbiter.telemetry():
            self._on_telemetry(state)


def _label(arbiter: str, host: str) -> str:
    return f"{arbiter} on {host}" if host else arbiter


def _has(specs: Sequence[BehaviorSpec], team_behavior: str) -> bool:
    return any(spec.name == team_behavior and spec.type is BehaviorType.TEAM for spec in specs)


def _addresses(arbiter: Arbiter, connection: Connection) -> Sequence[str]:
    if names_addresses(arbiter):
        return arbiter.addresses(connection.resource)
    settings = connection.settings
    return [json.dumps(dict(settings), sort_keys=True, default=str)] if settings else []


def _one_vehicle(arbiter: Arbiter) -> bool:
    return arbiter_capabilities(arbiter).one_vehicle
