"""The journal in memory: for simulation, tests and missions that need no resume."""

import asyncio
import os
import time
from bisect import bisect_right
from collections import defaultdict
from collections.abc import AsyncIterator, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from uuid import UUID, uuid4

from m2pem.engine.inputs import Revise
from m2pem.errors import InternalError, JournalError, StaleEntryError
from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.base import Deletion, Entry, RunHeader, RunInfo
from m2pem.journal.codec import (
    Numbered,
    encode_part,
    run_id,
    run_number,
    unknown_entry,
    unknown_run,
)
from m2pem.journal.fleet_server import FleetServer, this_process
from m2pem.journal.position import RunPosition
from m2pem.scheduling.entry import (
    EntryChange,
    EntryState,
    Hold,
    ScheduleEntry,
    SchedulePlan,
    entry_id,
)

_BATCH_ENTRIES = 500


@dataclass(slots=True)
class _Run:
    header: RunHeader
    position: RunPosition
    driven: bool = True
    entries: list[Entry] = field(default_factory=list)
    dropped_seq: int = 0


class MemoryJournal:
    """A `Journal` until the process ends.

    `keep`: how many of a run's last entries are kept at least (at most twice as many are held), for
    long runs that are not read; None: all. It has no file, and no lease.
    """

    file: Path | None = None
    lease_s: float | None = None
    owned_until_s: float | None = None

    def __init__(self, keep: int | None = None) -> None:
        self._keep = keep
        self._identity = uuid4()
        self._runs: dict[int, _Run] = {}
        self._deletions: dict[int, Deletion] = {}
        self._last = 0
        self._entries: dict[str, ScheduleEntry] = {}
        self._holds: dict[str, Hold | None] = {}
        self._numbered: dict[tuple[Numbered, str], dict[int, str]] = defaultdict(dict)
        self._last_entry = 0
        self._approvals: dict[tuple[str, str, str], Approval] = {}
        self._edits: dict[str, Edit] = {}
        self._fleets: dict[str, dict[str, FleetServer]] = {}
        self._closed = False

    @property
    def identity(self) -> UUID:
        return self._identity

    def abandon(self, fleet: str) -> FleetServer | None:
        """See `Journal.abandon`: no other executive has this journal."""
        return None

    async def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str = "", page: str = ""
    ) -> None:
        """See `Journal.serve_fleet`: no other executive has this journal."""
        self._check_open()
        me = this_process(digest, page)
        self._fleets.setdefault(fleet, {}).update(dict.fromkeys(resources, me))

    async def leave_fleet(self, fleet: str) -> None:
        self._check_open()
        self._fleets.pop(fleet, None)

    async def fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        self._check_open()
        served = self._fleets.get(fleet, {})
        return next((served[each] for each in resources if each in served), None)

    async def create(self, header: RunHeader, started: EntryChange | None = None) -> str:
        self._check_open()
        if started is not None:
            self._replaceable(started)
            if self._holds.get(self._entries[started.entry].plan.fleet) is not None:
                raise StaleEntryError(f"{started.entry} starts nothing: the schedule is held")
        position = RunPosition(epoch=1, pid=os.getpid(), started_us=header.created_us)
        self._last += 1
        self._runs[self._last] = _Run(header, position)
        run = run_id(self._last)
        if started is not None:
            self._replace(started.with_run(run))
        return run

    async def claim(self, run: str) -> int:
        found = self._find(run)
        if found.driven:
            raise JournalError(f"run {run} is already driven, by this process ({os.getpid()})")
        found.driven = True
        found.position = found.position.claimed(os.getpid())
        return found.position.epoch

    async def check_claim(self, run: str, epoch: int) -> None:
        self._check_open()
        self._find(run).position.check_claim(run, epoch)

    async def release(self, run: str) -> None:
        self._check_open()
        if (found := self._runs.get(run_number(run))) is not None:
            found.driven = False

    async def append(self, entries: Sequence[Entry]) -> None:
        self._check_open()
        changed: dict[str, RunPosition] = {}
        for entry in entries:
            before = changed.get(entry.run) or self._find(entry.run).position
            changed[entry.run] = before.after(entry)
        for run in changed:
            if not self._find(run).driven:
                raise InternalError(f"{run}: written to without having been claimed")
        for run, position in changed.items():
            self._find(run).position = position
        for entry in entries:
            self._keep_entry(self._find(entry.run), entry)

    async def check(self) -> None:
        self._check_open()

    def _keep_entry(self, run: _Run, entry: Entry) -> None:
        run.entries.append(entry)
        # At twice as many, so that dropping costs nothing per entry.
        if self._keep is not None and len(run.entries) > 2 * self._keep:
            surplus = len(run.entries) - self._keep
            run.dropped_seq = run.entries[surplus - 1].seq
            del run.entries[:surplus]

    async def read(self, run: str, after_seq: int = 0) -> AsyncIterator[Entry]:
        """See `Journal.read`.

        Raises:
            JournalError: there is no such run, or `keep` has dropped some of these entries.
        """
        found = self._find(run)
        while batch := self._batch(found, run, after_seq):
            for entry in batch:
                yield entry
            after_seq = batch[-1].seq

    async def revisions(self, run: str) -> Sequence[Entry]:
        """See `Journal.revisions`; those that `keep` has dropped are not among them."""
        return [each for each in self._find(run).entries if isinstance(each.input, Revise)]

    def _batch(self, found: _Run, run: str, after_seq: int) -> Sequence[Entry]:
        if after_seq < found.dropped_seq:
            raise JournalError(
                f"run {run}: only what comes after record {found.dropped_seq} was kept "
                f"(the journal in memory keeps {self._keep} entries)"
            )
        first = bisect_right(found.entries, after_seq, key=attrgetter("seq"))
        return found.entries[first : first + _BATCH_ENTRIES]

    async def runs(self, *, files: bool = True) -> Sequence[RunInfo]:
        self._check_open()
        return [
            found.position.info(
                run_id(number),
                found.header if files else found.header.without_files(),
                found.driven,
            )
            for number, found in self._runs.items()
        ]

    async def delete(self, runs: Sequence[str], *, by: str, unended: bool = False) -> None:
        for run in runs:
            found = self._find(run)
            if found.driven:
                raise JournalError(f"{run} is not deleted: it is driven by this process")
            if found.position.outcome is None and not unended:
                raise JournalError(f"{run} is not deleted: it has not ended")
        now_us = time.time_ns() // 1000
        for run in dict.fromkeys(runs):
            number = run_number(run)
            records = self._runs.pop(number).position.last_seq
            self._deletions[number] = Deletion(run, records, now_us, by)

    async def deletions(self) -> Sequence[Deletion]:
        self._check_open()
        return [self._deletions[number] for number in sorted(self._deletions)]

    # --- the schedule ---------------------------------------------------------------------------

    async def schedule(self, plan: SchedulePlan, state: EntryState) -> ScheduleEntry:
        self._check_open()
        encode_part(plan)
        self._last_entry += 1
        entry = ScheduleEntry(entry_id(self._last_entry), plan, state)
        self._entries[entry.id] = entry
        return entry

    async def change_entry(self, change: EntryChange, *, deletes: str = "") -> None:
        self._check_open()
        self._replaceable(change)
        if deletes:
            if self._find(deletes).position.last_seq:
                raise JournalError(f"{deletes} is not deleted: it has begun")
            await self.delete([deletes], by=f"the schedule ({change.entry})", unended=True)
        self._replace(change)

    def _replaceable(self, change: EntryChange) -> None:
        found = self._entries.get(change.entry)
        if found is None:
            raise unknown_entry(change.entry)
        if found.state.revision != change.state.revision - 1:
            raise StaleEntryError(f"{change.entry} was changed by another executive")

    def _replace(self, change: EntryChange) -> None:
        before = self._entries[change.entry]
        self._entries[change.entry] = ScheduleEntry(before.id, before.plan, change.state)

    async def entries(self) -> Sequence[ScheduleEntry]:
        self._check_open()
        return list(self._entries.values())

    async def schedule_revisions(self) -> Mapping[str, int]:
        self._check_open()
        return {entry.id: entry.state.revision for entry in self._entries.values()}

    async def changed(self, seen: int) -> int:
        """See `Journal.changed`: no other executive has this journal."""
        never: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        return await never

    async def remove_entries(self, entries: Sequence[str]) -> None:
        self._check_open()
        for entry in entries:
            if entry not in self._entries:
                raise unknown_entry(entry)
            if self._entries[entry].state.active:
                raise JournalError(f"{entry} is not removed: it may still start a mission")
        for entry in entries:
            self._entries.pop(entry, None)

    async def hold_schedule(self, fleet: str, hold: Hold | None) -> None:
        self._check_open()
        self._holds[fleet] = hold

    async def schedule_hold(self, fleet: str) -> Hold | None:
        self._check_open()
        return self._holds.get(fleet)

    # --- approvals ------------------------------------------------------------------------------

    async def approve(self, approval: Approval) -> None:
        self._check_open()
        self._approvals[approval.fleet, approval.digest, approval.person] = approval

    async def withdraw_approval(self, approval: Approval) -> None:
        self._check_open()
        self._approvals.pop((approval.fleet, approval.digest, approval.person), None)

    async def approvals(self, fleet: str) -> Sequence[Approval]:
        self._check_open()
        found = [each for each in self._approvals.values() if each.fleet == fleet]
        return sorted(found, key=lambda each: each.at_us)

    async def note_edit(self, edit: Edit) -> None:
        self._check_open()
        self._edits.setdefault(edit.digest, edit)

    async def edits(self, digests: Collection[str]) -> Mapping[str, Edit]:
        self._check_open()
        return {each: self._edits[each] for each in digests if each in self._edits}

    async def write_alerts(
        self, fleet: str, alerts: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        self._write(Numbered.ALERTS, fleet, alerts, last)

    async def alerts(self, fleet: str) -> Mapping[int, str]:
        self._check_open()
        return dict(sorted(self._numbered[Numbered.ALERTS, fleet].items()))

    async def write_drawings(
        self, fleet: str, drawings: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        self._write(Numbered.DRAWINGS, fleet, drawings, last)

    async def drawings(self, fleet: str) -> Mapping[int, str]:
        self._check_open()
        return dict(sorted(self._numbered[Numbered.DRAWINGS, fleet].items()))

    def _write(
        self, kind: Numbered, fleet: str, texts: Mapping[int, str | None], last: int | None
    ) -> None:
        """Write texts by their numbers; None: remove it."""
        self._check_open()
        kept = self._numbered[kind, fleet]
        if last is not None:
            kind.refuse_stale(fleet, max(kept, default=0), last)
        for number, text in texts.items():
            if text is None:
                kept.pop(number, None)
            else:
                kept[number] = text

    async def close(self) -> None:
        self._closed = True
        for found in self._runs.values():
            found.driven = False

    def _find(self, run: str) -> _Run:
        self._check_open()
        number = run_number(run)
        if number in self._deletions:
            raise JournalError(str(self._deletions[number]))
        if number not in self._runs:
            raise unknown_run(run)
        return self._runs[number]

    def _check_open(self) -> None:
        if self._closed:
            raise JournalError("the journal has been closed")
