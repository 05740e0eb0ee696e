"""The verdicts of monitors, judged by other evaluations of the same formulas."""

from dataclasses import dataclass
from itertools import pairwise

import pytest
from hypothesis import given, settings

from m2pem.monitors.anticipation import Anticipation, Verdict, completions
from m2pem.verify.ltl import negated, parse
from m2pem.verify.ltl.formula import Formula, Proposition
from m2pem.verify.ltl.lasso import Moment, holds
from m2pem.verify.ltl.model_check import Result, check
from tests.seeds import examples
from tests.verify import formulas
from tests.verify.formulas import ATOMS

LETTERS = 1 << len(ATOMS)


@dataclass(frozen=True)
class AnyContinuation:
    """A system that goes through the moments of a prefix, and then through any moments."""

    prefix: tuple[int, ...]
    propositions: tuple[Proposition, ...] = ATOMS
    reduced: bool = False

    def _any(self) -> list[int]:
        return list(range(len(self.prefix), len(self.prefix) + LETTERS))

    def initial(self) -> list[int]:
        return [0] if self.prefix else self._any()

    def is_open(self, state: int) -> bool:
        return False

    def successors(self, state: int) -> list[tuple[int, int]]:
        after = [state + 1] if state + 1 < len(self.prefix) else self._any()
        return [(0, each) for each in after]

    def true_in(self, state: int) -> int:
        known = state < len(self.prefix)
        return self.prefix[state] if known else state - len(self.prefix)

    def true_when(self, transition: int) -> int:
        return 0


def bits(moment: Moment, known: tuple[Proposition, ...]) -> int:
    return sum(1 << n for n, each in enumerate(known) if each in moment)


def certain(formula: Formula, prefix: list[Moment]) -> Verdict:
    """The verdict of the model checker on all continuations of a prefix."""
    system = AnyContinuation(tuple(bits(each, ATOMS) for each in prefix))
    if check(system, formula).result is Result.HOLDS:
        return Verdict.SATISFIED
    if check(system, negated(formula)).result is Result.HOLDS:
        return Verdict.VIOLATED
    return Verdict.OPEN


def states(monitor: Anticipation, moments: list[Moment]) -> list[int]:
    found = [monitor.start]
    for each in moments:
        found.append(monitor.step(found[-1], bits(each, monitor.propositions)))
    return found


def decided(formula: Formula, moments: list[Moment]) -> None:
    """A run that ends: the final verdict is what holds of its lasso, and no earlier one differs."""
    monitor = Anticipation(formula)
    passed = states(monitor, moments)
    verdicts = [monitor.verdicts[each] for each in passed]
    expected = holds(formula, moments, moments[-1:])
    final = monitor.at_end(passed[-1], bits(moments[-1], monitor.propositions))
    assert final is (Verdict.SATISFIED if expected else Verdict.VIOLATED)
    assert set(verdicts) <= {Verdict.OPEN, final}
    for before, after in pairwise(verdicts):
        assert before is Verdict.OPEN or after is before


def anticipated(formula: Formula, prefix: list[Moment]) -> None:
    monitor = Anticipation(formula)
    assert monitor.verdicts[states(monitor, prefix)[-1]] is certain(formula, prefix)


@settings(max_examples=examples(200, 1_000), deadline=None)
@given(formulas.formulas, formulas.cycles)
def test_the_final_verdict_is_what_holds_of_the_run(
    formula: Formula, moments: list[Moment]
) -> None:
    decided(formula, moments)


@pytest.mark.long
@pytest.mark.timeout(1_800)
@settings(max_examples=20_000, deadline=None)
@given(formulas.formulas, formulas.cycles)
def test_it_is_so_of_twenty_thousand_random_formulas_and_runs(
    formula: Formula, moments: list[Moment]
) -> None:
    decided(formula, moments)


@settings(max_examples=examples(100, 500), deadline=None)
@given(formulas.formulas, formulas.prefixes)
def test_a_verdict_comes_as_soon_as_no_continuation_can_change_it(
    formula: Formula, prefix: list[Moment]
) -> None:
    anticipated(formula, prefix)


@pytest.mark.long
@pytest.mark.timeout(1_800)
@settings(max_examples=20_000, deadline=None)
@given(formulas.formulas, formulas.prefixes)
def test_it_is_so_of_twenty_thousand_random_formulas_and_prefixes(
    formula: Formula, prefix: list[Moment]
) -> None:
    anticipated(formula, prefix)


@settings(max_examples=examples(100, 500), deadline=None)
@given(formulas.formulas, formulas.cycles)
def test_what_is_unknown_of_a_moment_leaves_open_what_depends_on_it(
    formula: Formula, moments: list[Moment]
) -> None:
    monitor = Anticipation(formula)
    unknown = 1 if monitor.propositions else 0
    state = monitor.start
    possible = {monitor.start}
    for each in moments:
        letter = bits(each, monitor.propositions)
        state = monitor.step(state, letter, unknown)
        possible = {
            monitor.step(old, new) for old in possible for new in completions(letter, unknown)
        }
    verdicts = {monitor.verdicts[each] for each in possible}
    if monitor.verdicts[state] is not Verdict.OPEN:
        assert verdicts == {monitor.verdicts[state]}
    else:
        assert verdicts != {Verdict.VIOLATED}
        assert verdicts != {Verdict.SATISFIED}


def test_the_memory_of_the_past_counts_for_what_can_still_come() -> None:
    # After a, `[]!once(a)` cannot hold any more, though the rest of the formula never says so.
    monitor = Anticipation(parse("active(b) U ([] !once(active(a)))"))
    first = monitor.step(monitor.start, bits(frozenset({ATOMS[0], ATOMS[1]}), monitor.propositions))
    assert monitor.verdicts[first] is Verdict.VIOLATED


def test_a_bound_of_a_count_is_violated_when_it_is_passed() -> None:
    monitor = Anticipation(parse("[] count(active(a)) <= 1"))
    verdicts = []
    state = monitor.start
    for letter in (1, 1, 0, 1, 0):
        state = monitor.step(state, letter)
        verdicts.append(monitor.verdicts[state])
    assert verdicts == [Verdict.OPEN] * 3 + [Verdict.VIOLATED] * 2
