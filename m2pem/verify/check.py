"""Checking a mission: rules, search, properties, verdicts."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from m2pem.fleet.fleet import Fleet
from m2pem.fleet.madeup import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Place, Role, Scope, System
from m2pem.verify.net.simplify import simplify
from m2pem.verify.net.size_limit import MOST_RULES
from m2pem.verify.properties import ALL, Searched
from m2pem.verify.properties.commands import INTERRUPTED, watch_interruptions
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.search.explore import Exploration, Limits, Progress, Stopped, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import Bound, Options, TooLargeError, translate

FULL_STATES = 100_000
"""States up to which nothing is left out: that gives the shortest runs."""
FULL_TIME = 0.4
"""Of the time that there is: what may be spent on that."""
_BYTES_A_RULE = 2_500
"""About what a rule costs in memory, from when it is derived until it is searched with."""
_FEWER_BEYOND = 100
"""Rules of a system beyond which fewer states are searched so: each of them takes longer."""


@dataclass(frozen=True, slots=True)
class Report:
    """All that a check found. `rules_of` says what `Violation.run` numbers the rules of.

    `states`: how many states were seen; `found` may hold fewer, if another engine saw the rest.
    `notes`: what else is to be told of the answers. `watched`: the rules that also note which
    vehicles are interrupted; `asked`: those that requirements were asked of.
    """

    system: System
    found: Exploration
    results: tuple[Result, ...]
    watched: System | None = None
    engine: str = "builtin"
    states: int = 0
    notes: tuple[str, ...] = ()
    asked: System | None = None

    def rules_of(self, result: Result) -> System:
        """The system of which the runs of a result number the rules."""
        if result.required:
            return self.asked or self.system
        return (self.watched or self.system) if result.property == INTERRUPTED else self.system

    @property
    def verdict(self) -> Verdict:
        """VIOLATED if any property that is no mere warning is; else UNDECIDED if any is."""
        return self.judged(strict=False)

    def judged(self, *, strict: bool) -> Verdict:
        """The same; `strict`: warnings count."""
        counted = [each for each in self.results if strict or not each.warning]
        for verdict in (Verdict.VIOLATED, Verdict.UNDECIDED):
            if any(each.verdict is verdict for each in counted):
                return verdict
        return Verdict.HOLDS


def check(
    mission: Mission,
    fleet: Fleet | None = None,
    *,
    process: str | None = None,
    options: Options | None = None,
    limits: Limits | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Report:
    """Check every default property of a mission.

    Raises:
        KeyError: the mission has no such process.
    """
    began = time.monotonic()
    limits = limits or Limits(tokens=3)
    fleet = fleet or fleet_for(mission)
    try:
        bound = bound_of(limits)
        system = translate(mission, fleet, process=process, options=options, bound=bound)
        system = simplify(system, bound=bound)
    except TooLargeError as error:
        return too_large(mission, error, process)
    found = search(system, _rest(limits, began), progress)
    searched = Searched(mission, system, found)
    watched = watch_interruptions(system, fleet.vehicles)
    if watched is not None and found.stopped is not Stopped.INTERRUPTED:
        searched.resources = watched[1]
        searched.watched = search(watched[0], _rest(limits, began), progress)
    results = tuple(each(searched) for each in ALL)
    return Report(
        system,
        found,
        results,
        watched[0] if watched is not None else None,
        states=len(found.states),
    )


def bound_of(limits: Limits) -> Bound:
    """How much may be derived within the limits, from now on."""
    most = min(MOST_RULES, int(limits.memory_mb * 1e6 / _BYTES_A_RULE))
    return Bound(time.monotonic() + limits.seconds, max(most, 1))


def _rest(limits: Limits, began: float) -> Limits:
    """The limits of a search that is a part of a check."""
    return replace(limits, seconds=max(0.0, limits.seconds - (time.monotonic() - began)))


def too_large(mission: Mission, error: TooLargeError, process: str | None = None) -> Report:
    """What is known of a mission whose rules are too many: what needs no search."""
    root = mission.process(process)
    places = tuple(
        Place(n, f"{root.id}:{name}", root.id, 0, Role.CONTROL if n == 0 else Role.END)
        for n, name in enumerate(("running", "completed", "terminated", "failed"))
    )
    scopes = (Scope(0, root.id, None, (root.id,)),)
    system = System(mission.file, root.id, scopes, places, (), (), ((0, 1),), 1, 2, 3)
    found = explore(system)
    found.stopped = Stopped.TIME if error.late else Stopped.RULES
    found.terminals.clear()
    results = (each(Searched(mission, system, found, watched=found)) for each in ALL)
    told = tuple(
        replace(each, covered=f"too large to search: {error}")
        if each.verdict is Verdict.UNDECIDED
        else each
        for each in results
    )
    return Report(system, found, told, states=len(found.states))


def search(
    system: System, limits: Limits, progress: Callable[[Progress], None] | None = None
) -> Exploration:
    """All of it if it is small; else without the orders that lead to the same."""
    began = time.monotonic()
    whole = min(limits.states, full_states(system))
    beyond = limits.states > whole
    small = replace(
        limits, states=whole, seconds=limits.seconds * FULL_TIME if beyond else limits.seconds
    )
    found = explore(system, small, progress=progress)
    if found.stopped not in (Stopped.STATES, Stopped.TIME) or not beyond:
        return found
    try:
        reduction = StubbornSets(system)
        return explore(system, _rest(limits, began), reduction=reduction, progress=progress)
    except KeyboardInterrupt:  # before the other search had begun
        found.stopped = Stopped.INTERRUPTED
        return found


def full_states(system: System) -> int:
    """States up to which a system is searched without leaving anything out."""
    return FULL_STATES * _FEWER_BEYOND // max(_FEWER_BEYOND, len(system.rules))
