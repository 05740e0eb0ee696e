"""Robotic mission patterns: what to keep away from."""

from m2pem.verify.ltl.formula import Always, And, Count, Eventually, Implies, Not, Until
from m2pem.verify.requirements.patterns.pattern import AVOIDED, TIMES, WHEN, Argument, Kind, Pattern

AVOIDANCE = (
    Pattern(
        "past_avoidance",
        "it does not happen before something else has, which must come",
        (AVOIDED, Argument("until", Kind.CONDITION)),
        lambda a, _: Until(Not(a["avoid"]), a["until"]),
        lambda a, words: f"never {words.of(a['avoid'])} before {words.of(a['until'])}, which comes",
        scoped=False,
    ),
    Pattern(
        "global_avoidance",
        "it never happens",
        (AVOIDED,),
        lambda a, _: Always(Not(a["avoid"])),
        lambda a, words: f"never {words.of(a['avoid'])}",
    ),
    Pattern(
        "future_avoidance",
        "once something has happened, it never happens any more",
        (AVOIDED, WHEN),
        lambda a, _: Always(Implies(a["when"], Always(Not(a["avoid"])))),
        lambda a, words: f"once {words.of(a['when'])}, never again {words.of(a['avoid'])}",
    ),
    Pattern(
        "upper_restricted_avoidance",
        "it happens at most so many times",
        (AVOIDED, TIMES),
        lambda a, _: Always(Count((a["avoid"],), "<=", a["times"])),
        lambda a, words: f"at most {a['times']} times: {words.of(a['avoid'])}",
    ),
    Pattern(
        "lower_restricted_avoidance",
        "it happens at least so many times",
        (AVOIDED, TIMES),
        lambda a, _: Eventually(Count((a["avoid"],), ">=", a["times"])),
        lambda a, words: f"at least {a['times']} times: {words.of(a['avoid'])}",
    ),
    Pattern(
        "exact_restricted_avoidance",
        "it happens just so many times",
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
