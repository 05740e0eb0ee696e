"""Read and write sets: which bits of a state each transition tests and changes, and vice versa.

`affected_transitions` says which transitions to test again after one has fired: those whose tests
it may have changed. Of thousands of transitions, many change the same bits: an element's that
differ in the values that they read, and those that end the run, as all work does that may fail.
Their lists are shared: in a large mission there is no room for one each.
"""

from collections.abc import Iterable, Mapping, Sequence

from m2pem.verify.net.encoding import Encoding


class ReadWriteSets:
    """By transition, bits of states; by bit, transitions as a mask of their numbers.

    A transition `needs` bits that must be set or whose tokens it moves on, and `forbids` bits that
    must not be set or, for the same reason, affect what it does. It `clears` and `sets` bits, and
    the places of `reset` are emptied whatever they hold.
    """

    def __init__(self, encoding: Encoding) -> None:
        count = len(encoding.transitions)
        self.encoding = encoding
        self.needs, self.forbids = [0] * count, [0] * count
        self.clears, self.sets = [0] * count, [0] * count
        self.reset = [transition.reset for transition in encoding.transitions]
        for number in range(count):
            self._look_at(number)
        self.needing = _registered(self.needs)
        self.forbidding = _registered(self.forbids)
        self.clearing = _registered(self.clears, self.reset)
        self.setting = _registered(self.sets)
        self.resetting = _registered(self.reset, self.reset)
        self.needing_any = Union(self.needing)
        self.forbidding_any = Union(self.forbidding)
        self.clearing_any = Union(self.clearing)
        self.setting_any = Union(self.setting)

    def _look_at(self, number: int) -> None:
        encoding = self.encoding
        c = encoding.transitions[number]
        needs, forbids = c.need, c.test & ~c.need
        for mask in c.any_of:
            needs |= mask
            forbids |= mask
        for mask, _, _ in c.at_least:
            needs |= mask
        for mask, _, _ in c.at_most:
            forbids |= mask
        clears, sets = c.clear, c.put
        for place, _ in c.takes:
            clears |= encoding.mask[place]
        for source, target, _, gone, _ in c.moves:
            needs |= source
            forbids |= source
            sets |= target
            if gone:
                clears |= source
        for mask, *_ in c.gives:
            sets |= mask
        self.needs[number], self.forbids[number] = needs, forbids
        self.clears[number], self.sets[number] = clears, sets


_PART = 64
_FULL = (1 << _PART) - 1
_FEW = 8
"""Masks of so few bits are looked up bit by bit."""


class Union:
    """The transitions of any bit of a mask, from a register by bit.

    Few masks are looked up, again and again, and others differ from them in few bits. So results
    are cached, for whole masks and for parts of masks.
    """

    def __init__(self, register: Mapping[int, int]) -> None:
        self._register = register
        self._known: dict[int, int] = {}
        self._parts: dict[tuple[int, int], int] = {}

    def __call__(self, mask: int) -> int:
        """Return those transitions, as a mask of their numbers."""
        known = self._known.get(mask)
        if known is None:
            few = mask.bit_count() <= _FEW
            known = self._known[mask] = self._each(mask) if few else self._in_parts(mask)
        return known

    def _each(self, mask: int) -> int:
        found, look_up = 0, self._register.get
        while mask:
            low = mask & -mask
            mask ^= low
            found |= look_up(low, 0)
        return found

    def _in_parts(self, mask: int) -> int:
        found = at = 0
        while mask:
            if part := mask & _FULL:
                known = self._parts.get((part, at))
                if known is None:
                    known = self._parts[part, at] = self._each(part << at)
                found |= known
            mask >>= _PART
            at += _PART
        return found


def _registered(masks: Sequence[int], reset: Sequence[int] = ()) -> dict[int, int]:
    """By bit, the transitions whose masks have it.

    The places that transitions `reset` differ little from one transition to the other, if at all.
    So only the places that they do not reset are noted one by one.
    """
    found: dict[int, int] = {}
    leaving: dict[int, int] = {}
    whole = most = 0
    for each in reset:
        whole |= each
    for number, mask in enumerate(masks):
        own = mask
        if reset and reset[number] and not reset[number] & ~mask:
            most |= 1 << number
            for low in bits_of(whole & ~reset[number]):
                leaving[low] = leaving.get(low, 0) | 1 << number
            own &= ~reset[number]
        for low in bits_of(own):
            found[low] = found.get(low, 0) | 1 << number
    if most:
        for low in bits_of(whole):
            found[low] = found.get(low, 0) | (most & ~leaving.get(low, 0))
    return found


def bits_of(mask: int) -> Iterable[int]:
    """Each bit of a mask, as a mask of its own."""
    while mask:
        low = mask & -mask
        yield low
        mask ^= low


MOST_NAMED = 4_000_000
"""Most entries in all lists of affected transitions; each takes about 100 bytes."""


def as_sets(affected: list[list[int]]) -> list[frozenset[int]]:
    """The same lists as sets; shared lists give shared sets."""
    made = {key: frozenset(each) for key, each in _apart(affected).items()}
    return [made[id(each)] for each in affected]


def tests_of(
    affected: list[list[int]], masks: list[tuple[int, int, int, int, bool]]
) -> list[list[tuple[int, int, int, bool]]]:
    """By transition, what to test after it: (number, masks, whether the masks say it all)."""
    of = [(n, test, need, plain) for n, (test, need, _, _, plain) in enumerate(masks)]
    made = {key: [of[n] for n in each] for key, each in _apart(affected).items()}
    return [made[id(each)] for each in affected]


def _apart(affected: list[list[int]]) -> dict[int, list[int]]:
    """Each list once, by identity, however many transitions share it."""
    return {id(each): each for each in affected}


def affected_transitions(encoding: Encoding) -> list[list[int]]:
    """By transition, those whose tests may read something that it changes.

    A transition that changes most of the state, such as the end of the run, may affect any other.
    Where there is no more room for lists, a transition is taken to affect all.
    """
    readers: dict[int, list[int]] = {}
    for number, transition in enumerate(encoding.transitions):
        for low in bits_of(transition.reads):
            readers.setdefault(low, []).append(number)
    every = list(range(len(encoding.transitions)))
    known: dict[int, list[int]] = {}
    named = 0
    for transition in encoding.transitions:
        if transition.changes in known:
            continue
        if transition.changes.bit_count() * 2 > encoding.bits or named > MOST_NAMED:
            known[transition.changes] = every
            continue
        touched: set[int] = set()
        for low in bits_of(transition.changes):
            touched.update(readers.get(low, ()))
        known[transition.changes] = sorted(touched)
        named += len(touched)
    return [known[transition.changes] for transition in encoding.transitions]
