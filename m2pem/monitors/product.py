"""The monitors of several formulas without bounds, as one automaton.

A moment changes few propositions, and most formulas stay in the state in which they are: so what a
letter does to all of them is looked up at once. The states and transitions that runs reach are made
once, and serve all runs with the same formulas.
"""

from collections.abc import Sequence
from functools import lru_cache

from m2pem.monitors.anticipation import Anticipation, Verdict

MOST_TRANSITIONS = 20_000
"""Transitions that are remembered, at most; beyond, they are found again."""

State = tuple[int, ...]
"""The state of each formula's monitor."""
Certain = tuple[tuple[int, Verdict], ...]
"""Which formulas have become satisfied or violated, by their place."""
Bits = tuple[tuple[int, int], ...]
"""Bits of the run's letter, and of the formula's."""


class Product:
    """The product of the monitors of formulas; `mask`: the bits of the run's letters that they are
    about."""

    def __init__(self, parts: Sequence[tuple[Anticipation, Bits]]) -> None:
        self._parts = tuple(parts)
        self.mask = 0
        for _, bits in self._parts:
            for theirs, _ in bits:
                self.mask |= theirs
        self.start: State = tuple(part.start for part, _ in self._parts)
        self._after: dict[tuple[State, int, int], tuple[State, Certain]] = {}

    def step(self, state: State, letter: int, unknown: int) -> tuple[State, Certain]:
        """The state after a moment, and what has become certain in it. `letter`, `unknown`: of the
        run."""
        key = (state, letter & self.mask, unknown & self.mask)
        found = self._after.get(key)
        if found is None:
            if len(self._after) >= MOST_TRANSITIONS:
                self._after.clear()
            found = self._after[key] = self._step(*key)
        return found

    def _step(self, state: State, letter: int, unknown: int) -> tuple[State, Certain]:
        after = []
        certain = []
        for place, (part, bits) in enumerate(self._parts):
            before = state[place]
            if part.verdicts[before].is_certain:
                after.append(before)
                continue
            now = part.step(before, own_letter(bits, letter), own_letter(bits, unknown))
            after.append(now)
            if part.verdicts[now].is_certain:
                certain.append((place, part.verdicts[now]))
        return tuple(after), tuple(certain)

    def at_end(self, state: State, letter: int, unknown: int) -> Certain:
        """What is certain of those that were open, if each moment from now on is as this one."""
        found = []
        for place, (part, bits) in enumerate(self._parts):
            if part.verdicts[state[place]].is_certain:
                continue
            verdict = part.at_end(state[place], own_letter(bits, letter), own_letter(bits, unknown))
            if verdict.is_certain:
                found.append((place, verdict))
        return tuple(found)


def own_letter(bits: Bits, letter: int) -> int:
    """The letter of a formula, given that of the run."""
    return sum(mine for theirs, mine in bits if letter & theirs)


@lru_cache(maxsize=100)
def product_of(parts: tuple[tuple[Anticipation, Bits], ...]) -> Product:
    """The product of monitors, made once."""
    return Product(parts)
