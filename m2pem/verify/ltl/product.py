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
"""In place of a rule: the run is over, and its last state stays for ever."""
QUIET = -2
"""In place of a rule: the quiet moment after one in which something was completed."""


class LabelledSystem(Protocol):
    """States and rules are numbers; what is true is a bit for each of `propositions`.

    A proposition of states (`active`, `commanded`, `ended`, data) is true as long as the state is
    one in which it is. One of rules (`completed`) is true in the moment in which the rule fires.

    A state without successors is the end of a run. A system that leaves out rules whose order
    makes no difference must keep all runs apart that differ in what is true of their states and
    rules, and says so (`reduced`).
    """

    @property
    def propositions(self) -> Sequence[Proposition]:
        """What the bits stand for."""
        ...

    @property
    def reduced(self) -> bool:
        """Whether successors are left out: not every rule that can fire is among them."""
        ...

    def initial(self) -> Sequence[int]:
        """The states in which runs begin."""
        ...

    def is_open(self, state: int) -> bool:
        """Whether what follows a state is not known: runs may go on, but not where to."""
        ...

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The rules that can fire in a state, each with the state after it."""
        ...

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""
        ...

    def true_when(self, rule: int) -> int:
        """The propositions that are true in the moment in which a rule fires."""
        ...


BYTES_A_NODE = 400
"""About what a node costs in memory."""
BYTES_A_MOVE = 120


class Product:
    """Nodes are numbered as found. One is a state of each, and whether a quiet moment comes next.

    `moves[n]`: rule, node and postponed promises of each move from node n, once it was expanded.
    With `steps`, each step of the system is one moment, and no quiet ones come between.
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
        """Whether a state was met of which what follows is not known."""
        self.broken = -1
        """The first node from which on the observer accepts whatever comes; -1 if none."""
        for state in system.initial():
            for observed, _ in observer.step(observer.start, self.true_in(state)):
                self._node(state, observed, False, -1, STUTTER)

    def __len__(self) -> int:
        return len(self.states)

    @property
    def bytes(self) -> int:
        """About what it takes in memory."""
        return len(self) * BYTES_A_NODE + self.number_of_moves * BYTES_A_MOVE

    def true_in(self, state: int) -> int:
        """What is true in a state of the system."""
        known = self._true.get(state)
        if known is None:
            known = self._true[state] = self.system.true_in(state)
        return known

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The steps of the system from a state."""
        known = self._successors.get(state)
        if known is None:
            known = self._successors[state] = tuple(self.system.successors(state))
        return known

    def is_quiet(self, node: int) -> bool:
        """Whether a quiet moment comes next."""
        return bool(self._pending[node])

    def expand(self) -> None:
        """Find the moves from the first node that was not yet expanded."""
        node = len(self.moves)
        state, observed = self.states[node], self.observed[node]
        found: list[tuple[int, int, int]] = []
        if self._pending[node]:
            self._move(found, node, QUIET, state, self.true_in(state), False)
        else:
            steps = self.successors(state)
            open_ = not steps and self.system.is_open(state)
            self.open |= open_
            for rule, after in steps:
                now = self.system.true_when(rule)
                letter = self.true_in(after) | now
                pending = bool(now) and not self.steps
                for target, postponed in self.observer.step(observed, letter):
                    number = self._node(after, target, pending, node, rule)
                    found.append((rule, number, postponed))
            if not steps and not open_:
                self._move(found, node, STUTTER, state, self.true_in(state), False)
        self.number_of_moves += len(found)
        self.moves.append(found)

    def _move(
        self,
        found: list[tuple[int, int, int]],
        node: int,
        rule: int,
        state: int,
        letter: int,
        pending: bool,
    ) -> None:
        for target, postponed in self.observer.step(self.observed[node], letter):
            found.append((rule, self._node(state, target, pending, node, rule), postponed))

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
