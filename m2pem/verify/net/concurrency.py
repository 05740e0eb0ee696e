"""Which places may have a token at the same time, by the rules' structure alone.

A superset of what can happen, found without a search: when it says no, it is no. It proves places
to have one token at most, and rules never to fire.
"""

from collections.abc import Iterable

from m2pem.verify.net.petri_net import Rule, System
from m2pem.verify.net.size_limit import Bound

MOST_PLACES = 1_500
"""Of a system that is looked at; the work grows with the square."""


MOST_RULES = 6_000
"""Likewise."""


def is_small(system: System) -> bool:
    """Whether it is worth the work."""
    return len(system.places) <= MOST_PLACES and len(system.rules) <= MOST_RULES


class _Wants:
    """What a rule asks for and does, as bits; `before`: what it needs before each of `needed`."""

    __slots__ = ("absent", "before", "killed", "made", "needed", "needed_bits", "twice")

    def __init__(self, rule: Rule) -> None:
        self.needed = [place for place, _ in rule.consume] + list(rule.read)
        self.needed_bits = 0
        self.before: list[int] = []
        for place in self.needed:
            self.before.append(self.needed_bits & ~(1 << place))
            self.needed_bits |= 1 << place
        self.absent = bits_of(rule.inhibit)
        self.killed = bits_of(rule.kill)
        self.made = bits_of(place for place, _ in rule.produce)
        self.twice = bits_of(place for place, count in rule.produce if count > 1)


def bits_of(places: Iterable[int]) -> int:
    """A bit for each place."""
    bits = 0
    for place in places:
        bits |= 1 << place
    return bits


class Concurrency:
    """`rows[p]`: a bit for each place that may have a token when p has one; p's own bit: two."""

    def __init__(self, system: System, bound: Bound | None = None) -> None:
        """Raises TooLargeError if it takes longer than `bound` allows."""
        bound = bound or Bound()
        self.rows = [0] * len(system.places)
        self.live: set[int] = set()
        self._marked = 0
        self._wants = [_Wants(rule) for rule in system.rules]
        by_place: dict[int, list[Rule]] = {}
        for rule in system.rules:
            for place in self._looks_at(rule):
                by_place.setdefault(place, []).append(rule)
        start = 0
        for place, _ in system.initial:
            start |= 1 << place
        for place, count in system.initial:
            self.rows[place] |= start & ~(1 << place)
            if count > 1:
                self.rows[place] |= 1 << place
        self._marked = start
        waiting = dict.fromkeys(rule.index for rule in system.rules)
        while waiting:
            number = next(iter(waiting))
            del waiting[number]
            bound.look(system.rules[number].element)
            for place in self._fire(system.rules[number]):
                for rule in by_place.get(place, ()):
                    waiting[rule.index] = None

    @staticmethod
    def _looks_at(rule: Rule) -> set[int]:
        found = {place for place, _ in rule.consume} | set(rule.read)
        return found | {source for source, _ in (*rule.moves, *rule.copies)}

    def _fire(self, rule: Rule) -> set[int]:
        """Add what firing a rule leads to; the places that it is news for."""
        wants = self._wants[rule.index]
        if wants.needed_bits & (~self._marked | wants.absent):
            return set()
        beside = self._marked
        for number, place in enumerate(wants.needed):
            row = self.rows[place]
            if wants.before[number] & ~row:
                return set()
            beside &= row | 1 << place
        for place, count in rule.consume:
            if count > 1 and not self.rows[place] >> place & 1:
                return set()
        beside &= ~wants.absent
        for place, _ in rule.consume:
            if not self.rows[place] >> place & 1:
                beside &= ~(1 << place)
        self.live.add(rule.index)
        moved = 0
        for source, target in (*rule.moves, *rule.copies):
            if beside >> source & 1:
                moved |= 1 << target
        twice = wants.twice | moved & wants.made
        return self._add(wants.made | moved, beside & ~wants.killed, twice)

    def _add(self, made: int, beside: int, twice: int) -> set[int]:
        news: set[int] = set()
        bits = made
        while bits:
            low = bits & -bits
            bits ^= low
            place = low.bit_length() - 1
            if not self._marked & low:
                self._marked |= low
                news.add(place)
            add = (beside | (made & ~low) | (twice & low)) & ~self.rows[place]
            if add:
                news.add(place)
                self.rows[place] |= add
                while add:
                    other = add & -add
                    add ^= other
                    number = other.bit_length() - 1
                    if not self.rows[number] & low:
                        self.rows[number] |= low
                        news.add(number)
        return news

    def together(self, one: int, other: int) -> bool:
        """Whether two places may have a token at once; of the same place: two tokens."""
        return bool(self.rows[one] >> other & 1)

    @property
    def single(self) -> frozenset[int]:
        """The places that have one token at most."""
        return frozenset(n for n, row in enumerate(self.rows) if not row >> n & 1)

    def may_fire(self, rule: Rule) -> bool:
        """Whether a rule may ever fire."""
        return rule.index in self.live
