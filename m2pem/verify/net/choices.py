"""The detail of a step in which a task is given resources (`Action.ALLOCATED`), as a text.

By role, one item for each place in it: the resource, or several that are interchangeable, of which
any may be the one.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence

Choice = Mapping[str, Sequence[Sequence[str]]]
"""By role, for each place in it the resources of which any may fill it."""


def written(choice: Choice) -> str:
    """Return the detail of a step."""
    return json.dumps(choice, ensure_ascii=False, separators=(",", ":"))


def read(detail: str) -> Choice:
    """Return what the detail of a step says; nothing for "".

    Raises:
        ValueError: it is no JSON.
    """
    choice: dict[str, list[list[str]]] = json.loads(detail) if detail else {}
    return choice


def in_words(choice: Choice) -> str:
    """Return what a task is given, for people: `uav2 as scout`, `2 of uav1, uav2 and uav3`."""
    filled = [(role, places) for role, places in choice.items() if places]
    said: list[str] = []
    for role, places in filled:
        pools = Counter(tuple(place) for place in places)
        what = _and([_of(pool, count) for pool, count in pools.items()])
        said.append(f"{what} as {role}" if len(filled) > 1 else what)
    return _and(said) if said else "nothing"


def _of(pool: Sequence[str], count: int) -> str:
    if len(pool) == count:
        return _and(pool)
    return f"{'one' if count == 1 else count} of {_and(pool)}"


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
