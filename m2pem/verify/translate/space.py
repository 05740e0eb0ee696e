"""Shared space: which is followed, and how vehicles move in and out of it.

Of a shared space that more vehicles may enter than have room, the net knows how many are in it. A
behavior whose way enters it begins only if there is room. Where a vehicle stands between its
behaviors is followed as far as ways depend on it: the *standings* of a `Group` of interchangeable
vehicles. After an interruption a vehicle may stand anywhere: inside of what it was on its way
through, or outside. Spaces with room for all that may enter them are left out.
"""

import itertools
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.fleet import Fleet, OnConflict, SharedSpace
from m2pem.fleet.space import BY_HAND, ONE_BY_ONE, may_wait_for_space
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.verify.translate.order import later_tasks
from m2pem.verify.translate.pools import Candidates, behaviors
from m2pem.verify.translate.ways import KnownWays, Station, Way

Spaces: TypeAlias = frozenset[str]
"""Names of shared spaces."""

Members: TypeAlias = Mapping[ResourceId, tuple[int, ...]]
"""The vehicles that may do a behavior, with which members of its team each may be."""

Tasks: TypeAlias = Mapping[e.FlowNode, tuple[Behavior, Members]]
"""The tasks that move vehicles."""

OwnTasks: TypeAlias = Mapping[e.FlowNode, tuple[Behavior, Sequence[int]]]
"""The tasks of one vehicle, with which members of their teams it may be."""

LaterTasks: TypeAlias = Mapping[e.FlowNode, frozenset[e.FlowNode]]
"""By task, those that may come after it."""

MOST_UNKNOWN = 4
"""Of more shared spaces than this of which it is not known whether a way enters them, only none,
each, and all together are followed."""


def space_plan(
    mission: Mission,
    process: e.Process,
    fleet: Fleet,
    candidates: Candidates,
    ways: KnownWays | None,
) -> "SpacePlan | None":
    """Return what is followed of the shared spaces of a fleet; None: nobody competes for them."""
    if ways is None or not fleet.shared_space:
        return None
    tasks = {
        node: (behavior, members)
        for node, behavior in behaviors(mission)
        if ways.moves(behavior) and (members := _members(node, behavior, fleet, candidates))
    }
    later = later_tasks(mission, process, tasks)
    followed = _competed_for(fleet, tasks, later, ways)
    if not followed:
        return None
    alone = replace(fleet, shared_space=followed, on_conflict=OnConflict.REFUSE)
    asking = {
        node
        for node, behavior in behaviors(mission)
        if may_wait_for_space(
            alone, behavior.type, behavior.name, _members(node, behavior, fleet, candidates)
        )
    }
    return SpacePlan(alone, followed, tasks, asking, later, ways)


def _members(node: e.FlowNode, behavior: Behavior, fleet: Fleet, candidates: Candidates) -> Members:
    found: dict[ResourceId, tuple[int, ...]] = {}
    if node not in candidates:
        try:
            named = allocate(behavior, fleet).resources
        except AllocationError:
            return {}
        return {each: (index,) for index, each in enumerate(named) if each in fleet.vehicles}
    first = 0
    for each in candidates[node]:
        need = each.role.need
        most = len(each.resources) if each.named or need is None else need.most
        for place, vehicle in enumerate(each.resources):
            if vehicle in fleet.vehicles:
                indexes = (first + place,) if each.named else tuple(range(first, first + most))
                found[vehicle] = (*found.get(vehicle, ()), *indexes)
        first += most
    if behavior.type is not BehaviorType.TEAM:
        return dict.fromkeys(found, (0,))
    return found


def _competed_for(
    fleet: Fleet, tasks: Tasks, later: LaterTasks, ways: KnownWays
) -> dict[str, SharedSpace]:
    """Return the shared spaces which more vehicles may be in than they have room for."""
    may_enter: Counter[str] = Counter()
    for vehicle in fleet.vehicles:
        own = _tasks_of(vehicle, tasks)
        entered: set[str] = set()
        for station, coming in _stations(ways, (vehicle,), own, later):
            inside = ways.inside(station, vehicle)
            entered.update(name for name, there in inside.items() if there)
            for node in coming:
                behavior, indexes = own[node]
                way = ways.way(behavior, (vehicle,), indexes, station)
                entered.update(name for name, enters in way.enters.items() if enters is not False)
        may_enter.update(entered)
    return {n: s for n, s in fleet.shared_space.items() if may_enter[n] > s.capacity}


def _tasks_of(vehicle: ResourceId, tasks: Tasks) -> OwnTasks:
    return {
        node: (behavior, members[vehicle])
        for node, (behavior, members) in tasks.items()
        if vehicle in members
    }


def _stations(
    ways: KnownWays, vehicles: Sequence[ResourceId], own: OwnTasks, later: LaterTasks
) -> list[tuple[Station, frozenset[e.FlowNode]]]:
    """Return where vehicles may stand before and after their tasks, with those that may come."""
    found: dict[tuple[Station, frozenset[e.FlowNode]], None] = {}
    waiting = [(ways.home(each), frozenset(own)) for each in vehicles]
    while waiting:
        station, coming = waiting.pop()
        if (station, coming) in found:
            continue
        found[station, coming] = None
        for node in coming:
            behavior, indexes = own[node]
            then = later[node].intersection(own)
            after = ways.way(behavior, vehicles, indexes, station).after
            waiting += [(after, then), (ways.anywhere, then)]
    return list(found)


def _possible(known: Mapping[str, bool | None], followed: Collection[str]) -> tuple[Spaces, ...]:
    """Return all sets of spaces that agree with what is known of each."""
    sure = frozenset(name for name in followed if known.get(name, False))
    open_ = [name for name in followed if known.get(name, False) is None]
    counts: Sequence[int] = range(len(open_) + 1)
    if len(open_) > MOST_UNKNOWN:
        counts = (0, 1, len(open_))
    return tuple(
        sure | frozenset(some) for count in counts for some in itertools.combinations(open_, count)
    )


@dataclass(frozen=True, slots=True)
class Departure:
    """What comes of a behavior that begins at some standing of its vehicle.

    `enters`: the spaces that its way enters, beside those that it is in. `after`: the standings in
    which it may end; `cut`: those in which an interruption may leave it. `leaves`: spaces that it
    leaves before the behavior ends; `stays`: those in which it ends.
    """

    enters: Spaces
    after: tuple[int, ...]
    cut: tuple[int, ...]
    leaves: Spaces
    stays: Spaces


@dataclass(slots=True)
class Group:
    """Interchangeable vehicles of one domain.

    `standings`: by number, the spaces that a vehicle is in which stands so. Where it is not known
    of a place which ways from there enter a space, it has two: all of them do, or none.
    `departures`: by task and standing. `initial`: how many vehicles stand in one of some ways at
    first. `unknown`: by task, the spaces of which it is not known whether its way enters them, but
    for its way after an interruption.
    """

    vehicles: tuple[ResourceId, ...]
    standings: list[Spaces] = field(default_factory=list)
    departures: dict[tuple[e.FlowNode, int], Departure] = field(default_factory=dict)
    initial: Counter[tuple[int, ...]] = field(default_factory=Counter)
    unknown: dict[e.FlowNode, Spaces] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The names of its vehicles."""
        return "|".join(self.vehicles)


Mover: TypeAlias = tuple[Group, int]
"""A vehicle of a group that a behavior has: its number among those of the group."""


@dataclass(frozen=True, slots=True)
class Move:
    """A behavior's vehicle begins to move from a standing."""

    mover: Mover
    standing: int
    departure: Departure

    @property
    def inside(self) -> Spaces:
        """The spaces that it is in before it moves."""
        return self.mover[0].standings[self.standing]


class SpacePlan:
    """The shared spaces that are followed, and how vehicles move in and out of them.

    `spaces`: by name. `fleet`: with these alone.
    """

    def __init__(
        self,
        fleet: Fleet,
        spaces: Mapping[str, SharedSpace],
        tasks: Tasks,
        asking: Collection[e.FlowNode],
        later: LaterTasks,
        ways: KnownWays,
    ) -> None:
        self.spaces = spaces
        self.fleet = fleet
        self._tasks = tasks
        self._ways = ways
        self._asking = asking
        self._later = later
        self._groups: dict[tuple[ResourceId, ...], Group] = {}
        domains = {domain for space in spaces.values() for domain in space.domains}
        self._counted = frozenset(v.id for v in fleet.vehicles.values() if v.domain in domains)

    def likeness(self, resource: ResourceId) -> object:
        """Vehicles are interchangeable only if this is equal."""
        vehicle = self.fleet.vehicles.get(resource)
        return None if vehicle is None or resource not in self._counted else vehicle.domain

    def wait_s(self) -> float:
        """The shortest time that a task waits for space."""
        return min(each.wait_s for each in self.spaces.values() if each.waits)

    def most_in(self, space: str) -> int:
        """How many vehicles may be in a shared space."""
        domains = self.spaces[space].domains
        return sum(each.domain in domains for each in self.fleet.vehicles.values())

    def bystanders(self, groups: Collection[Group]) -> dict[ResourceId, Spaces]:
        """Return the vehicles that stand in the spaces and never move; `groups`: of those that
        do."""
        moved = {vehicle for group in groups for vehicle in group.vehicles}
        found = {}
        for vehicle in self.fleet.vehicles:
            if vehicle in self._counted - moved:
                known = self._ways.inside(self._ways.home(vehicle), vehicle)
                inside = frozenset(name for name in self.spaces if known.get(name))
                if inside:
                    found[vehicle] = inside
        return found

    def moves(self, node: e.FlowNode) -> bool:
        """Whether a task moves vehicles."""
        return node in self._tasks

    def counts(self, resource: ResourceId) -> bool:
        """Whether a vehicle counts in any of the spaces."""
        return resource in self._counted

    def unknown_homes(self) -> list[ResourceId]:
        """Return the vehicles that move, and of which it is not known where they stand at first."""
        moved = {vehicle for _, members in self._tasks.values() for vehicle in members}
        return [
            each
            for each in self.fleet.vehicles
            if each in moved & self._counted and self._ways.home(each) == self._ways.anywhere
        ]

    def unknown(self, node: e.FlowNode, groups: Collection[Group]) -> Spaces:
        """Return the spaces of which it is not known whether the way of a task enters them, but
        for its way after an interruption."""
        return frozenset[str]().union(*(group.unknown.get(node, ()) for group in groups))

    def by_hand(self, node: e.FlowNode) -> bool:
        """Whether a person drives the vehicles of a task."""
        return node in self._tasks and self._tasks[node][0].name in BY_HAND

    # --- groups -----------------------------------------------------------------------------------

    def group(self, vehicles: tuple[ResourceId, ...]) -> Group:
        """Return a group with all its standings and departures."""
        known = self._groups.get(vehicles)
        if known is None:
            known = self._groups[vehicles] = self._made(vehicles)
        return known

    def _made(self, vehicles: tuple[ResourceId, ...]) -> Group:
        one, ways = vehicles[0], self._ways
        own = _tasks_of(one, self._tasks)
        stations = _stations(ways, vehicles, own, self._later)
        entered = {name for each in stations for name in self._entered(*each, vehicles, own)}
        raw: list[_Standing] = []
        numbers: dict[tuple[Station, frozenset[e.FlowNode]], list[int]] = {}
        for station, later in stations:
            known = ways.inside(station, one)
            if station == ways.anywhere:
                known = dict.fromkeys(entered)
            open_ = self._open(station, vehicles, {node: own[node] for node in later})
            for inside in _possible(known, self.spaces):
                for enters in _possible(dict.fromkeys(open_ - inside), self.spaces):
                    numbers.setdefault((station, later), []).append(len(raw))
                    raw.append(_Standing(station, later, inside, enters))
        found = {}
        for number, each in enumerate(raw):
            for node in each.later:
                behavior, indexes = own[node]
                way = ways.way(behavior, vehicles, indexes, each.station)
                then = self._later[node].intersection(own)
                after = tuple(numbers[way.after, then])
                cut = tuple(numbers[ways.anywhere, then])
                found[node, number] = self._departure(way, each, after, cut)
        group = _merged(vehicles, raw, found, list(own), ways)
        homes = {ways.home(each) for each in vehicles}
        for station, later in stations:
            if station != ways.anywhere or station in homes:
                for node in later:
                    open_ = self._open(station, vehicles, {node: own[node]})
                    group.unknown[node] = group.unknown.get(node, frozenset()) | open_
        return group

    def _open(self, station: Station, vehicles: tuple[ResourceId, ...], own: OwnTasks) -> Spaces:
        """Return the spaces of which it is not known whether some ways from a station enter
        them."""
        ways = (self._ways.way(b, vehicles, indexes, station) for b, indexes in own.values())
        unknown = {n for way in ways for n, enters in way.enters.items() if enters is None}
        return frozenset(unknown & self.spaces.keys())

    def _entered(
        self,
        station: Station,
        later: Collection[e.FlowNode],
        vehicles: tuple[ResourceId, ...],
        own: OwnTasks,
    ) -> Iterator[str]:
        """Spaces that a vehicle may stand in when it is interrupted."""
        for node in later:
            behavior, indexes = own[node]
            way = self._ways.way(behavior, vehicles, indexes, station)
            yield from (n for n, enters in way.enters.items() if enters is not False)
        if station != self._ways.anywhere:
            inside = self._ways.inside(station, vehicles[0])
            yield from (n for n, there in inside.items() if there is not False)

    def _departure(
        self, way: Way, standing: "_Standing", after: tuple[int, ...], cut: tuple[int, ...]
    ) -> Departure:
        enters = frozenset(
            name
            for name in self.spaces
            if (known := way.enters.get(name, False)) or (known is None and name in standing.enters)
        )
        leaves = way.leaves & (enters | standing.inside)
        stays = way.stays & enters
        return Departure(enters - standing.inside, after, cut, leaves, stays)

    def groups(self, pool_of: Mapping[ResourceId, tuple[ResourceId, ...]]) -> list[Group]:
        """Return the groups of all vehicles that move; `pool_of`: those in pools."""
        moved = {vehicle for _, members in self._tasks.values() for vehicle in members}
        pools = (pool_of.get(r, (r,)) for r in self.fleet.vehicles if r in moved & self._counted)
        return [self.group(pool) for pool in dict.fromkeys(pools)]

    def movers(
        self, node: e.FlowNode, pool_of: Mapping[ResourceId, tuple[ResourceId, ...]]
    ) -> list[Mover]:
        """Return all vehicles that a task may move at a time; `pool_of`: those in pools."""
        if node not in self._tasks:
            return []
        behavior, members = self._tasks[node]
        found: dict[tuple[ResourceId, ...], int] = {}
        for vehicle, indexes in members.items():
            if vehicle in self._counted:
                pool = pool_of.get(vehicle, (vehicle,))
                team = behavior.type is BehaviorType.TEAM
                found[pool] = min(len(pool), len(indexes) if team else self._roles(behavior))
        return [(self.group(pool), n) for pool, count in found.items() for n in range(count)]

    @staticmethod
    def _roles(behavior: Behavior) -> int:
        return max(len(behavior.roles), 1)

    def asks(self, node: e.FlowNode) -> bool:
        """Whether a task asks for space before its behavior begins."""
        return node in self._asking

    # --- what a task may do -----------------------------------------------------------------------

    def starts(self, node: e.FlowNode, movers: Sequence[Mover]) -> Iterator[tuple[Move, ...]]:
        """Yield how the vehicles of a task may begin: from which standings, into which spaces."""
        each_way = []
        for mover in movers:
            group, _ = mover
            ways = [
                Move(mover, standing, departure)
                for standing in range(len(group.standings))
                if (departure := group.departures.get((node, standing))) is not None
            ]
            each_way.append(ways)
        for moves in itertools.product(*each_way):
            alike = itertools.pairwise(moves)
            if all(a.mover[0] is not b.mover[0] or a.standing <= b.standing for a, b in alike):
                yield moves

    def needed(self, behavior: Behavior, moves: Sequence[Move]) -> dict[str, tuple[int, int]]:
        """Return, by space, for how many vehicles there must be room beside those that are in it,
        and how many enter."""
        found = {}
        for name in self.spaces:
            entering = [m for m in moves if name in m.departure.enters and name not in m.inside]
            if not entering:
                continue
            room = len(entering)
            if behavior.name in ONE_BY_ONE:
                staying = sum(name in m.departure.stays for m in entering)
                room = min(room, staying + 1)
            found[name] = (room, len(entering))
        return found


@dataclass(frozen=True, slots=True)
class _Standing:
    """How a vehicle stands at a station: in which spaces, and which of those are entered by ways
    of which it is not known. `later`: the tasks that may come."""

    station: Station
    later: frozenset[e.FlowNode]
    inside: Spaces
    enters: Spaces


def _merged(
    vehicles: tuple[ResourceId, ...],
    raw: Sequence[_Standing],
    found: Mapping[tuple[e.FlowNode, int], Departure],
    nodes: Sequence[e.FlowNode],
    ways: KnownWays,
) -> Group:
    """Return a group in which standings are one that nothing distinguishes."""
    alike = _classes(raw, found, nodes)
    group = Group(vehicles)
    count = max(alike, default=-1) + 1
    group.standings = [raw[alike.index(number)].inside for number in range(count)]
    for (node, number), departure in found.items():
        group.departures[node, alike[number]] = replace(
            departure,
            after=tuple(sorted({alike[each] for each in departure.after})),
            cut=tuple(sorted({alike[each] for each in departure.cut})),
        )

    def standings_at(station: Station, *, outside: bool = False) -> tuple[int, ...]:
        first = {*nodes}
        there = (n for n, s in enumerate(raw) if s.station == station and s.later == first)
        return tuple(sorted({alike[n] for n in there if not (outside and raw[n].inside)}))

    for vehicle in vehicles:
        home = ways.home(vehicle)
        # Where it is not known, it is taken to be in no space.
        group.initial[standings_at(home, outside=home == ways.anywhere)] += 1
    return group


def _classes(
    raw: Sequence[_Standing],
    found: Mapping[tuple[e.FlowNode, int], Departure],
    nodes: Sequence[e.FlowNode],
) -> list[int]:
    """Return the class of each standing: equal ones enter the same, and end in equal ones."""
    classes = [0] * len(raw)
    while True:
        keys: dict[object, int] = {}
        refined = []
        for number, standing in enumerate(raw):
            outcomes = tuple(
                (
                    node,
                    departure.enters,
                    departure.leaves,
                    departure.stays,
                    frozenset(classes[each] for each in departure.after),
                    frozenset(classes[each] for each in departure.cut),
                )
                for node in nodes
                if (departure := found.get((node, number))) is not None
            )
            refined.append(keys.setdefault((classes[number], standing.inside, outcomes), len(keys)))
        if refined == classes:
            return classes
        classes = refined
