"""A formula's observer: its automaton, and small state machines for its operators of the past.

Each operator of the past and each count becomes a new bit of the letter; a machine sets it from the
letters up to now. The rest of the formula is about the future alone, and becomes the automaton.
"""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from m2pem.verify.ltl.automaton import Automaton, translate
from m2pem.verify.ltl.formula import (
    And,
    Constant,
    Count,
    Formula,
    Historically,
    Iff,
    Implies,
    Not,
    Once,
    Or,
    Proposition,
    Since,
    children,
    propositions,
)
from m2pem.verify.ltl.normal_form import Forms, lower

_COMPARE: dict[str, Callable[[int, int], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
    "==": operator.eq,
    "!=": operator.ne,
}
Memory = tuple[int, ...]
"""The memory of the machines: a number each, and one more bit for each thing that is counted."""


@dataclass(frozen=True, slots=True)
class _Machine:
    """One operator: its bit of the letter, and the index of its bit in the memory."""

    formula: Formula
    bit: int
    slot: int


class Past:
    """The machines of one formula, inner operators first."""

    def __init__(self, first_bit: int, number: Callable[[Formula], int]) -> None:
        self._first_bit = first_bit
        self._number = number
        self._machines: list[_Machine] = []
        self._bits: dict[Formula, int] = {}
        self._slots = 0

    def bit(self, formula: Formula) -> int:
        """The bit of a proposition, or of an operator of the past; its machine is created."""
        if not isinstance(formula, (Once, Historically, Since, Count)):
            return self._number(formula)
        known = self._bits.get(formula)
        if known is not None:
            return known
        for each in _inside(formula):
            self.bit(each)
        bit = self._first_bit + len(self._machines)
        self._machines.append(_Machine(formula, bit, self._slots))
        self._slots += 1 + (len(formula.operands) if isinstance(formula, Count) else 0)
        self._bits[formula] = bit
        return bit

    @property
    def initial(self) -> Memory:
        """The memory before the first moment."""
        return (0,) * self._slots

    def step(self, memory: Memory, letter: int) -> tuple[Memory, int]:
        """Return the memory after a moment, and the letter with the bits of the past."""
        new = list(memory)
        for machine in self._machines:
            if self._watch(machine, memory, new, letter):
                letter |= 1 << machine.bit
        return tuple(new), letter

    def _watch(self, machine: _Machine, old: Memory, new: list[int], letter: int) -> bool:
        slot, formula = machine.slot, machine.formula
        match formula:
            case Once():
                new[slot] = int(old[slot] or self._holds(formula.operand, letter))
                return bool(new[slot])
            case Historically():  # remembered: whether it has failed
                new[slot] = int(old[slot] or not self._holds(formula.operand, letter))
                return not new[slot]
            case Since():
                began = self._holds(formula.right, letter)
                new[slot] = int(began or (old[slot] and self._holds(formula.left, letter)))
                return bool(new[slot])
            case Count():
                for at, operand in enumerate(formula.operands, slot + 1):
                    new[at] = int(self._holds(operand, letter))
                    if new[at] and not old[at]:  # past the bound, more makes no difference
                        new[slot] = min(new[slot] + 1, formula.number + 1)
                return _COMPARE[formula.operator](new[slot], formula.number)
            case _:
                raise TypeError(f"no operator of the past: {formula}")

    def _holds(self, formula: Formula, letter: int) -> bool:
        match formula:
            case Constant():
                return formula.value
            case Not():
                return not self._holds(formula.operand, letter)
            case And():
                return all(self._holds(each, letter) for each in formula.operands)
            case Or():
                return any(self._holds(each, letter) for each in formula.operands)
            case Implies(left, right):
                return not self._holds(left, letter) or self._holds(right, letter)
            case Iff(left, right):
                return self._holds(left, letter) == self._holds(right, letter)
            case _:
                return bool(letter >> self.bit(formula) & 1)


def _inside(formula: Formula) -> list[Formula]:
    """The outermost operators of the past in a formula."""
    found: list[Formula] = []
    waiting = list(children(formula))
    while waiting:
        each = waiting.pop()
        if isinstance(each, (Once, Historically, Since, Count)):
            found.append(each)
        else:
            waiting += children(each)
    return found


class Observer:
    """An automaton with memory that accepts the runs of which a formula holds.

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
        """A mask of all promises that an accepted run must not postpone for ever."""
        return (1 << self.automaton.promises) - 1

    @property
    def has_memory(self) -> bool:
        """Whether there are operators of the past, so that a state is more than the automaton's."""
        return bool(self._past.initial)

    def may_accept(self, state: int) -> bool:
        """Whether the automaton accepts some continuation from a state on; with memory, it may be
        one that cannot come."""
        return bool(self.automaton.edges[self._states[state][0]])

    def accepts_all(self, state: int) -> bool:
        """Whether every continuation is accepted from a state on."""
        return self._states[state][0] == self.automaton.accepting_all

    def step(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """The states after a moment, each with the promises that the step postpones."""
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
