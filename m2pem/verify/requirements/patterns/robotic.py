"""Robotic mission patterns: visits, avoidance and reactions (their authors call those triggers).

A visit lasts as long as its condition holds; the next visit of the same location begins after it
did not hold. Locations are numbered from 1 as they are listed.
"""

import itertools
from collections.abc import Sequence

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Count,
    Eventually,
    Formula,
    Iff,
    Implies,
    Next,
    Not,
    Until,
    WeakUntil,
    conjunction,
)
from m2pem.verify.requirements.patterns.pattern import (
    AVOIDED,
    CONDITIONS,
    FOR,
    THEN,
    TIMES,
    WHEN,
    WITHIN,
    Argument,
    Arguments,
    Kind,
    Pattern,
    Words,
    bounded,
    lasting,
    say_coming,
    say_lasting,
    say_soon,
    soon,
)


def _places(a: Arguments) -> Sequence[Formula]:
    found: Sequence[Formula] = a["locations"]
    return found


def _visit(places: Sequence[Formula]) -> Formula:
    return conjunction([Eventually(each) for each in places])


def sequence(places: Sequence[Formula]) -> Formula:
    """The first at some time, from then on the second at some time, and so on."""
    first, *rest = places
    return Eventually(And((first, sequence(rest))) if rest else first)


def _no_earlier(places: Sequence[Formula]) -> list[Formula]:
    """Each happens only after the one before it."""
    return [Until(Not(later), earlier) for earlier, later in itertools.pairwise(places)]


def _ordered(places: Sequence[Formula]) -> list[Formula]:
    return [sequence(places), *_no_earlier(places)]


def then_not_before(place: Formula, other: Formula) -> Formula:
    """After this visit, the location is visited again only after the other one, which must be
    visited.
    """
    return Until(place, And((Not(place), Until(Not(place), other))))


def then_not_before_if(place: Formula, other: Formula) -> Formula:
    """The same, but the other one need not be visited, if the location is not either."""
    return WeakUntil(place, And((Not(place), WeakUntil(Not(place), other))))


def _strictly(places: Sequence[Formula]) -> list[Formula]:
    return [
        Until(Not(earlier), And((earlier, then_not_before(earlier, later))))
        for earlier, later in itertools.pairwise(places)
    ]


def _in_turn(places: Sequence[Formula]) -> list[Formula]:
    """Between two visits of a location, the next one in order is visited."""
    turn = [*places[1:], places[0]]
    return [
        Always(Implies(each, then_not_before_if(each, other)))
        for each, other in zip(places, turn, strict=True)
    ]


def _again(places: Sequence[Formula]) -> Formula:
    return conjunction([Always(Eventually(each)) for each in places])


def _ordered_rounds(places: Sequence[Formula]) -> list[Formula]:
    return [
        Always(sequence(places)),
        *_no_earlier(places),
        *(
            Always(Implies(later, then_not_before(later, earlier)))
            for earlier, later in itertools.pairwise(places)
        ),
    ]


def _strict_rounds(places: Sequence[Formula]) -> list[Formula]:
    return [
        *_ordered_rounds(places),
        *(
            Always(Implies(earlier, then_not_before(earlier, later)))
            for earlier, later in itertools.pairwise(places)
        ),
    ]


def _pattern(name: str, meaning: str, build: "object", english: str) -> Pattern:
    def formula(a: Arguments, _: object) -> Formula:
        assert callable(build)
        made = build(_places(a))
        return made if not isinstance(made, list) else conjunction(made)

    def say(a: Arguments, words: Words) -> str:
        return english.format(all=words.each(_places(a)), order=words.each(_places(a), "then"))

    return Pattern(name, meaning, (CONDITIONS,), formula, say)


VISITS = (
    _pattern(
        "visit", "each location is visited, in any order", _visit, "at some point each: {all}"
    ),
    _pattern(
        "sequenced_visit",
        "each location is visited after the one before it; earlier visits do not matter",
        sequence,
        "at some point, one after the other: {order}",
    ),
    _pattern(
        "ordered_visit",
        "each location is visited, and none before the one that is listed before it",
        _ordered,
        "in this order, none before the one before it: {order}",
    ),
    _pattern(
        "strict_ordered_visit",
        "as ordered_visit, and none is visited twice before the next one is",
        lambda places: [*_ordered(places), *_strictly(places)],
        "in this order, none before the one before it and none twice before the next: {order}",
    ),
    _pattern(
        "fair_visit",
        "each location is visited, and none twice before the next one in turn",
        lambda places: [_visit(places), *_in_turn(places)],
        "at some point each, and none twice before the next in turn: {all}",
    ),
    _pattern(
        "patrolling",
        "each location is visited again and again, in any order",
        _again,
        "again and again each: {all}",
    ),
    _pattern(
        "sequenced_patrolling",
        "again and again, the locations are visited one after the other",
        lambda places: Always(sequence(places)),
        "again and again, one after the other: {order}",
    ),
    _pattern(
        "ordered_patrolling",
        "as sequenced_patrolling, and none is visited before the one that is listed before it, "
        "in any round",
        _ordered_rounds,
        "again and again in this order, in each round none before the one before it: {order}",
    ),
    _pattern(
        "strict_ordered_patrolling",
        "as ordered_patrolling, and none is visited twice before the next one is",
        _strict_rounds,
        "again and again in this order, none twice before the next: {order}",
    ),
    _pattern(
        "fair_patrolling",
        "each location is visited again and again, and none twice before the next one in turn",
        lambda places: [_again(places), *_in_turn(places)],
        "again and again each, and none twice before the next in turn: {all}",
    ),
)


AVOIDANCE = (
    Pattern(
        "past_avoidance",
        "the first condition never holds before the second one, which must hold at some point",
        (AVOIDED, Argument("until", Kind.CONDITION), WITHIN),
        lambda a, _: bounded(a, Until(Not(a["avoid"]), a["until"])),
        lambda a, words: (
            f"never {words.of(a['avoid'])} before {words.of(a['until'])}, {say_coming(a)}"
        ),
        scoped=False,
    ),
    Pattern(
        "global_avoidance",
        "the condition never holds",
        (AVOIDED, FOR),
        lambda a, _: Always(Not(lasting(a, a["avoid"]))),
        lambda a, words: f"never {say_lasting(a, words, a['avoid'])}",
    ),
    Pattern(
        "future_avoidance",
        "the first condition never holds once the second one has held",
        (AVOIDED, WHEN, FOR),
        lambda a, _: Always(Implies(a["when"], Always(Not(lasting(a, a["avoid"]))))),
        lambda a, words: (
            f"once {words.of(a['when'])}, never again {say_lasting(a, words, a['avoid'])}"
        ),
    ),
    Pattern(
        "upper_restricted_avoidance",
        "the condition occurs at most so many times",
        (AVOIDED, TIMES),
        lambda a, _: Always(Count((a["avoid"],), "<=", a["times"])),
        lambda a, words: f"at most {a['times']} times: {words.of(a['avoid'])}",
    ),
    Pattern(
        "lower_restricted_avoidance",
        "the condition occurs at least so many times",
        (AVOIDED, TIMES),
        lambda a, _: Eventually(Count((a["avoid"],), ">=", a["times"])),
        lambda a, words: f"at least {a['times']} times: {words.of(a['avoid'])}",
    ),
    Pattern(
        "exact_restricted_avoidance",
        "the condition occurs exactly so many times",
        (AVOIDED, TIMES),
        lambda a, _: And(
            (
                Always(Count((a["avoid"],), "<=", a["times"])),
                Eventually(Count((a["avoid"],), ">=", a["times"])),
            )
        ),
        lambda a, words: f"exactly {a['times']} times: {words.of(a['avoid'])}",
    ),
)


REACTIONS = (
    Pattern(
        "instantaneous_reaction",
        "whenever the first condition holds, the second one holds in the same moment",
        (WHEN, THEN, FOR),
        lambda a, _: Always(Implies(a["when"], lasting(a, a["then"]))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, in that moment {say_lasting(a, words, a['then'])}"
        ),
    ),
    Pattern(
        "delayed_reaction",
        "whenever the first condition holds, the second one holds then or later",
        (WHEN, THEN, WITHIN, FOR),
        lambda a, _: Always(Implies(a["when"], soon(a, lasting(a, a["then"])))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, {say_soon(a, 'then or later')} "
            f"{say_lasting(a, words, a['then'])}"
        ),
    ),
    Pattern(
        "prompt_reaction",
        "whenever the first condition holds, the second one holds in the next step of the run",
        (WHEN, THEN),
        lambda a, _: Always(Implies(a["when"], Next(a["then"]))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, in the very next step {words.of(a['then'])}"
        ),
        scoped=False,
        steps=True,
    ),
    Pattern(
        "bound_reaction",
        "the first condition holds in exactly those moments in which the second one holds",
        (WHEN, THEN),
        lambda a, _: Always(Iff(a["when"], a["then"])),
        lambda a, words: f"whenever {words.of(a['when'])}, and only then, {words.of(a['then'])}",
    ),
    Pattern(
        "bound_delay",
        "the first condition holds in a step exactly if the second one holds in the next step",
        (WHEN, THEN),
        lambda a, _: Always(Iff(a["when"], Next(a["then"]))),
        lambda a, words: (
            f"in the very next step after {words.of(a['when'])}, and only then, "
            f"{words.of(a['then'])}"
        ),
        scoped=False,
        steps=True,
    ),
    Pattern(
        "wait",
        "the first condition holds until the second one holds, which must happen",
        (Argument("hold", Kind.CONDITION), Argument("until", Kind.CONDITION), WITHIN),
        lambda a, _: bounded(a, Until(a["hold"], a["until"])),
        lambda a, words: f"{words.of(a['hold'])} until {words.of(a['until'])}, {say_coming(a)}",
        scoped=False,
    ),
)
