"""Check a mission: translate it, explore its net, and read the verdict of each property."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.confirmation import Confirmation
from m2pem.verify.net.petri_net import PetriNet, Place, Role, Scope
from m2pem.verify.net.simplify import simplify
from m2pem.verify.net.size_limit import MOST_TRANSITIONS
from m2pem.verify.properties import ALL, SearchedMission
from m2pem.verify.properties.commands import (
    INTERRUPTED,
    interrupted_commanded_again,
    watch_interruptions,
)
from m2pem.verify.properties.early import EarlyInterruptions, EarlyResults
from m2pem.verify.properties.results import Result, Verdict, bounded
from m2pem.verify.search.explore import (
    Exploration,
    Limits,
    Progress,
    Stopped,
    Watch,
    explore,
)
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import Options, SizeLimit, TooLargeError, translate

FULL_STATES = 100_000
"""States up to which a search uses no reduction: that gives the shortest runs."""
FULL_TIME = 0.4
"""Share of the time limit for the search without reduction."""
SHARE_REDUCED = 0.04
"""A state takes about 25 times as long with a reduction as without."""
_BYTES_A_TRANSITION = 2_500
"""Approximate memory of a transition, from its translation until the search is over."""
_FEWER_BEYOND = 100
"""Transitions beyond which fewer states are searched without reduction: each takes longer."""


@dataclass(frozen=True, slots=True)
class Report:
    """All that a check found.

    `states`: how many states were seen; `found` may hold fewer, if another engine saw the rest.
    `notes`: remarks on the answers. `watched`: the net that also notes which vehicles are
    interrupted; `asked`: the net that requirements were checked on. `assumed`: what the whole check
    assumes; `without`: the same check where nothing is assumed.
    """

    net: PetriNet
    found: Exploration
    results: tuple[Result, ...]
    watched: PetriNet | None = None
    engine: str = "builtin"
    states: int = 0
    notes: tuple[str, ...] = ()
    asked: PetriNet | None = None
    assumed: Assumptions = NOTHING
    without: "Report | None" = None

    def transitions_of(self, result: Result) -> PetriNet:
        """The net whose transitions the runs of a result number."""
        if result.net is not None:
            return result.net
        if result.required:
            return self.asked or self.net
        return (self.watched or self.net) if result.property == INTERRUPTED else self.net

    @property
    def interrupted(self) -> bool:
        """Whether a person has ended a search."""
        return self.found.stopped is Stopped.INTERRUPTED or any(
            each.covered.endswith(Stopped.INTERRUPTED) for each in self.results
        )

    @property
    def verdict(self) -> Verdict:
        """VIOLATED if any property that is no mere warning is; else MAY_BE_VIOLATED or UNDECIDED if
        any is."""
        return self.judged(strict=False)

    def judged(self, *, strict: bool) -> Verdict:
        """The same as `verdict`; `strict`: warnings count too."""
        counted = [each for each in self.results if strict or not each.warning]
        for verdict in (Verdict.VIOLATED, Verdict.MAY_BE_VIOLATED, Verdict.UNDECIDED):
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
    decided: Callable[[Result], None] | None = None,
) -> Report:
    """Check every default property of a mission.

    `decided` gets the result of each property once, as soon as it is certain. When one of them that
    is no mere warning is violated, the search ends after a share more (`Limits.after_violation`).

    Raises:
        KeyError: the mission has no such process.
    """
    began = time.monotonic()
    limits = limits or Limits(tokens=3)
    fleet = fleet or fleet_for(mission)
    try:
        size_limit = size_limit_of(limits)
        net = translate(mission, fleet, process=process, options=options, size_limit=size_limit)
        net = simplify(net, size_limit=size_limit)
    except TooLargeError as error:
        return too_large(mission, error, process)
    confirm = Confirmation(mission, fleet, process, options or Options()).doubt
    early = EarlyResults(mission, net, decided, confirm)
    early.begin(unsearched(net))
    found = search(net, _rest(limits, began), progress, early)
    searched = SearchedMission(mission, net, found, confirm=confirm)
    watched = watch_interruptions(net, fleet.vehicles)
    if watched is not None and found.stopped is not Stopped.INTERRUPTED:
        early.settle(each(searched) for each in ALL if each is not interrupted_commanded_again)
        searched.resources = watched[1]
        watch = EarlyInterruptions(
            mission, net, watched[1], violated=early.violated, confirm=confirm
        )
        searched.watched = search(watched[0], _rest(limits, began), progress, watch)
    results = tuple(early.merged(each(searched)) for each in ALL)
    early.settle(results)
    return Report(
        replace(net, approximations=bounded(found)),
        found,
        results,
        watched[0] if watched is not None else None,
        states=len(found.states),
    )


def size_limit_of(limits: Limits) -> SizeLimit:
    """The limit of a translation that begins now, within the limits of a check."""
    most = min(MOST_TRANSITIONS, int(limits.memory_mb * 1e6 / _BYTES_A_TRANSITION))
    return SizeLimit(time.monotonic() + limits.seconds, max(most, 1))


def _rest(limits: Limits, began: float) -> Limits:
    """The limits of a search that is a part of a check."""
    return replace(limits, seconds=max(0.0, limits.seconds - (time.monotonic() - began)))


def too_large(mission: Mission, error: TooLargeError, process: str | None = None) -> Report:
    """The report on a mission whose net is too large: only what needs no search is decided."""
    root = mission.process(process)
    places = tuple(
        Place(n, f"{root.id}:{name}", root.id, 0, Role.CONTROL if n == 0 else Role.END)
        for n, name in enumerate(("running", "completed", "terminated", "failed"))
    )
    scopes = (Scope(0, root.id, None, (root.id,)),)
    net = PetriNet(mission.file, root.id, scopes, places, (), (), ((0, 1),), 1, 2, 3)
    found = unsearched(net)
    found.stopped = Stopped.TIME if error.late else Stopped.TRANSITIONS
    verdicts = (each(SearchedMission(mission, net, found, watched=found)) for each in ALL)
    results = tuple(
        replace(each, covered=f"too large to search: {error}")
        if each.verdict is Verdict.UNDECIDED
        else each
        for each in verdicts
    )
    return Report(net, found, results, states=len(found.states))


def unsearched(net: PetriNet) -> Exploration:
    """Return an exploration that has seen nothing but the initial state."""
    found = explore(replace(net, transitions=()))
    found.stopped = Stopped.STATES
    found.terminals.clear()
    found.expanded = 0
    return found


def search(
    net: PetriNet,
    limits: Limits,
    progress: Callable[[Progress], None] | None = None,
    watch: Watch | None = None,
) -> Exploration:
    """Explore a net completely if it is small, else with stubborn sets."""
    began = time.monotonic()
    whole = min(limits.states, full_states(net))
    beyond = limits.states > whole
    small = replace(
        limits,
        states=whole,
        seconds=limits.seconds * FULL_TIME if beyond else limits.seconds,
        after_violation=share(limits, full_states(net) / FULL_STATES),
    )
    found = explore(net, small, progress=progress, watch=watch)
    if found.stopped not in (Stopped.STATES, Stopped.TIME) or not beyond:
        return found
    try:
        reduction = StubbornSets(net)
        rest = replace(_rest(limits, began), after_violation=share(limits, SHARE_REDUCED))
        return explore(net, rest, reduction=reduction, progress=progress, watch=watch)
    except KeyboardInterrupt:  # before the other search had begun
        found.stopped = Stopped.INTERRUPTED
        return found


def share(limits: Limits, share: float) -> int | None:
    """The states to search after a violation, where each takes longer."""
    return None if limits.after_violation is None else int(limits.after_violation * share)


def full_states(net: PetriNet) -> int:
    """States up to which a net is searched without reduction."""
    return FULL_STATES * _FEWER_BEYOND // max(_FEWER_BEYOND, len(net.transitions))
