"""Check a mission with Spin: the same properties, read from what Spin has seen.

Spin's answers are converted to an exploration (`as_exploration`): it has only the runs that Spin
gave, but all that properties read. Whether an end can be reached *from everywhere* is not a
question about single runs; Spin cannot answer it, and the built-in search does.
"""

from array import array
from collections.abc import Callable
from dataclasses import replace

from m2pem.errors import InternalError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, size_limit_of, too_large
from m2pem.verify.check import search as search_built_in
from m2pem.verify.confirmation import Confirmation
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties import ALL, SearchedMission
from m2pem.verify.properties.commands import watch_interruptions
from m2pem.verify.properties.results import Result, Verdict, bounded
from m2pem.verify.properties.soundness import can_complete, completes_if_fair, no_livelock
from m2pem.verify.search.explore import Exploration, Limits, Progress, Stopped
from m2pem.verify.spin.queries import Storage
from m2pem.verify.spin.search import SpinExploration, WantedRuns, search
from m2pem.verify.translate import Options, TooLargeError, translate

BEYOND_SPIN = (can_complete, completes_if_fair, no_livelock)
"""Properties about what can be reached from each state."""


def check_with_spin(
    mission: Mission,
    fleet: Fleet | None = None,
    *,
    process: str | None = None,
    options: Options | None = None,
    limits: Limits | None = None,
    storage: Storage = Storage.EXACT,
    progress: Callable[[Progress], None] | None = None,
) -> Report:
    """Check every default property of a mission.

    Raises:
        KeyError: the mission has no such process.
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin's answer is wrong, or differs from that of the built-in search.
    """
    limits = limits or Limits(tokens=3)
    fleet = fleet or fleet_for(mission)
    try:
        size_limit = size_limit_of(limits)
        net = translate(mission, fleet, process=process, options=options, size_limit=size_limit)
        net = simplify(net, size_limit=size_limit)
    except TooLargeError as error:
        return replace(too_large(mission, error, process), engine="spin")
    found = search(net, limits, storage=storage, progress=progress)
    confirm = Confirmation(mission, fleet, process, options or Options()).doubt
    searched = SearchedMission(mission, net, as_exploration(found), confirm=confirm)
    watched = watch_interruptions(net, fleet.vehicles)
    if watched is not None and found.stopped is not Stopped.INTERRUPTED:
        searched.resources = watched[1]
        wanted = WantedRuns(frozenset(), stuck=False, left=tuple(watched[1]))
        searched.watched = as_exploration(
            search(watched[0], limits, wanted=wanted, storage=storage, progress=progress)
        )
    beside = _also(net, found, limits, progress)
    other = SearchedMission(mission, net, beside, confirm=confirm)
    searched.found.lost = beside.lost
    results = tuple(
        _beyond(each(other), found) if each in BEYOND_SPIN else _covered(each(searched), found)
        for each in ALL
    )
    beyond = ", ".join(each(other).property for each in BEYOND_SPIN)
    answered = "answered" if found.stopped is not Stopped.INTERRUPTED else "was not begun"
    return Report(
        replace(net, approximations=bounded(searched.found)),
        searched.found,
        results,
        watched[0] if watched is not None else None,
        engine="spin",
        states=found.states,
        notes=(f"Spin cannot be asked {beyond}: the built-in search {answered}",),
    )


def _also(
    net: PetriNet,
    found: SpinExploration,
    limits: Limits,
    progress: Callable[[Progress], None] | None,
) -> Exploration:
    """Explore the same net with the built-in search; both must have seen as many states."""
    if found.stopped is Stopped.INTERRUPTED:
        limits = replace(limits, seconds=0.0)
    other = search_built_in(net, limits, progress)
    both = other.complete and not other.reduced and found.stopped is None
    if both and len(other.states) != found.states:
        raise InternalError(
            f"Spin sees {found.states:,} states, and the built-in search {len(other.states):,}"
        )
    return other


def _beyond(result: Result, found: SpinExploration) -> Result:
    if result.verdict is not Verdict.UNDECIDED or found.stopped is not Stopped.INTERRUPTED:
        return result
    return replace(result, covered=f"not begun, after {Stopped.INTERRUPTED}")


def _covered(result: Result, found: SpinExploration) -> Result:
    if result.verdict is not Verdict.UNDECIDED:
        return result
    return replace(result, covered=f"{found.states:,} states, stopped by {found.stopped}")


def as_exploration(found: SpinExploration) -> Exploration:
    """Return the runs that Spin gave, as an exploration that saw nothing else.

    `fired` has all transitions that fire; only those to which a run was wanted have the state
    before.
    """
    states = [found.encoding.initial]
    parents, via = array("q", [0]), array("i", [-1])
    known: dict[tuple[int, int], int] = {}

    def walk(run: tuple[int, ...]) -> int:
        at = 0
        for transition in run:
            after = known.get((at, transition))
            if after is None:
                after = known[at, transition] = len(states)
                states.append(found.encoding.fire(transition, states[at])[0])
                parents.append(at)
                via.append(transition)
            at = after
        return at

    # A transition that fires, and to which a run was wanted and not found, is left undecided.
    fired = dict.fromkeys(found.fired - found.wanted.transitions, 0)
    # Properties take what was found first to be nearest.
    for transition, run in sorted(found.transition_runs.items(), key=lambda each: len(each[1])):
        fired[transition] = walk(run[:-1])
    ends = sorted((*found.stuck_runs, *found.left_runs.values()), key=len)
    terminals = list(dict.fromkeys(walk(run) for run in ends))
    return Exploration(
        found.net,
        found.encoding,
        states,
        parents,
        via,
        found.transitions,
        found.stopped,
        found.seconds,
        terminals,
        fired,
        overflows={place: (walk(run[:-1]), run[-1]) for place, run in found.overflow_runs.items()},
        overflow_runs=dict(found.overflow_runs),
        beyond=frozenset(found.beyond),
    )
