"""Robotic mission patterns: what must follow on what (their authors call them triggers)."""

from m2pem.verify.ltl.formula import Always, Eventually, Iff, Implies, Next, Until
from m2pem.verify.requirements.patterns.pattern import THEN, WHEN, Argument, Kind, Pattern

REACTIONS = (
    Pattern(
        "instantaneous_reaction",
        "whenever the one holds, the other does in the same moment",
        (WHEN, THEN),
        lambda a, _: Always(Implies(a["when"], a["then"])),
        lambda a, words: f"whenever {words.of(a['when'])}, in that moment {words.of(a['then'])}",
    ),
    Pattern(
        "delayed_reaction",
        "whenever the one happens, the other does then or later",
        (WHEN, THEN),
        lambda a, _: Always(Implies(a["when"], Eventually(a["then"]))),
        lambda a, words: f"whenever {words.of(a['when'])}, then or later {words.of(a['then'])}",
    ),
    Pattern(
        "prompt_reaction",
        "whenever the one happens, the other does in the very next step of the run",
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
        "the one holds in just those moments in which the other does",
        (WHEN, THEN),
        lambda a, _: Always(Iff(a["when"], a["then"])),
        lambda a, words: f"whenever {words.of(a['when'])}, and only then, {words.of(a['then'])}",
    ),
    Pattern(
        "bound_delay",
        "the one holds in just those steps after which, in the very next, the other does",
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
        "the one holds until the other comes, which must come",
        (Argument("hold", Kind.CONDITION), Argument("until", Kind.CONDITION)),
        lambda a, _: Until(a["hold"], a["until"]),
        lambda a, words: f"{words.of(a['hold'])} until {words.of(a['until'])}, which comes",
        scoped=False,
    ),
)
