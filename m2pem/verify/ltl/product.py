"""The product of a labelled transition system and a formula's observer.

`LabelledSystem` is what a system provides for a formula to be checked of it. `Product` is built
node by node, nearest to the initial state first.
"""

from array import array
from collections.abc import Sequence
from typing import Protocol

from m2pem.verify.ltl import Observer
from m2pem.verify.ltl.formula import Proposition

STUTTER = -1
"""In place of a transition: the run is over, and its last state remains for ever."""
QUIET = -2
"""In place of a transition: the quiet moment after one in which something was completed."""


class LabelledSystem(Protocol):
    """A labelled transition system. States and transitions are numbers; labels have a bit for each
    of `propositions`.

    A proposition of states (`active`, `commanded`, `ended`, data) is true while the system is in
    such a state. One of transitions (`completed`) is true in the moment in which the transition
    fires. A state without successors is the end of a run. A system with a reduction (`reduced`)
    must keep all runs apart that differ in the labels of their states and transitions.
    """

    @property
    def propositions(self) -> Sequence[Proposition]:
        """The propositions of the labels' bits."""

    @property
    def reduced(self) -> bool:
        """Whether successors are left out: not every enabled transition is among them."""

    def initial(self) -> Sequence[int]:
        """The initial states."""

    def is_open(self, state: int) -> bool:
        """Whether the successors of a state are unknown."""

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The enabled transitions of a state, each with the state after it."""

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""

    def true_when(self, transition: int) -> int:
        """The propositions that are true in the moment in which a transition fires."""


BYTES_A_NODE = 400
"""Approximate memory of a node."""
BYTES_A_MOVE = 120


class Product:
    """The product, built node by node. A node is a state of each, and whether a quiet moment
    follows.

    `moves[n]`: transition, node and postponed promises of each move from node n, once it was
    expanded. With `steps`, each step of the system is one moment, and no quiet ones come between.
    """

    def __init__(self, system: LabelledSystem, observer: Observer, *, steps: bool) -> None:
        self.system = system
        self.observer = observer
        self.steps = steps
        self.states = array("q")
        self.observed = array("q")
        self.parent = array("q")
        self.via = array("i")
        self.moves: list[list[tuple[int, int, int]]] = []
        self.number_of_moves = 0
        self._numbers: dict[tuple[int, int, bool], int] = {}
        self._pending = bytearray()
        self._true: dict[int, int] = {}
        self._successors: dict[int, Sequence[tuple[int, int]]] = {}
        self.open = False
        """Whether a state with unknown successors was reached."""
        self.broken = -1
        """The first node from which the observer accepts every continuation; -1 if none."""
        for state in system.initial():
            for observed, _ in observer.step(observer.start, self.true_in(state)):
                self._node(state, observed, False, -1, STUTTER)

    def __len__(self) -> int:
        return len(self.states)

    @property
    def bytes(self) -> int:
        """Approximate memory of the product."""
        return len(self) * BYTES_A_NODE + self.number_of_moves * BYTES_A_MOVE

    def true_in(self, state: int) -> int:
        """The label of a state of the system."""
        known = self._true.get(state)
        if known is None:
            known = self._true[state] = self.system.true_in(state)
        return known

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        known = self._successors.get(state)
        if known is None:
            known = self._successors[state] = tuple(self.system.successors(state))
        return known

    def is_quiet(self, node: int) -> bool:
        """Whether a quiet moment follows."""
        return bool(self._pending[node])

    def expand(self) -> None:
        """Find the moves from the first node that is not yet expanded."""
        node = len(self.moves)
        state, observed = self.states[node], self.observed[node]
        found: list[tuple[int, int, int]] = []
        if self._pending[node]:
            self._move(found, node, QUIET, state, self.true_in(state), False)
        else:
            steps = self.successors(state)
            open_ = not steps and self.system.is_open(state)
            self.open |= open_
            for transition, after in steps:
                now = self.system.true_when(transition)
                letter = self.true_in(after) | now
                pending = bool(now) and not self.steps
                for target, postponed in self.observer.step(observed, letter):
                    number = self._node(after, target, pending, node, transition)
                    found.append((transition, number, postponed))
            if not steps and not open_:
                self._move(found, node, STUTTER, state, self.true_in(state), False)
        self.number_of_moves += len(found)
        self.moves.append(found)

    def _move(
        self,
        found: list[tuple[int, int, int]],
        node: int,
        transition: int,
        state: int,
        letter: int,
        pending: bool,
    ) -> None:
        for target, postponed in self.observer.step(self.observed[node], letter):
            found.append(
                (transition, self._node(state, target, pending, node, transition), postponed)
            )

    def _node(self, state: int, observed: int, pending: bool, parent: int, via: int) -> int:
        key = (state, observed, pending)
        known = self._numbers.get(key)
        if known is None:
            known = self._numbers[key] = len(self.states)
            self.states.append(state)
            self.observed.append(observed)
            self._pending.append(pending)
            self.parent.append(parent)
            self.via.append(via)
            if self.broken < 0 and self.observer.accepts_all(observed):
                self.broken = known
        return known
