"""Which rules to test again after a rule has fired: those whose tests it may have changed.

Of thousands of rules, many change the same: an element's that differ in what values it reads, and
those that end the run, as all work does that may fail. What is said of those is shared: in a large
mission there is no room to say it of each.
"""

from m2pem.verify.encoding import Encoding
from m2pem.verify.footprints import bits_of

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
