"""The monitors of several formulas without bounds, as one automaton.

A moment changes few propositions, and most formulas stay in the state in which they are: so what a
letter does to all of them is looked up at once. The states and transitions that runs reach are made
once, and serve all runs with the same formulas.
"""

from collections.abc import Sequence
from typing import NamedTuple

from m2pem.monitors.anticipation import Anticipation, Verdict

MOST_TRANSITIONS = 20_000
"""Transitions that are remembered, at most; beyond, they are found again."""

Certain = tuple[tuple[int, Verdict], ...]
"""Which formulas are satisfied or violated, by their place."""
Bits = tuple[tuple[int, int], ...]
"""Bits of the run's letter, and of the formula's."""


class Position(NamedTuple):
    """Where the monitor of one formula is. `bits`: those of the letters that it reads."""

    monitor: Anticipation
    bits: Bits
    state: int


class State:
    """A state of a product. `parts`: the state of each formula's monitor; `certain`: what is."""

    __slots__ = ("after", "certain", "parts")

    def __init__(self, parts: tuple[int, ...], certain: Certain) -> None:
        self.parts = parts
        self.certain = certain
        self.after: dict[int, State] = {}
        """By letter of the run, all of which is known."""


class Product:
    """The product of the monitors of formulas; `mask`: the bits of the run's letters that they are
    about."""

    def __init__(self, parts: Sequence[tuple[Anticipation, Bits]]) -> None:
        self._parts = tuple(parts)
        self.mask = 0
        for _, bits in self._parts:
            for theirs, _ in bits:
                self.mask |= theirs
        self._states: dict[tuple[int, ...], State] = {}
        self._transitions = 0
        self.start = self.state_of(tuple(part.start for part, _ in self._parts))

    def state_of(self, parts: tuple[int, ...]) -> State:
        """The state with these states of the formulas' monitors."""
        state = self._states.get(parts)
        if state is None:
            verdicts = (part.verdicts[at] for (part, _), at in zip(self._parts, parts, strict=True))
            certain = tuple(pair for pair in enumerate(verdicts) if pair[1].is_certain)
            state = self._states[parts] = State(parts, certain)
        return state

    def step(self, state: State, letter: int, unknown: int) -> State:
        """The state after a moment. `letter`, `unknown`: of the run."""
        letter, unknown = letter & self.mask, unknown & self.mask
        if unknown:
            return self._step(state, letter, unknown)
        after = state.after.get(letter)
        if after is None:
            self._transitions += 1
            if self._transitions > MOST_TRANSITIONS:
                self._forget()
            after = state.after[letter] = self._step(state, letter, 0)
        return after

    def _forget(self) -> None:
        for each in self._states.values():
            each.after.clear()
        self._states.clear()
        self._transitions = 0

    def _step(self, state: State, letter: int, unknown: int) -> State:
        after = list(state.parts)
        for place, (part, bits) in enumerate(self._parts):
            before = state.parts[place]
            if not part.verdicts[before].is_certain:
                own, own_unknown = own_letter(bits, letter), own_letter(bits, unknown)
                after[place] = part.step(before, own, own_unknown)
        return self.state_of(tuple(after))

    def at_end(self, state: State, letter: int, unknown: int) -> Certain:
        """What is certain of those that were open, if each moment from now on is as this one."""
        found = []
        for place, (part, bits) in enumerate(self._parts):
            if part.verdicts[state.parts[place]].is_certain:
                continue
            verdict = part.at_end(
                state.parts[place], own_letter(bits, letter), own_letter(bits, unknown)
            )
            if verdict.is_certain:
                found.append((place, verdict))
        return tuple(found)


def own_letter(bits: Bits, letter: int) -> int:
    """The letter of a formula, given that of the run."""
    return sum(mine for theirs, mine in bits if letter & theirs)
