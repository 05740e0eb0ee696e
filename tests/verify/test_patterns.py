from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.verify.ltl import Observer, parse, show
from m2pem.verify.ltl.formula import (
    Active,
    Commanded,
    Completed,
    Ended,
    Eventually,
    Formula,
    Next,
    Not,
    walk,
)
from m2pem.verify.ltl.lasso import Moment, holds
from m2pem.verify.requirements.english import English
from m2pem.verify.requirements.patterns import PATTERNS, Kind, Pattern
from m2pem.verify.requirements.patterns.scopes import ScopeError, within
from tests.verify import formulas
from tests.verify.acceptance import accepts
from tests.verify.pattern_runs import GOOD_AND_BAD, OF_PART

LETTERS: dict[str, Formula] = {
    **{each: Completed(each) for each in "abc"},
    "u": Commanded("uav1"),
    "e": Ended("completed"),
    "f": Ended("failed"),
    "s": Completed("SurveyNorth"),
    "t": Completed("SurveySouth"),
    "x": Active("A"),
    "y": Active("B"),
}
SCOPES = ("before", "after", "until")


class Around:
    """A mission in which two areas can be surveyed."""

    def places_of(self, resource: str, behavior: str) -> Mapping[str, Sequence[str]]:
        return {"area north": ["SurveyNorth"], "area south": ["SurveySouth"]}

    def store_of(self, task: str) -> str:
        return "user.decision"


def moment(written: str) -> Moment:
    found = {LETTERS[each] for each in written if each != "-"}
    return frozenset(found | {Ended()} if found & {LETTERS["e"], LETTERS["f"]} else found)


def run(written: str) -> tuple[list[Moment], list[Moment]]:
    before, _, again = written.partition("|")
    return [moment(each) for each in before.split()], [moment(each) for each in again.split()] or [
        moment("-")
    ]


def formula_of(name: str, arguments: dict[str, Any]) -> Formula:
    pattern = PATTERNS[name]
    given_: dict[str, Any] = {each.name: each.default for each in pattern.arguments}
    for key, value in arguments.items():
        argument = pattern.argument(key)
        kind = argument.kind if argument else Kind.CONDITION
        if kind is Kind.CONDITION:
            given_[key] = LETTERS[value]
        elif kind is Kind.CONDITIONS:
            given_[key] = tuple(LETTERS[each] for each in value)
        else:
            given_[key] = value
    part = {key: given_[key] for key in SCOPES if key in given_ and not pattern.argument(key)}
    return within(pattern.build(given_, Around()), **part)


def test_every_pattern_has_runs_that_keep_to_it_and_runs_that_do_not() -> None:
    assert set(GOOD_AND_BAD) == set(PATTERNS)
    assert all(good and bad for _, good, bad in GOOD_AND_BAD.values())


CASES = [(name, *case) for name, case in GOOD_AND_BAD.items()] + OF_PART


@pytest.mark.parametrize(("name", "arguments", "good", "bad"), CASES)
def test_a_pattern_means_what_it_says(
    name: str, arguments: dict[str, Any], good: list[str], bad: list[str]
) -> None:
    formula = formula_of(name, arguments)
    observer = Observer(formula)
    for written in good:
        assert holds(formula, *run(written)), written
        assert accepts(observer, *run(written)), written
    for written in bad:
        assert not holds(formula, *run(written)), written
        assert not accepts(observer, *run(written)), written


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=lambda each: each.name)
def test_only_patterns_that_say_so_look_at_single_steps(pattern: Pattern) -> None:
    formula = formula_of(pattern.name, GOOD_AND_BAD[pattern.name][0])
    assert any(isinstance(each, Next) for each in walk(formula)) is pattern.steps
    if not pattern.steps:
        assert parse(show(formula)) == formula


@settings(max_examples=150, deadline=None)
@given(st.data(), formulas.prefixes, formulas.cycles, st.lists(st.integers(1, 3), min_size=9))
def test_no_pattern_but_those_can_tell_how_long_a_moment_is(
    data: st.DataObject, prefix: list[Moment], cycle: list[Moment], times: list[int]
) -> None:
    name = data.draw(st.sampled_from([name for name in PATTERNS if not PATTERNS[name].steps]))
    formula = formula_of(name, GOOD_AND_BAD[name][0])
    letters = list(LETTERS.values())
    known = dict(zip(formulas.ATOMS, letters, strict=False))
    prefix = [frozenset(known[each] for each in moment) for moment in prefix]
    cycle = [frozenset(known[each] for each in moment) for moment in cycle]

    def longer(moments: list[Moment]) -> list[Moment]:
        return [each for each, n in zip(moments, times, strict=False) for _ in range(n)]

    assert holds(formula, prefix, cycle) is holds(formula, longer(prefix), longer(cycle))


DWYER = {
    ("absence", "before"): "<>completed(c) -> (!completed(a) U completed(c))",
    ("absence", "after"): "[](completed(b) -> []!completed(a))",
    ("absence", "until"): "[](completed(b) && !completed(c) -> (!completed(a) W completed(c)))",
    ("existence", "before"): "!completed(c) W (completed(a) && !completed(c))",
    ("existence", "after"): "[]!completed(b) || <>(completed(b) && <>completed(a))",
    ("existence", "between"): "[](completed(b) && !completed(c) -> "
    "(!completed(c) W (completed(a) && !completed(c))))",
    ("existence", "until"): "[](completed(b) && !completed(c) -> "
    "(!completed(c) U (completed(a) && !completed(c))))",
    ("universality", "before"): "<>completed(c) -> (completed(a) U completed(c))",
    ("universality", "after"): "[](completed(b) -> []completed(a))",
    ("universality", "until"): "[](completed(b) && !completed(c) -> (completed(a) W completed(c)))",
}
PARTS = {
    "before": {"before": "c"},
    "after": {"after": "b"},
    "between": {"after": "b", "before": "c"},
    "until": {"after": "b", "until": "c"},
}
letters = st.frozensets(st.sampled_from([LETTERS[each] for each in "abc"]))


@settings(max_examples=60, deadline=None)
@given(st.lists(letters, max_size=5), st.lists(letters, min_size=1, max_size=3))
def test_parts_of_runs_are_those_of_the_published_catalogue(
    prefix: list[Moment], cycle: list[Moment]
) -> None:
    for (name, part), text in DWYER.items():
        formula = formula_of(name, {"what": "a", **PARTS[part]})
        assert holds(formula, prefix, cycle) is holds(parse(text), prefix, cycle), (name, part)


def test_what_counts_from_the_beginning_cannot_be_asked_for_a_part() -> None:
    with pytest.raises(ScopeError, match="counts from the beginning"):
        formula_of("upper_restricted_avoidance", {"avoid": "a", "times": 1, "after": "b"})
    with pytest.raises(ScopeError, match="beside 'after'"):
        within(Eventually(LETTERS["a"]), until=LETTERS["b"])


@pytest.mark.parametrize(
    ("text", "english"),
    [
        ("[] !active(E)", "Never 'Drive' is active."),
        ("[](active(E) -> <> x)", "Whenever 'Drive' is active, then or later x."),
        ("[]<> commanded(uav1, orbit)", "Again and again uav1 is doing orbit."),
        ("<>[] !commanded(uav1)", "From some point on, always uav1 is not commanded."),
        ("<> count(active(E)) > 2", "At some point (more than 2 times so far 'Drive' is active)."),
        ("active(E) U x == 1", "'Drive' is active until x == 1, which comes."),
        ("!active(E) W ended(failed)", "Never 'Drive' is active before the mission has failed."),
        ("active(F) && !x || ended", "('F' is active and not (x)) or the mission is over."),
        ("once x -> y since z", "If at some time before (or now) x, then y ever since z."),
    ],
)
def test_formulas_are_said_in_english(text: str, english: str) -> None:
    assert English({"E": "Drive", "F": ""}).sentence(parse(text)) == english


@given(formulas.formulas)
def test_every_formula_can_be_said(formula: Formula) -> None:
    assert English({}).sentence(Not(formula)).endswith(".")
