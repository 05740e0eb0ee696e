"""Random formulas and runs for tests of temporal logic."""

from hypothesis import strategies as st

from m2pem.verify.ltl.formula import (
    Active,
    Always,
    And,
    Completed,
    Constant,
    Count,
    Eventually,
    Formula,
    Historically,
    Iff,
    Implies,
    Next,
    Not,
    Once,
    Or,
    Since,
    Until,
    WeakUntil,
)
from m2pem.verify.ltl.lasso import Moment

ATOMS = (Active("a"), Active("b"), Completed("c"))

atoms = st.sampled_from(ATOMS)


def _connectives(inner: st.SearchStrategy[Formula]) -> list[st.SearchStrategy[Formula]]:
    pairs = st.lists(inner, min_size=2, max_size=3).map(tuple)
    return [
        st.builds(Not, inner),
        st.builds(And, pairs),
        st.builds(Or, pairs),
        st.builds(Implies, inner, inner),
        st.builds(Iff, inner, inner),
    ]


past = st.recursive(
    atoms,
    lambda inner: st.one_of(
        *_connectives(inner),
        st.builds(Once, inner),
        st.builds(Historically, inner),
        st.builds(Since, inner, inner),
        st.builds(
            Count,
            st.lists(inner, min_size=1, max_size=2).map(tuple),
            st.sampled_from([">=", "<=", "==", "!=", ">", "<"]),
            st.integers(0, 3),
        ),
    ),
    max_leaves=4,
)


def _future(leaves: st.SearchStrategy[Formula], *, steps: bool) -> st.SearchStrategy[Formula]:
    def extend(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        found = [
            *_connectives(inner),
            st.builds(Always, inner),
            st.builds(Eventually, inner),
            st.builds(Until, inner, inner),
            st.builds(WeakUntil, inner, inner),
        ]
        return st.one_of(*found, *([st.builds(Next, inner)] if steps else []))

    return st.recursive(leaves, extend, max_leaves=7)


constants = st.builds(Constant, st.booleans())
future = _future(st.one_of(atoms, atoms, atoms, constants), steps=False)
"""Formulas of the future alone."""
stepping = _future(atoms, steps=True)
"""With the operator that looks at the next moment."""
formulas = _future(st.one_of(atoms, past), steps=False)
"""All that people can write."""

moments: st.SearchStrategy[Moment] = st.frozensets(atoms)
prefixes = st.lists(moments, max_size=5)
cycles = st.lists(moments, min_size=1, max_size=4)
