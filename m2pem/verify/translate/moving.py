"""The places and transitions of vehicles that move in and out of shared space.

A vehicle that stands has a token on the place of its *standing*. A behavior takes it, and puts one
on a place of the task *on its way*, which says what the vehicle is in. A success moves that token
to where the vehicle then stands; whatever else resets the place gives it to what an interrupted
vehicle does: it stands anywhere. Internal transitions then take the vehicle out of what it has
left.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import ResourceId
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Place, Role, Step
from m2pem.verify.translate.context import ActivityInstance, TranslationContext
from m2pem.verify.translate.net_builder import Effect
from m2pem.verify.translate.pools import Pool
from m2pem.verify.translate.space import Departure, Group, Move, Mover, SpacePlan, Spaces

_REFUSED = ":refused"


def movers_of(
    context: TranslationContext,
    node: e.FlowNode,
    named: Sequence[str],
    chosen: Mapping[Pool, int] | None = None,
) -> list[Mover]:
    """Return the vehicles that a task moves, of those that it has. `chosen`: how many of pools."""
    plan = context.space
    if plan is None or not plan.moves(node):
        return []
    counts = dict(chosen or {})
    for each in map(ResourceId, named):
        pool = context.pool_of.get(each, (each,))
        counts[pool] = counts.get(pool, 0) + 1
    return [
        (plan.group(pool), number)
        for pool, count in counts.items()
        if plan.counts(pool[0])
        for number in range(count)
    ]


def begin_moving(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    movers: Sequence[Mover],
) -> list[Effect]:
    """Return the ways in which the vehicles of a task begin to move, as far as there is room."""
    plan = context.space
    if plan is None or not movers:
        return [Effect()]
    found = []
    for moves in plan.starts(instance.node, movers):
        context.net.size_limit.count_case(instance.node.id)
        needed = plan.needed(behavior, moves)
        limits = {n: plan.spaces[n].capacity - room for n, (room, _) in needed.items()}
        if min(limits.values(), default=0) < 0:
            continue
        busy = [_on_its_way(context, instance, move) for move in moves]
        entered = [
            place
            for name, (_, count) in needed.items()
            for place in (space_place(context, name),) * count
        ]
        found.append(
            Effect(
                consume=_standings(context, moves),
                inhibit=frozenset(busy) if instance.inside.several else frozenset(),
                at_most=tuple((space_place(context, n), most) for n, most in limits.items()),
                produce=(*entered, *busy),
            )
        )
    return found


def without_room(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    movers: Sequence[Mover],
    *,
    awaited: bool,
) -> list[Effect]:
    """Return when the vehicles of a task may not move, and the task does not wait for that.

    `awaited`: it waits where a space says so.
    """
    plan = context.space
    if plan is None or not movers:
        return []
    found: dict[object, Effect] = {}
    for moves in plan.starts(instance.node, movers):
        fits: tuple[tuple[int, int], ...] = ()
        for name, (room, _) in plan.needed(behavior, moves).items():
            space, place = plan.spaces[name], space_place(context, name)
            least = space.capacity - room + 1
            if not awaited or not space.waits or least <= 0:
                tested = (*_standings(context, moves), *(place,) * max(least, 0))
                step = Step(instance.node.id, Action.REFUSED, name)
                effect = Effect((step,), tested, at_most=fits, produce=tested)
                found[tested, fits] = effect
            fits = (*fits, (place, least - 1))
            if least <= 0:
                break
    return list(found.values())


def _standings(context: TranslationContext, moves: Sequence[Move]) -> tuple[int, ...]:
    places = (standing_place(context, move.mover[0], move.standing) for move in moves)
    return tuple(place for place in places if place is not None)


def stop_moving(context: TranslationContext, instance: ActivityInstance) -> Effect:
    """The effect of a success on the vehicles of a task: they stand where its way ends."""
    return Effect(moves=tuple(dict.fromkeys(_tracks(context, instance))))


def _tracks(context: TranslationContext, instance: ActivityInstance) -> Iterator[tuple[int, int]]:
    """Yield the places of the vehicles of a task on their way, with where each then stops."""
    plan = context.space
    assert plan is not None
    for mover in plan.movers(instance.node, context.pool_of):
        group, _ = mover
        for (node, standing), departure in group.departures.items():
            if node is not instance.node:
                continue
            held = group.standings[standing] | departure.enters
            for inside in _subsets_left(held, departure.leaves):
                busy = _busy_place(context, instance, mover, inside, departure)
                yield busy, _stopped(context, group, inside, departure.after)


def _subsets_left(held: Spaces, leaves: Spaces) -> list[Spaces]:
    """What a vehicle may be in that leaves some spaces, one after the other."""
    found = {held: None}
    waiting = [held]
    while waiting:
        each = waiting.pop()
        for name in sorted(each & leaves):
            rest = each - {name}
            if rest not in found:
                found[rest] = None
                waiting.append(rest)
    return list(found)


def _on_its_way(context: TranslationContext, instance: ActivityInstance, move: Move) -> int:
    inside = move.inside | move.departure.enters
    return _busy_place(context, instance, move.mover, inside, move.departure)


def _busy_place(
    context: TranslationContext,
    instance: ActivityInstance,
    mover: Mover,
    inside: Spaces,
    departure: Departure,
) -> int:
    """Return the place of a vehicle on its way, while it is in some spaces. It leaves some of them
    early."""
    group, number = mover
    leaves = departure.leaves & inside
    name = f":moves {number + 1} of {group.name} in {_said(inside)} to {departure.after}"
    name += f" or {departure.cut}"
    if leaves:
        name += f" leaves {_said(leaves)}"
    key = (instance.node, instance.inside.index, name)
    known = context.moving.get(key)
    if known is not None:
        return known
    net = context.net
    place = context.moving[key] = net.place(
        instance.node,
        instance.inside,
        Role.CONTROL,
        name,
        returns=(_stopped(context, group, inside, departure.cut),),
        holder=instance.active,
    )
    net.places[place] = replace(
        net.places[place], inside=tuple(sorted(inside)), vehicles=group.vehicles
    )
    for space in sorted(leaves):
        after = _busy_place(context, instance, mover, inside - {space}, departure)
        left = Effect(
            steps=(Step(instance.node.id, Action.LEFT, space),),
            consume=(place, space_place(context, space)),
            read=frozenset({instance.active}),
            produce=(after,),
        )
        net.transition(left, Kind.EXTERNAL)
    return place


def _stopped(
    context: TranslationContext, group: Group, inside: Spaces, after: tuple[int, ...]
) -> int:
    """Return the place of a vehicle that has just stopped; it then stands in one of the ways
    `after`: inside of no more than what it was in, unless it surely ends there."""
    name = f":stopped {group.name} in {_said(inside)} {after}"
    key = (context.process, context.everything.index, name)
    known = context.moving.get(key)
    if known is not None:
        return known
    place = context.moving[key] = _place_of_vehicles(context, group, name, inside)
    possible = [each for each in after if group.standings[each] <= inside] or list(after)
    for standing in dict.fromkeys(possible):
        there = standing_place(context, group, standing)
        left = inside - group.standings[standing]
        entered = group.standings[standing] - inside
        stands = Effect(
            steps=(Step(context.process.id, Action.STANDS, _stands(group, standing)),),
            consume=(place, *(space_place(context, name) for name in sorted(left))),
            produce=(
                *(() if there is None else (there,)),
                *(space_place(context, name) for name in sorted(entered)),
            ),
        )
        context.net.transition(stands)
    return place


def _stands(group: Group, standing: int) -> str:
    """Say that a vehicle is at rest in a shared space; "": it is not."""
    inside = group.standings[standing]
    vehicles = group.vehicles
    who = vehicles[0] if len(vehicles) == 1 else f"one of {', '.join(vehicles)}"
    return f"{who} is at rest in {_said(inside)}" if inside else ""


def standing_place(context: TranslationContext, group: Group, standing: int) -> int | None:
    """Return the place of the vehicles of a group that stand so; None: all stand alike."""
    if len(group.standings) < 2:
        return None
    inside = group.standings[standing]
    name = f":stands {standing + 1} {group.name} in {_said(inside)}"
    return _place_of_vehicles(context, group, name, inside)


def _place_of_vehicles(context: TranslationContext, group: Group, name: str, inside: Spaces) -> int:
    """Return a place with a token for each vehicle of a group that is at rest in some spaces."""
    place = context.net.place(
        context.process, context.everything, Role.CONTROL, name, several=len(group.vehicles) > 1
    )
    context.net.places[place] = replace(
        context.net.places[place],
        most=len(group.vehicles),
        inside=tuple(sorted(inside)),
        vehicles=group.vehicles,
    )
    return place


def space_place(context: TranslationContext, name: str) -> int:
    """Return the place with a token for each vehicle that is in a shared space."""
    assert context.space is not None
    place = context.net.place(
        context.process, context.everything, Role.CONTROL, f":in {name}", several=True
    )
    context.net.places[place] = replace(
        context.net.places[place], space=name, most=context.space.most_in(name)
    )
    return place


def refused_place(context: TranslationContext, instance: ActivityInstance) -> int:
    """Return the place of a token while a behavior has begun that is going to be rejected."""
    return context.net.place(instance.node, instance.inside, Role.CONTROL, _REFUSED)


def is_refused(place: Place) -> bool:
    """Whether a token on a place says that a behavior has begun that is going to be rejected."""
    return place.role is Role.CONTROL and place.name.endswith(_REFUSED)


def may_be_refused(context: TranslationContext, instance: ActivityInstance) -> bool:
    """Whether a behavior begins and is then rejected, because a shared space has no room."""
    plan = context.space
    return (
        plan is not None
        and plan.moves(instance.node)
        and not asks_for_space(context, instance.node)
    )


def asks_for_space(context: TranslationContext, node: e.FlowNode) -> bool:
    """Whether a task asks for space before its behavior begins."""
    return context.space is not None and context.space.asks(node)


def initial_places(context: TranslationContext) -> tuple[int, ...]:
    """Return the places of vehicles that stand at first, and of those in shared space."""
    plan = context.space
    if plan is None:
        return ()
    groups = plan.groups(context.pool_of)
    found: list[int] = []
    for group in groups:
        for standings, count in group.initial.items():
            place = standing_place(context, group, standings[0])
            if len(standings) > 1:
                inside = group.standings[standings[0]]
                place = _stopped(context, group, inside, standings)
            if place is not None:
                found += [place] * count
            for name in sorted(group.standings[standings[0]]):
                found += [space_place(context, name)] * count
    for vehicle, inside in plan.bystanders(groups).items():
        name = f":stays {vehicle}"
        place = context.net.place(context.process, context.everything, Role.CONTROL, name)
        context.net.places[place] = replace(
            context.net.places[place], inside=tuple(sorted(inside)), vehicles=(vehicle,)
        )
        found += [place, *(space_place(context, each) for each in sorted(inside))]
    _note(context, plan, groups)
    return tuple(found)


def _note(context: TranslationContext, plan: SpacePlan, groups: Sequence[Group]) -> None:
    """Note where the net is not exactly what vehicles do."""
    if unknown := plan.unknown_homes():
        are = "are" if len(unknown) > 1 else "is"
        what = f"where {', '.join(unknown)} {are} at first is not known: in no shared space"
        context.net.approximate(context.process, Exactness.BOUNDED, what)
    for node in context.mission.nodes:
        if names := plan.unknown(node, groups):
            what = f"whether its way enters {_said(names)} is not known for every place from which"
            context.net.approximate(node, Exactness.MORE, f"{what} it may begin: both are followed")
        if plan.by_hand(node):
            what = "the shared space into which an operator drives is not followed"
            context.net.approximate(node, Exactness.BOUNDED, what)


def _said(names: Spaces) -> str:
    return ", ".join(sorted(names))
