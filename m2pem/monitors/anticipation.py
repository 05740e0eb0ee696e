"""The three-valued verdict on a run that goes on: LTL3.

A requirement is violated as soon as every continuation of the run violates it, satisfied as soon as
every continuation satisfies it, and open until then (Bauer, Leucker, Schallhart: "Runtime
Verification for LTL and TLTL", ACM TOSEM 20(4), 2011). So a verdict is found from two automata, of
the formula and of its negation: each is in a set of states, without those from which nothing is
accepted; where the set is empty, no continuation is accepted.

A *letter* has bit n set if the n-th proposition of the formula is true in a moment. Letters may be
known in part: each bit of `unknown` may be either.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from functools import lru_cache
from typing import TypeAlias

from m2pem.verify.ltl import Observer, negated, propositions
from m2pem.verify.ltl.automaton import components
from m2pem.verify.ltl.formula import Formula, Proposition


class Verdict(StrEnum):
    """What is certain of a requirement at one moment of a run."""

    OPEN = "open"
    SATISFIED = "satisfied"
    VIOLATED = "violated"

    @property
    def is_certain(self) -> bool:
        """Whether nothing that follows can change it."""
        return self is not Verdict.OPEN


MOST_STEPS = 100_000
"""Steps of a product of automaton and memory that are looked at, at most. Beyond, a state counts as
one that may accept if its automaton alone may: a verdict may come late then, and is never wrong."""


Transitions: TypeAlias = Callable[[int], Iterable[tuple[Sequence[int], int]]]
"""From a state of a run: the letters of each transition, one at least, and the state after it."""


class _Language:
    """The runs that an observer accepts: its states from which it accepts anything, and sets of
    these, numbered; 0 is the empty set."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._live = _live_states(observer)
        self._numbers: dict[frozenset[int], int] = {frozenset(): 0}
        self._sets: list[frozenset[int]] = [frozenset()]
        self.start = self._number(frozenset({observer.start}))

    def _number(self, states: frozenset[int]) -> int:
        live = self._live
        alive = frozenset(
            state
            for state in states
            if (state in live if live is not None else self._observer.may_accept(state))
        )
        number = self._numbers.get(alive)
        if number is None:
            number = self._numbers[alive] = len(self._sets)
            self._sets.append(alive)
        return number

    def step(self, number: int, letter: int, unknown: int) -> int:
        """The set of states after a moment."""
        step = self._observer.step
        return self._number(
            frozenset(
                target
                for state in self._sets[number]
                for each in completions(letter, unknown)
                for target, _ in step(state, each)
            )
        )

    def accepts_for_ever(self, number: int, letter: int, unknown: int) -> bool:
        """Whether a run is accepted that has this letter in all moments from now on."""
        letters = [((each,), 0) for each in completions(letter, unknown)]
        return self.accepts_some(number, 0, lambda _: letters)

    def accepts_some(self, number: int, run: int, transitions: Transitions) -> bool:
        """Whether one of the runs is accepted that go on for ever from a state `run`."""
        order = [(run, state) for state in self._sets[number]]
        index = {pair: at for at, pair in enumerate(order)}
        edges: list[list[tuple[int, int]]] = []
        while len(edges) < len(order):
            run, state = order[len(edges)]
            found: list[tuple[int, int]] = []
            for letters, after in transitions(run):
                for target, postponed in self._read(state, letters):
                    pair = (after, target)
                    if pair not in index:
                        index[pair] = len(order)
                        order.append(pair)
                    found.append((index[pair], postponed))
            edges.append(found)
        return any(_accepting(edges, self._observer.promises))

    def _read(self, state: int, letters: Iterable[int]) -> set[tuple[int, int]]:
        """The states after letters, each with the promises that all steps to it postpone."""
        found = {(state, self._observer.promises)}
        for letter in letters:
            found = {
                (target, postponed & late)
                for source, postponed in found
                for target, late in self._observer.step(source, letter)
            }
        return found


def completions(letter: int, unknown: int) -> Iterator[int]:
    """Yield the letters that a letter may be, of which the bits of `unknown` are not known."""
    part = unknown
    while True:
        yield (letter & ~unknown) | part
        if not part:
            return
        part = (part - 1) & unknown


def _live_states(observer: Observer) -> frozenset[int] | None:
    """The states from which some run is accepted; None: too many to look at."""
    if not observer.has_memory:
        return None  # the states of a reduced automaton are such, and `may_accept` knows it
    letters = range(1 << len(observer.propositions))
    edges: list[list[tuple[int, int]]] = []
    seen = 1
    while len(edges) < seen:
        if len(edges) * len(letters) > MOST_STEPS:
            return None
        found = {pair for each in letters for pair in observer.step(len(edges), each)}
        seen = max(seen, *(target + 1 for target, _ in found)) if found else seen
        edges.append(list(found))
    live = {state for state, good in enumerate(_accepting(edges, observer.promises)) if good}
    sources: list[list[int]] = [[] for _ in edges]
    for state, each in enumerate(edges):
        for target, _ in each:
            sources[target].append(state)
    waiting = list(live)
    while waiting:
        for source in sources[waiting.pop()]:
            if source not in live:
                live.add(source)
                waiting.append(source)
    return frozenset(live)


def _accepting(edges: list[list[tuple[int, int]]], promises: int) -> list[bool]:
    """For each state, whether it is on cycles that together postpone no promise for ever."""
    component = components([[target for target, _ in each] for each in edges])
    postponed = [promises] * (max(component, default=-1) + 1)
    cyclic = [False] * len(postponed)
    for state, each in enumerate(edges):
        for target, late in each:
            if component[target] == component[state]:
                cyclic[component[state]] = True
                postponed[component[state]] &= late
    return [cyclic[each] and not postponed[each] for each in component]


class Anticipation:
    """The monitor of one formula: a deterministic automaton whose states have a verdict.

    States are numbers, made when they are reached; `start` is the one before the first moment. They
    hold for every run: one object serves all monitors of the formula.
    """

    start = 0

    def __init__(self, formula: Formula) -> None:
        """
        Raises:
            FormulaTooLargeError: its automaton would be too large.
        """
        self.propositions: tuple[Proposition, ...] = propositions(formula)
        self._yes = _Language(Observer(formula, self.propositions))
        self._no = _Language(Observer(negated(formula), self.propositions))
        self._pairs = [(self._yes.start, self._no.start)]
        self._numbers = {self._pairs[0]: 0}
        self.verdicts = [self._verdict(*self._pairs[0])]
        """By state, what is certain there."""
        self._after: dict[tuple[int, int, int], int] = {}
        self._at_end: dict[tuple[int, int, int], Verdict] = {}

    @staticmethod
    def _verdict(yes: int, no: int) -> Verdict:
        if not yes:
            return Verdict.VIOLATED
        return Verdict.OPEN if no else Verdict.SATISFIED

    def step(self, state: int, letter: int, unknown: int = 0) -> int:
        """The state after a moment."""
        key = (state, letter, unknown)
        after = self._after.get(key)
        if after is None:
            after = self._after[key] = self._step(state, letter, unknown)
        return after

    def _step(self, state: int, letter: int, unknown: int) -> int:
        yes, no = self._pairs[state]
        pair = (self._yes.step(yes, letter, unknown), self._no.step(no, letter, unknown))
        number = self._numbers.get(pair)
        if number is None:
            number = self._numbers[pair] = len(self._pairs)
            self._pairs.append(pair)
            self.verdicts.append(self._verdict(*pair))
        return number

    def at_end(self, state: int, letter: int, unknown: int = 0) -> Verdict:
        """The verdict if each moment from now on is as this one.

        It is OPEN only if it depends on what is unknown.
        """
        key = (state, letter, unknown)
        verdict = self._at_end.get(key)
        if verdict is None:
            yes, no = self._pairs[state]
            verdict = self._at_end[key] = self._verdict(
                int(self._yes.accepts_for_ever(yes, letter, unknown)),
                int(self._no.accepts_for_ever(no, letter, unknown)),
            )
        return verdict

    def in_loops(self, state: int, run: int, transitions: Transitions) -> Verdict:
        """The verdict on all runs that go on for ever from a state `run`, if the monitor is in
        `state` there; OPEN if it differs from run to run."""
        yes, no = self._pairs[state]
        return self._verdict(
            int(self._yes.accepts_some(yes, run, transitions)),
            int(self._no.accepts_some(no, run, transitions)),
        )


anticipation = lru_cache(maxsize=1_000)(Anticipation)
"""The monitor of a formula, made once."""
