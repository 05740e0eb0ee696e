"""The resource graph: payloads on vehicles, vehicles in teams, and what each can do.

Nodes are vehicles, payloads, teams and capabilities; a capability is one behavior that a resource
offers. Edges: a payload is MOUNTED_ON a vehicle, a vehicle is a MEMBER_OF a team, a vehicle or
payload offers a capability: that edge has the resource's own spec of the behavior, as two arbiters
may take different parameters for one. The graph never changes; `allocation` says which resources
are free.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, TypeAlias

import rustworkx

from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet, Payload, Vehicle
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

Catalogue: TypeAlias = Callable[[ResourceId], Sequence[BehaviorSpec]]
"""What the arbiter of a resource offers on it, before the fleet's `behaviors` list."""


class Relation(StrEnum):
    """What an edge says about its source."""

    MOUNTED_ON = "mounted on"
    MEMBER_OF = "member of"


@dataclass(frozen=True, slots=True)
class ResourceNode:
    """A vehicle, payload or team."""

    kind: BehaviorType
    id: str


class Capability(NamedTuple):
    """A behavior that a resource offers."""

    name: str
    type: BehaviorType


class ResourceGraph:
    """Built once from a fleet and what its arbiters offer. Answers are in the fleet's order."""

    def __init__(self, fleet: Fleet, catalogue: Catalogue) -> None:
        self.fleet = fleet
        self._graph: rustworkx.PyDiGraph = rustworkx.PyDiGraph()
        self._index: dict[Capability | str, int] = {}
        self._offers: dict[str, tuple[BehaviorSpec, ...]] = {}
        self._sorted: dict[tuple[int, ...], tuple[BehaviorSpec, ...]] = {}
        for vehicle in fleet.vehicles.values():
            self._add(BehaviorType.VEHICLE, vehicle.id)
            self._add_offers(vehicle, catalogue)
        for payload in fleet.payloads.values():
            index = self._add(BehaviorType.PAYLOAD, payload.id)
            self._graph.add_edge(index, self._index[payload.vehicle], Relation.MOUNTED_ON)
            self._add_offers(payload, catalogue)
        for team in fleet.teams.values():
            index = self._add(BehaviorType.TEAM, team.name)
            for member in spelled_out(team):
                self._graph.add_edge(self._index[member], index, Relation.MEMBER_OF)

    def _add(self, kind: BehaviorType, resource: str) -> int:
        index: int = self._graph.add_node(ResourceNode(kind, resource))
        self._index[resource] = index
        return index

    def _add_offers(self, resource: Vehicle | Payload, catalogue: Catalogue) -> None:
        offered = [
            spec
            for spec in catalogue(resource.id)
            if resource.behaviors is None or spec.name in resource.behaviors
        ]
        # Most vehicles of a fleet offer the same: it is sorted once.
        same = tuple(map(id, offered))
        if same not in self._sorted:
            self._sorted[same] = tuple(sorted(offered, key=lambda spec: (spec.name, spec.type)))
        self._offers[resource.id] = self._sorted[same]
        here, edges = self._index[resource.id], []
        for spec in offered:
            capability = Capability(spec.name, spec.type)
            there = self._index.get(capability)
            if there is None:
                there = self._index[capability] = self._graph.add_node(capability)
            edges.append((here, there, spec))
        self._graph.add_edges_from(edges)

    def kind(self, resource: str) -> BehaviorType | None:
        """Whether a name is a vehicle, payload or team; None when the fleet lacks it."""
        index = self._index.get(resource)
        return None if index is None else self._graph[index].kind

    def payloads(self, vehicle: ResourceId) -> tuple[ResourceId, ...]:
        """What is mounted on a vehicle."""
        return self._sources(vehicle, Relation.MOUNTED_ON)

    def vehicle(self, payload: ResourceId) -> ResourceId | None:
        """What a payload is mounted on."""
        return next(iter(self._targets(payload, Relation.MOUNTED_ON)), None)

    def members(self, team: str) -> tuple[ResourceId, ...]:
        """The vehicles of a team, its lead first."""
        return self._sources(team, Relation.MEMBER_OF)

    def teams(self, vehicle: ResourceId) -> tuple[str, ...]:
        """The teams that a vehicle belongs to."""
        return self._targets(vehicle, Relation.MEMBER_OF)

    def spec(self, resource: str, name: str, type_: BehaviorType) -> BehaviorSpec | None:
        """How a vehicle, payload or team takes a behavior; None when it does not.

        A team takes what all of its members offer; its lead says with which parameters.
        """
        if self.kind(resource) is BehaviorType.TEAM:
            specs = [self.spec(member, name, type_) for member in self.members(resource)]
            return specs[0] if all(specs) else None
        here, there = self._index.get(resource), self._index.get(Capability(name, type_))
        if here is None or there is None or not self._graph.has_edge(here, there):
            return None
        spec: BehaviorSpec = self._graph.get_edge_data(here, there)
        return spec

    def offers(self, resource: str) -> tuple[BehaviorSpec, ...]:
        """Everything that a vehicle, payload or team takes, by name.

        A team has its team behaviors only; a member also lists those it can take part in.
        """
        if self.kind(resource) is BehaviorType.TEAM:
            lead = self.members(resource)[0]
            team = BehaviorType.TEAM
            names = [spec.name for spec in self.offers(lead) if spec.type is team]
            found = (self.spec(resource, name, team) for name in names)
            return tuple(spec for spec in found if spec is not None)
        return self._offers.get(resource, ())

    def offering(self, name: str, type_: BehaviorType) -> tuple[str, ...]:
        """The vehicles, payloads or (for a team behavior) teams that take a behavior."""
        if type_ is BehaviorType.TEAM:
            return tuple(team for team in self.fleet.teams if self.spec(team, name, type_))
        index = self._index.get(Capability(name, type_))
        if index is None:
            return ()
        sources = sorted(source for source, _, _ in self._graph.in_edges(index))
        return tuple(self._graph[source].id for source in sources)

    def _sources(self, resource: str, relation: Relation) -> tuple[ResourceId, ...]:
        if resource not in self._index:
            return ()
        edges = self._graph.in_edges(self._index[resource])
        # The library lists the newest edge first.
        return tuple(self._graph[s].id for s, _, data in reversed(edges) if data is relation)

    def _targets(self, resource: str, relation: Relation) -> tuple[ResourceId, ...]:
        if resource not in self._index:
            return ()
        edges = self._graph.out_edges(self._index[resource])
        return tuple(self._graph[t].id for _, t, data in reversed(edges) if data is relation)
