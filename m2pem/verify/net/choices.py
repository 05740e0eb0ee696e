"""The detail of a step in which a task is given resources (`Action.ALLOCATED`), as a text.

By role, one item for each place in it: the resource, or several that are interchangeable, of which
any may be the one; and whether the run has kept it.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Filling:
    """What fills a place in a role: one of `resources`. `kept`: one that the run has kept for the
    task, until `kept` ends (the id of a process or subprocess); "": one that was free."""

    resources: tuple[str, ...]
    kept: str = ""


Choice = Mapping[str, Sequence[Filling]]
"""By role, what fills each place in it."""


def written(choice: Choice) -> str:
    """Return the detail of a step."""
    roles = {
        role: [
            {"of": each.resources, "kept": each.kept} if each.kept else each.resources
            for each in places
        ]
        for role, places in choice.items()
    }
    return json.dumps(roles, ensure_ascii=False, separators=(",", ":"))


def read(detail: str) -> Choice:
    """Return what the detail of a step says; nothing for "".

    Raises:
        ValueError: it is no JSON.
    """
    roles = json.loads(detail) if detail else {}
    return {
        role: [
            Filling(tuple(each["of"]), each["kept"])
            if isinstance(each, dict)
            else Filling(tuple(each))
            for each in places
        ]
        for role, places in roles.items()
    }


def in_words(choice: Choice) -> str:
    """Return what a task is given, for people: `uav2 as scout`, `2 of uav1, uav2 and uav3`."""
    filled = [(role, places) for role, places in choice.items() if places]
    said: list[str] = []
    for role, places in filled:
        what = _and([_of(each, count) for each, count in Counter(places).items()])
        said.append(f"{what} as {role}" if len(filled) > 1 else what)
    return _and(said) if said else "nothing"


def _of(filling: Filling, count: int) -> str:
    pool = filling.resources
    said = _and(pool)
    if len(pool) != count:
        said = f"{'one' if count == 1 else count} of {said}"
    return f"{said}, which the run has kept," if filling.kept else said


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
