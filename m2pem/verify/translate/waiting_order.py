"""The order in which tasks that ask for resources are served, as far as the net follows it.

The executive serves the greatest priority first, then who asked first. A choice of any task that
asks may fire in the net, with two exceptions: of what one of greater priority could have that needs
one resource, and of what an earlier one keeps that waits for several. A place *before* has a token
while such a task asks that has asked before another one.
"""

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from m2pem.verify.net.petri_net import BEGINS, Action, Exactness, Kind, Role, Step
from m2pem.verify.translate.context import Asking, PassedOver, TranslationContext
from m2pem.verify.translate.keeping import sources
from m2pem.verify.translate.net_builder import Effect
from m2pem.verify.translate.pools import Pool

Kept = Mapping[int, int]
"""How many resources are kept, by the place where they are free. As many as its pool has: all."""


def may_take(context: TranslationContext, asking: Asking, pools: Iterable[Pool]) -> set[int]:
    """Return the places from which a task may take resources of some pools."""
    return {
        source.place
        for pool in pools
        if pool in asking.pools
        for source in sources(context, asking.scope, pool)
    }


def served_before(
    context: TranslationContext, asking: Asking, taken: Mapping[int, Pool]
) -> frozenset[int]:
    """Return the places of tasks of a greater priority that ask for some of what a task takes, and
    that could have it. `taken`: the places that it takes from, with their pools.
    """
    return frozenset(
        each.place
        for each in context.asking
        if each.urgent
        and each.priority > asking.priority
        and may_take(context, each, taken.values()) & taken.keys()
    )


# --- what is kept by tasks that wait for several --------------------------------------------------


def not_kept(context: TranslationContext, asking: Asking, taken: Mapping[int, int]) -> list[Effect]:
    """Return when no task that comes before keeps what a task takes: how many by place."""
    keepers = _keepers(context, asking, taken.keys())
    certain = {place for place, each in keepers.items() if _is_certain(context, each, asking)}
    inhibit = frozenset[int]()
    if asking.waits and (unsure := keepers.keys() - certain):
        over = context.passed_over.setdefault(
            asking.place, PassedOver(_passed_over(context, asking))
        )
        over.keepers.update({place: keepers[place] for place in unsure})
        inhibit |= {over.place}
    found: list[Effect] = []
    for before in _combinations(context, asking, {place: keepers[place] for place in certain}):
        kept = _kept(context, before.values(), taken.keys())
        if all(taken[place] + count <= _size(context, place) for place, count in kept.items()):
            spare = tuple(Counter(kept).elements())
            others = inhibit | certain - before.keys()
            found.append(Effect((), spare, frozenset(before), others, produce=spare))
    return found


def refusals_by_kept(context: TranslationContext, asking: Asking) -> Iterator[tuple[Effect, Kept]]:
    """Yield the cases in which tasks that come before keep what a task could have, with how many
    they keep."""
    places = may_take(context, asking, asking.pools)
    for before in _combinations(context, asking, _keepers(context, asking, places)):
        if before:
            yield Effect(read=frozenset(before)), _kept(context, before.values(), places)


def _combinations(
    context: TranslationContext, asking: Asking, keepers: Mapping[int, Asking]
) -> Iterator[dict[int, Asking]]:
    """Yield which of some tasks may ask that come before another one."""
    for count in range(len(keepers) + 1):
        for some in itertools.combinations(sorted(keepers), count):
            context.net.size_limit.count_case(asking.instance.node.id)
            yield {place: keepers[place] for place in some}


def _keepers(
    context: TranslationContext, asking: Asking, places: Iterable[int]
) -> dict[int, Asking]:
    """Return the tasks that may keep something from another one that is free in places, by the
    place of a token while they do."""
    wanted = set(places)
    return {
        _before(context, each, asking): each
        for each in context.asking
        if each.totals
        and each.place != asking.place
        and each.priority >= asking.priority
        and not _serves_as_well(context, each, asking)
        and not wanted.isdisjoint(may_take(context, each, _amounts(context, each)[0]))
    }


def _serves_as_well(context: TranslationContext, first: Asking, then: Asking) -> bool:
    """Whether any choice of one task could be given to another one that asks before: it needs no
    more, and any will do. Then nothing has to be kept for that."""
    whole = _amounts(context, first)[0]
    return (
        first.any_will_do
        and then.least >= first.least
        and then.pools <= whole.keys()
        and may_take(context, then, then.pools) <= may_take(context, first, whole)
    )


def _amounts(context: TranslationContext, keeper: Asking) -> tuple[Mapping[Pool, int], bool]:
    """Return how many of each pool a task keeps at most, and whether it does so as long as it
    waits: all that is free if any will do."""
    whole = {pool: len(pool) for total in keeper.totals for pool in total}
    first = keeper.totals[0]
    if keeper.any_will_do:
        return whole, True
    same = all(total == first for total in keeper.totals)
    # Of what is kept for different tasks, it is not known which it keeps.
    if same and all(n == len(pool) or pool not in context.kept for pool, n in first.items()):
        return first, True
    return whole, False


def _kept(context: TranslationContext, keepers: Iterable[Asking], places: Iterable[int]) -> Kept:
    kept: Counter[int] = Counter()
    wanted = set(places)
    for each in keepers:
        for pool, count in _amounts(context, each)[0].items():
            for place in wanted.intersection(may_take(context, each, (pool,))):
                kept[place] += count
    return {place: min(count, _size(context, place)) for place, count in kept.items()}


def _size(context: TranslationContext, place: int) -> int:
    """Return how many resources the pool of a place has."""
    found = context.net.places[place]
    return len(found.free or found.kept)


# --- who asked before -----------------------------------------------------------------------------


def _is_certain(context: TranslationContext, first: Asking, then: Asking) -> bool:
    """Whether it is known how much a task keeps from another one that comes after it."""
    return _amounts(context, first)[1] and not then.instance.inside.several


def _before(context: TranslationContext, first: Asking, then: Asking) -> int:
    """Return the place of a token while a task asks that comes before another one that asks."""
    node, inside = first.instance.node, first.instance.inside
    place = first.place
    if first.priority == then.priority and not then.instance.inside.several:
        name = f":before {context.net.places[then.place].name}"
        place = context.net.place(node, inside, Role.CONTROL, name)
        context.before[first.place, then.place] = place
    if not _is_certain(context, first, then):
        what = "later tasks may get what is free while it waits for the rest, or may not"
        context.net.approximate(node, Exactness.MORE, what)
    places = context.net.places
    places[place] = replace(places[place], keepers=(node.id,))
    return place


def _passed_over(context: TranslationContext, asking: Asking) -> int:
    """Return the place of a token while a task does not get, until something happens outside, what
    another one may keep."""
    instance = asking.instance
    return context.net.place(instance.node, instance.inside, Role.CONTROL, ":passed over")


def follow_order(context: TranslationContext, initial: tuple[int, ...]) -> tuple[int, ...]:
    """Let tasks that keep something, and those that they keep it from, note who has asked before.

    Tasks that begin at one moment ask in any order, each in a step of its own. Returns the places
    that have a token at first.
    """
    if not (context.before or context.passed_over):
        return initial
    net = context.net
    asking = {each.place: each for each in context.asking}
    due: dict[int, int] = {}
    over: dict[int, set[int]] = {}
    for pair, before in context.before.items():
        for place in pair:
            task = asking[place].instance
            due[place] = net.place(task.node, task.inside, Role.CONTROL, ":begins to ask")
            over.setdefault(place, set()).add(before)
    for place, passed in context.passed_over.items():
        for each in (place, *(keeper.place for keeper in passed.keepers.values())):
            over.setdefault(each, set()).add(passed.place)
    again = {passed.place for passed in context.passed_over.values()}
    for draft in net.drafts:
        effect = draft.effect
        draft.effect = replace(
            effect,
            produce=tuple(due.get(place, place) for place in effect.produce),
            reset=effect.reset.union(
                again if draft.kind is Kind.EXTERNAL else (),
                *(over.get(place, ()) for place in effect.consume),
            ),
        )
    for place, begins in due.items():
        step = Step(asking[place].instance.node.id, Action.ENTERED, BEGINS)
        firsts = [(pair[0], each) for pair, each in context.before.items() if pair[1] == place]
        net.transition(Effect((step,), (begins,), copies=tuple(firsts), produce=(place,)))
    for place, passed in context.passed_over.items():
        for before, keeper in passed.keepers.items():
            step = Step(asking[place].instance.node.id, Action.PASSED_OVER, keeper.instance.node.id)
            stays = Effect((step,), (), frozenset({place, before}), frozenset({passed.place}))
            net.transition(replace(stays, produce=(passed.place,)), Kind.JOIN)
    return tuple(due.get(place, place) for place in initial)
