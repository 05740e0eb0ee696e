"""Specification patterns of Dwyer, Avrunin and Corbett: whether and in which order things happen.

With their five scopes (`scopes.py`). In chains, what follows comes later or in the same moment.
"""

from collections.abc import Sequence

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Eventually,
    Formula,
    Implies,
    Not,
    Until,
    WeakUntil,
)
from m2pem.verify.requirements.patterns.pattern import (
    FOR,
    TIMES,
    WITHIN,
    Argument,
    Kind,
    Pattern,
    lasting,
    say_lasting,
    say_soon,
    soon,
)
from m2pem.verify.requirements.patterns.robotic import sequence

_WHAT = Argument("what", Kind.CONDITION)
_FIRST, _THEN = Argument("first", Kind.CONDITION), Argument("then", Kind.CONDITION)
_WHEN = Argument("when", Kind.CONDITION)
_FIRSTS, _THENS = Argument("first", Kind.CONDITIONS), Argument("then", Kind.CONDITIONS)
_WHENS = Argument("when", Kind.CONDITIONS)


def at_most(what: Formula, times: int) -> Formula:
    """It begins to hold at most so many times, from now on."""
    never: Formula = Always(Not(what))
    for _ in range(times):
        never = WeakUntil(Not(what), WeakUntil(what, never))
    return never


def _only_after(chain: Sequence[Formula], then: Formula) -> Formula:
    first, *rest = chain
    return WeakUntil(Not(then), And((first, _only_after(rest, then))) if rest else first)


def _nested_response(whens: Sequence[Formula], then: Formula) -> Formula:
    first, *rest = whens
    inner = _nested_response(rest, then) if rest else Eventually(then)
    return Always(Implies(first, inner))


OCCURRENCE = (
    Pattern(
        "absence",
        "the condition never holds",
        (_WHAT, FOR),
        lambda a, _: Always(Not(lasting(a, a["what"]))),
        lambda a, words: f"never {say_lasting(a, words, a['what'])}",
    ),
    Pattern(
        "existence",
        "the condition holds at some point",
        (_WHAT, WITHIN, FOR),
        lambda a, _: soon(a, lasting(a, a["what"])),
        lambda a, words: f"{say_soon(a, 'at some point')} {say_lasting(a, words, a['what'])}",
    ),
    Pattern(
        "bounded_existence",
        "the condition occurs at most so many times",
        (_WHAT, TIMES),
        lambda a, _: at_most(a["what"], a["times"]),
        lambda a, words: f"at most {a['times']} times: {words.of(a['what'])}",
    ),
    Pattern(
        "universality",
        "the condition holds all the time",
        (_WHAT, FOR),
        lambda a, _: Always(a["what"]) if a["for"] is None else lasting(a, a["what"]),
        lambda a, words: words.of(Always(a["what"]) if a["for"] is None else lasting(a, a["what"])),
    ),
    Pattern(
        "precedence",
        "the second condition holds only after (or with) the first one",
        (_FIRST, _THEN),
        lambda a, _: WeakUntil(Not(a["then"]), a["first"]),
        lambda a, words: f"{words.of(a['then'])} only after {words.of(a['first'])}",
    ),
    Pattern(
        "response",
        "whenever the first condition holds, the second one holds then or later",
        (_WHEN, _THEN, WITHIN, FOR),
        lambda a, _: Always(Implies(a["when"], soon(a, lasting(a, a["then"])))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, {say_soon(a, 'then or later')} "
            f"{say_lasting(a, words, a['then'])}"
        ),
    ),
    Pattern(
        "chain_precedence",
        "a condition holds only after a chain of conditions, in their order",
        (_FIRSTS, _THEN),
        lambda a, _: _only_after(a["first"], a["then"]),
        lambda a, words: f"{words.of(a['then'])} only after {words.each(a['first'], 'then')}",
    ),
    Pattern(
        "precedence_chain",
        "a chain of conditions, in their order, comes only after another condition",
        (_FIRST, _THENS),
        lambda a, _: Implies(sequence(a["then"]), Until(Not(a["then"][0]), a["first"])),
        lambda a, words: f"{words.each(a['then'], 'then')} only after {words.of(a['first'])}",
    ),
    Pattern(
        "response_chain",
        "whenever the first condition holds, a chain of conditions, in their order, follows",
        (_WHEN, _THENS),
        lambda a, _: Always(Implies(a["when"], sequence(a["then"]))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, then or later {words.each(a['then'], 'then')}"
        ),
    ),
    Pattern(
        "chain_response",
        "whenever a chain of conditions has held, in their order, another one holds then or later",
        (_WHENS, _THEN),
        lambda a, _: _nested_response(a["when"], a["then"]),
        lambda a, words: (
            f"whenever {words.each(a['when'], 'then')}, then or later {words.of(a['then'])}"
        ),
    ),
)
