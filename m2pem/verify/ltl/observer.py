"""A formula's automaton with its machines of the past: what a search runs beside a mission."""

from collections.abc import Sequence

from m2pem.verify.ltl.automaton import Automaton
from m2pem.verify.ltl.formula import Formula, Proposition, propositions
from m2pem.verify.ltl.lowering import lower
from m2pem.verify.ltl.normal import Forms
from m2pem.verify.ltl.past import Memory, Past
from m2pem.verify.ltl.translate import translate


class Observer:
    """Accepts the runs of which a formula holds.

    A letter has bit n set if the n-th of `propositions` is true in a moment. States are numbers;
    `start` is the one before the first moment.
    """

    start = 0

    def __init__(self, formula: Formula, known: Sequence[Proposition] = ()) -> None:
        """`known`: propositions that have the first bits, in this order.

        Raises:
            FormulaTooLargeError: the automaton would be too large.
        """
        self.formula = formula
        self.propositions = tuple(dict.fromkeys([*known, *propositions(formula)]))
        bits: dict[Formula, int] = {each: n for n, each in enumerate(self.propositions)}
        self._past = Past(len(bits), bits.__getitem__)
        forms = Forms()
        self.automaton: Automaton = translate(lower(formula, forms, self._past.bit), forms)
        first = (self.automaton.initial, self._past.initial)
        self._numbers: dict[tuple[int, Memory], int] = {first: 0}
        self._states = [first]
        self._steps: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {}

    @property
    def promises(self) -> int:
        """How many promises an accepted run must not postpone for ever, as a mask of them all."""
        return (1 << self.automaton.promises) - 1

    def accepts_all(self, state: int) -> bool:
        """Whether every run is accepted from there on."""
        return self._states[state][0] == self.automaton.accepting_all

    def step(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """The states after a moment, each with the promises that going there postpones."""
        key = (state, letter)
        known = self._steps.get(key)
        if known is None:
            known = self._steps[key] = self._step(state, letter)
        return known

    def _step(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        at, memory = self._states[state]
        memory, full = self._past.step(memory, letter)
        found: list[tuple[int, int]] = []
        for edge in self.automaton.edges[at]:
            if edge.reads(full):
                after = (edge.target, memory)
                number = self._numbers.get(after)
                if number is None:
                    number = self._numbers[after] = len(self._states)
                    self._states.append(after)
                found.append((number, edge.postponed))
        return tuple(dict.fromkeys(found))
