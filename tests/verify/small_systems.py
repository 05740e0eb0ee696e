"""Small systems to check formulas of: random ones, and all their runs up to a length."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hypothesis import strategies as st

from m2pem.verify.ltl.formula import Proposition
from m2pem.verify.ltl.model_check import Move, Run
from tests.verify.formulas import ATOMS


@dataclass(frozen=True)
class SmallSystem:
    """`steps[s]`: transition and state after it. `of_states` and `of_transitions`: what is true."""

    steps: tuple[tuple[tuple[int, int], ...], ...]
    of_states: tuple[int, ...]
    of_transitions: tuple[int, ...]
    propositions: Sequence[Proposition] = ATOMS
    reduced: bool = False
    open_at: int = -1

    def initial(self) -> Sequence[int]:
        return (0,)

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        return self.steps[state]

    def is_open(self, state: int) -> bool:
        return state == self.open_at

    def true_in(self, state: int) -> int:
        return self.of_states[state]

    def true_when(self, transition: int) -> int:
        return self.of_transitions[transition]


@st.composite
def systems(draw: st.DrawFn, transitions: int = 3, states: int = 4) -> SmallSystem:
    """`a` and `b` are true in states, `c` when transitions fire."""
    size = draw(st.integers(1, states))
    step = st.tuples(st.integers(0, transitions - 1), st.integers(0, size - 1))
    steps = st.lists(step, max_size=3, unique=True).map(tuple)
    return SmallSystem(
        tuple(draw(steps) for _ in range(size)),
        tuple(draw(st.integers(0, 3)) for _ in range(size)),
        tuple(draw(st.sampled_from([0, 0, 4])) for _ in range(transitions)),
    )


def runs(system: SmallSystem, length: int) -> Iterator[Run]:
    """All runs of so many moves: ended ones, and ones that go back to a state."""
    waiting: list[tuple[Move, ...]] = [()]
    while waiting:
        moves = waiting.pop()
        visited = [0, *(move.state for move in moves)]
        if not system.successors(visited[-1]):
            yield Run(0, moves)
            continue
        for at, state in enumerate(visited[:-1]):
            if state == visited[-1]:
                yield Run(0, moves[:at], moves[at:])
        if len(moves) < length:
            waiting += [(*moves, Move(*step)) for step in system.successors(visited[-1])]


def is_fair(system: SmallSystem, run: Run) -> bool:
    """Whether each transition that can fire in a round does so."""
    possible = {transition for move in run.cycle for transition, _ in system.successors(move.state)}
    return possible <= {move.transition for move in run.cycle}
