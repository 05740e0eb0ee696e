"""Which rules to test again after a rule has fired: those whose tests it may have changed.

Rules that end a run, of which there are as many as work that may fail, change nearly everything.
What is said of those is shared: in a large mission there is no room to say it of each.
"""

from m2pem.verify.encoding import Encoding
from m2pem.verify.footprints import bits_of


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

    One that changes most of all there is, such as the end of the run, may affect any rule.
    """
    readers: dict[int, list[int]] = {}
    for number, rule in enumerate(encoding.rules):
        for low in bits_of(rule.reads):
            readers.setdefault(low, []).append(number)
    every = list(range(len(encoding.rules)))
    result: list[list[int]] = []
    for rule in encoding.rules:
        if rule.changes.bit_count() * 2 > encoding.bits:
            result.append(every)
            continue
        touched: set[int] = set()
        for low in bits_of(rule.changes):
            touched.update(readers.get(low, ()))
        result.append(sorted(touched))
    return result
