"""A smaller system that does the same: without rules that cannot fire and places only passed.

A token on a passed place has one thing to do, which nothing can keep it from and nobody sees:
what comes to the place goes straight to what follows it. The places that remain keep their names.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import replace
from functools import cache

from m2pem.verify.net.concurrency import Concurrency, is_small
from m2pem.verify.net.petri_net import Kind, Role, Rule, System
from m2pem.verify.net.size_limit import Bound

_MOST_PAIRS = 64
"""Rules that one passed place may be replaced by."""

_WORTH_TRIMMING = 0.5
"""Of what a rule kills, what may be left. It is more use if all rules of a scope kill alike."""


def simplify(
    system: System,
    seen: Collection[int] = (),
    visible: Collection[int] = (),
    bound: Bound | None = None,
) -> System:
    """The same, smaller.

    `seen`: places that a property looks at; `visible`: rules that change those, or are looked at
    themselves. Those places stay, and such a rule stays a step of its own after what it follows.

    Raises:
        TooLargeError: it takes longer than `bound` allows.
    """
    bound = bound or Bound()
    concurrency = Concurrency(system, bound) if is_small(system) else None
    rules = list(system.rules)
    if concurrency is not None:
        rules = [_trim(rule, concurrency) for rule in rules if concurrency.may_fire(rule)]
        # What the smaller system does, this one can do as well: so that is true of it, too.
        system = replace(system, single=concurrency.single)
    return renumbered(system, _fused(system, rules, frozenset(seen), frozenset(visible), bound))


def _trim(rule: Rule, concurrency: Concurrency) -> Rule:
    """Without what cannot be there when it fires anyway."""
    needed = [place for place, _ in rule.consume] + list(rule.read)
    if not needed or not (rule.inhibit or rule.kill):
        return rule

    possible = -1
    for place in needed:
        possible &= concurrency.rows[place] | 1 << place
    told = {t for _, t in (*rule.moves, *rule.copies)}
    inhibit = tuple(p for p in rule.inhibit if possible >> p & 1)
    absent = set(rule.inhibit) - told
    kill = tuple(p for p in rule.kill if p not in absent and (possible >> p & 1 or p in told))
    if len(kill) > len(rule.kill) * _WORTH_TRIMMING:
        kill = rule.kill
    return replace(rule, inhibit=inhibit, kill=kill)


def renumbered(system: System, rules: list[Rule]) -> System:
    """A system with other rules, and only the places and numbers that those use."""
    used = set(system.ends) | {place for place, _ in system.initial}
    for rule in rules:
        used |= {p for p, _ in (*rule.consume, *rule.produce)} | set(rule.read)
        for one, other in (*rule.moves, *rule.copies):
            used |= {one, other}
    order = [place for place in system.places if place.index in used]
    number = {place.index: n for n, place in enumerate(order)}

    @cache  # what ends one scope says the same, and as much as the scope is large
    def killed(places: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(number[p] for p in places if p in number)

    made = tuple(
        replace(
            rule,
            index=n,
            consume=tuple((number[p], c) for p, c in rule.consume),
            produce=tuple((number[p], c) for p, c in rule.produce),
            read=tuple(number[p] for p in rule.read),
            inhibit=tuple(number[p] for p in rule.inhibit if p in number),
            kill=killed(rule.kill),
            moves=tuple((number[a], number[b]) for a, b in rule.moves),
            copies=tuple((number[a], number[b]) for a, b in rule.copies),
        )
        for n, rule in enumerate(rules)
    )
    return replace(
        system,
        places=tuple(replace(place, index=n) for n, place in enumerate(order)),
        rules=made,
        initial=tuple((number[p], c) for p, c in system.initial),
        completed=number[system.completed],
        terminated=number[system.terminated],
        failed=number[system.failed],
        single=(
            None
            if system.single is None
            else frozenset(number[p] for p in system.single if p in number)
        ),
    )


# --- passed places ------------------------------------------------------------------------------


def _fused(
    system: System,
    rules: list[Rule],
    seen: frozenset[int],
    visible: frozenset[int],
    bound: Bound,
) -> list[Rule]:
    looked_at: set[int] = set(seen)
    watched: set[int] = set()
    for rule in rules:
        sources = {source for source, _ in (*rule.moves, *rule.copies)}
        targets = {target for _, target in (*rule.moves, *rule.copies)}
        looked_at |= set(rule.read) | sources | targets
        if rule.kind is Kind.INTERNAL:
            watched |= set(rule.read) | sources
            if len(rule.consume) == 0 or rule.inhibit:
                watched |= _seen_absent(system, rule)
            if any(rule.read) or rule.moves:
                watched |= {p for p, _ in rule.consume}
    initial = {place for place, _ in system.initial}
    alive: dict[int, Rule] = dict(enumerate(rules))
    producers: dict[int, set[int]] = {}
    consumers: dict[int, set[int]] = {}
    following = len(rules)
    for n, rule in alive.items():
        _note(n, rule, producers, consumers)
    for place in system.places:
        p = place.index
        if place.role not in (Role.ENTERING, Role.TRIGGERED) or p in initial or p in looked_at:
            continue
        eaters = [alive[n] for n in sorted(consumers.get(p, ()))]
        makers = sorted(producers.get(p, ()))
        if not eaters or not all(_passes(rule, p, watched) for rule in eaters):
            continue
        if any(rule.index in visible for rule in eaters):  # of joined ones, that of the first
            continue
        if len(eaters) * len(makers) > max(_MOST_PAIRS, len(eaters) + len(makers)):
            continue
        bound.look(place.element)
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


def _seen_absent(system: System, rule: Rule) -> set[int]:
    """Places whose emptiness a rule looks at, other than with all of its scope's."""
    if rule.quiet:
        return set()
    return set(rule.inhibit)


def _note(
    n: int, rule: Rule, producers: dict[int, set[int]], consumers: dict[int, set[int]]
) -> None:
    for place, _ in rule.produce:
        producers.setdefault(place, set()).add(n)
    for place, _ in rule.consume:
        consumers.setdefault(place, set()).add(n)


def _forget(
    n: int, rule: Rule, producers: dict[int, set[int]], consumers: dict[int, set[int]]
) -> None:
    for place, _ in rule.produce:
        producers[place].discard(n)
    for place, _ in rule.consume:
        consumers[place].discard(n)


def _passes(rule: Rule, place: int, watched: set[int]) -> bool:
    """Whether a rule only passes a token of a place on, to where nobody watches at once."""
    return (
        rule.kind is Kind.INTERNAL
        and rule.consume == ((place, 1),)
        and not (rule.read or rule.inhibit or rule.kill or rule.moves or rule.copies)
        and not (rule.guard or rule.assign or rule.flag)
        and not any(p in watched or p == place for p, _ in rule.produce)
    )


def _joined(maker: Rule, eater: Rule, place: int) -> Rule:
    produce = Counter(dict(maker.produce))
    del produce[place]
    produce.update(dict(eater.produce))
    return replace(
        maker,
        steps=maker.steps + eater.steps,
        produce=tuple(sorted(produce.items())),
        outcomes=tuple(dict.fromkeys(maker.outcomes + eater.outcomes)),
    )
