"""Which items of a mission any run can reach, by the mission's Petri net, and the runs that do."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

from m2pem.coverage.items import Item, error_key
from m2pem.executive.verification import known_ways
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.check import search, size_limit_of
from m2pem.verify.net.petri_net import Action, Flag, PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.report.run_steps import ElementNames, RunStep, describe_run, encoding_of
from m2pem.verify.search.explore import Exploration, Limits
from m2pem.verify.translate import Options, TooLargeError, translate

_REACHES = frozenset(
    {Action.ENTERED, Action.COMPLETED, Action.TRIGGERED, Action.TAKEN, Action.THROWN}
)
_ENDS_THE_RUN = frozenset({Flag.UNCAUGHT, Flag.UNCAUGHT_FAILURE})
MOST_RUNS = 4
"""Runs to one item that are tried: each ends in another transition."""


class Reach:
    """The states of a mission, searched once. `problem`: why they could not be; "" if they were.

    `states`: how many were seen. `complete`: whether those are all, so that what no run has reached
    none reaches. `uncaught`: the codes of the errors that end a run as no event catches them.
    """

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet,
        process: str,
        data: Mapping[str, Value],
        service_writes: Mapping[str, Sequence[str]],
        limits: Limits,
        wanted: Collection[str] = (),
    ) -> None:
        """`wanted`: keys of items. A large search ends soon after it has runs to all of them."""
        self.process = process
        self.problem = ""
        self.uncaught: list[str] = []
        self.states = 0
        self.complete = False
        self._names = ElementNames(mission)
        self._by_key: dict[str, list[int]] = {}
        self._possible: set[str] = set()
        self._net: PetriNet | None = None
        self._found: Exploration | None = None
        options = Options(data, service_writes, ways=known_ways(fleet, mission))
        size_limit = size_limit_of(limits)
        try:
            net = translate(mission, fleet, process=process, options=options, size_limit=size_limit)
            net = self._net = simplify(net, size_limit=size_limit)
        except TooLargeError as error:
            self.problem = f"the mission is too large to be searched: {error}"
            return
        self._possible = {key for each in net.transitions for key in _reached_by(net, each.index)}
        watch = _All(net, self._possible & {*wanted})
        self._found = found = search(net, limits, watch=watch)
        self.states = len(found.states)
        self.complete = found.complete
        if not found.complete and watch.missing:
            self.problem = f"the search was stopped by {found.stopped}"
        fired = (net.transitions[index] for index in found.fired)
        self.uncaught = sorted({each.flagged for each in fired if each.flag in _ENDS_THE_RUN})
        # Those that fired in earlier states come first: their runs are shorter.
        for index, _ in sorted(found.fired.items(), key=lambda fired: fired[1]):
            for key in _reached_by(net, index):
                self._by_key.setdefault(key, []).append(index)

    def reaches(self, item: Item) -> bool:
        """Whether any run that was seen reaches an item."""
        return item.key in self._by_key

    def cannot_reach(self, item: Item) -> bool:
        """Whether it is certain that no run reaches an item."""
        if item.key in self._by_key:
            return False
        return self.complete or (self._net is not None and item.key not in self._possible)

    def runs_to(self, item: Item) -> Iterator[tuple[RunStep, ...]]:
        """Yield runs that reach an item in their last step, shorter ones first."""
        if self._net is None or self._found is None:
            return
        for index in islice(self._by_key.get(item.key, ()), MOST_RUNS):
            run = [*self._found.run_to(self._found.fired[index]), index]
            steps, _ = describe_run(encoding_of(self._net), self._names, run)
            yield steps


class _All:
    """A `Watch` that has seen enough when there are runs to all that is wanted."""

    def __init__(self, net: PetriNet, wanted: Collection[str]) -> None:
        self._net = net
        self._looked_at: set[int] = set()
        self.missing = {*wanted}

    def look(self, found: Exploration) -> bool:
        """Whether there is a run to everything."""
        for index in found.fired.keys() - self._looked_at:
            self._looked_at.add(index)
            self.missing -= _reached_by(self._net, index)
        return not self.missing


def _reached_by(net: PetriNet, index: int) -> set[str]:
    transition = net.transitions[index]
    keys = {step.element for step in transition.steps if step.action in _REACHES}
    if transition.flag in _ENDS_THE_RUN:
        keys.add(error_key(transition.flagged))
    return keys


def as_step(run_step: RunStep) -> dict[str, Any]:
    """Return a step as `ConformanceRun.play` takes it."""
    return {
        "trigger": run_step.trigger or None,
        "element": run_step.element,
        "detail": run_step.detail,
        "actions": [
            {"element": each.element, "action": each.action.value, "detail": each.detail}
            for each in run_step.actions
        ],
        "data": dict(run_step.data),
        "writes": dict(run_step.writes),
    }
