"""Which places may have a token at the same time, by the net' structure alone.

A superset of what can happen, found without a search: when it says no, it is no. It proves places
to have one token at most, and transitions never to fire.
"""

from collections.abc import Iterable

from m2pem.verify.net.petri_net import PetriNet, Transition
from m2pem.verify.net.size_limit import SizeLimit

MOST_PLACES = 1_500
"""Largest net that is analyzed: the work grows with the square of its places."""


MOST_TRANSITIONS = 6_000
"""Largest number of transitions that are analyzed."""


def is_small(net: PetriNet) -> bool:
    """Whether a net is small enough for the analysis to pay."""
    return len(net.places) <= MOST_PLACES and len(net.transitions) <= MOST_TRANSITIONS


class _Wants:
    """What a transition tests and changes, as bits. `before`: what it needs before each of
    `needed`.
    """

    __slots__ = ("absent", "before", "made", "needed", "needed_bits", "reset_places", "twice")

    def __init__(self, transition: Transition) -> None:
        self.needed = [place for place, _ in transition.consume] + list(transition.read)
        self.needed_bits = 0
        self.before: list[int] = []
        for place in self.needed:
            self.before.append(self.needed_bits & ~(1 << place))
            self.needed_bits |= 1 << place
        self.absent = bits_of(transition.inhibit)
        self.reset_places = bits_of(transition.reset)
        self.made = bits_of(place for place, _ in transition.produce)
        self.twice = bits_of(place for place, count in transition.produce if count > 1)


def bits_of(places: Iterable[int]) -> int:
    bits = 0
    for place in places:
        bits |= 1 << place
    return bits


class Concurrency:
    """The concurrency relation of a net's places. `rows[p]` has a bit for each place that may have
    a token when p has one; p's own bit says that p may have two.
    """

    def __init__(self, net: PetriNet, size_limit: SizeLimit | None = None) -> None:
        """Raises TooLargeError if the analysis takes longer than `size_limit` allows."""
        size_limit = size_limit or SizeLimit()
        self.rows = [0] * len(net.places)
        self.live: set[int] = set()
        self._marked = 0
        self._wants = [_Wants(transition) for transition in net.transitions]
        by_place: dict[int, list[Transition]] = {}
        for transition in net.transitions:
            for place in self._looks_at(transition):
                by_place.setdefault(place, []).append(transition)
        start = 0
        for place, _ in net.initial:
            start |= 1 << place
        for place, count in net.initial:
            self.rows[place] |= start & ~(1 << place)
            if count > 1:
                self.rows[place] |= 1 << place
        self._marked = start
        waiting = dict.fromkeys(transition.index for transition in net.transitions)
        while waiting:
            number = next(iter(waiting))
            del waiting[number]
            size_limit.check_time(net.transitions[number].element)
            for place in self._fire(net.transitions[number]):
                for transition in by_place.get(place, ()):
                    waiting[transition.index] = None

    @staticmethod
    def _looks_at(transition: Transition) -> set[int]:
        found = {place for place, _ in transition.consume} | set(transition.read)
        return found | {source for source, _ in (*transition.moves, *transition.copies)}

    def _fire(self, transition: Transition) -> set[int]:
        """Add what firing a transition leads to, and return the places whose rows changed."""
        wants = self._wants[transition.index]
        if wants.needed_bits & (~self._marked | wants.absent):
            return set()
        beside = self._marked
        for number, place in enumerate(wants.needed):
            row = self.rows[place]
            if wants.before[number] & ~row:
                return set()
            beside &= row | 1 << place
        for place, count in transition.consume:
            if count > 1 and not self.rows[place] >> place & 1:
                return set()
        beside &= ~wants.absent
        for place, _ in transition.consume:
            if not self.rows[place] >> place & 1:
                beside &= ~(1 << place)
        self.live.add(transition.index)
        moved = many = 0
        for source, target in (*transition.moves, *transition.copies):
            if beside >> source & 1:
                moved |= 1 << target
                if self.rows[source] >> source & 1:  # all of them go
                    many |= 1 << target
        twice = wants.twice | moved & wants.made | many
        return self._add(wants.made | moved, beside & ~wants.reset_places, twice)

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
        """Whether two places may have tokens at once; of the same place: two tokens."""
        return bool(self.rows[one] >> other & 1)

    @property
    def single(self) -> frozenset[int]:
        """The places that never have more than one token."""
        return frozenset(n for n, row in enumerate(self.rows) if not row >> n & 1)

    def may_fire(self, transition: Transition) -> bool:
        """Whether a transition may ever fire."""
        return transition.index in self.live
