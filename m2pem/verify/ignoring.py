"""Where a reduced search would put something off for ever: round circles of states.

A run that goes round a circle on which a rule is always left out never comes to that rule. So on
every circle there must be a state in which nothing was put off. What comes from outside can only be
put off in a state in which only that can come, and an internal step only in one with such steps:
both kinds of state are looked at apart. (A circle may well have a state in which all internal steps
are tried, and put off what comes from outside in every other one.)
"""

from collections.abc import Collection, Iterator, Sequence

from m2pem.verify.ltl.automaton import components

_A_FEW = 500
"""Of so many states that lie on circles together, one is chosen at a time."""


def ignoring(
    targets: Sequence[Sequence[int]], inner: Collection[int], partly: Collection[int]
) -> set[int]:
    """States in which nothing may be put off, so that nothing is put off for ever; few of them.

    `targets`: by state, those after it. `inner`: states with internal steps or joins. `partly`:
    states in which something was put off. Empty: all is well.
    """
    inside = {state for state in partly if state in inner}
    outside = {state for state in partly if state not in inner}
    return _breaking(targets, outside | set(inner), outside) | _breaking(targets, inside, inside)


def _breaking(
    targets: Sequence[Sequence[int]], states: Collection[int], partly: Collection[int]
) -> set[int]:
    """Of `partly`, such that each circle with one of these, of `states` alone, has a found one."""
    found: set[int] = set()
    waiting = [sorted(states)] if partly else []
    while waiting:
        for part in _circles(targets, waiting.pop()):
            first = [state for state in part if state in partly][: 1 + len(part) // _A_FEW]
            if first:
                found.update(first)
                waiting.append([state for state in part if state not in found])
    return found


def _circles(targets: Sequence[Sequence[int]], states: list[int]) -> Iterator[list[int]]:
    """Some states, in parts of which each can reach each other, without those on no circle."""
    place = {state: at for at, state in enumerate(states)}
    among = [[place[each] for each in targets[state] if each in place] for state in states]
    parts: dict[int, list[int]] = {}
    for at, number in enumerate(components(among)):
        parts.setdefault(number, []).append(at)
    for part in parts.values():
        if len(part) > 1 or part[0] in among[part[0]]:
            yield [states[at] for at in part]
