"""Checking a mission with Spin: the same properties, read from what Spin has seen.

What Spin says is brought into the form of a search (`as_exploration`): only the runs that it told,
but all that properties look at. Whether an end can be reached *from everywhere* is no question
about single runs; Spin cannot be asked it, and the built-in search answers.
"""

from array import array
from collections.abc import Callable
from dataclasses import replace

from m2pem.errors import InternalError
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.madeup import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, bound_of, too_large
from m2pem.verify.check import search as search_built_in
from m2pem.verify.net.petri_net import System
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties import ALL, Searched
from m2pem.verify.properties.commands import watch_interruptions
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.properties.soundness import can_complete, completes_if_fair, no_livelock
from m2pem.verify.search.explore import Exploration, Limits, Progress, Stopped
from m2pem.verify.spin.queries import Storage
from m2pem.verify.spin.search import Found, Wanted, search
from m2pem.verify.translate import Options, TooLargeError, translate

BEYOND_SPIN = (can_complete, completes_if_fair, no_livelock)
"""Properties that are about what can be reached from each state."""


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
        InternalError: Spin says something that is not so, or that the built-in search does not.
    """
    limits = limits or Limits(tokens=3)
    fleet = fleet or fleet_for(mission)
    try:
        bound = bound_of(limits)
        system = translate(mission, fleet, process=process, options=options, bound=bound)
        system = simplify(system, bound=bound)
    except TooLargeError as error:
        return replace(too_large(mission, error, process), engine="spin")
    found = search(system, limits, storage=storage, progress=progress)
    searched = Searched(mission, system, as_exploration(found))
    watched = watch_interruptions(system, fleet.vehicles)
    if watched is not None and found.stopped is not Stopped.INTERRUPTED:
        searched.resources = watched[1]
        wanted = Wanted(frozenset(), stuck=False, left=tuple(watched[1]))
        searched.watched = as_exploration(
            search(watched[0], limits, wanted=wanted, storage=storage, progress=progress)
        )
    other = Searched(mission, system, _also(system, found, limits, progress))
    results = tuple(
        _beyond(each(other), found) if each in BEYOND_SPIN else _covered(each(searched), found)
        for each in ALL
    )
    beyond = ", ".join(each(other).property for each in BEYOND_SPIN)
    answered = "answered" if found.stopped is not Stopped.INTERRUPTED else "was not begun"
    return Report(
        system,
        searched.found,
        results,
        watched[0] if watched is not None else None,
        engine="spin",
        states=found.states,
        notes=(f"Spin cannot be asked {beyond}: the built-in search {answered}",),
    )


def _also(
    system: System,
    found: Found,
    limits: Limits,
    progress: Callable[[Progress], None] | None,
) -> Exploration:
    """The built-in search of the same; both must have seen as many states."""
    if found.stopped is Stopped.INTERRUPTED:
        limits = replace(limits, seconds=0.0)
    other = search_built_in(system, limits, progress)
    both = other.complete and not other.reduced and found.stopped is None
    if both and len(other.states) != found.states:
        raise InternalError(
            f"Spin sees {found.states:,} states, and the built-in search {len(other.states):,}"
        )
    return other


def _beyond(result: Result, found: Found) -> Result:
    if result.verdict is not Verdict.UNDECIDED or found.stopped is not Stopped.INTERRUPTED:
        return result
    return replace(result, covered=f"not begun, after {Stopped.INTERRUPTED}")


def _covered(result: Result, found: Found) -> Result:
    if result.verdict is not Verdict.UNDECIDED:
        return result
    return replace(result, covered=f"{found.states:,} states, stopped by {found.stopped}")


def as_exploration(found: Found) -> Exploration:
    """The runs that Spin told, as a search that saw nothing else.

    `fired` has all rules that fire; only those to which a run was wanted with the state before.
    """
    states = [found.encoding.initial]
    parents, via = array("q", [0]), array("i", [-1])
    known: dict[tuple[int, int], int] = {}

    def walk(run: tuple[int, ...]) -> int:
        at = 0
        for rule in run:
            after = known.get((at, rule))
            if after is None:
                after = known[at, rule] = len(states)
                states.append(found.encoding.fire(rule, states[at])[0])
                parents.append(at)
                via.append(rule)
            at = after
        return at

    # A rule that fires, and to which a run was wanted and not found, is left undecided.
    fired = dict.fromkeys(found.fired - found.wanted.rules, 0)
    # Properties take what was found first to be nearest.
    for rule, run in sorted(found.rule_runs.items(), key=lambda each: len(each[1])):
        fired[rule] = walk(run[:-1])
    ends = sorted((*found.stuck_runs, *found.left_runs.values()), key=len)
    terminals = list(dict.fromkeys(walk(run) for run in ends))
    return Exploration(
        found.system,
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
