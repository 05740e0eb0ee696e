"""What the start of a scheduled mission waits for: other runs, a condition, its vehicles.

`StartConditions.wait` is asked about a time that has come again and again, until nothing keeps it.
"""

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from m2pem.allocation.candidates import Facts
from m2pem.api.runs import RunId
from m2pem.errors import ExpressionError, JournalError, M2pemError
from m2pem.executive.scheduled_runs import ScheduledRuns
from m2pem.fleet.allocation import resources_of_mission
from m2pem.journal.base import RunHeader
from m2pem.journal.mission import fleet_of, mission_of
from m2pem.mission.catalogue import ResourceId
from m2pem.scheduling import times
from m2pem.scheduling.entry import (
    Concurrency,
    EntryId,
    ScheduleEntry,
    entry_number,
)
from m2pem.units import US_PER_S

LOOK_AGAIN_S = 0.5
"""Between two looks at telemetry for a condition."""

ASK_AGAIN_S = 5.0
"""Between two looks at what is not reported: runs of other executives, a journal that refused."""

STARTING = "it starts in a moment"


@dataclass(slots=True)
class Look:
    """What the scheduler knows of an entry since it was read; nothing of it is journaled.

    `resources`: those that its mission names; None: not known yet. `warned_us`: when operators
    were warned of the start of time `warned_due_us`. `true_since_us`: since when its condition
    holds. `reason`: why it waits.
    """

    resources: tuple[ResourceId, ...] | None = None
    warned_due_us: int | None = None
    warned_us: int = 0
    true_since_us: int | None = None
    reason: str = ""
    starts_us: int | None = None


@dataclass(slots=True)
class Wait:
    """Why a time that has come does not start now. `again_us`: when to look again at the latest;
    None: when something changes. `never`: it cannot come any more. `for_resources`: it waits for
    nothing else, and those who come after it must leave them to it."""

    reason: str
    again_us: int | None = None
    never: bool = False
    for_resources: bool = False


class StartConditions:
    """Says what keeps entries of the schedule from their starts. `entries`: all, by their ids."""

    def __init__(self, starter: ScheduledRuns, entries: Mapping[EntryId, ScheduleEntry]) -> None:
        self._starter = starter
        self._entries = entries
        self._outcomes: dict[RunId, str] = {}
        self._asked_us = 0

    def outcome(self, run: RunId) -> str | None:
        """How a run has ended; "": it has not, as far as is known; None: there is no such run."""
        here = self._starter.outcome_of(run)
        return self._outcomes.get(run) if here is None else here

    async def ask_journal(self, active: Sequence[ScheduleEntry]) -> None:
        """Read how the runs have ended that are not driven here, `ASK_AGAIN_S` after the last."""
        asked = {each.state.run for each in active if each.state.run}
        asked |= {each.plan.when.after for each in active if each.plan.when.after}
        asked = {run for run in asked if entry_number(run) is None}
        elsewhere = {run for run in asked if self._starter.outcome_of(run) is None}
        if not any(self._outcomes.get(run, "") == "" for run in elsewhere):
            return
        now_us = self._starter.clock.now_us()
        if now_us < self._asked_us and elsewhere <= self._outcomes.keys():
            return
        self._asked_us = now_us + round(ASK_AGAIN_S * US_PER_S)
        for line in await self._starter.journal.runs():
            self._outcomes[line.run] = line.outcome.value if line.outcome else ""

    def wait(
        self,
        entry: ScheduleEntry,
        look: Look,
        now_us: int,
        kept: Mapping[ResourceId, EntryId],
    ) -> Wait | None:
        """Return what keeps a time that has come from its start; None: nothing that is known."""
        if (wait := self._wait_after(entry)) is not None:
            return wait
        one = entry.plan.when.concurrency is Concurrency.FORBID
        if one and entry.state.run and self.outcome(entry.state.run) == "":
            return Wait(f"its run {entry.state.run} goes on", self._in(ASK_AGAIN_S))
        if (wait := self._wait_condition(entry, look, now_us)) is not None:
            return wait
        return self._wait_resources(look, kept)

    def _wait_after(self, entry: ScheduleEntry) -> Wait | None:
        name, is_entry = times.after_of(entry.plan.when)
        if not name:
            return None
        run = name
        if is_entry:
            before = self._entries.get(name)
            if before is None:
                return Wait(f"{name} is not in the schedule any more", never=True)
            run = before.state.run
            if not run and not before.state.active:
                return Wait(f"{name} has started nothing: {before.state.detail}", never=True)
            if not run:
                return Wait(f"after {name}, which has not started yet")
        outcome = self.outcome(run)
        if outcome is None:
            return Wait(f"the journal has no run {run} any more", never=True)
        if not outcome:
            return Wait(f"after {run}, which has not ended", self._in(ASK_AGAIN_S))
        if outcome in entry.plan.when.outcomes:
            return None
        if is_entry and self._entries[name].state.active:
            return Wait(f"after {name}; its run {run} has ended: {outcome}")
        return Wait(f"{run} has ended: {outcome}", never=True)

    def _wait_condition(self, entry: ScheduleEntry, look: Look, now_us: int) -> Wait | None:
        when = entry.plan.when
        if not when.condition:
            return None
        condition, again_us = times.condition_of(when.condition), self._in(LOOK_AGAIN_S)
        for name in when.vehicles or vehicles_of(look.resources or ()):
            vehicle = ResourceId(name)
            facts = self._starter.facts(vehicle)
            try:
                holds = condition.holds(facts.get)
            except ExpressionError as error:
                return Wait(f"condition of {vehicle}: {error}", again_us)
            if (why := self._starter.unusable(vehicle)) or not holds:
                look.true_since_us = None
                why = why or _values(condition.names, facts)
                return Wait(f"{when.condition} does not hold of {vehicle}: {why}", again_us)
        if look.true_since_us is None:
            look.true_since_us = now_us
        until_us = look.true_since_us + round(when.held_for_s * US_PER_S)
        if now_us < until_us:
            reason = f"{when.condition} has to hold for {when.held_for_s:g} s"
            return Wait(reason, min(again_us, until_us))
        return None

    def _wait_resources(self, look: Look, kept: Mapping[ResourceId, EntryId]) -> Wait | None:
        users = self._starter.users()
        reasons = []
        for resource in look.resources or ():
            if resource in users:
                reasons.append(f"{resource}: {users[resource]}")
            elif resource in kept:
                reasons.append(f"{resource}: {kept[resource]} is before it")
            elif why := self._starter.unusable(resource):
                reasons.append(f"{resource}: {why}")
        if not reasons:
            return None
        return Wait(f"for {'; '.join(reasons)}", self._in(LOOK_AGAIN_S), for_resources=True)

    async def interrupted(self, resources: Sequence[ResourceId]) -> str:
        """Return which run that no executive drives may still command some of these."""
        for line in await self._starter.journal.runs():
            if line.outcome is not None or line.driven or not line.last_seq:
                continue
            if line.header.simulated is not self._starter.fleet.simulated:
                continue
            named = await asyncio.to_thread(_named_in, line.header)
            if shared := [each for each in resources if each in named]:
                return (
                    f"{line.run} was interrupted and may still command {', '.join(shared)}: "
                    f"`m2pem resume {line.run}` takes it up"
                )
        return ""

    def _in(self, seconds: float) -> int:
        return self._starter.clock.now_us() + round(seconds * US_PER_S)


def vehicles_of(resources: Sequence[ResourceId]) -> tuple[str, ...]:
    """Return the vehicles among resources, and those that carry the payloads among them."""
    return tuple(dict.fromkeys(each.partition("/")[0] for each in resources))


def _named_in(header: RunHeader) -> frozenset[ResourceId]:
    """Return what the mission of a run names, all of its fleet if it cannot be read any more."""
    try:
        fleet = fleet_of(header)
    except JournalError:
        return frozenset()
    try:
        return frozenset(resources_of_mission(mission_of(header), fleet))
    except M2pemError:
        return frozenset((*fleet.vehicles, *fleet.payloads))


def _values(names: Iterable[str], facts: Facts) -> str:
    """Say what a condition reads: `vehicle.battery` is 0.8."""
    said = []
    for name in sorted(names):
        value = facts.get(name)
        shown = (
            "not known" if value is None else f"{value:.3g}" if isinstance(value, float) else value
        )
        said.append(f"{name} is {shown}")
    return ", ".join(said)
