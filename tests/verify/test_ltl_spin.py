"""Another translator's automata accept the same runs."""

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from m2pem.verify.ltl import Observer
from m2pem.verify.ltl.formula import Active, Always, And, Formula, Not
from m2pem.verify.ltl.lasso import Moment
from tests.seeds import examples
from tests.verify import formulas, never_claim
from tests.verify.acceptance import accepts

NEVER = And((Not(Active("a")), Always(Active("a"))))
"""Holds of no run. Spin's automaton has no state to go to, in its own notation."""

runs = st.lists(st.tuples(formulas.prefixes, formulas.cycles), min_size=10, max_size=30)


@settings(max_examples=examples(20, 80), deadline=None, suppress_health_check=list(HealthCheck))
@given(formulas.future, runs)
@example(NEVER, [([], [frozenset()]), ([], [frozenset({Active("a")})])])
def test_spin_accepts_the_same_runs(
    formula: Formula, runs: list[tuple[list[Moment], list[Moment]]]
) -> None:
    claim = never_claim.never_claim(formula)
    observer = Observer(formula)
    for prefix, cycle in runs:
        expected = never_claim.accepts(claim, prefix, cycle)
        assert accepts(observer, prefix, cycle) is expected, never_claim.promela(formula)
