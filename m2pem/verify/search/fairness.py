"""Fair infinite runs: runs that never end though no outcome is passed over for ever.

On a fair cycle, each outcome (`Transition.outcomes`) that is possible in one of its states happens.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from m2pem.verify.ltl.automaton import components
from m2pem.verify.net.petri_net import outcomes_of
from m2pem.verify.search.explore import Exploration, Stopped

_Step = tuple[int, int]
"""A transition, and the state after it."""
_MOST_BEGINNINGS = 20
"""Most states of a component among which the one with the shortest run is looked for."""
_LARGE = 2_000
"""States up to which the shortest run is looked for at all."""


@dataclass(frozen=True, slots=True)
class Lasso:
    """A run to `state`, and the transitions of a cycle that begins and ends there."""

    state: int
    prefix: tuple[int, ...]
    cycle: tuple[int, ...]


class FairCycles:
    """The states of a search in which fair runs can stay for ever.

    The search must have kept its edges, and used no reduction. `ignored`: transitions that no run
    needs to take, and that none of the runs found takes.
    """

    def __init__(self, found: Exploration, ignored: Callable[[int], bool]) -> None:
        self._found = found
        self._ignored = [ignored(transition.index) for transition in found.net.transitions]
        outcomes = outcomes_of(found.net)
        self._outcomes = [
            frozenset(outcomes[transition.index]) for transition in found.net.transitions
        ]
        self._open = set(found.cut)
        """States of which not all steps are known."""
        if found.stopped is Stopped.INTERRUPTED:
            self._open.add(_last_expanded(found))

    @property
    def any(self) -> bool:
        """Whether there is any cycle, fair or not."""
        return any(self._goes_round(part) for part in self._parts(range(self._size)))

    def nearest(self) -> Lasso | None:
        """A fair run that never ends; None if there is none."""
        parts = sorted(self._fair(), key=min)
        if not parts:
            return None
        part = parts[0]
        tried = _MOST_BEGINNINGS if len(part) < _LARGE else 1
        return min(
            (self._lasso(part, state) for state in sorted(part)[:tried]),
            key=lambda each: len(each.prefix) + len(each.cycle),
        )

    # --- where ----------------------------------------------------------------------------------

    @property
    def _size(self) -> int:
        return len(self._found.states)

    def _steps(self, state: int) -> Iterator[_Step]:
        if state not in self._open:
            for step in self._found.successors(state):
                if not self._ignored[step[0]]:
                    yield step

    def _possible(self, state: int) -> frozenset[int]:
        """The outcomes that are possible in a state."""
        return frozenset[int]().union(
            *(self._outcomes[transition] for transition, _ in self._steps(state))
        )

    def _fair(self) -> Iterator[frozenset[int]]:
        waiting: list[Collection[int]] = [range(self._size)]
        while waiting:
            for part in self._parts(waiting.pop()):
                if not self._goes_round(part):
                    continue
                passed: set[int] = set()
                for state in part:
                    for transition, to in self._steps(state):
                        if to in part:
                            passed |= self._outcomes[transition]
                kept = [state for state in part if self._possible(state) <= passed]
                if len(kept) == len(part):
                    yield part
                elif kept:  # who stays must not be where an outcome could come that leads away
                    waiting.append(kept)

    def _parts(self, states: Collection[int]) -> Iterator[frozenset[int]]:
        """The strongly connected components of some states."""
        place = {state: at for at, state in enumerate(states)}
        targets = [[place[to] for _, to in self._steps(s) if to in place] for s in states]
        members: dict[int, list[int]] = {}
        for state, number in zip(states, components(targets), strict=True):
            members.setdefault(number, []).append(state)
        return (frozenset(each) for each in members.values())

    def _goes_round(self, part: frozenset[int]) -> bool:
        return len(part) > 1 or any(to in part for s in part for _, to in self._steps(s))

    # --- one such run ---------------------------------------------------------------------------

    def _lasso(self, part: frozenset[int], start: int) -> Lasso:
        """Return a fair lasso that takes each outcome that is possible in its states, and little
        else.
        """
        cycle: list[int] = []
        possible = set(self._possible(start))
        passed: set[int] = set()
        at = start
        while not cycle or at != start or possible - passed:
            missing = frozenset(possible - passed)
            for transition, state in self._way(part, at, missing, start):
                cycle.append(transition)
                passed |= self._outcomes[transition]
                possible |= self._possible(state)
                at = state
        return Lasso(start, tuple(self._found.run_to(start)), tuple(cycle))

    def _way(
        self, part: frozenset[int], start: int, missing: frozenset[int], back_to: int
    ) -> list[_Step]:
        """The shortest way to one of some outcomes, or, if none is missing, back to the start."""
        came: dict[int, tuple[int, _Step]] = {}
        waiting = deque([start])
        while waiting:
            state = waiting.popleft()
            for transition, to in self._steps(state):
                if to not in part:
                    continue
                if self._outcomes[transition] & missing if missing else to == back_to:
                    way = [(transition, to)]
                    while state != start:
                        state, step = came[state]
                        way.append(step)
                    return way[::-1]
                if to not in came and to != start:
                    came[to] = (state, (transition, to))
                    waiting.append(to)
        raise AssertionError("the states of a round reach each other")


def _last_expanded(found: Exploration) -> int:
    """The state at which a search was interrupted: its steps may be incomplete."""
    starts = found.edge_start
    assert starts is not None
    return max((n for n in range(len(found.states)) if starts[n + 1] > starts[n]), default=-1)
