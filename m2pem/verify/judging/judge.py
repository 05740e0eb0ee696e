"""Asks all properties that are asked by default."""

from collections.abc import Callable, Iterator

from m2pem.model.mission import Mission
from m2pem.verify.answers import Alarm, Answer, Answers, Coverage, Verdict
from m2pem.verify.explore import Exploration
from m2pem.verify.judging import ending, flagged, interrupted
from m2pem.verify.judging.case import Case
from m2pem.verify.system import System

Judge = Callable[[Case], Iterator[Alarm]]

PROPERTIES: dict[str, tuple[str, Judge]] = {
    "no_deadlock": ("no token is stuck", ending.deadlocks),
    "no_livelock": ("no run goes on for ever without a way to an end", ending.livelocks),
    "exclusive_resources": ("no vehicle or payload is commanded twice at once", flagged.conflicts),
    "commanded_again": ("every interrupted vehicle is told what to do next", interrupted.abandoned),
    "errors_caught": ("every error of the model is caught", flagged.uncaught),
    "decisions_handled": ("every decision has a flow", flagged.unanswered),
    "proper_completion": ("no end is reached twice", ending.twice),
    "one_token_per_place": ("branches are joined before they meet", ending.overfull),
    "everything_heard": ("what is thrown can be caught, and the other way round", flagged.unheard),
    "no_dead_element": ("every element can be reached", ending.dead),
    "can_always_complete": ("a good end can always be reached", ending.without_completion),
    "failures_caught": (
        "every failure of a vehicle, service or prompt is caught",
        flagged.failures,
    ),
}
"""By name, what each says and who judges it; causes come before what follows from them."""

WARNINGS = frozenset({"failures_caught"})
"""Properties whose violations are warnings."""

NEED_ALL = frozenset({"no_livelock", "can_always_complete", "no_dead_element", "everything_heard"})
"""Properties of which nothing is known before all was searched."""


def judge(mission: Mission, system: System, found: Exploration) -> Answers:
    """Answers for all properties, from a search without reduction that kept its steps."""
    case = Case(mission, system, found)
    stopped = found.stopped.value if found.stopped is not None else ""
    answers = [_answer(name, says, ask, case, stopped) for name, (says, ask) in PROPERTIES.items()]
    coverage = Coverage(len(found.states), found.transitions, found.seconds, stopped)
    return Answers(answers, coverage, frozenset() if stopped else case.unreached)


def _answer(name: str, says: str, ask: Judge, case: Case, stopped: str) -> Answer:
    warning = name in WARNINGS
    note = f"the search ended at {stopped}, after {len(case.found.states):,} states"
    if stopped and name in NEED_ALL:
        return Answer(name, says, Verdict.UNDECIDED, (), warning, note)
    alarms = tuple(ask(case))
    if alarms:
        return Answer(name, says, Verdict.VIOLATED, alarms, warning)
    if stopped:
        return Answer(name, says, Verdict.UNDECIDED, (), warning, note)
    return Answer(name, says, Verdict.HOLDS, (), warning)
