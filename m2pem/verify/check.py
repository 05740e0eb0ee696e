"""Checking a mission: rules, search, properties, verdicts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from m2pem.model.mission import Mission
from m2pem.resources.fleet import Fleet
from m2pem.resources.madeup import fleet_for
from m2pem.verify.derive import Options, derive
from m2pem.verify.explore import Exploration, Limits, Progress, Stopped, explore
from m2pem.verify.interruption import watch_interruptions
from m2pem.verify.properties import ALL, Searched
from m2pem.verify.properties.commands import INTERRUPTED
from m2pem.verify.reduction import StubbornSets
from m2pem.verify.results import Result, Verdict
from m2pem.verify.simplify import simplify
from m2pem.verify.system import System

FULL_STATES = 30_000
"""States up to which nothing is left out: that gives the shortest runs."""
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
    limits = limits or Limits(tokens=3)
    fleet = fleet or fleet_for(mission)
    system = simplify(derive(mission, fleet, process=process, options=options))
    found = search(system, limits, progress)
    searched = Searched(mission, system, found)
    watched = watch_interruptions(system, fleet.vehicles)
    if watched is not None and found.stopped is not Stopped.INTERRUPTED:
        searched.resources = watched[1]
        searched.watched = search(watched[0], limits, progress)
    results = tuple(each(searched) for each in ALL)
    return Report(
        system,
        found,
        results,
        watched[0] if watched is not None else None,
        states=len(found.states),
    )


def search(
    system: System, limits: Limits, progress: Callable[[Progress], None] | None = None
) -> Exploration:
    """All of it if it is small; else without the orders that lead to the same."""
    small = replace(limits, states=min(limits.states, full_states(system)))
    found = explore(system, small, progress=progress)
    if found.stopped is not Stopped.STATES or limits.states <= small.states:
        return found
    return explore(system, limits, reduction=StubbornSets(system), progress=progress)


def full_states(system: System) -> int:
    """States up to which a system is searched without leaving anything out."""
    return FULL_STATES * _FEWER_BEYOND // max(_FEWER_BEYOND, len(system.rules))
