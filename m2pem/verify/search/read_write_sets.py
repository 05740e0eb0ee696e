"""Read and write sets: which bits of a state each transition tests and changes, and vice versa.

`affected_transitions` says which transitions to test again after one has fired: those whose tests
it may have changed. Of thousands of transitions, many change the same bits: an element's that
differ in the values that they read, and those that end the run, as all work does that may fail.
Their lists are shared: in a large mission there is no room for one each.
"""

from collections.abc import Iterable, Mapping, Sequence

from m2pem.verify.net.encoding import Encoding


class Footprints:
    """By rule, bits of states; by bit, rules as a mask of their numbers.

    A rule `needs` bits that must be set or whose tokens it moves on, and `forbids` bits that must
    not be set or, for the same reason, bear on what it does. It `clears` and `sets` bits, and the
    places of `kill` are emptied whatever they hold.
    """

    def __init__(self, encoding: Encoding) -> None:
        count = len(encoding.rules)
        self.encoding = encoding
        self.needs, self.forbids = [0] * count, [0] * count
        self.clears, self.sets = [0] * count, [0] * count
        self.kill = [rule.kill for rule in encoding.rules]
        for number in range(count):
            self._look_at(number)
        self.needing = _registered(self.needs)
        self.forbidding = _registered(self.forbids)
        self.clearing = _registered(self.clears, self.kill)
        self.setting = _registered(self.sets)
        self.killing = _registered(self.kill, self.kill)
        self.needing_any = Union(self.needing)
        self.forbidding_any = Union(self.forbidding)
        self.clearing_any = Union(self.clearing)
        self.setting_any = Union(self.setting)

    def _look_at(self, number: int) -> None:
        encoding = self.encoding
        c = encoding.rules[number]
        needs, forbids = c.need, c.test & ~c.need
        for mask in c.any_of:
            needs |= mask
            forbids |= mask
        for mask, _, _ in c.at_least:
            needs |= mask
        clears, sets = c.clear, c.put
        for place, _ in c.takes:
            clears |= encoding.mask[place]
        for source, target, _, gone in c.moves:
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
"""Bits of a mask that are looked up one by one."""


class Union:
    """Of a register, the rules of any bit of a mask.

    The same few masks are asked for again, and others that differ from them in few bits.
    """

    def __init__(self, register: Mapping[int, int]) -> None:
        self._register = register
        self._known: dict[int, int] = {}
        self._parts: dict[tuple[int, int], int] = {}

    def __call__(self, mask: int) -> int:
        """Those rules, as a mask of their numbers."""
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


def _registered(masks: Sequence[int], kill: Sequence[int] = ()) -> dict[int, int]:
    """By bit, the rules whose masks have it.

    What rules `kill` differs little from one to the other, if at all: what they leave is noted.
    """
    found: dict[int, int] = {}
    leaving: dict[int, int] = {}
    whole = most = 0
    for each in kill:
        whole |= each
    for number, mask in enumerate(masks):
        own = mask
        if kill and kill[number] and not kill[number] & ~mask:
            most |= 1 << number
            for low in bits_of(whole & ~kill[number]):
                leaving[low] = leaving.get(low, 0) | 1 << number
            own &= ~kill[number]
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


_MOST_NAMED = 4_000_000
"""Rules that are named to be tested after others, all together; each takes about 100 bytes."""


def as_sets(affected: list[list[int]]) -> list[frozenset[int]]:
    """The same as sets; lists that are shared give sets that are."""
    made = {key: frozenset(each) for key, each in _apart(affected).items()}
    return [made[id(each)] for each in affected]


def tests_of(
    affected: list[list[int]], masks: list[tuple[int, int, int, int, bool]]
) -> list[list[tuple[int, int, int, bool]]]:
    """By rule, what to test after it: the number of each rule, its masks and whether they say it
    all."""
    of = [(n, test, need, plain) for n, (test, need, _, _, plain) in enumerate(masks)]
    made = {key: [of[n] for n in each] for key, each in _apart(affected).items()}
    return [made[id(each)] for each in affected]


def _apart(affected: list[list[int]]) -> dict[int, list[int]]:
    """Each list once, however many rules share it."""
    return {id(each): each for each in affected}


def affected_rules(encoding: Encoding) -> list[list[int]]:
    """By rule, those whose tests may look at something that it changes.

    One that changes most of all there is, such as the end of the run, may affect any rule; where
    there is no more room to say which ones a rule affects, it is taken to affect all.
    """
    readers: dict[int, list[int]] = {}
    for number, rule in enumerate(encoding.rules):
        for low in bits_of(rule.reads):
            readers.setdefault(low, []).append(number)
    every = list(range(len(encoding.rules)))
    known: dict[int, list[int]] = {}
    named = 0
    for rule in encoding.rules:
        if rule.changes in known:
            continue
        if rule.changes.bit_count() * 2 > encoding.bits or named > _MOST_NAMED:
            known[rule.changes] = every
            continue
        touched: set[int] = set()
        for low in bits_of(rule.changes):
            touched.update(readers.get(low, ()))
        known[rule.changes] = sorted(touched)
        named += len(touched)
    return [known[rule.changes] for rule in encoding.rules]
