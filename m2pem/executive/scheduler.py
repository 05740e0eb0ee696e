"""The scheduler: starts missions at times, after runs, on conditions, or when vehicles are free.

The laws, in their order:

1. No time of an entry starts two runs. A run and the mark that its time has started it are written
   to the journal together, or neither is.
2. No time is lost unsaid. Each ends as started, missed or refused, in the journal and as an alert.
3. What is held does not start. A hold acts at once, before the journal has it; STOP of all runs is
   one. It is looked at again between the journal's commit and a run's first input.
4. `check` has the last word: a mission is checked when it is scheduled, and before each start.
5. Operators are warned before each start, and can cancel it.

When an entry is due says `m2pem.scheduling`; what its start waits for, `scheduled_start`; what
operators do with entries, `schedule_entries`.
"""

import asyncio
import logging
import time
from collections.abc import Iterable

import msgspec

from m2pem.api.clock import SystemClock
from m2pem.api.runs import NOT_STARTED, STARTS_SOON, RunId
from m2pem.api.schedule import time_in
from m2pem.errors import (
    BusyError,
    JournalError,
    M2pemError,
    NotApprovedError,
    OperatorError,
    StaleEntryError,
)
from m2pem.executive.run_starter import NotBegunError
from m2pem.executive.schedule_entries import ScheduleEntries
from m2pem.executive.scheduled_runs import ScheduledRuns
from m2pem.executive.scheduled_start import (
    ASK_AGAIN_S,
    LOOK_AGAIN_S,
    STARTING,
    Look,
    StartConditions,
    Wait,
)
from m2pem.executive.supervisor import LeftToOthersError
from m2pem.fleet.allocation import resources_of_mission
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.scheduling import times
from m2pem.scheduling.entry import (
    Concurrency,
    EntryChange,
    EntryId,
    Hold,
    ScheduleEntry,
    SettledTime,
    Settlement,
)
from m2pem.scheduling.times import Due
from m2pem.units import US_PER_S

log = logging.getLogger("m2pem.schedule")

LONGEST_SLEEP_S = 600.0

CLOCKS_APART_S = 5.0

FOLLOW_S = 1.0
"""Between two looks at what other executives on the journal have done with the schedule, if it
notifies of no change."""


def _first(times_us: Iterable[int | None]) -> int | None:
    return min((each for each in times_us if each is not None), default=None)


class Scheduler:
    """Starts the missions of a schedule when they are due, or when an operator says so."""

    def __init__(self, starter: ScheduledRuns, entries: ScheduleEntries) -> None:
        self._starter = starter
        self._entries = entries
        self._conditions = StartConditions(starter, entries.by_id)
        self._clocks_apart = False
        self._changes = 0
        """Of other executives on the journal, as the journal counts them."""

    async def serve(self) -> None:
        """Start what is due, for ever. The entries are loaded before."""
        if self._entries.hold_of_all is not None and self._entries.active():
            self._entries.say_held()
        try:
            while True:
                self._entries.changed.clear()
                async with self._entries.lock:
                    next_us = await self._look()
                await self._wait(next_us)
        finally:
            self._entries.served = False

    async def _wait(self, next_us: int | None) -> None:
        """Wait until that time, or until something has changed, here or at another executive."""
        clock, is_shared = self._starter.clock, self._starter.journal.file is not None
        while not self._entries.changed.is_set():
            now_us = clock.now_us()
            if next_us is not None and now_us >= next_us:
                return
            limits = [next_us, self._in(FOLLOW_S) if is_shared else None]
            await self._sleep_until(_first(limits))
            if is_shared and await self._has_changed_elsewhere():
                return

    async def _has_changed_elsewhere(self) -> bool:
        async with self._entries.lock:
            try:
                return await self._entries.refresh()
            except JournalError:
                return False  # looking at the schedule says why

    async def _sleep_until(self, next_us: int | None) -> None:
        if next_us is None:
            await self._entries.changed.wait()
            return
        clock = self._starter.clock
        latest_us = clock.now_us() + round(LONGEST_SLEEP_S * US_PER_S)
        sleeping = asyncio.ensure_future(clock.sleep_until(min(next_us, latest_us)))
        waking = asyncio.ensure_future(self._entries.changed.wait())
        notified = asyncio.ensure_future(self._starter.journal.changed(self._changes))
        try:
            await asyncio.wait((sleeping, waking, notified), return_when=asyncio.FIRST_COMPLETED)
            if notified.done():
                self._changes = notified.result()
        finally:
            for each in (sleeping, waking, notified):
                each.cancel()

    # --- what is due ----------------------------------------------------------------------------

    async def _look(self) -> int | None:
        """Start what can start now; returns when to look again."""
        try:
            await self._entries.refresh()
            await self._conditions.ask_journal(self._entries.active())
            await self._judge_runs()
        except JournalError as error:
            log.warning("the schedule cannot be read or written: %s", error)
            return self._in(ASK_AGAIN_S)
        self._compare_clocks()
        kept: dict[ResourceId, EntryId] = {}
        wakes: list[int] = []
        for number in [entry.id for entry in self._entries.in_order()]:
            entry = self._entries.by_id.get(number)
            if entry is None:  # another executive has removed it meanwhile
                continue
            try:
                again_us = await self._look_at(entry, kept)
            except StaleEntryError:
                await self._entries.refresh()
                again_us = self._starter.clock.now_us()
            except (JournalError, LeftToOthersError) as error:
                look = self._entries.looks[entry.id]
                if look.reason != str(error):
                    look.reason = str(error)
                    self._entries.say(
                        f"{entry.id} cannot start {entry.plan.title}: {error}", NOT_STARTED
                    )
                again_us = self._in(ASK_AGAIN_S)
            if again_us is not None:
                wakes.append(again_us)
        return min(wakes, default=None)

    def _compare_clocks(self) -> None:
        """Say once when the computer's clock was set: dates do not mean what people read."""
        clock = self._starter.clock
        if not isinstance(clock, SystemClock) or clock.speed != 1.0 or not self._entries.active():
            return
        apart_s = abs(time.time() - clock.now_us() / US_PER_S)
        if apart_s > CLOCKS_APART_S and not self._clocks_apart:
            self._entries.say(
                f"the computer's clock was set: it is {apart_s:.0f} s from that of the executive, "
                "by which the schedule goes; start the executive again",
                NOT_STARTED,
            )
        self._clocks_apart = apart_s > CLOCKS_APART_S

    async def _judge_runs(self) -> None:
        """Hold the entries whose run has failed or was stopped: what made it so may be there yet.

        Of an entry that starts nothing any more there is nothing to hold.
        """
        for number in [entry.id for entry in self._entries.active()]:
            entry = self._entries.by_id.get(number)
            if entry is None:  # another executive has removed it meanwhile
                continue
            hold = self._entries.to_hold.get(number)
            run, judged = entry.state.run, entry.state.judged_run
            if hold is None and run and run != judged:
                judged, outcome = run, self._conditions.outcome(run)
                if outcome in ("failed", "stopped"):
                    how = "has failed" if outcome == "failed" else "was stopped"
                    now_us = self._starter.clock.now_us()
                    hold = Hold("", f"its run {run} {how}", now_us)
                elif not outcome:
                    continue
            elif hold is None:
                continue
            fields: dict[str, object] = {"judged_run": run}
            if entry.state.hold is None and hold is not None:
                fields["hold"] = hold
            try:
                await self._entries.change(entry, **fields)
            except StaleEntryError:
                await self._entries.refresh()
                continue
            if "hold" in fields:
                self._entries.say(f"{entry.id} is {hold}; it starts nothing until it is released")
            self._entries.to_hold.pop(entry.id, None)

    def _in(self, seconds: float) -> int:
        return self._starter.clock.now_us() + round(seconds * US_PER_S)

    @property
    def _warning_us(self) -> int:
        return round(self._starter.fleet.start_warning_s * US_PER_S)

    async def _look_at(self, entry: ScheduleEntry, kept: dict[ResourceId, EntryId]) -> int | None:
        """Start an entry if it can start now; returns when to look again.

        `kept`: what entries before it wait for.
        """
        now_us = self._starter.clock.now_us()
        look = self._entries.looks[entry.id]
        entry, found = await self._settle_passed(entry, now_us)
        if not entry.state.active:
            return None
        if found.due_us is None:
            return self._before(entry, look, found, now_us)
        if look.resources is None and not self._entries.why_held(entry):
            loaded = await self._admitted(entry, found.due_us)
            if loaded is None:
                return None
            look.resources = resources_of_mission(loaded[0], self._starter.fleet)
        held = self._entries.why_held(entry)
        wait = Wait(held) if held else self._conditions.wait(entry, look, now_us, kept)
        if wait is None:
            wait = await self._ready(entry, look, found, now_us)
        if wait is None:
            entry = self._entries.by_id[entry.id]
            return now_us if entry.state.active else None
        if wait.never:
            await self._missed(entry, found.due_us, 1, owed=found.owed, ends=wait.reason)
            return None
        if wait.for_resources:
            for resource in look.resources or ():
                kept.setdefault(resource, entry.id)
        self._note(entry, look, wait)
        limits = [found.next_us, wait.again_us]
        if found.deadline_us is not None:
            limits.append(found.deadline_us + 1)
        return _first(limits)

    async def _settle_passed(self, entry: ScheduleEntry, now_us: int) -> tuple[ScheduleEntry, Due]:
        """Settle the times that are missed by now; returns what the entry is then, and its due
        time."""
        found = times.due(entry.plan, entry.state, now_us)
        overdue = found.deadline_us is not None and now_us > found.deadline_us
        if found.due_us is not None and (overdue or found.passed):
            due_us = found.due_us if overdue else found.passed_us
            ends = "its last moment has passed" if overdue and found.owed else ""
            number = found.passed + overdue
            entry = await self._missed(entry, due_us, number, owed=found.owed, ends=ends)
            if entry.state.active:
                found = times.due(entry.plan, entry.state, now_us)
        return entry, found

    def _before(self, entry: ScheduleEntry, look: Look, found: Due, now_us: int) -> int | None:
        """Warn operators of a time that comes; returns when to look again."""
        look.reason, look.true_since_us, look.starts_us = "", None, None
        if found.next_us is None:
            return None
        warn_us = found.next_us - self._warning_us
        if now_us < warn_us:
            return warn_us
        if look.warned_due_us != found.next_us and not self._entries.why_held(entry):
            look.warned_due_us, look.warned_us = found.next_us, now_us
            look.starts_us = found.next_us
            self._warn(entry, found.next_us)
        return found.next_us

    def _warn(self, entry: ScheduleEntry, starts_us: int) -> None:
        left_s = (starts_us - self._starter.clock.now_us()) / US_PER_S
        who = f"{entry.id}, scheduled by {entry.plan.by or 'an operator'}"
        self._entries.say(
            f"{entry.plan.title} starts in {left_s:.0f} s ({who}); "
            f"`m2pem schedule cancel {entry.id}` or hold keeps it from that",
            STARTS_SOON,
        )

    def _note(self, entry: ScheduleEntry, look: Look, wait: Wait) -> None:
        """Keep why an entry waits; tell operators when a start that they expect does not come."""
        if look.reason == wait.reason:
            return
        if look.starts_us is not None and not wait.reason.startswith(STARTING):
            look.starts_us = look.warned_due_us = None
            self._entries.say(
                f"{entry.id} does not start {entry.plan.title} yet: {wait.reason}",
                NOT_STARTED,
            )
        self._entries.note(entry.id, wait.reason)

    async def _missed(
        self, entry: ScheduleEntry, due_us: int, number: int, *, owed: bool, ends: str = ""
    ) -> ScheduleEntry:
        """Settle times that were missed, and tell operators. `owed`: it had been missed before, and
        the start that replaces it does not come any more."""
        look, plan = self._entries.looks[entry.id], entry.plan
        why = (
            ends or self._entries.why_held(entry) or look.reason or "it was not served at that time"
        )
        now_us = self._starter.clock.now_us()
        settled = SettledTime(due_us, now_us, Settlement.MISSED, text=why, times=number, owed=owed)
        changed = await self._entries.write(
            entry, times.settle(plan, entry.state, settled, ends=ends)
        )
        look.warned_due_us = look.starts_us = None
        at = time_in(due_us, plan.when.time_zone)
        least = "at least " if number >= times.COUNTED_TIMES - 1 else ""
        many = f"{least}{number} starts, the last at" if number > 1 else "the start at"
        then = "; it starts once as soon as it can" if changed.state.owed_us else ""
        self._entries.say(
            f"{entry.id} missed {many} {at} of {plan.title}: {why}{then}", NOT_STARTED
        )
        return changed

    # --- starting -------------------------------------------------------------------------------

    async def _ready(
        self, entry: ScheduleEntry, look: Look, found: Due, now_us: int
    ) -> Wait | None:
        """Warn operators, and start when the warning has been long enough."""
        assert found.due_us is not None
        if why := await self._starter.unapproved(entry.plan):
            return Wait(why, self._in(ASK_AGAIN_S))
        if look.warned_due_us != found.due_us:
            look.warned_due_us, look.warned_us = found.due_us, now_us
            look.starts_us = now_us + self._warning_us
            if self._warning_us:
                self._warn(entry, look.starts_us)
        starts_us = max(found.due_us, look.warned_us + self._warning_us)
        look.starts_us = starts_us
        if now_us < starts_us:
            return Wait(STARTING, starts_us, for_resources=True)
        return await self._start(entry, look, found, now_us)

    async def _start(
        self, entry: ScheduleEntry, look: Look, found: Due, now_us: int
    ) -> Wait | None:
        """Check the mission once more, and begin its run."""
        plan = entry.plan
        assert found.due_us is not None
        admitted = await self._admitted(entry, found.due_us)
        if admitted is None:
            return None
        loaded, process = admitted
        look.resources = resources_of_mission(loaded, self._starter.fleet)
        if why := await self._conditions.interrupted(look.resources):
            return Wait(why, self._in(ASK_AGAIN_S), for_resources=True)
        settled = SettledTime(found.due_us, now_us, Settlement.STARTED, owed=found.owed)
        by = f"{entry.id}, scheduled by {plan.by or 'an operator'}"
        try:
            await self._begin(entry, loaded, process, by, settled)
        except NotBegunError as error:
            return await self._not_begun(
                entry, self._started(entry, settled, error.run), str(error)
            )
        except BusyError as error:
            return Wait(str(error), self._in(LOOK_AGAIN_S), for_resources=True)
        except NotApprovedError as error:  # an approval was withdrawn just now
            return Wait(str(error), self._in(ASK_AGAIN_S))
        return None

    async def start(self, number: EntryId, by: str) -> RunId:
        """Start the mission of an entry now; the start counts as the time that has come, or for
        the only one that is to come. Times of cron that are to come stay.

        Raises:
            MissionError: `check` refuses it; the entry is as before.
            BusyError: its vehicles are not free.
            OperatorError: there is no such entry, it is over or held, its last run goes on, or a
                run that was interrupted may command its vehicles.
        """
        async with self._entries.lock:
            await self._entries.refresh()
            entry = self._entries.active_entry(number)
            if held := self._entries.why_held(entry):
                raise OperatorError(f"{number} is not started: {held}; release it first")
            now_us = self._starter.clock.now_us()
            entry, found = await self._settle_passed(entry, now_us)
            if not entry.state.active:
                raise OperatorError(f"{number} is {entry.state.status.value}")
            forbids = entry.plan.when.concurrency is Concurrency.FORBID
            if forbids and entry.state.run and self._conditions.outcome(entry.state.run) == "":
                raise OperatorError(f"{number} is not started: its run {entry.state.run} goes on")
            loaded, process = await asyncio.to_thread(self._starter.admitted, entry.plan)
            resources = resources_of_mission(loaded, self._starter.fleet)
            if why := await self._conditions.interrupted(resources):
                raise OperatorError(f"{number} is not started: {why}")
            extra = bool(entry.plan.when.cron) and found.due_us is None
            due_us = now_us if extra else found.due_us or found.next_us or now_us
            settled = SettledTime(due_us, now_us, Settlement.STARTED, owed=found.owed)
            who = f"{entry.id}, started by {by or 'an operator'}"
            try:
                run = await self._begin(entry, loaded, process, who, settled)
            except NotBegunError as error:
                await self._not_begun(entry, self._started(entry, settled, error.run), str(error))
                raise OperatorError(f"{number} is not started: {error}") from error
        self._entries.changed.set()
        return run

    async def _begin(
        self, entry: ScheduleEntry, loaded: Mission, process: str, by: str, settled: SettledTime
    ) -> RunId:
        """Begin a run of an entry, which settles a time of it.

        Raises:
            NotBegunError: it was created, and nothing of it has begun.
            M2pemError: nothing was written.
        """
        plan, look = entry.plan, self._entries.looks[entry.id]
        change = EntryChange(entry.id, times.settle(plan, entry.state, settled))
        run = await self._starter.begin_scheduled(
            loaded, process, plan, by, change, lambda: not self._entries.why_held(entry)
        )
        self._entries.add(msgspec.structs.replace(entry, state=change.with_run(run).state))
        look.reason, look.starts_us, look.warned_due_us = "", None, None
        look.true_since_us = None
        self._entries.say(f"{entry.id} has started {plan.title} as {run}")
        return run

    @staticmethod
    def _started(entry: ScheduleEntry, settled: SettledTime, run: RunId) -> EntryChange:
        state = times.settle(entry.plan, entry.state, settled)
        return EntryChange(entry.id, state).with_run(run)

    async def _not_begun(self, entry: ScheduleEntry, change: EntryChange, why: str) -> Wait | None:
        """Take a start back of which nothing has begun: its time counts again."""
        created = msgspec.structs.replace(entry, state=change.state)
        self._entries.by_id[entry.id] = created
        try:
            self._entries.by_id[entry.id] = await self._entries.take_back(created)
        except JournalError as error:
            self._entries.add(created)
            text = (
                f"{entry.id}: {created.state.run} was created and could not begin: {why}; {error}"
            )
            self._entries.say(f"{text}. When the executive is started again, its time counts again")
            return None
        return Wait(why, self._in(ASK_AGAIN_S))

    async def _admitted(self, entry: ScheduleEntry, due_us: int) -> tuple[Mission, str] | None:
        """Read and check the mission of an entry; None: it is refused, and the entry has failed.

        Raises:
            LeftToOthersError: it is refused, and another executive may start it.
        """
        try:
            return await asyncio.to_thread(self._starter.admitted, entry.plan)
        except M2pemError as error:
            if await asyncio.to_thread(self._starter.has_others):
                text = f"{error}\nAnother executive on the journal may start it"
                raise LeftToOthersError(text) from error
            await self._refused(entry, due_us, str(error))
            return None

    async def _refused(self, entry: ScheduleEntry, due_us: int, why: str) -> None:
        now_us = self._starter.clock.now_us()
        settled = SettledTime(due_us, now_us, Settlement.REFUSED, text=why)
        await self._entries.write(entry, times.settle(entry.plan, entry.state, settled))
        self._entries.say(f"{entry.id} failed, and starts nothing any more: {why}", NOT_STARTED)
