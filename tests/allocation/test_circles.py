"""Circles of requests that wait for each other, compared with every set of them."""

from collections.abc import Sequence
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from m2pem.allocation.circles import Until, Waiting, circles

NAMES = ("a", "b", "c", "d", "e")
HELD = st.dictionaries(
    st.frozensets(st.sampled_from((*NAMES, "no request")), max_size=2),
    st.integers(1, 2),
    max_size=3,
)
NEEDED = st.lists(st.tuples(st.integers(1, 3), HELD), max_size=2).map(tuple)
WAITING = st.lists(NEEDED, max_size=len(NAMES)).map(
    lambda needed: [Waiting(*each) for each in zip(NAMES, needed, strict=False)]
)


def waits(request: str, *others: str) -> Waiting:
    return Waiting(request, ((1, {Until({other}): 1 for other in others}),))


def stuck_for_ever(waiting: Sequence[Waiting]) -> set[str]:
    """The requests in any set of which none can be met before another one of it is."""
    found = set[str]()
    for size in range(1, len(waiting) + 1):
        for some in combinations(waiting, size):
            names = {each.request for each in some}
            if not any(each.can_be_met(names) for each in some):
                found |= names
    return found


@given(WAITING)
def test_what_is_stuck_and_on_or_between_circles_is_found(waiting: list[Waiting]) -> None:
    stuck = stuck_for_ever(waiting)
    reached = {each.request: each.waits_for() & stuck for each in waiting if each.request in stuck}
    for middle, beyond in reached.items():
        for reaches in reached.values():
            if middle in reaches:
                reaches.update(beyond)
    on_circle = {name for name, reaches in reached.items() if name in reaches}
    after_circle = set[str]().union(*(reached[name] for name in on_circle))
    found = circles(waiting)
    said = [name for circle in found for name in circle]
    assert len(said) == len(set(said))
    assert set(said) == {name for name in after_circle if reached[name] & on_circle}


def test_who_waits_for_a_circle_is_not_in_it() -> None:
    waiting = [waits("a", "b"), waits("b", "a"), waits("c", "a"), waits("d", "e"), waits("e", "d")]
    assert circles(waiting) == [{"a", "b"}, {"d", "e"}]


def test_a_run_goes_on_when_one_of_its_requests_is_met() -> None:
    holds_until = Waiting("a", ((1, {Until({"b", "c"}): 1}),))
    assert circles([holds_until, waits("b", "a"), waits("c", "a")]) == [{"a", "b", "c"}]
    assert circles([holds_until, waits("b", "a")]) == []
