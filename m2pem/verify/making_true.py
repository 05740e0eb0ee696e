"""Data that makes a condition true, or false: what is missing in a run that waits for it."""

from collections.abc import Collection, Iterator, Mapping
from itertools import combinations, islice, product

from m2pem.errors import ExpressionError
from m2pem.mission.expression import Expression
from m2pem.mission.values import ReadValue, Value
from m2pem.verify.translate.domains import constants, representatives

_MOST_TRIES = 20_000
_ORDINARY: tuple[Value, ...] = (True, False, 1, 0, -1, 2, None, "something", [])
"""Values that are tried beside those that a condition compares with."""


def data_for(
    condition: Expression, truth: bool, read: ReadValue, known: Collection[str] = ()
) -> Mapping[str, Value] | None:
    """The fewest values to write for a condition to have a truth; None: none were found.

    `read`: the data that there is. `known`: names that stay as they are.
    """
    free = sorted(name for name in condition.names if name not in known)
    for data in islice(_changes(condition, free), _MOST_TRIES):

        def with_changes(name: str, data: Mapping[str, Value] = data) -> Value:
            return data[name] if name in data else read(name)

        try:
            if condition.holds(with_changes) is truth:
                return data
        except ExpressionError:
            continue
    return None


def _changes(condition: Expression, names: list[str]) -> Iterator[dict[str, Value]]:
    """Every choice of values, those that change the fewest names first."""
    compared = constants(condition)
    tried: dict[str, list[Value]] = {}
    for name in names:
        alike = representatives(compared[name]) if name in compared else []
        tried[name] = [*(value for value, _ in alike), *_ORDINARY]
    for count in range(len(names) + 1):
        for changed in combinations(names, count):
            for values in product(*(tried[name] for name in changed)):
                yield dict(zip(changed, values, strict=True))
