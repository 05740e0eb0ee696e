"""Asks all properties that are asked by default."""

from collections.abc import Callable, Iterator

from m2pem.model.mission import Mission
from m2pem.verify.answers import Answers, Coverage
from m2pem.verify.explore import Exploration
from m2pem.verify.judging import ending, flagged, interrupted
from m2pem.verify.judging.case import Case
from m2pem.verify.results import Result, Verdict, Violation
from m2pem.verify.system import System

Judge = Callable[[Case], Iterator[Violation]]

PROPERTIES: dict[str, tuple[str, Judge]] = {
    "no-deadlock": ("No token is stuck for ever.", ending.deadlocks),
    "no-livelock": ("Nothing goes on for ever without a way out.", ending.livelocks),
    "one-behavior": (
        "No vehicle or payload is commanded by two behaviors at once.",
        flagged.conflicts,
    ),
    "commanded-again": (
        "Every vehicle that is interrupted is commanded again.",
        interrupted.abandoned,
    ),
    "errors-caught": ("Every error that the model throws is caught.", flagged.uncaught),
    "decisions-handled": ("Every decision has a flow to take.", flagged.unanswered),
    "proper-completion": (
        "No end event is reached twice in one instance of its scope.",
        ending.twice,
    ),
    "one-token": ("Tokens that were parted do not meet again unjoined.", ending.overfull),
    "is-caught": (
        "Every signal and escalation that is thrown can be caught.",
        flagged.unheard,
    ),
    "can-be-triggered": ("Whatever waits can get what it waits for.", flagged.untriggered),
    "no-dead-element": ("Every element is reached in some run.", ending.dead),
    "can-complete": ("From everywhere, the end can be reached.", ending.without_completion),
    "failures-handled": ("Work that may fail has an error boundary event.", flagged.failures),
}
"""By name, what each says and who judges it; causes come before what follows from them."""

WARNINGS = frozenset({"failures-handled"})
"""Properties whose violations are warnings."""

NEED_ALL = frozenset({"no-livelock", "can-complete", "no-dead-element", "can-be-triggered"})
"""Properties of which nothing is known before all was searched."""


def judge(mission: Mission, system: System, found: Exploration) -> Answers:
    """Answers for all properties, from a search without reduction that kept its steps."""
    case = Case(mission, system, found)
    stopped = found.stopped.value if found.stopped is not None else ""
    answers = [_answer(name, says, ask, case, stopped) for name, (says, ask) in PROPERTIES.items()]
    coverage = Coverage(len(found.states), found.transitions, found.seconds, stopped)
    return Answers(answers, coverage, frozenset() if stopped else case.unreached)


def _answer(name: str, says: str, ask: Judge, case: Case, stopped: str) -> Result:
    warning = name in WARNINGS
    note = f"the search ended at {stopped}, after {len(case.found.states):,} states"
    if stopped and name in NEED_ALL:
        return Result(name, says, Verdict.UNDECIDED, (), warning, note)
    violations = tuple(ask(case))
    if violations:
        return Result(name, says, Verdict.VIOLATED, violations, warning)
    if stopped:
        return Result(name, says, Verdict.UNDECIDED, (), warning, note)
    return Result(name, says, Verdict.HOLDS, (), warning)
