"""Check requirements with the built-in search."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.mission.expression import Expression
from m2pem.mission.mission import Mission
from m2pem.verify.ltl import propositions
from m2pem.verify.ltl.formula import Commanded, Data, needs_steps
from m2pem.verify.ltl.model_check import Result, Run, Stopped, Verdict, check
from m2pem.verify.net.petri_net import PetriNet, Transition
from m2pem.verify.net.simplify import simplify
from m2pem.verify.net.size_limit import SizeLimit
from m2pem.verify.requirements.propositions import ExploredRuns, Labels, UnknownDataError
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Exploration, Limits
from m2pem.verify.search.explore import Stopped as ExploreStopped
from m2pem.verify.search.stubborn_sets import Reduction, StubbornSets
from m2pem.verify.translate import Options, translate


@dataclass(frozen=True, slots=True)
class Answer:
    """What is known of one requirement.

    `why`: the reason of an undecided answer. `prefix` and `cycle`: the transitions of a run that
    violates it, `cycle` again and again; without a cycle the run is over then, or violates it
    whatever follows (`run.whatever_follows`).
    """

    requirement: Requirement
    result: Result
    run: Run | None = None
    prefix: tuple[Transition, ...] = ()
    cycle: tuple[Transition, ...] = ()
    why: str = ""
    states: int = 0
    seconds: float = 0.0


def conditions(requirements: Sequence[Requirement]) -> tuple[Expression, ...]:
    """The conditions on data in requirements: the net must be translated with them
    (`Options.conditions`).
    """
    return tuple(
        each.expression
        for requirement in requirements
        for each in propositions(requirement.formula)
        if isinstance(each, Data)
    )


def distinguished(requirements: Sequence[Requirement], fleet: Fleet) -> frozenset[str]:
    """The vehicles and payloads that requirements are about: they are in no pool with others
    (`Options.distinguished`).
    """
    commanded = {
        each.resource
        for requirement in requirements
        for each in propositions(requirement.formula)
        if isinstance(each, Commanded)
    }
    teams = [fleet.teams[name] for name in commanded if name in fleet.teams]
    return frozenset(commanded).union(*(spelled_out(team) for team in teams))


def net_for(
    mission: Mission,
    fleet: Fleet,
    requirements: Sequence[Requirement],
    *,
    process: str | None = None,
    options: Options | None = None,
    size_limit: SizeLimit | None = None,
) -> PetriNet:
    """The net on which requirements are checked: simplified as far as none of them can observe it.

    If one of them observes single steps, or needs fairness, the net is not simplified.

    Raises:
        KeyError: the mission has no such process.
        TooLargeError: its net is larger than `size_limit` allows.
    """
    options = replace(
        options or Options(),
        conditions=conditions(requirements),
        distinguished=distinguished(requirements, fleet),
    )
    net = translate(mission, fleet, process=process, options=options, size_limit=size_limit)
    if any(each.fair or needs_steps(each.formula) for each in requirements):
        return net
    places: frozenset[int] = frozenset()
    transitions: frozenset[int] = frozenset()
    for each in requirements:
        try:
            labels = Labels(net, mission, fleet, propositions(each.formula))
        except UnknownDataError:
            continue  # it is going to be undecided, whatever the transitions are
        places |= labels.visible_places()
        transitions |= labels.visible_transitions()
    return simplify(net, places, transitions, size_limit)


def reduction_for(
    net: PetriNet, mission: Mission, fleet: Fleet, requirement: Requirement
) -> Reduction | None:
    """The reduction for the search for one requirement; None: it allows none.

    Fair runs and single steps are kept only without a reduction.
    """
    if requirement.fair or needs_steps(requirement.formula):
        return None
    try:
        labels = Labels(net, mission, fleet, propositions(requirement.formula))
    except UnknownDataError:
        return None
    return StubbornSets(net, labels.visible_transitions())


def check_requirement(
    exploration: Exploration,
    mission: Mission,
    fleet: Fleet,
    requirement: Requirement,
    *,
    limits: Limits | None = None,
) -> Answer:
    """Check a requirement on an exploration that kept its edges.

    Of an incomplete search, violations are found; the rest is undecided.
    """
    if exploration.stopped is ExploreStopped.TOKENS:
        return Answer(
            requirement, Result.UNDECIDED, why=f"the search stopped at {exploration.stopped}"
        )
    net = exploration.net
    asked = propositions(requirement.formula)
    try:
        runs = ExploredRuns(exploration, Labels(net, mission, fleet, asked))
        fair: Mapping[int, int] | None = runs.outcomes() if requirement.fair else None
        verdict = check(runs, requirement.formula, fair=fair, limits=limits)
    except UnknownDataError as error:
        return Answer(requirement, Result.UNDECIDED, why=str(error))
    return _answer(requirement, verdict, exploration, net)


def _answer(
    requirement: Requirement, verdict: Verdict, exploration: Exploration, net: PetriNet
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
        tuple(net.transitions[move.transition] for move in run.prefix) if run else (),
        tuple(net.transitions[move.transition] for move in run.cycle) if run else (),
        why,
        verdict.states,
        verdict.seconds,
    )
