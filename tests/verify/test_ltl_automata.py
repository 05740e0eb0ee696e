from hypothesis import given, settings

from m2pem.verify.ltl import Observer, negated
from m2pem.verify.ltl.formula import Formula
from m2pem.verify.ltl.lasso import Moment, holds
from tests.seeds import examples
from tests.verify import formulas
from tests.verify.acceptance import accepts


@settings(max_examples=examples(75, 300), deadline=None)
@given(formulas.formulas, formulas.prefixes, formulas.cycles)
def test_an_observer_accepts_just_the_runs_of_which_the_formula_holds(
    formula: Formula, prefix: list[Moment], cycle: list[Moment]
) -> None:
    expected = holds(formula, prefix, cycle)
    assert accepts(Observer(formula), prefix, cycle) is expected
    assert accepts(Observer(negated(formula)), prefix, cycle) is not expected


@settings(max_examples=examples(50, 200), deadline=None)
@given(formulas.stepping, formulas.prefixes, formulas.cycles)
def test_so_does_one_of_a_formula_that_looks_at_single_steps(
    formula: Formula, prefix: list[Moment], cycle: list[Moment]
) -> None:
    assert accepts(Observer(formula), prefix, cycle) is holds(formula, prefix, cycle)
