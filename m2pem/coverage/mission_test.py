"""Tests one mission: its scenarios are rehearsed, and what they have not seen is searched for."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from m2pem.api.runs import RunStatus
from m2pem.coverage.comparing import differences
from m2pem.coverage.items import Item, Kind, error_item, error_key, items_of, seen_in
from m2pem.coverage.reach import Reach
from m2pem.coverage.scenario_file import Scenario, ScenarioFile, refuse_misfits
from m2pem.coverage.suggesting import Suggestion, suggest_answers
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import Rehearser
from m2pem.verify.search.explore import Limits

MAX_STEPS = 1_000_000
"""Engine steps after which a rehearsal is given up."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """A scenario that was rehearsed. `differences`: a sentence for each; () if it has passed.
    `line`: in the file of scenarios. `took_s`: mission time."""

    title: str
    line: int
    differences: tuple[str, ...]
    status: RunStatus
    took_s: float
    seen: frozenset[str]


@dataclass(frozen=True, slots=True)
class NeverSeen:
    """An item that no scenario sees. `reason`: as the file of scenarios says, or the checker.

    `named`: whether it is accounted for: the file names it, or no run at all can reach it.
    """

    item: Item
    reason: str
    named: bool


@dataclass(frozen=True, slots=True)
class MissionReport:
    """All that was found about one mission.

    `items`: every item, by its key. `stale`: what the file of scenarios calls unreached, and a
    scenario sees. `called`: the other files that the mission uses. `states`: how many were
    searched. `searched`: why not all states were; "".
    """

    mission: Path
    scenarios: Path | None
    outcomes: tuple[Outcome, ...]
    items: Mapping[str, Item]
    never: tuple[NeverSeen, ...]
    stale: tuple[str, ...]
    complete: bool
    called: tuple[str, ...] = ()
    suggestions: tuple[Suggestion, ...] = ()
    states: int = 0
    searched: str = ""

    @property
    def unnamed(self) -> list[NeverSeen]:
        """What is never seen, and not accounted for."""
        return [each for each in self.never if not each.named]

    @property
    def passed(self) -> bool:
        """Whether all is as the file of scenarios says."""
        failed = any(each.differences for each in self.outcomes)
        return not (failed or self.stale or (self.complete and self.unnamed))

    def seen_of(self, kind: Kind) -> tuple[int, int]:
        """How many items of a kind scenarios have seen, and how many there are."""
        keys = {key for key, item in self.items.items() if item.kind is kind}
        return len(keys - {each.item.key for each in self.never}), len(keys)


class MissionTest:
    """A mission with its scenarios, read and checked.

    Raises:
        FindingsError: the mission, its fleet or its scenarios cannot be used.
    """

    def __init__(self, mission: Path, scenarios: ScenarioFile, plugins: PluginManager) -> None:
        folders = [scenarios.folder / each for each in scenarios.model.path]
        self.path = mission
        self.file = scenarios
        self.mission = load_source(str(mission), folders)
        self._plugins = plugins
        self._fleets: dict[str, Fleet] = {}
        self._rehearsers: dict[tuple[str, str | None], Rehearser] = {}
        refuse_misfits(scenarios, self.mission)

    def play(self, number: int) -> Outcome:
        """Rehearse a scenario, by its place in the file.

        Raises:
            FindingsError: its fleet, answers or data cannot be used.
        """
        scenario = self.file.model.scenarios[number]
        result = self.rehearser(scenario).rehearse(
            data=self.file.data_of(scenario),
            answers=self.file.answers_of(number),
            max_steps=MAX_STEPS,
            observed=False,
        )
        return Outcome(
            scenario.scenario,
            self.file.line(number),
            differences(scenario.then, result),
            result.summary.status,
            result.summary.took_s or 0.0,
            seen_in(each.record for each in result.records),
        )

    def rehearser(self, scenario: Scenario | None) -> Rehearser:
        """The rehearser of a scenario; None: with what the whole file says."""
        fleet = self.file.located(self.file.model.fleet)
        process = self.file.model.process
        if scenario is not None:
            fleet, process = self.file.fleet_of(scenario), self.file.process_of(scenario)
        if (fleet, process) not in self._rehearsers:
            self._rehearsers[fleet, process] = Rehearser(
                self.mission, self._fleet(fleet), self._plugins, process
            )
        return self._rehearsers[fleet, process]

    def _fleet(self, fleet: str) -> Fleet:
        if fleet not in self._fleets:
            made_up = fleet == "sim"
            self._fleets[fleet] = fleet_for(self.mission) if made_up else load_fleet(fleet)
        return self._fleets[fleet]

    def report(
        self,
        outcomes: Iterable[Outcome],
        limits: Limits,
        *,
        suggest: bool = False,
        complete: bool = False,
        progress: Callable[[str], None] = lambda _: None,
    ) -> MissionReport:
        """Return what the scenarios have not seen, and with `suggest` answers files that see it.

        `complete`: what is neither seen nor named is an error, also if the file does not say so.
        `progress` gets what is done now.
        """
        outcomes = tuple(outcomes)
        model = self.file.model
        seen = frozenset().union(*(each.seen for each in outcomes))
        items = {item.key: item for item in items_of(self.mission)}
        reach: Reach | None = None
        if outcomes or suggest:
            progress(f"{self.path}: searching for runs")
            reach = self._reach(limits, items.keys() - seen - model.unreached.keys())
            items |= {error_key(code): error_item(code) for code in reach.uncaught}
        prefix = error_key("")
        codes = {key.removeprefix(prefix) for key in seen if key.startswith(prefix)}
        items |= {error_key(code): error_item(code) for code in sorted(codes)}
        never = [item for key, item in items.items() if key not in seen]
        wanted = [item for item in never if item.key not in model.unreached]
        found: tuple[Suggestion, ...] = ()
        unscripted: Mapping[str, str] = {}
        if reach is not None and suggest:
            progress(f"{self.path}: looking for answers")
            found, unscripted = suggest_answers(
                reach, self.rehearser(None), model.data, wanted, limits.seconds
            )
        return MissionReport(
            self.path,
            self.file.path,
            outcomes,
            items,
            tuple(_never(item, model.unreached, reach, unscripted) for item in never),
            tuple(key for key in model.unreached if key in seen),
            complete or model.complete,
            tuple(each.name for each in self.mission.library),
            found,
            reach.states if reach is not None else 0,
            reach.problem if reach is not None else "",
        )

    def _reach(self, limits: Limits, wanted: Collection[str]) -> Reach:
        model = self.file.model
        return Reach(
            self.mission,
            self.rehearser(None).fleet,
            self.mission.process(model.process).id,
            model.data,
            self._plugins.service_writes(),
            limits,
            wanted,
        )


def _never(
    item: Item,
    unreached: Mapping[str, str],
    reach: Reach | None,
    unscripted: Mapping[str, str],
) -> NeverSeen:
    if item.key in unreached:
        return NeverSeen(item, unreached[item.key], named=True)
    if reach is None:
        return NeverSeen(item, "there are no scenarios", named=False)
    if not reach.reaches(item):
        if reach.cannot_reach(item):
            return NeverSeen(item, "no run reaches it", named=True)
        return NeverSeen(item, f"no run was found that reaches it: {reach.problem}", named=False)
    if item.key in unscripted:
        return NeverSeen(item, unscripted[item.key], named=False)
    return NeverSeen(item, "a run reaches it, and no scenario does", named=False)
