"""The results of requirements in a report, next to the properties of every mission."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.check import SHARE_REDUCED, Report, full_states, share, size_limit_of
from m2pem.verify.confirmation import Confirmation
from m2pem.verify.ltl import model_check, propositions
from m2pem.verify.ltl.formula import Active, Completed, needs_runs
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.properties.results import Confirm, Result, Verdict, Violation, judged
from m2pem.verify.report.run_steps import encoding_of
from m2pem.verify.requirements.check import (
    Answer,
    check_requirement,
    net_for,
    reduction_for,
)
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import (
    Exploration,
    Limits,
    Progress,
    Stopped,
    Watch,
    explore,
)
from m2pem.verify.spin import ltl_claims
from m2pem.verify.spin.queries import Storage
from m2pem.verify.spin.search import SpinExploration, WantedRuns
from m2pem.verify.spin.search import search as search_with_spin
from m2pem.verify.translate import Options, TooLargeError

IN_RUNS = "time and telemetry are checked in runs only"
"""Why a requirement has no answer: it is no question about the net."""

Show = Callable[[Progress], None] | None


class _Violated:
    """The `Watch` of searches after a property was violated: a share of each is searched."""

    def look(self, _: Exploration) -> bool:
        return True


@dataclass(slots=True)
class _Asking:
    """Searches of one net, each done when it is first needed.

    `interrupted`: a person has ended one, so no other one begins.
    """

    mission: Mission
    fleet: Fleet
    net: PetriNet
    limits: Limits
    progress: Show
    watch: Watch | None = None
    small: Exploration | None = None
    whole: Exploration | None = None
    interrupted: bool = False

    def answer(self, requirement: Requirement) -> Answer:
        found = self._search(requirement)
        self.interrupted |= found.stopped is Stopped.INTERRUPTED
        return check_requirement(found, self.mission, self.fleet, requirement, limits=self.limits)

    def _search(self, requirement: Requirement) -> Exploration:
        """Explore all if it is small, else with a reduction if the requirement allows one."""
        if self.small is None:
            least = min(self.limits.states, full_states(self.net))
            limits = replace(self.limits, states=least)
            self.small = explore(self.net, limits, progress=self.progress, watch=self.watch)
        if self.small.stopped is not Stopped.STATES or len(self.small.states) > self.limits.states:
            return self.small
        reduction = reduction_for(self.net, self.mission, self.fleet, requirement)
        if reduction is not None:
            limits = replace(self.limits, after_violation=share(self.limits, SHARE_REDUCED))
            return explore(
                self.net, limits, reduction=reduction, progress=self.progress, watch=self.watch
            )
        if self.whole is None:
            self.whole = explore(self.net, self.limits, progress=self.progress, watch=self.watch)
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
    decided: Callable[[Result], None] | None = None,
) -> Report:
    """Return the report with a result for each requirement added.

    The report's engine searches. What Spin cannot answer, the built-in search does, and a note says
    so. If a person has interrupted a search, no other one begins. If the search of the properties
    has ended after a violation, the search for each requirement ends after as large a share.
    `decided` gets the result of each requirement when it is known.

    Raises:
        KeyError: the mission has no such process.
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin's answer is wrong.
    """
    in_runs = [each.id for each in requirements if needs_runs(each.formula)]
    if in_runs:
        note = f"{IN_RUNS}: {', '.join(in_runs)}"
        report = replace(report, notes=(*report.notes, note))
        requirements = [each for each in requirements if each.id not in in_runs]
    if not requirements:
        return report
    limits = limits or Limits(tokens=3)
    confirm = Confirmation(mission, fleet, process, options or Options()).doubt
    try:
        size_limit = size_limit_of(limits)
        net = net_for(
            mission, fleet, requirements, process=process, options=options, size_limit=size_limit
        )
    except TooLargeError as error:
        why = f"too large to search: {error}"
        answers = (Answer(each, model_check.Result.UNDECIDED, why=why) for each in requirements)
        undecided = (_result(each, mission, None, None) for each in answers)
        return replace(report, results=(*report.results, *undecided))
    watch = _Violated() if report.found.stopped is Stopped.VIOLATION else None
    queries = _Asking(mission, fleet, net, limits, progress, watch)
    spins: SpinExploration | None = None
    results: list[Result] = []
    instead: list[str] = []
    stopped = report.interrupted
    for each in requirements:
        if decided is not None and results:
            decided(results[-1])
        if stopped or queries.interrupted:
            why = f"not begun, after {Stopped.INTERRUPTED}"
            answer = Answer(each, model_check.Result.UNDECIDED, why=why)
            results.append(_result(answer, mission, net, None))
            continue
        if report.engine != "spin":
            answer = queries.answer(each)
            stopped = answer.why.endswith(Stopped.INTERRUPTED)
            results.append(_result(answer, mission, net, confirm))
            continue
        if spins is None:
            spins = search_with_spin(
                net,
                limits,
                wanted=WantedRuns(frozenset(), stuck=False),
                storage=storage,
                progress=progress,
            )
        answer = ltl_claims.check_requirement(
            spins, mission, fleet, each, limits=limits, storage=storage, progress=progress
        )
        if answer.why in ltl_claims.BEYOND_SPIN:
            instead.append(each.id)
            answer = queries.answer(each)
        stopped = spins.stopped is Stopped.INTERRUPTED or answer.why.endswith(Stopped.INTERRUPTED)
        results.append(_result(answer, mission, net, confirm))
    notes = report.notes
    if instead:
        notes = (*notes, f"Spin cannot answer {', '.join(instead)}: the built-in search did")
    return replace(report, results=(*report.results, *results), asked=net, notes=notes)


def _result(
    answer: Answer, mission: Mission, net: PetriNet | None, confirm: Confirm | None
) -> Result:
    requirement, verdict = answer.requirement, Verdict(answer.result.value)
    violations: tuple[Violation, ...] = ()
    covered = answer.why
    if verdict is Verdict.VIOLATED:
        assert net is not None
        room = encoding_of(net)
        explained = bool(net.approximations)
        violations = judged([_violation(answer, mission)], room, confirm, explained=explained)
        if covered := violations[0].doubt:
            verdict = Verdict.MAY_BE_VIOLATED
    return Result(
        requirement.id,
        requirement.english,
        verdict,
        violations,
        covered=covered,
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
        tuple(move.transition for move in run.prefix),
        tuple(move.transition for move in run.cycle),
    )
