"""Whether a mission does what its author requires."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.fleet.fleet import Fleet
from m2pem.mission.expression import Expression
from m2pem.mission.mission import Mission
from m2pem.verify.ltl import propositions
from m2pem.verify.ltl.formula import Data, needs_steps
from m2pem.verify.ltl.model_check import Limits, Progress, Result, Run, Stopped, Verdict, check
from m2pem.verify.net.petri_net import Rule, System
from m2pem.verify.net.simplify import simplify
from m2pem.verify.net.size_limit import Bound
from m2pem.verify.requirements.propositions import Labels, MissionRuns, UnknownDataError
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Exploration, explore
from m2pem.verify.search.explore import Limits as ExploreLimits
from m2pem.verify.search.explore import Stopped as ExploreStopped
from m2pem.verify.search.stubborn_sets import Reduction, StubbornSets
from m2pem.verify.translate import Options, translate


@dataclass(frozen=True, slots=True)
class Answer:
    """What is known of one requirement.

    `why`: of an undecided one, what stands in the way. `prefix` and `cycle`: the rules of a run
    that breaks it, `cycle` again and again; without a cycle it is over then, or broken whatever
    follows (`run.whatever_follows`).
    """

    requirement: Requirement
    result: Result
    run: Run | None = None
    prefix: tuple[Rule, ...] = ()
    cycle: tuple[Rule, ...] = ()
    why: str = ""
    states: int = 0
    seconds: float = 0.0


def conditions(requirements: Sequence[Requirement]) -> tuple[Expression, ...]:
    """What requirements ask of the data: rules must be derived with them (`Options.conditions`)."""
    return tuple(
        each.expression
        for requirement in requirements
        for each in propositions(requirement.formula)
        if isinstance(each, Data)
    )


def system_for(
    mission: Mission,
    fleet: Fleet,
    requirements: Sequence[Requirement],
    *,
    process: str | None = None,
    options: Options | None = None,
    bound: Bound | None = None,
) -> System:
    """The rules that requirements are asked of: as few as say the same to all of them.

    Where one of them tells single steps apart, or asks what is fair to each, they stay as they are.

    Raises:
        KeyError: the mission has no such process.
        TooLargeError: it stands for more than `bound` allows.
    """
    options = replace(options or Options(), conditions=conditions(requirements))
    system = translate(mission, fleet, process=process, options=options, bound=bound)
    if any(each.fair or needs_steps(each.formula) for each in requirements):
        return system
    places: frozenset[int] = frozenset()
    rules: frozenset[int] = frozenset()
    for each in requirements:
        try:
            labels = Labels(system, mission, fleet, propositions(each.formula))
        except UnknownDataError:
            continue  # it is going to be undecided, whatever the rules are
        places |= labels.visible_places()
        rules |= labels.visible_rules()
    return simplify(system, places, rules, bound)


def check_mission(
    mission: Mission,
    fleet: Fleet,
    requirements: Sequence[Requirement],
    *,
    process: str | None = None,
    options: Options | None = None,
    limits: ExploreLimits | None = None,
    reduce: bool = False,
) -> list[Answer]:
    """Derive, search and check, in one go.

    With `reduce`, orders that make no difference to a requirement are left out where they can be.
    """
    system = system_for(mission, fleet, requirements, process=process, options=options)
    whole: Exploration | None = None
    answers = []
    for each in requirements:
        reduction = reduction_for(system, mission, fleet, each) if reduce else None
        if reduction is not None:
            found = explore(system, limits, reduction=reduction)
        else:
            found = whole = whole or explore(system, limits)
        answers.append(check_requirement(found, mission, fleet, each))
    return answers


def reduction_for(
    system: System, mission: Mission, fleet: Fleet, requirement: Requirement
) -> Reduction | None:
    """What may be left out of the search for one requirement; None: nothing.

    Runs that put something off for ever, and single steps, are kept only where all is tried.
    """
    if requirement.fair or needs_steps(requirement.formula):
        return None
    try:
        labels = Labels(system, mission, fleet, propositions(requirement.formula))
    except UnknownDataError:
        return None
    return StubbornSets(system, labels.visible_rules())


def check_requirement(
    exploration: Exploration,
    mission: Mission,
    fleet: Fleet,
    requirement: Requirement,
    *,
    limits: Limits | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Answer:
    """Whether a requirement holds of all that an exploration found; it must have kept its edges.

    Of a search that was cut short, what was found to be broken is; the rest is undecided.
    """
    if exploration.stopped is ExploreStopped.TOKENS:
        return Answer(
            requirement, Result.UNDECIDED, why=f"the search stopped at {exploration.stopped}"
        )
    system = exploration.system
    asked = propositions(requirement.formula)
    try:
        runs = MissionRuns(exploration, Labels(system, mission, fleet, asked))
        fair: Mapping[int, int] | None = runs.outcomes() if requirement.fair else None
        verdict = check(runs, requirement.formula, fair=fair, limits=limits, progress=progress)
    except UnknownDataError as error:
        return Answer(requirement, Result.UNDECIDED, why=str(error))
    return _answer(requirement, verdict, exploration, system)


def _answer(
    requirement: Requirement, verdict: Verdict, exploration: Exploration, system: System
) -> Answer:
    why = ""
    if verdict.result is Result.UNDECIDED:
        own = verdict.stopped is not Stopped.SYSTEM
        why = f"the search stopped at {verdict.stopped if own else exploration.stopped}"
    run = verdict.run
    return Answer(
        requirement,
        verdict.result,
        run,
        tuple(system.rules[move.rule] for move in run.prefix) if run else (),
        tuple(system.rules[move.rule] for move in run.cycle) if run else (),
        why,
        verdict.states,
        verdict.seconds,
    )
