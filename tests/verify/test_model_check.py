from collections.abc import Sequence
from itertools import islice

import pytest
from hypothesis import given, settings

from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import Always, Completed, Eventually, Formula, Implies, Next
from m2pem.verify.ltl.model_check import (
    Move,
    Result,
    Run,
    Stopped,
    Verdict,
    breaks,
    check,
)
from m2pem.verify.search.explore import Limits
from tests.seeds import examples
from tests.verify import formulas
from tests.verify.small_systems import SmallSystem, is_fair, runs, systems

A, B, C = 1, 2, 4


def chain(*of_states: int, back_to: int | None = None) -> SmallSystem:
    """States one after the other; transition n leaves state n."""
    last = len(of_states) - 1
    steps = [((n, n + 1),) for n in range(last)]
    steps.append(() if back_to is None else ((last, back_to),))
    return SmallSystem(tuple(steps), of_states, (0,) * len(of_states))


@settings(max_examples=examples(37, 150), deadline=None)
@given(systems(), formulas.formulas)
def test_a_formula_holds_just_when_no_run_breaks_it(system: SmallSystem, formula: Formula) -> None:
    verdict = check(system, formula)
    if any(breaks(system, formula, run, steps=False) for run in islice(runs(system, 7), 300)):
        assert verdict.result is Result.VIOLATED
    if verdict.run is not None:
        assert breaks(system, formula, verdict.run, steps=False)


@settings(max_examples=examples(37, 150), deadline=None)
@given(systems(), formulas.formulas)
def test_with_fairness_only_fair_runs_count(system: SmallSystem, formula: Formula) -> None:
    verdict = check(system, formula, fair={transition: transition for transition in range(3)})
    fair = [run for run in islice(runs(system, 7), 300) if is_fair(system, run)]
    if any(breaks(system, formula, run, steps=False) for run in fair):
        assert verdict.result is Result.VIOLATED
    if verdict.run is not None and not verdict.run.whatever_follows:
        assert is_fair(system, verdict.run)


@settings(max_examples=examples(25, 100), deadline=None)
@given(systems(), formulas.stepping)
def test_single_steps_are_moments_for_formulas_that_look_at_them(
    system: SmallSystem, formula: Formula
) -> None:
    formula = Always(Implies(formula, Next(formula)))
    verdict = check(system, formula)
    if any(breaks(system, formula, run, steps=True) for run in islice(runs(system, 6), 100)):
        assert verdict.result is Result.VIOLATED


def test_what_is_broken_once_and_for_all_is_shown_by_a_shortest_run() -> None:
    system = SmallSystem(
        (((0, 1), (1, 2)), ((0, 3),), ((0, 3),), ((0, 4),), ((2, 0),)), (0, 0, B, 0, B), (0, 0, 0)
    )
    verdict = check(system, parse("[] !active(b)"))
    assert verdict.run == Run(0, (Move(1, 2),), whatever_follows=True)


def test_what_never_comes_is_shown_by_a_round() -> None:
    verdict = check(chain(0, 0, A, back_to=1), parse("<> active(b)"))
    assert verdict.run == Run(0, (Move(0, 1),), (Move(1, 2), Move(2, 1)))


def test_a_run_that_is_over_stays_as_it_is() -> None:
    assert check(chain(0, A), parse("<>[] active(a)")).result is Result.HOLDS
    verdict = check(chain(A, 0), parse("[]<> active(a)"))
    assert verdict.run == Run(0, (Move(0, 1),))


def test_what_is_completed_is_so_for_a_moment() -> None:
    system = SmallSystem((((0, 1),), ((0, 1),)), (0, 0), (C,))
    assert check(system, parse("<> completed(c)")).result is Result.HOLDS
    assert check(system, parse("[] (completed(c) -> <> !completed(c))")).result is Result.HOLDS
    assert check(system, parse("<> count(completed(c)) >= 3")).result is Result.HOLDS
    assert check(system, parse("[] count(completed(c)) <= 3")).result is Result.VIOLATED


def test_a_choice_that_is_never_made_is_no_fair_run() -> None:
    system = SmallSystem((((0, 0), (1, 1)), ()), (0, B), (0, 0))
    formula = parse("<> active(b)")
    assert check(system, formula).run == Run(0, (), (Move(0, 0),))
    assert check(system, formula, fair={0: 0, 1: 1}).result is Result.HOLDS


def test_outcomes_of_one_kind_are_one() -> None:
    system = SmallSystem((((0, 0), (1, 1)), ()), (0, B), (0, 0))
    assert check(system, parse("<> active(b)"), fair={0: 7, 1: 7}).result is Result.VIOLATED


def counter(size: int) -> SmallSystem:
    return chain(*[0] * size, A)


def test_limits_leave_it_undecided() -> None:
    formula = parse("[] !active(b)")
    verdict = check(counter(5_000), formula, limits=Limits(states=1_000))
    assert (verdict.result, verdict.stopped) == (Result.UNDECIDED, Stopped.STATES)
    verdict = check(counter(5_000), formula, limits=Limits(memory_mb=0.1))
    assert verdict.stopped is Stopped.MEMORY
    verdict = check(counter(5_000), formula, limits=Limits(seconds=0))
    assert verdict.stopped is Stopped.TIME
    assert check(counter(5_000), formula).result is Result.HOLDS


def test_what_was_found_before_a_limit_counts() -> None:
    verdict = check(counter(5_000), parse("active(a)"), limits=Limits(states=1_000))
    assert verdict.result is Result.VIOLATED


def test_an_interruption_says_what_was_seen() -> None:
    class Interrupted(SmallSystem):
        def successors(self, state: int) -> Sequence[tuple[int, int]]:
            if state > 1_000:
                raise KeyboardInterrupt
            return self.steps[state]

    whole = counter(5_000)
    system = Interrupted(whole.steps, whole.of_states, whole.of_transitions)
    verdict: Verdict = check(system, parse("[] !active(b)"))
    assert (verdict.result, verdict.stopped) == (Result.UNDECIDED, Stopped.INTERRUPTED)
    assert 1_000 < verdict.states < 2_000


def test_a_round_is_found_before_all_is_seen() -> None:
    size = 60_000
    steps = [((0, 0), (1, 1)), *(((1, n + 1),) for n in range(1, size)), ()]
    system = SmallSystem(tuple(steps), (0,) * (size + 1), (0, 0))
    verdict = check(system, parse("<> ended"))
    assert verdict.run == Run(0, (), (Move(0, 0),))
    assert verdict.states < 5_000


def test_systems_that_leave_transitions_out_are_refused_where_all_are_needed() -> None:
    system = SmallSystem((((0, 0),),), (0,), (0,), reduced=True)
    with pytest.raises(ValueError, match="leaves no transition out"):
        check(system, Eventually(Completed("c")), fair={0: 0})
    with pytest.raises(ValueError, match="leaves no transition out"):
        check(system, Next(Completed("c")))
