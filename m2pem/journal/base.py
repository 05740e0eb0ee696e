"""The journal: every input and record of every run, durable before anything is dispatched.

`JournalContract` checks every promise made here.
"""

from collections.abc import AsyncIterator, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol
from uuid import UUID

from m2pem.engine.inputs import Input, Revise
from m2pem.engine.records import MissionRevised, Record, RunOutcome
from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.fleet_server import FleetServer
from m2pem.mission.library import Source
from m2pem.scheduling.entry import EntryChange, EntryState, Hold, ScheduleEntry, SchedulePlan
from m2pem.units import US_PER_S


@dataclass(frozen=True, slots=True)
class RunHeader:
    """What a run is rebuilt from: the mission and the fleet themselves.

    `mission_name` is the file's name, `mission` its bytes, `library` the other files
    that it uses; `fleet` is `m2pem.fleet.fleet.dump(fleet)`, or b"" without one.
    `simulated`: every arbiter is the simulated one, or was replaced by it. `speed`: of the clock
    against the wall clock. `created_us`: by the wall clock, also where the executive's runs ahead
    of it.
    """

    mission_name: str
    mission: bytes
    process: str
    fleet: bytes = b""
    simulated: bool = False
    speed: float = 1.0
    created_us: int = 0
    library: tuple[Source, ...] = ()

    def without_files(self) -> "RunHeader":
        """The same without the files of the mission and without the fleet."""
        return replace(self, mission=b"", fleet=b"", library=())


@dataclass(frozen=True, slots=True)
class Entry:
    """One input with the records that deciding it gave.

    `seq` is the number of the first record (from 1 in each run; an entry always has at least one
    record). `at_us`: when it was decided, microseconds since the Unix epoch. `t_us`: mission
    time of its records, microseconds from the start.
    """

    run: str
    epoch: int
    seq: int
    at_us: int
    t_us: int
    input: Input
    records: tuple[Record, ...]

    @property
    def revision(self) -> Revise | None:
        """The revision of the mission that its input is; None: it is none, or was refused."""
        if not isinstance(self.input, Revise):
            return None
        done = any(isinstance(record, MissionRevised) for record in self.records)
        return self.input if done else None


@dataclass(frozen=True, slots=True)
class Loss:
    """Entries that were reported as durable and are not in the journal any more.

    `acknowledged` is the last record that was reported as durable, `found` the last one that the
    journal has now (0: none; None: the run itself is gone). `resumable`: the run can be taken up.
    `salvaged`: the run comes from another journal, which may have had more of it.
    """

    acknowledged: int
    found: int | None
    resumable: bool = True
    salvaged: bool = False

    @property
    def records(self) -> int:
        """The least number of missing records; 0: the number is right, the content is not."""
        return max(0, self.acknowledged - (self.found or 0))

    def remedy(self, run: str) -> str:
        """Say what an operator should do about it."""
        if self.resumable:
            return f"`m2pem resume {run}` holds its vehicles and asks"
        return f"Look at its vehicles, then `m2pem runs --accept-loss {run}` lets new runs begin"

    def __str__(self) -> str:
        if self.salvaged and self.found is not None:
            return (
                f"the run was salvaged from another journal, which acknowledged record "
                f"{self.acknowledged}; its last one here is {self.found}"
            )
        if self.found is None:
            return (
                f"the journal has lost the run: it acknowledged {self.acknowledged} records of it"
            )
        if not self.records:
            return (
                f"the journal has lost what was acknowledged up to record {self.acknowledged}: "
                "something else is in its place"
            )
        return (
            f"the journal has lost records: it acknowledged record {self.acknowledged}, and its "
            f"last one now is {self.found}"
        )


@dataclass(frozen=True, slots=True)
class RunInfo:
    """What the journal knows of a run without reading its records.

    `driven`: a living executive holds the run's lock. `outcome` None: not ended. `loss`: what was
    acknowledged and is gone; of a run that is gone whole, the header is empty and the epoch 0.
    """

    run: str
    header: RunHeader
    epoch: int
    last_seq: int
    started_us: int
    driven: bool = False
    paused: bool = False
    outcome: RunOutcome | None = None
    detail: str = ""
    ended_us: int | None = None
    loss: Loss | None = None

    @property
    def gone(self) -> bool:
        """Whether the journal has lost the run whole: all fields are those of its mark."""
        return self.loss is not None and self.loss.found is None


@dataclass(frozen=True, slots=True)
class Deletion:
    """A run that was deleted on request: how many records it had, and who deleted it when.

    `deleted_us`: microseconds since the Unix epoch, by the wall clock.
    """

    run: str
    records: int
    deleted_us: int
    by: str

    def __str__(self) -> str:
        when = datetime.fromtimestamp(self.deleted_us / US_PER_S, UTC)
        return f"{self.run} was deleted on {when:%Y-%m-%d at %H:%M:%S} UTC by {self.by}"


class Journal(Protocol):
    """Opened by its constructor's `open` class method; one per executive."""

    @property
    def identity(self) -> UUID:
        """A unique id of this journal; the same each time that it is opened."""

    @property
    def file(self) -> Path | None:
        """The journal's path, for files beside it; None for a journal in memory.

        Of a journal in a database elsewhere it is a file of this host, which names the journal.
        """

    @property
    def lease_s(self) -> float | None:
        """How long runs stay this executive's while the journal cannot be reached, in seconds.

        None: as long as its process lives.
        """

    @property
    def owned_until_s(self) -> float | None:
        """Until when the runs that were claimed or created here surely are this executive's, by
        `m2pem.boot_time.boot_time_s`; it moves on as the lease is renewed.

        None: as long as its process lives, or no run was. When it is over, another executive may
        claim them, and `append` raises StaleEpochError until they are released.
        """

    def abandon(self, fleet: str) -> FleetServer | None:
        """Let an executive that stands by for a fleet of this name have all runs and vehicles in a
        moment: this process ends now. Return that executive; None: none stands by.

        Any thread may call it. It blocks, for as long as the database does.

        Raises:
            JournalError: the journal cannot say who stands by.
        """

    async def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str = "", page: str = ""
    ) -> None:
        """Let no other executive on this journal serve these vehicles and payloads in a fleet of
        this name, until `leave_fleet` or `close`, the end of its process or of its lease. Again:
        check that it is so still; what no executive serves is taken again. `digest`: of the fleet's
        content, and `page`: the address of this executive's web page, for `fleet_server`.

        Raises:
            FleetServedError: another executive serves one of them, and this one none; host, process
                and command are named.
            JournalError: the journal cannot say or note it.
        """

    async def leave_fleet(self, fleet: str) -> None:
        """Let another executive serve what is served here of a fleet."""

    async def fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        """Return which executive serves one of these in a fleet of this name; None: none does."""

    async def create(self, header: RunHeader, started: EntryChange | None = None) -> str:
        """Create a run, durable on return and claimed with epoch 1; the id is r1, r2, ...

        `started`: the new state of the entry of the schedule that starts it, whose last time gets
        the run's id. Both are written, or neither.

        Raises:
            StaleEntryError: the entry was changed since, or the schedule of its fleet is held;
                nothing is written.
            JournalError: it cannot be written, there is too little free space, or a loss is open.
        """

    async def claim(self, run: str) -> int:
        """Claim a run: its epoch rises by one and is returned; older epochs cannot append.

        Raises:
            JournalError: no such run, or a living executive holds it (its process is named).
        """

    async def check_claim(self, run: str, epoch: int) -> None:
        """Return if the claim of a run with this epoch holds; nothing is written.

        Raises:
            StaleEpochError: another executive has claimed the run since.
            JournalError: no such run, or the journal cannot say.
        """

    async def release(self, run: str) -> None:
        """Release a run, so that another executive may claim it."""

    async def append(self, entries: Sequence[Entry]) -> None:
        """Write entries; durable on return. Calls that wait at the same time share one commit.

        Raises:
            StaleEpochError: the run was claimed by another since; nothing of the call is written.
            JournalError: not written (disk full, ...); nothing of the call is written. Or the
                files were removed or replaced: the journal writes no more.
        """

    async def check(self) -> None:
        """Return if it can write now and runs may begin; nothing is written.

        Raises:
            JournalError: as `append` and `create` would, and why.
        """

    def read(self, run: str, after_seq: int = 0) -> AsyncIterator[Entry]:
        """Yield the entries whose first record comes after `after_seq`, in order, in constant
        memory.

        Raises:
            JournalError: no such run; or an entry is damaged or missing, by run and record.
        """

    async def revisions(self, run: str) -> Sequence[Entry]:
        """Return the entries of a run whose input is a revision of its mission, also one that was
        refused, in order. They are found without reading the others.

        Raises:
            JournalError: no such run, or one of them is damaged.
        """

    async def runs(self, *, files: bool = True) -> Sequence[RunInfo]:
        """Return every run, in order of its number.

        `files`: with the files of its mission and its fleet; without, they are empty in the
        headers, and ten thousand runs are read in a moment.
        """

    async def delete(self, runs: Sequence[str], *, by: str, unended: bool = False) -> None:
        """Delete runs with all that the journal has of them; their ids are not given again.

        `by`: who asks. `unended`: delete runs that have not ended, too, but never a driven one.

        Raises:
            JournalError: a run is unknown, driven, not ended, or has lost entries; then nothing is
                deleted.
        """

    async def deletions(self) -> Sequence[Deletion]:
        """Return the runs that were deleted, in order of their numbers."""

    # --- the schedule ---------------------------------------------------------------------------

    async def schedule(self, plan: SchedulePlan, state: EntryState) -> ScheduleEntry:
        """Add an entry to the schedule, durable on return; the id is s1, s2, ...

        Raises:
            JournalError: it cannot be written.
        """

    async def change_entry(self, change: EntryChange, *, deletes: str = "") -> None:
        """Write the new state of an entry; durable on return.

        `deletes`: a run that the entry started and that never began, which is deleted with it.

        Raises:
            StaleEntryError: the entry was changed since; nothing is written.
            JournalError: it cannot be written, or the run has begun, or is driven.
        """

    async def entries(self) -> Sequence[ScheduleEntry]:
        """Return every entry of the schedule, of all fleets, in order of its number."""

    async def schedule_revisions(self) -> Mapping[str, int]:
        """Return the revision of each entry of the schedule, by its id.

        It is asked each second, and after each change, for what other executives have added,
        changed or removed, so it must cost little.
        """

    async def changed(self, seen: int) -> int:
        """Return the number of changes of which this journal was notified, once it exceeds `seen`.

        A change is that of a schedule, of its hold, or of who serves a fleet, by another executive.
        With 0 it returns as soon as notifications arrive. None does while the database cannot be
        reached, so a follower looks from time to time, too. Where nothing notifies of changes, it
        does not return.
        """

    async def remove_entries(self, entries: Sequence[str]) -> None:
        """Remove entries that can start nothing any more; their ids are not given again.

        Raises:
            JournalError: one is active, or there is none of that id; nothing is removed.
        """

    async def hold_schedule(self, fleet: str, hold: Hold | None) -> None:
        """Note that the whole schedule of a fleet is held; None: that it is not any more.

        Raises:
            JournalError: it cannot be written.
        """

    async def schedule_hold(self, fleet: str) -> Hold | None:
        """Return who holds the whole schedule of a fleet, and why; None: no operator."""

    # --- approvals ------------------------------------------------------------------------------

    async def approve(self, approval: Approval) -> None:
        """Note that a person has approved a content for a fleet; durable on return.

        Raises:
            JournalError: it cannot be written.
        """

    async def withdraw_approval(self, approval: Approval) -> None:
        """Note that a person's approval of a content does not count any more; durable on return.

        Raises:
            JournalError: it cannot be written.
        """

    async def approvals(self, fleet: str) -> Sequence[Approval]:
        """Return the approvals for a fleet, the oldest first."""

    async def note_edit(self, edit: Edit) -> None:
        """Note who has made a file what it is; durable on return. The first one counts.

        Raises:
            JournalError: it cannot be written.
        """

    async def edits(self, digests: Collection[str]) -> Mapping[str, Edit]:
        """Return who has edited these files, by their hashes, as far as it is known."""

    # --- alerts ---------------------------------------------------------------------------------

    async def write_alerts(
        self, fleet: str, alerts: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        """Write alerts of a fleet by their numbers, new ones or in place of those of the same
        number; None: remove it. Durable on return.

        `last`: the greatest number that the fleet must have before, 0 for none; None: any. Of two
        processes that have read the same alerts, one writes, and the other is refused.

        Raises:
            StaleAlertsError: the greatest number is another one; nothing was written.
            JournalError: they cannot be written.
        """

    async def alerts(self, fleet: str) -> Mapping[int, str]:
        """Return the alerts of a fleet by their numbers, which rise, as they were written."""

    # --- drawings -------------------------------------------------------------------------------

    async def write_drawings(
        self, fleet: str, drawings: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        """Write versions of routes, areas and points that operators have handed over, by their
        numbers; None: remove it. Durable on return.

        `last`: the greatest number that the fleet must have before, 0 for none; None: any. Of two
        processes that have read the same versions, one writes, and the other is refused.

        Raises:
            StaleDrawingsError: the greatest number is another one; nothing was written.
            JournalError: they cannot be written.
        """

    async def drawings(self, fleet: str) -> Mapping[int, str]:
        """Return the versions of drawings of a fleet by their numbers, which rise, as they were
        written."""

    async def close(self) -> None:
        """Finish what is being written, and release all runs."""
