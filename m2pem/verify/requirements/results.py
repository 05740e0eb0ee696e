"""Requirements as results of a report, beside the properties of every mission."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, bound_of, full_states
from m2pem.verify.ltl import model_check, propositions
from m2pem.verify.ltl.formula import Active, Completed
from m2pem.verify.net.petri_net import System
from m2pem.verify.properties.results import Result, Verdict, Violation
from m2pem.verify.requirements.check import (
    Answer,
    check_requirement,
    reduction_for,
    system_for,
)
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Exploration, Limits, Progress, Stopped, explore
from m2pem.verify.spin import ltl_claims
from m2pem.verify.spin.queries import Storage
from m2pem.verify.spin.search import Found, Wanted
from m2pem.verify.spin.search import search as search_with_spin
from m2pem.verify.translate import Options, TooLargeError

Show = Callable[[Progress], None] | None


@dataclass(slots=True)
class _Asking:
    """Searches of one system, each done when it is first needed.

    `interrupted`: a person has ended one, and no other is to be begun.
    """

    mission: Mission
    fleet: Fleet
    system: System
    limits: Limits
    progress: Show
    small: Exploration | None = None
    whole: Exploration | None = None
    interrupted: bool = False

    def answer(self, requirement: Requirement) -> Answer:
        found = self._search(requirement)
        self.interrupted |= found.stopped is Stopped.INTERRUPTED
        limits = model_check.Limits(self.limits.states, self.limits.seconds, self.limits.memory_mb)
        return check_requirement(found, self.mission, self.fleet, requirement, limits=limits)

    def _search(self, requirement: Requirement) -> Exploration:
        """All of it if it is small; else, if that can be, without orders that lead to the same."""
        if self.small is None:
            least = min(self.limits.states, full_states(self.system))
            limits = replace(self.limits, states=least)
            self.small = explore(self.system, limits, progress=self.progress)
        if self.small.stopped is not Stopped.STATES or len(self.small.states) > self.limits.states:
            return self.small
        reduction = reduction_for(self.system, self.mission, self.fleet, requirement)
        if reduction is not None:
            return explore(self.system, self.limits, reduction=reduction, progress=self.progress)
        if self.whole is None:
            self.whole = explore(self.system, self.limits, progress=self.progress)
        return self.whole


def with_requirements(
    report: Report,
    mission: Mission,
    fleet: Fleet,
    requirements: Sequence[Requirement],
    *,
    process: str | None = None,
    options: Options | None = None,
    limits: Limits | None = None,
    storage: Storage = Storage.EXACT,
    progress: Show = None,
) -> Report:
    """The report, with a result for each requirement after those of the properties.

    The report's engine searches; what Spin cannot be asked, the built-in search answers, and a note
    says so. If a person has ended the search before, nothing more is searched.

    Raises:
        KeyError: the mission has no such process.
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin says something that is not so.
    """
    if not requirements:
        return report
    limits = limits or Limits(tokens=3)
    try:
        bound = bound_of(limits)
        system = system_for(
            mission, fleet, requirements, process=process, options=options, bound=bound
        )
    except TooLargeError as error:
        why = f"too large to search: {error}"
        answers = (Answer(each, model_check.Result.UNDECIDED, why=why) for each in requirements)
        return replace(
            report, results=(*report.results, *(_result(each, mission) for each in answers))
        )
    asking = _Asking(mission, fleet, system, limits, progress)
    spins: Found | None = None
    results: list[Result] = []
    instead: list[str] = []
    stopped = report.found.stopped is Stopped.INTERRUPTED or any(
        each.covered.endswith(Stopped.INTERRUPTED) for each in report.results
    )
    for each in requirements:
        if stopped or asking.interrupted:
            why = f"not begun, after {Stopped.INTERRUPTED}"
            results.append(_result(Answer(each, model_check.Result.UNDECIDED, why=why), mission))
            continue
        if report.engine != "spin":
            answer = asking.answer(each)
            stopped = answer.why.endswith(Stopped.INTERRUPTED)
            results.append(_result(answer, mission))
            continue
        if spins is None:
            spins = search_with_spin(
                system,
                limits,
                wanted=Wanted(frozenset(), stuck=False),
                storage=storage,
                progress=progress,
            )
        answer = ltl_claims.check_requirement(
            spins, mission, fleet, each, limits=limits, storage=storage, progress=progress
        )
        if answer.why in ltl_claims.BEYOND_SPIN:
            instead.append(each.id)
            answer = asking.answer(each)
        stopped = spins.stopped is Stopped.INTERRUPTED or answer.why.endswith(Stopped.INTERRUPTED)
        results.append(_result(answer, mission))
    notes = report.notes
    if instead:
        notes = (*notes, f"Spin cannot answer {', '.join(instead)}: the built-in search did")
    return replace(report, results=(*report.results, *results), asked=system, notes=notes)


def _result(answer: Answer, mission: Mission) -> Result:
    requirement = answer.requirement
    return Result(
        requirement.id,
        requirement.english,
        Verdict(answer.result.value),
        (_violation(answer, mission),) if answer.result is model_check.Result.VIOLATED else (),
        covered=answer.why,
        required=True,
        author=requirement.text,
    )


def _violation(answer: Answer, mission: Mission) -> Violation:
    run = answer.run
    assert run is not None, "what is broken comes with a run"
    if not run.prefix and not run.cycle:
        how = "broken from the beginning, whatever follows"
    elif run.whatever_follows:
        how = "broken at the end of this run, whatever follows"
    elif run.cycle:
        how = "broken by this run, the last steps of which go on for ever"
    else:
        how = "broken by this run, which is over then"
    requirement = answer.requirement
    named = [
        each.element
        for each in propositions(requirement.formula)
        if isinstance(each, Active | Completed) and each.element in mission.elements
    ]
    return Violation(
        f"{how}: {requirement.english.rstrip('.')}",
        tuple(dict.fromkeys(named)),
        tuple(move.rule for move in run.prefix),
        tuple(move.rule for move in run.cycle),
    )
