"""A smaller net that does the same: without dead transitions and without places that are only
passed.

A token on a passed place enables one transition that nothing can disable and no property observes.
The transition that puts the token there is fused with the one that takes it (fusion of series
transitions). The places that remain keep their names.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import replace
from functools import cache

from m2pem.verify.net.concurrency import Concurrency, is_small
from m2pem.verify.net.petri_net import Kind, PetriNet, Role, Transition
from m2pem.verify.net.size_limit import SizeLimit

_MOST_PAIRS = 64
"""Most fused transitions that one passed place may be replaced by."""

_WORTH_TRIMMING = 0.5
"""Share of a transition's reset arcs above which trimming is not worth it. The reduction profits if
all transitions of a scope reset the same places.
"""


def simplify(
    net: PetriNet,
    seen: Collection[int] = (),
    visible: Collection[int] = (),
    size_limit: SizeLimit | None = None,
) -> PetriNet:
    """Return a smaller net that does the same.

    `seen`: places that a property observes; `visible`: transitions that change those, or are
    observed themselves. Those places stay, and such a transition remains a step of its own after
    what it follows.

    Raises:
        TooLargeError: it takes longer than `size_limit` allows.
    """
    size_limit = size_limit or SizeLimit()
    concurrency = Concurrency(net, size_limit) if is_small(net) else None
    transitions = list(net.transitions)
    if concurrency is not None:
        transitions = [
            _trim(transition, concurrency)
            for transition in transitions
            if concurrency.may_fire(transition)
        ]
        # What the smaller net does, this one can do as well: so that is true of it, too.
        net = replace(net, single=concurrency.single)
    return renumbered(
        net, _fused(net, transitions, frozenset(seen), frozenset(visible), size_limit)
    )


def _trim(transition: Transition, concurrency: Concurrency) -> Transition:
    """Remove arcs from places that never have a token when the transition fires."""
    needed = [place for place, _ in transition.consume] + list(transition.read)
    if not needed or not (transition.inhibit or transition.reset or transition.copies):
        return transition

    possible = -1
    for place in needed:
        possible &= concurrency.rows[place] | 1 << place
    targets = {t for _, t in (*transition.moves, *transition.copies)}
    inhibit = tuple(p for p in transition.inhibit if possible >> p & 1)
    moved = {target for _, target in transition.moves}
    copies = tuple(
        (one, other) for one, other in transition.copies if possible >> one & 1 or one in moved
    )
    absent = set(transition.inhibit) - targets
    reset = tuple(
        p for p in transition.reset if p not in absent and (possible >> p & 1 or p in targets)
    )
    if len(reset) > len(transition.reset) * _WORTH_TRIMMING:
        reset = transition.reset
    if (inhibit, reset, copies) == (transition.inhibit, transition.reset, transition.copies):
        return transition
    return replace(transition, inhibit=inhibit, reset=reset, copies=copies)


def renumbered(net: PetriNet, transitions: list[Transition]) -> PetriNet:
    """Return a net with other transitions, and only the places and numbers that those use."""
    used = set(net.ends) | {place for place, _ in net.initial}
    for transition in transitions:
        used |= {p for p, _ in (*transition.consume, *transition.produce)} | set(transition.read)
        for one, other in (*transition.moves, *transition.copies):
            used |= {one, other}
    order = [place for place in net.places if place.index in used]
    number = {place.index: n for n, place in enumerate(order)}

    @cache  # what ends one scope says the same, and as much as the scope is large
    def reset_places(places: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(number[p] for p in places if p in number)

    made = tuple(
        replace(
            transition,
            index=n,
            consume=tuple((number[p], c) for p, c in transition.consume),
            produce=tuple((number[p], c) for p, c in transition.produce),
            read=tuple(number[p] for p in transition.read),
            inhibit=tuple(number[p] for p in transition.inhibit if p in number),
            at_most=tuple((number[p], c) for p, c in transition.at_most if p in number),
            reset=reset_places(transition.reset),
            moves=tuple((number[a], number[b]) for a, b in transition.moves),
            copies=tuple((number[a], number[b]) for a, b in transition.copies),
        )
        for n, transition in enumerate(transitions)
    )
    return replace(
        net,
        places=tuple(
            place
            if place.index == n and not place.returns and place.holder is None
            else replace(
                place,
                index=n,
                returns=tuple(number[p] for p in place.returns if p in number),
                holder=None if place.holder is None else number.get(place.holder),
            )
            for n, place in enumerate(order)
        ),
        transitions=made,
        initial=tuple((number[p], c) for p, c in net.initial),
        completed=number[net.completed],
        terminated=number[net.terminated],
        failed=number[net.failed],
        single=(
            None if net.single is None else frozenset(number[p] for p in net.single if p in number)
        ),
    )


# --- passed places ------------------------------------------------------------------------------


def _fused(
    net: PetriNet,
    transitions: list[Transition],
    seen: frozenset[int],
    visible: frozenset[int],
    size_limit: SizeLimit,
) -> list[Transition]:
    looked_at: set[int] = set(seen)
    watched: set[int] = set()
    for transition in transitions:
        sources = {source for source, _ in (*transition.moves, *transition.copies)}
        targets = {target for _, target in (*transition.moves, *transition.copies)}
        looked_at |= set(transition.read) | sources | targets
        if transition.kind is Kind.INTERNAL:
            watched |= set(transition.read) | sources
            if len(transition.consume) == 0 or transition.inhibit:
                watched |= _seen_absent(transition)
            if any(transition.read) or transition.moves:
                watched |= {p for p, _ in transition.consume}
    initial = {place for place, _ in net.initial}
    alive: dict[int, Transition] = dict(enumerate(transitions))
    producers: dict[int, set[int]] = {}
    consumers: dict[int, set[int]] = {}
    following = len(transitions)
    for n, transition in alive.items():
        _note(n, transition, producers, consumers)
    for place in net.places:
        p = place.index
        if place.role not in (Role.ENTERING, Role.TRIGGERED) or p in initial or p in looked_at:
            continue
        eaters = [alive[n] for n in sorted(consumers.get(p, ()))]
        makers = sorted(producers.get(p, ()))
        if not eaters or not all(_passes(transition, p, watched) for transition in eaters):
            continue
        if any(
            transition.index in visible for transition in eaters
        ):  # of joined ones, that of the first
            continue
        if len(eaters) * len(makers) > max(_MOST_PAIRS, len(eaters) + len(makers)):
            continue
        size_limit.check_time(place.element)
        if any(dict(alive[n].produce)[p] != 1 or n in consumers[p] for n in makers):
            continue
        for n in makers:
            for eater in eaters:
                made = _joined(alive[n], eater, p)
                alive[following] = made
                _note(following, made, producers, consumers)
                following += 1
        for n in [*makers, *consumers.get(p, set())]:
            _forget(n, alive.pop(n), producers, consumers)
    return list(alive.values())


def _seen_absent(transition: Transition) -> set[int]:
    """Places that a transition tests for emptiness, other than with all places of its scope."""
    if transition.quiet:
        return set()
    return set(transition.inhibit)


def _note(
    n: int, transition: Transition, producers: dict[int, set[int]], consumers: dict[int, set[int]]
) -> None:
    for place, _ in transition.produce:
        producers.setdefault(place, set()).add(n)
    for place, _ in transition.consume:
        consumers.setdefault(place, set()).add(n)


def _forget(
    n: int, transition: Transition, producers: dict[int, set[int]], consumers: dict[int, set[int]]
) -> None:
    for place, _ in transition.produce:
        producers[place].discard(n)
    for place, _ in transition.consume:
        consumers[place].discard(n)


def _passes(transition: Transition, place: int, watched: set[int]) -> bool:
    """Whether a transition only passes a token of a place on, to where nothing observes
    it at once.
    """
    return (
        transition.kind is Kind.INTERNAL
        and transition.consume == ((place, 1),)
        and not (
            transition.read
            or transition.inhibit
            or transition.at_most
            or transition.reset
            or transition.moves
            or transition.copies
        )
        and not (transition.guard or transition.assign or transition.flag)
        and not any(p in watched or p == place for p, _ in transition.produce)
    )


def _joined(maker: Transition, eater: Transition, place: int) -> Transition:
    produce = Counter(dict(maker.produce))
    del produce[place]
    produce.update(dict(eater.produce))
    return replace(
        maker,
        steps=maker.steps + eater.steps,
        produce=tuple(sorted(produce.items())),
        outcomes=tuple(dict.fromkeys(maker.outcomes + eater.outcomes)),
    )
