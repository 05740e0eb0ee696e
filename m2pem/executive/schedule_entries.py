"""The entries of a schedule, and what operators do with them: add, cancel, hold and release.

Each change is written to the journal before it counts. A hold is the exception: it acts at once.
"""

import asyncio
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec

from m2pem.api.alerts import AlertSeverity
from m2pem.api.runs import NOT_STARTED, SCHEDULE, Alert, RunId
from m2pem.api.schedule import Schedule, ScheduleChanged, ScheduledMission
from m2pem.errors import JournalError, OperatorError
from m2pem.executive.emergency import WRITTEN_WITHIN_S, StopMark, StopMarks
from m2pem.executive.schedule_view import scheduled_mission
from m2pem.executive.scheduled_runs import ScheduledRuns
from m2pem.executive.scheduled_start import Look
from m2pem.mission.catalogue import ResourceId
from m2pem.scheduling import times
from m2pem.scheduling.entry import (
    EntryChange,
    EntryId,
    EntryState,
    Hold,
    ScheduleEntry,
    SchedulePlan,
    entry_number,
)

_SEVERITIES = {NOT_STARTED: AlertSeverity.WARNING}

log = logging.getLogger("m2pem.schedule")

KEPT_ENTRIES = 200
"""Entries that have ended and are kept; of more, the oldest are removed."""

MARK = "schedule"
"""The name of the mark that keeps a STOP of all until the journal has the hold."""


class ScheduleEntries:
    """The schedule of one executive's fleet. `real`: whether something in the fleet is real.

    `publish`: takes alerts for operators and says that the schedule has changed. `marks`: keep a
    STOP of all until the journal has the hold.
    """

    def __init__(
        self,
        starter: ScheduledRuns,
        publish: Callable[[Alert | ScheduleChanged], None],
        marks: StopMarks,
        *,
        real: bool,
    ) -> None:
        self._starter = starter
        self._publish = publish
        self._marks = marks
        self._real = real
        self.by_id: dict[EntryId, ScheduleEntry] = {}
        self.looks: dict[EntryId, Look] = {}
        self.hold_of_all: Hold | None = None
        """The hold of the whole schedule."""
        self.holds = 0
        """How often all was stopped or held."""
        self.served = self.is_beginning = False
        """Whether due missions are started."""
        self.lock = asyncio.Lock()
        """Held while entries are looked at and changed."""
        self.changed = asyncio.Event()
        """Set when something may start that could not before."""
        self._unwritten: Hold | None = None
        """The hold of the whole schedule that the journal does not have yet."""
        self._writing: asyncio.Future[bool] | None = None
        self._stopped: set[EntryId] = set()
        """Entries that an operator cancels or holds, before the journal has it."""
        self.to_hold: dict[EntryId, Hold] = {}
        """Entries whose run is stopped, before the journal has their hold."""
        self._runs: dict[RunId, EntryId] = {}
        self._elsewhere: set[EntryId] = set()
        """Entries of the journal that are of other fleets."""

    # --- the entries ----------------------------------------------------------------------------

    async def load(self) -> None:
        """Read the schedule, and take back starts whose runs never began: they come again.

        It comes before runs are taken up. A STOP of all that came before, or comes meanwhile,
        holds what is read.

        Raises:
            JournalError: the journal cannot be read or written.
        """
        journal = self._starter.journal
        async with self.lock:
            self.hold_of_all = await self._hold_now()
            mark = self._marks.get(MARK)
            if self.hold_of_all is None and mark is not None:
                self.hold_at_once(mark.by, mark.reason)
            elif self._unwritten is None:
                self._marks.remove(MARK)
            lines = {line.run: line for line in await journal.runs()}
            for entry in await journal.entries():
                if self._belongs_here(entry.plan):
                    started = [each.run for each in entry.state.times[-1:] if each.run]
                    line = lines.get(started[0]) if started else None
                    never_began = line and not (line.gone or line.last_seq or line.driven)
                    self.add(await self.take_back(entry) if never_began else entry)
                    line = lines.get(entry.state.run)
                    if line and line.outcome is None and (stopped := self._marks.get(line.run)):
                        self.run_stopping(line.run, stopped.by)

    def _belongs_here(self, plan: SchedulePlan) -> bool:
        # What was scheduled in a simulation must never start a real vehicle.
        return plan.fleet == self._starter.fleet.name and plan.simulated is not self._real

    async def take_back(self, entry: ScheduleEntry) -> ScheduleEntry:
        """Take back the last start of an entry, whose run never began.

        Raises:
            JournalError: the journal cannot be written.
        """
        run = entry.state.times[-1].run
        change = EntryChange(entry.id, times.withdrawn(entry.state))
        await self._starter.journal.change_entry(change, deletes=run)
        log.warning(
            "%s: %s was created for it and never began: its time counts again", entry.id, run
        )
        return msgspec.structs.replace(entry, state=change.state)

    def add(self, entry: ScheduleEntry) -> None:
        """Take over an entry as the journal has it."""
        self.by_id[entry.id] = entry
        self.looks.setdefault(entry.id, Look())
        if entry.state.run:
            self._runs[entry.state.run] = entry.id

    async def refresh(self) -> bool:
        """Take over what other executives on the journal have added, changed, removed, held and
        released; returns whether anything has changed.

        Raises:
            JournalError: the journal cannot be read.
        """
        if self._unwritten is not None and self._writing is not None and self._writing.done():
            self._begin_writing(self._unwritten)
        held = await self.read_hold()
        revisions = await self._starter.journal.schedule_revisions()
        known = {number: entry.state.revision for number, entry in self.by_id.items()}
        if {each: revisions[each] for each in revisions.keys() - self._elsewhere} == known:
            return held
        found = await self._starter.journal.entries()
        here = {entry.id: entry for entry in found if self._belongs_here(entry.plan)}
        self._elsewhere = {entry.id for entry in found} - here.keys()
        for number, entry in here.items():
            if known.get(number) != entry.state.revision:
                self.add(entry)
        for number in known.keys() - here.keys():
            self._remove(number)
        self._publish(ScheduleChanged())
        return True

    def _remove(self, number: EntryId) -> None:
        del self.by_id[number], self.looks[number]
        self._runs = {run: entry for run, entry in self._runs.items() if entry != number}

    def active(self) -> list[ScheduleEntry]:
        """Return the entries that may still start something."""
        return [entry for entry in self.by_id.values() if entry.state.active]

    def in_order(self) -> list[ScheduleEntry]:
        """Return the entries that may still start something, in the order of service."""
        return sorted(self.active(), key=self._rank)

    def _rank(self, entry: ScheduleEntry) -> tuple[int, int, int]:
        found = times.due(entry.plan, entry.state, self._starter.clock.now_us())
        due_us = found.due_us or found.next_us or 0
        return -entry.plan.priority, due_us, entry_number(entry.id) or 0

    def active_entry(self, number: EntryId) -> ScheduleEntry:
        """Return an entry that may still start something.

        Raises:
            OperatorError: there is none, or it is over.
        """
        entry = self.by_id.get(number)
        if entry is None:
            known = ", ".join(each.id for each in self.active()) or "none"
            raise OperatorError(f"there is no entry {number!r} in the schedule; it has {known}")
        if not entry.state.active:
            raise OperatorError(f"{number} is {entry.state.end}")
        return entry

    async def find(self, number: EntryId) -> ScheduleEntry:
        """Return an entry that may still start something, also one that another executive has just
        added.

        Raises:
            OperatorError: there is none, or it is over.
            JournalError: the journal cannot be read.
        """
        if number not in self.by_id:
            async with self.lock:
                await self.refresh()
        return self.active_entry(number)

    async def change(self, entry: ScheduleEntry, **fields: object) -> ScheduleEntry:
        """Write an entry with other values of some fields of its state; returns it."""
        return await self.write(entry, entry.state.changed(**fields))

    async def write(self, entry: ScheduleEntry, state: EntryState) -> ScheduleEntry:
        """Write a new state of an entry; returns the entry.

        Raises:
            JournalError: the journal cannot be written; `StaleEntryError` among them: another
                executive has changed the entry.
        """
        await self._starter.journal.change_entry(EntryChange(entry.id, state))
        changed = msgspec.structs.replace(entry, state=state)
        self.by_id[entry.id] = changed
        self._publish(ScheduleChanged())
        return changed

    def note(self, number: EntryId, reason: str) -> None:
        """Keep why an entry waits."""
        self.looks[number].reason = reason
        self._publish(ScheduleChanged())

    def say(self, text: str, code: str = SCHEDULE) -> None:
        """Tell operators what was done with the schedule."""
        log.info("%s", text)
        self._publish(Alert("", code, text, _SEVERITIES.get(code, AlertSeverity.NOTICE)))
        self._publish(ScheduleChanged())

    def view(self) -> Schedule:
        """Return the schedule as operators see it."""
        over = [entry for entry in self.by_id.values() if not entry.state.active]
        return Schedule(
            tuple(self._seen(entry) for entry in (*self.in_order(), *over)),
            str(self.hold_of_all) if self.hold_of_all is not None else "",
            self.served,
            self._starter.fleet.start_warning_s,
        )

    def _seen(self, entry: ScheduleEntry) -> ScheduledMission:
        held = self.why_held(entry) if entry.state.active else ""
        now_us = self._starter.clock.now_us()
        return scheduled_mission(entry, self.looks[entry.id], held, now_us)

    # --- what operators do ----------------------------------------------------------------------

    async def schedule(
        self, plan: SchedulePlan, resources: tuple[ResourceId, ...], holds: int = 0
    ) -> EntryId:
        """Add an entry, of a mission that was checked and names `resources`.

        `holds`: the attribute `holds` as it was when the operator asked.

        Raises:
            OperatorError: all was stopped or held since: what was asked for before does not count.
        """
        async with self.lock:
            await self.refresh()  # what another executive has removed is not removed again
            if holds != self.holds:
                raise OperatorError("all was stopped or held meanwhile; schedule it again")
            state = EntryState(plan.scheduled_us - 1 if not plan.when.cron else plan.scheduled_us)
            entry = await self._starter.journal.schedule(plan, state)
            self.add(entry)
            self.looks[entry.id].resources = resources
            await self._forget_old()
        what = f"{plan.title} {times.described(plan.when)}"
        self.say(f"{entry.id} is scheduled by {plan.by or 'an operator'}: {what}")
        self.changed.set()
        return entry.id

    async def _forget_old(self) -> None:
        over = [entry.id for entry in self.by_id.values() if not entry.state.active]
        if old := over[:-KEPT_ENTRIES]:
            await self._starter.journal.remove_entries(old)
            for each in old:
                self._remove(each)

    async def cancel(self, number: EntryId, by: str) -> None:
        """Cancel an entry.

        Raises:
            OperatorError: there is none, or it is over.
        """
        entry, who = await self.find(number), by or "an operator"
        with self._stopping(number):
            async with self.lock:
                found = self.active_entry(number)
                await self.write(found, found.state.cancelled(by))
        self.say(f"{number} is cancelled by {who}: {entry.plan.title} is not started")

    @contextmanager
    def _stopping(self, number: EntryId) -> Iterator[None]:
        """Let an entry start nothing, before the journal has why."""
        self._stopped.add(number)
        try:
            yield
        finally:
            self._stopped.discard(number)

    def hold_at_once(self, by: str, reason: str) -> "asyncio.Future[bool]":
        """Hold the whole schedule, whether or not its entries are known yet.

        The future is done when the journal has the hold: whether there is anything to hold. If
        nothing is scheduled, the hold is over then.
        """
        self.holds += 1
        hold = Hold(by, reason, self._starter.clock.now_us())
        self.hold_of_all = self._unwritten = hold
        self._marks.put(MARK, StopMark(by, reason))
        if self.active():
            self.say_held()
        return self._begin_writing(hold)

    def _begin_writing(self, hold: Hold) -> "asyncio.Future[bool]":
        writing = self._writing = asyncio.ensure_future(self._write(hold))
        writing.add_done_callback(_log_unwritten)
        return writing

    async def _write(self, hold: Hold) -> bool:
        journal, fleet = self._starter.journal, self._starter.fleet.name
        if not self.active():
            async with self.lock:  # what is being read is known then
                await self.refresh()
            if self.active():
                self.say_held()
        if needed := bool(self.active()):
            await journal.hold_schedule(fleet, hold)
        found = hold if needed else await journal.schedule_hold(fleet)
        if self._unwritten is hold:
            self.hold_of_all, self._unwritten = found, None
            self._marks.remove(MARK)
        return needed

    def say_held(self) -> None:
        """Tell operators that the whole schedule is held."""
        text = f"the schedule is {self.hold_of_all}; nothing starts until it is released"
        self.say(text, NOT_STARTED)

    async def written(self, writing: "asyncio.Future[bool]") -> bool:
        """Wait until the journal has a hold of the whole schedule; returns whether there is
        anything to hold.

        Raises:
            OperatorError: it has not written it within `WRITTEN_WITHIN_S`; the hold stays in force.
        """
        try:
            return await asyncio.wait_for(asyncio.shield(writing), WRITTEN_WITHIN_S)
        except (TimeoutError, JournalError) as error:
            raise OperatorError(
                "the schedule is held, but the journal does not write: it has not been recorded"
                f"{f' ({error})' if str(error) else ''}"
            ) from error

    async def _hold_now(self) -> Hold | None:
        """Return the hold of the journal, unless this executive has or gets another one."""
        before = self.hold_of_all
        found = await self._starter.journal.schedule_hold(self._starter.fleet.name)
        is_own = self._unwritten is not None or self.hold_of_all is not before
        return self.hold_of_all if is_own else found

    async def read_hold(self) -> bool:
        """Take over that another executive on the journal has held or released all; returns
        whether it has.

        Raises:
            JournalError: the journal cannot be read.
        """
        found = await self._hold_now()
        if found == self.hold_of_all:
            return False
        self.hold_of_all = found
        if found is None:
            self.say("the schedule is released by another executive's operator")
        else:
            self.say_held()
        return True

    async def hold(self, number: EntryId | None, by: str, reason: str) -> None:
        """Hold an entry, or the whole schedule.

        Raises:
            OperatorError: there is no such entry, it is over; or the journal does not write.
        """
        if number is None:
            if not await self.written(self.hold_at_once(by, reason)):
                raise OperatorError("nothing is scheduled")
            return
        await self.find(number)
        hold = Hold(by, reason, self._starter.clock.now_us())
        with self._stopping(number):
            async with self.lock:
                await self.change(self.active_entry(number), hold=hold)
        self.say(f"{number} is {hold}; it starts nothing until it is released")

    async def release(self, number: EntryId | None, by: str) -> None:
        """Let an entry, or the whole schedule, start missions again.

        Raises:
            OperatorError: it is not held.
        """
        if number is not None:
            await self.find(number)
        async with self.lock:
            if number is None:
                await self._release_all()
            else:
                entry = self.active_entry(number)
                if entry.state.hold is None:
                    raise OperatorError(f"{number} is not held")
                await self.change(entry, hold=None)
        for each in self.looks if number is None else (number,):
            look = self.looks[each]
            look.reason, look.warned_due_us, look.starts_us = "", None, None
        self.say(f"{number or 'the schedule'} is released by {by or 'an operator'}")
        self.changed.set()

    async def _release_all(self) -> None:
        if self.hold_of_all is None:
            await self.read_hold()
        held = self.hold_of_all
        if held is None:
            raise OperatorError("the schedule is not held")
        await self._starter.journal.hold_schedule(self._starter.fleet.name, None)
        if self.hold_of_all is not held:  # by a STOP that came meanwhile, written after this
            raise OperatorError(f"not released: the schedule is {self.hold_of_all}")
        self._marks.remove(MARK)
        self.hold_of_all = self._unwritten = None

    def run_stopping(self, run: RunId, by: str) -> None:
        """An operator stops a run: the entry that would start its mission again is held."""
        number = self._runs.get(run)
        if number is not None and self.by_id[number].state.active:
            now_us = self._starter.clock.now_us()
            self.to_hold[number] = Hold(by, f"its run {run} was stopped", now_us)
            self.changed.set()

    def why_held(self, entry: ScheduleEntry) -> str:
        """Return by whom an entry or the whole schedule is held, and why; "": it is not."""
        if self.hold_of_all is not None:
            return f"the schedule is {self.hold_of_all}"
        hold = entry.state.hold or self.to_hold.get(entry.id)
        if hold is not None:
            return str(hold)
        return "held" if entry.id in self._stopped else ""


def _log_unwritten(writing: "asyncio.Future[bool]") -> None:
    if not writing.cancelled() and (error := writing.exception()) is not None:
        log.warning("the journal does not have the hold of the schedule yet: %s", error)
