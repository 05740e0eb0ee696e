"""The contract of journals (`m2pem.journal.base.Journal`), as tests to inherit.

    class TestMyJournal(JournalContract):
        @pytest.fixture
        def open_journal(self, tmp_path):
            return lambda: MyJournal(tmp_path / "journal")

Needs pytest-asyncio.
"""

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import ClassVar, TypeAlias

import pytest

from m2pem.boot_time import boot_time_s
from m2pem.engine.inputs import BehaviorReported, Continue, Input, PauseRun, StartRun, Tick
from m2pem.engine.records import (
    BehaviorProgressed,
    DataWritten,
    InputIgnored,
    Record,
    RunClaimed,
    RunEnded,
    RunOutcome,
    RunPaused,
    RunResumed,
    RunStarted,
)
from m2pem.errors import (
    FleetServedError,
    InternalError,
    JournalError,
    StaleEntryError,
    StaleEpochError,
)
from m2pem.journal.base import Entry, Journal, RunHeader, RunInfo
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.library import Source
from m2pem.mission.values import Value
from m2pem.scheduling.entry import (
    EntryChange,
    EntryState,
    EntryStatus,
    Hold,
    SchedulePlan,
    SettledTime,
    Settlement,
    When,
)
from m2pem.testing.contracts.contract import Contract, needs

HEADER = RunHeader(
    mission_name="vignette1.bpmn",
    mission="<définitions/>".encode(),
    process="PATROL",
    fleet=b"\x00\xff fleet",
    simulated=True,
    speed=2.5,
    created_us=1_767_225_600_000_001,
    library=(
        Source("lib/süd.bpmn", b"\x00\xff", (("call", "SEARCH", ""), ("import", "a.bpmn", "m"))),
        Source("b.bpmn", b""),
    ),
)

PLAN = SchedulePlan(
    "vignette1.bpmn",
    HEADER.mission,
    "PATROL",
    "north",
    1_767_225_600_000_001,
    When(cron="0 8 * * *", time_zone="Europe/Berlin"),
    HEADER.library,
    {"a": [1, 2.5, None, "ü"]},
    simulated=False,
    priority=-3,
    by="anna",
)

STARTED = SettledTime(9, 10, Settlement.STARTED)

_NOTIFIED_WITHIN_S = 30.0

ENDED = (RunStarted("PATROL", 5), RunEnded(RunOutcome.COMPLETED, ""))
"""Records of a run that has ended."""

OpenJournal: TypeAlias = Callable[[], Journal]


@asynccontextmanager
async def opened(open_journal: OpenJournal) -> AsyncIterator[Journal]:
    """Open a journal, and close it in the end."""
    journal = open_journal()
    try:
        yield journal
    finally:
        await journal.close()


def entry(
    run: str, seq: int, *records: Record, given: Input | None = None, epoch: int = 1
) -> Entry:
    """An entry with these records, else with one `InputIgnored` that says its number."""
    some = records or (InputIgnored(f"nr {seq}"),)
    at_us = HEADER.created_us + seq
    return Entry(run, epoch, seq, at_us, seq * 10, Tick() if given is None else given, some)


async def written(journal: Journal, run: str, after_seq: int = 0) -> list[Entry]:
    """Return all entries that the journal has of a run."""
    return [found async for found in journal.read(run, after_seq)]


async def info(journal: Journal, run: str) -> RunInfo:
    """Return the information of `runs` about one run."""
    (found,) = [some for some in await journal.runs() if some.run == run]
    return found


async def outcomes(*calls: Awaitable[None]) -> Sequence[BaseException | None]:
    """Return what each of several concurrent calls raised."""
    return await asyncio.gather(*calls, return_exceptions=True)


@pytest.mark.asyncio
class JournalContract(Contract):
    """The contract of a journal: override the fixture `open_journal`."""

    m2pem_contract: ClassVar[str] = "JournalContract"
    subjects: ClassVar[Mapping[str, str]] = {
        "durability": "a journal that is opened again, or twice, has what was written",
        "notification": "a journal is notified of what other executives change",
    }

    @pytest.fixture
    def open_journal(self) -> OpenJournal:
        """Opens a journal; each call on the same storage, which is empty at first."""
        raise NotImplementedError("override this fixture")

    # --- who serves a fleet ---------------------------------------------------------------------

    async def test_an_executive_serves_a_fleet_until_it_leaves_it(
        self, open_journal: OpenJournal
    ) -> None:
        """It is named by its process; to ask again changes nothing, and to leave twice neither."""
        page = "https://gcs1:8700/"
        async with opened(open_journal) as journal:
            assert await journal.fleet_server("north", ["ugv2"]) is None
            for _ in range(2):
                await journal.serve_fleet("north", ["ugv1", "ugv2"], page=page)
                server = await journal.fleet_server("north", ["ugv2"])
                assert server is not None
                assert (server.pid, server.page) == (os.getpid(), page)
                if journal.lease_s is None:
                    assert server.left_s is None
                else:
                    assert server.left_s is not None
                    assert 0 < server.left_s <= journal.lease_s
            assert await journal.fleet_server("north 2", ["ugv2"]) is None
            for _ in range(2):
                await journal.leave_fleet("north")
                assert await journal.fleet_server("north", ["ugv2"]) is None

    @needs("durability")
    async def test_of_two_executives_on_a_journal_one_serves_a_fleet(
        self, open_journal: OpenJournal
    ) -> None:
        """The other may serve another one, and this one when the first has left it or is closed."""
        async with opened(open_journal) as second:
            async with opened(open_journal) as first:
                await first.serve_fleet("north", ["ugv1", "ugv2"])
                with pytest.raises(FleetServedError, match=str(os.getpid())):
                    await second.serve_fleet("north", ["ugv1", "ugv2"])
                server = await second.fleet_server("north", ["ugv2"])
                assert server is not None
                assert server.pid == os.getpid()
                await second.serve_fleet("south", ["ugv1", "ugv2"])
                await second.serve_fleet("north", ["ugv3"])
                with pytest.raises(FleetServedError):
                    await second.serve_fleet("north", ["ugv4", "ugv2"])
                assert await first.fleet_server("north", ["ugv4"]) is None
                await second.leave_fleet("north")  # the others are not this one's to leave
                with pytest.raises(FleetServedError):
                    await second.serve_fleet("north", ["ugv1", "ugv2"])
                await first.leave_fleet("north")
                await second.serve_fleet("north", ["ugv1", "ugv2"])
                with pytest.raises(FleetServedError):
                    await first.serve_fleet("north", ["ugv1", "ugv2"])
                await second.leave_fleet("north")
                await first.serve_fleet("north", ["ugv1", "ugv2"])
            await second.serve_fleet("north", ["ugv1", "ugv2"])

    # --- the schedule ---------------------------------------------------------------------------

    async def test_an_entry_of_the_schedule_comes_back_as_it_was(
        self, open_journal: OpenJournal
    ) -> None:
        """Also after the journal was closed, where it is durable; ids are given in their order."""
        async with opened(open_journal) as journal:
            first = await journal.schedule(PLAN, EntryState(5))
            second = await journal.schedule(PLAN, EntryState(6))
            assert (first.id, second.id) == ("s1", "s2")
            assert await journal.entries() == [first, second]
            changed = EntryState(7, hold=Hold("anna", "rain", 8), revision=1)
            await journal.change_entry(EntryChange("s1", changed))
            assert [each.state for each in await journal.entries()] == [changed, EntryState(6)]

    async def test_a_run_and_its_entry_are_written_together_or_not_at_all(
        self, open_journal: OpenJournal
    ) -> None:
        """So that no time of an entry starts two runs."""
        async with opened(open_journal) as journal:
            await journal.schedule(PLAN, EntryState(5))
            started = EntryState(9, times=(STARTED,), revision=1)
            run = await journal.create(HEADER, EntryChange("s1", started))
            (entry,) = await journal.entries()
            assert (entry.state.run, entry.state.times[-1].run) == (run, run)
            with pytest.raises(StaleEntryError):
                await journal.create(HEADER, EntryChange("s1", started))
            with pytest.raises(JournalError):
                await journal.create(HEADER, EntryChange("s2", started))
            assert [found.run for found in await journal.runs()] == [run]
            assert await journal.entries() == [entry]

    async def test_of_two_changes_at_once_the_second_is_refused(
        self, open_journal: OpenJournal
    ) -> None:
        """It would undo the first one."""
        async with opened(open_journal) as journal:
            await journal.schedule(PLAN, EntryState(5))
            changes = [
                journal.change_entry(EntryChange("s1", EntryState(number, revision=1)))
                for number in (6, 7)
            ]
            failed = [type(each) for each in await outcomes(*changes) if each is not None]
            assert failed == [StaleEntryError]
            assert (await journal.entries())[0].state.settled_us in (6, 7)

    async def test_a_run_that_never_began_is_deleted_with_the_start_of_its_entry(
        self, open_journal: OpenJournal
    ) -> None:
        """One that has begun stays, and so does the state of the entry."""
        async with opened(open_journal) as journal:
            await journal.schedule(PLAN, EntryState(5))
            started = EntryChange("s1", EntryState(9, times=(STARTED,), revision=1))
            run = await journal.create(HEADER, started)
            back = EntryChange("s1", EntryState(5, revision=2))
            with pytest.raises(JournalError, match="driven"):
                await journal.change_entry(back, deletes=run)
            await journal.release(run)
            await journal.change_entry(back, deletes=run)
            assert await journal.runs() == []
            assert [each.run for each in await journal.deletions()] == [run]
            again = EntryChange("s1", EntryState(9, times=(STARTED,), revision=3))
            begun = await journal.create(HEADER, again)
            await journal.append([entry(begun, 1)])
            await journal.release(begun)
            with pytest.raises(JournalError, match="has begun"):
                await journal.change_entry(
                    EntryChange("s1", EntryState(5, revision=4)), deletes=begun
                )
            assert (await journal.entries())[0].state.run == begun

    async def test_only_entries_that_are_over_are_removed(self, open_journal: OpenJournal) -> None:
        """And their ids are not given again."""
        async with opened(open_journal) as journal:
            for _ in range(2):
                await journal.schedule(PLAN, EntryState(5))
            cancelled = EntryState(5, status=EntryStatus.CANCELLED, revision=1)
            await journal.change_entry(EntryChange("s2", cancelled))
            with pytest.raises(JournalError, match="may still start"):
                await journal.remove_entries(["s2", "s1"])
            await journal.remove_entries(["s2"])
            assert [each.id for each in await journal.entries()] == ["s1"]
            assert (await journal.schedule(PLAN, EntryState(5))).id == "s3"

    async def test_a_change_of_the_schedule_shows_in_its_revisions(
        self, open_journal: OpenJournal
    ) -> None:
        """Each entry that is added, changed, has started a run, or is removed."""
        async with opened(open_journal) as journal:
            assert await journal.schedule_revisions() == {}
            await journal.schedule(PLAN, EntryState(5))
            await journal.schedule(PLAN, EntryState(6))
            assert await journal.schedule_revisions() == {"s1": 0, "s2": 0}
            await journal.create(
                HEADER, EntryChange("s1", EntryState(9, times=(STARTED,), revision=1))
            )
            assert await journal.schedule_revisions() == {"s1": 1, "s2": 0}
            cancelled = EntryState(6, status=EntryStatus.CANCELLED, revision=1)
            await journal.change_entry(EntryChange("s2", cancelled))
            assert await journal.schedule_revisions() == {"s1": 1, "s2": 1}
            await journal.remove_entries(["s2"])
            assert await journal.schedule_revisions() == {"s1": 1}

    @needs("durability", "notification")
    async def test_a_change_by_another_executive_is_notified(
        self, open_journal: OpenJournal
    ) -> None:
        """Of the schedule, of its hold, and of who serves a fleet. What runs do is not."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            seen = await asyncio.wait_for(one.changed(0), _NOTIFIED_WITHIN_S)
            cancelled = EntryState(5, status=EntryStatus.CANCELLED, revision=1)
            for change in (
                lambda: two.schedule(PLAN, EntryState(5)),
                lambda: two.change_entry(EntryChange("s1", cancelled)),
                lambda: two.remove_entries(["s1"]),
                lambda: two.hold_schedule("north", Hold("anna", "rain", 8)),
                lambda: two.hold_schedule("north", None),
                lambda: two.serve_fleet("north", ["ugv1"]),
                lambda: two.leave_fleet("north"),
            ):
                waiting = asyncio.ensure_future(one.changed(seen))
                await change()
                before, seen = seen, await asyncio.wait_for(waiting, _NOTIFIED_WITHIN_S)
                assert seen > before

    async def test_a_schedule_is_held_for_each_fleet(self, open_journal: OpenJournal) -> None:
        """Until it is released."""
        async with opened(open_journal) as journal:
            await journal.hold_schedule("north", Hold("anna", "rain", 8))
            assert await journal.schedule_hold("north") == Hold("anna", "rain", 8)
            assert await journal.schedule_hold("south") is None
            await journal.hold_schedule("north", None)
            assert await journal.schedule_hold("north") is None

    async def test_what_is_held_starts_no_run(self, open_journal: OpenJournal) -> None:
        """Whoever holds it; and what another fleet holds does not matter."""
        async with opened(open_journal) as journal:
            await journal.schedule(PLAN, EntryState(5))
            started = EntryChange("s1", EntryState(9, times=(STARTED,), revision=1))
            await journal.hold_schedule(PLAN.fleet, Hold("anna", "rain", 8))
            with pytest.raises(StaleEntryError, match="s1 starts nothing: the schedule is held"):
                await journal.create(HEADER, started)
            assert await journal.runs() == []
            await journal.hold_schedule(PLAN.fleet, None)
            await journal.hold_schedule("another", Hold("anna", "rain", 8))
            assert await journal.create(HEADER, started) == "r1"

    # --- runs -----------------------------------------------------------------------------------

    async def test_runs_are_named_in_order(self, open_journal: OpenJournal) -> None:
        """Runs are named r1, r2, ... in their order."""
        async with opened(open_journal) as journal:
            assert [await journal.create(HEADER) for _ in range(3)] == ["r1", "r2", "r3"]
            assert [found.run for found in await journal.runs()] == ["r1", "r2", "r3"]

    async def test_a_new_run_is_driven_and_has_its_header(self, open_journal: OpenJournal) -> None:
        """Byte for byte: it is what the run is rebuilt from."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            assert await journal.runs() == [
                RunInfo(run, HEADER, 1, 0, started_us=HEADER.created_us, driven=True)
            ]
            assert await written(journal, run) == []

    async def test_an_unknown_run_is_refused_by_name(self, open_journal: OpenJournal) -> None:
        """By every method, and whether or not the name looks like one."""
        async with opened(open_journal) as journal:
            await journal.create(HEADER)
            for run in ("r2", "r0", "r01", "1", "", "r", "r-1", "R1", "r1 ", "r" + "9" * 30):
                for asked in (
                    journal.claim(run),
                    written(journal, run),
                    journal.append([entry(run, 1)]),
                ):
                    with pytest.raises(JournalError) as refused:
                        await asked
                    assert repr(run) in str(refused.value)

    async def test_a_line_follows_the_run(self, open_journal: OpenJournal) -> None:
        """Started, paused, going on and ended, without reading records."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1, RunStarted("PATROL", 77), InputIgnored("x"))])
            assert (await info(journal, run)).started_us == 77
            assert (await info(journal, run)).last_seq == 2
            await journal.append([entry(run, 3, RunPaused(5), given=PauseRun())])
            assert (await info(journal, run)).paused
            await journal.append([entry(run, 4, RunResumed(6))])
            assert not (await info(journal, run)).paused
            assert (await info(journal, run)).outcome is None
            await journal.append([entry(run, 5, RunPaused(7))])
            await journal.append([entry(run, 6, RunEnded(RunOutcome.STOPPED, "by the operator"))])
            ended = await info(journal, run)
            assert (ended.outcome, ended.detail) == (RunOutcome.STOPPED, "by the operator")
            assert (ended.ended_us, ended.last_seq) == (HEADER.created_us + 6, 6)
            assert not ended.paused
            await journal.append(
                [entry(run, 7, BehaviorProgressed("b1", 1, BehaviorState.RUNNING))]
            )
            assert (await info(journal, run)).ended_us == HEADER.created_us + 6

    # --- entries --------------------------------------------------------------------------------

    async def test_entries_come_back_as_they_were(self, open_journal: OpenJournal) -> None:
        """Equal objects, whatever JSON can say."""
        data: dict[str, Value] = {
            'naïve ✓ \x00"\\\n🛰': [1, 1.0, -0.0, True, None, {"": [-(2**63), 2**63 - 1]}]
        }
        some = [
            entry("r1", 1, RunStarted("PATROL", 1), given=StartRun("PATROL", data, by="op")),
            entry("r1", 2, DataWritten(1, "P", "E", 2, "k", 5e-324, 1), InputIgnored("")),
            entry(
                "r1",
                4,
                given=BehaviorReported("b1", 1, BehaviorState.RUNNING, native_ref="null"),
            ),
        ]
        async with opened(open_journal) as journal:
            await journal.create(HEADER)
            for one in some:
                await journal.append([one])
            assert repr(await written(journal, "r1")) == repr(some)

    async def test_reading_starts_after_a_record(self, open_journal: OpenJournal) -> None:
        """With the entry whose first record comes next."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1, InputIgnored("1"), InputIgnored("2"))])
            await journal.append([entry(run, 3), entry(run, 4)])
            for after_seq, expected in {0: [1, 3, 4], 1: [3, 4], 2: [3, 4], 3: [4], 9: []}.items():
                assert [e.seq for e in await written(journal, run, after_seq)] == expected

    async def test_a_long_run_is_read_in_order(self, open_journal: OpenJournal) -> None:
        """Beyond any batch that a journal may read in."""
        async with opened(open_journal) as journal:
            run, other = await journal.create(HEADER), await journal.create(HEADER)
            some = [entry(run, seq) for seq in range(1, 2501)]
            await journal.append(some)
            await journal.append([entry(other, 1)])
            assert await written(journal, run) == some

    async def test_one_call_may_write_to_several_runs(self, open_journal: OpenJournal) -> None:
        """One call may write to several runs, and keeps them apart."""
        async with opened(open_journal) as journal:
            runs = [await journal.create(HEADER) for _ in range(3)]
            some = [entry(run, seq) for seq in (1, 2) for run in runs]
            await journal.append(some)
            for run in runs:
                assert await written(journal, run) == [e for e in some if e.run == run]

    async def test_calls_that_wait_together_are_all_written(
        self, open_journal: OpenJournal
    ) -> None:
        """Each in its own run, in order."""
        async with opened(open_journal) as journal:
            runs = [await journal.create(HEADER) for _ in range(20)]

            async def drive(run: str) -> None:
                for seq in range(1, 6):
                    await journal.append([entry(run, seq)])

            await asyncio.gather(*map(drive, runs))
            for run in runs:
                assert [found.seq for found in await written(journal, run)] == [1, 2, 3, 4, 5]

    async def test_a_check_writes_nothing(self, open_journal: OpenJournal) -> None:
        """It returns, whether a run is driven or not."""
        async with opened(open_journal) as journal:
            await journal.check()
            assert await journal.runs() == []
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1)])
            await journal.check()
            assert [each.last_seq for each in await journal.runs()] == [1]

    async def test_nothing_to_append_is_no_error(self, open_journal: OpenJournal) -> None:
        """An empty append writes nothing."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([])
            assert await written(journal, run) == []

    # --- what is refused ------------------------------------------------------------------------

    async def test_an_entry_that_does_not_follow_is_refused_whole(
        self, open_journal: OpenJournal
    ) -> None:
        """A gap, a number that is there already, no record: a bug of the caller."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1)])
            empty = Entry(run, 1, 3, 0, 0, Continue(), ())
            unclaimed = entry(run, 3, epoch=2)
            for bad in (entry(run, 1), entry(run, 2), entry(run, 4), empty, unclaimed):
                with pytest.raises(InternalError, match="r1"):
                    await journal.append([entry(run, 2), bad])
            assert [found.seq for found in await written(journal, run)] == [1]
            await journal.append([entry(run, 2)])
            assert (await info(journal, run)).last_seq == 2

    async def test_an_older_epoch_is_shut_out(self, open_journal: OpenJournal) -> None:
        """Nothing of its call is written, not even to runs that it may write to."""
        async with opened(open_journal) as journal:
            run, other = await journal.create(HEADER), await journal.create(HEADER)
            await journal.append([entry(run, 1)])
            await journal.release(run)
            assert await journal.claim(run) == 2
            with pytest.raises(StaleEpochError, match="r1"):
                await journal.append([entry(other, 1), entry(run, 2)])
            assert await written(journal, other) == []
            await journal.append([entry(run, 2, RunClaimed(2), epoch=2)])
            assert [found.epoch for found in await written(journal, run)] == [1, 2]

    async def test_a_claim_holds_until_another_executive_claims_the_run(
        self, open_journal: OpenJournal
    ) -> None:
        """`check_claim` says so without a record, to an executive that was stopped for a while."""
        async with opened(open_journal) as journal:
            run, other = await journal.create(HEADER), await journal.create(HEADER)
            await journal.check_claim(run, 1)
            await journal.release(run)
            assert await journal.claim(run) == 2
            with pytest.raises(StaleEpochError, match="epoch 2; this one has 1"):
                await journal.check_claim(run, 1)
            await journal.check_claim(run, 2)
            await journal.check_claim(other, 1)
            with pytest.raises(JournalError, match="r9"):
                await journal.check_claim("r9", 1)
            assert await written(journal, run) == []

    async def test_a_refused_call_does_not_touch_those_it_waits_with(
        self, open_journal: OpenJournal
    ) -> None:
        """The others of its group are written."""
        async with opened(open_journal) as journal:
            runs = [await journal.create(HEADER) for _ in range(4)]
            await journal.release(runs[1])
            await journal.claim(runs[1])
            seqs = (1, 1, 7, 1)
            calls = (journal.append([entry(run, seq)]) for run, seq in zip(runs, seqs, strict=True))
            raised = await outcomes(*calls)
            assert [type(error) for error in raised] == [
                type(None),
                StaleEpochError,
                InternalError,
                type(None),
            ]
            assert [len(await written(journal, run)) for run in runs] == [1, 0, 0, 1]

    # --- claims ---------------------------------------------------------------------------------

    async def test_a_driven_run_cannot_be_claimed(self, open_journal: OpenJournal) -> None:
        """The process that drives it is named, and nothing changes."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            with pytest.raises(JournalError, match=str(os.getpid())):
                await journal.claim(run)
            assert (await info(journal, run)).epoch == 1
            await journal.append([entry(run, 1)])

    async def test_a_released_run_can_be_claimed(self, open_journal: OpenJournal) -> None:
        """Its epoch rises by one, and it is driven again."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.release(run)
            await journal.release(run)
            assert not (await info(journal, run)).driven
            assert await journal.claim(run) == 2
            assert (await info(journal, run)).driven
            assert (await info(journal, run)).epoch == 2

    async def test_a_released_run_is_not_written_to(self, open_journal: OpenJournal) -> None:
        """Another may claim it at any moment."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.release(run)
            with pytest.raises(InternalError, match="r1"):
                await journal.append([entry(run, 1)])
            assert await written(journal, run) == []

    async def test_a_claim_lasts_as_long_as_the_journal_says(
        self, open_journal: OpenJournal
    ) -> None:
        """Until the end of a lease that it names, which is renewed; else as long as the process."""
        async with opened(open_journal) as journal:
            assert journal.owned_until_s is None
            before_s = boot_time_s()
            run = await journal.create(HEADER)
            until_s = journal.owned_until_s
            if journal.lease_s is None:
                assert until_s is None
            else:
                assert until_s is not None
                assert before_s < until_s <= boot_time_s() + journal.lease_s
            await journal.release(run)
            assert journal.owned_until_s is None

    # --- cancelling and closing -----------------------------------------------------------------

    async def test_a_cancelled_append_is_whole_or_not_there(
        self, open_journal: OpenJournal
    ) -> None:
        """And the journal goes on."""
        async with opened(open_journal) as journal:
            run, other = await journal.create(HEADER), await journal.create(HEADER)
            call = asyncio.ensure_future(journal.append([entry(run, 1), entry(run, 2)]))
            await asyncio.sleep(0)
            call.cancel()
            await asyncio.wait([call])
            await journal.append([entry(other, 1)])
            assert [found.seq for found in await written(journal, run)] in ([], [1, 2])
            assert (await info(journal, run)).last_seq == len(await written(journal, run))

    async def test_a_deleted_run_is_gone_and_its_id_is_not_given_again(
        self, open_journal: OpenJournal
    ) -> None:
        """Other runs are untouched, and the journal says who deleted it."""
        async with opened(open_journal) as journal:
            runs = [await journal.create(HEADER) for _ in range(2)]
            for run in runs:
                await journal.append([entry(run, 1, *ENDED)])
                await journal.release(run)
            kept = (await journal.runs())[0]
            await journal.delete(["r2"], by="ann")
            assert await journal.runs() == [kept]
            assert len(await written(journal, "r1")) == 1
            assert [(each.run, each.records, each.by) for each in await journal.deletions()] == [
                ("r2", 2, "ann")
            ]
            for asked in (
                journal.claim("r2"),
                written(journal, "r2"),
                journal.delete(["r2"], by="bob"),
            ):
                with pytest.raises(JournalError, match=r"r2 was deleted on .* UTC by ann"):
                    await asked
            assert await journal.create(HEADER) == "r3"

    async def test_a_run_that_is_driven_is_not_deleted(self, open_journal: OpenJournal) -> None:
        """Nor is any other run of the same call."""
        async with opened(open_journal) as journal:
            ended = await journal.create(HEADER)
            await journal.append([entry(ended, 1, *ENDED)])
            await journal.release(ended)
            driven = await journal.create(HEADER)
            with pytest.raises(JournalError, match=f"{driven} is not deleted: it is driven"):
                await journal.delete([ended, driven], by="ann", unended=True)
            assert [found.run for found in await journal.runs()] == [ended, driven]
            assert await journal.deletions() == []

    async def test_a_run_that_has_not_ended_is_deleted_only_on_purpose(
        self, open_journal: OpenJournal
    ) -> None:
        """With `unended`."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1)])
            await journal.release(run)
            with pytest.raises(JournalError, match=f"{run} is not deleted: it has not ended"):
                await journal.delete([run], by="ann")
            await journal.delete([run], by="ann", unended=True)
            assert await journal.runs() == []

    async def test_a_closed_journal_says_so(self, open_journal: OpenJournal) -> None:
        """Whatever is asked of it; closing it again does nothing."""
        journal = open_journal()
        run = await journal.create(HEADER)
        await journal.close()
        await journal.close()
        for asked in (
            journal.create(HEADER),
            journal.claim(run),
            journal.release(run),
            journal.append([entry(run, 1)]),
            journal.check(),
            written(journal, run),
            journal.runs(),
            journal.delete([run], by="ann"),
            journal.deletions(),
        ):
            with pytest.raises(JournalError, match="closed"):
                await asked

    async def test_closing_finishes_what_is_being_written(self, open_journal: OpenJournal) -> None:
        """Calls made before are answered, and durable."""
        journal = open_journal()
        run = await journal.create(HEADER)
        calls = [asyncio.ensure_future(journal.append([entry(run, seq)])) for seq in range(1, 51)]
        await asyncio.sleep(0)
        await journal.close()
        assert await outcomes(*calls) == [None] * 50
        if "durability" not in self.unsupported:
            async with opened(open_journal) as again:
                assert len(await written(again, run)) == 50

    # --- opening again --------------------------------------------------------------------------

    @needs("durability")
    async def test_what_was_written_is_there_when_opened_again(
        self, open_journal: OpenJournal
    ) -> None:
        """Not driven; claimed with the next epoch; names go on."""
        async with opened(open_journal) as journal:
            run = await journal.create(HEADER)
            await journal.append([entry(run, 1, RunStarted("PATROL", 5), RunPaused(6))])
            before = await info(journal, run)
            entries = await written(journal, run)
        async with opened(open_journal) as journal:
            assert await journal.runs() == [
                RunInfo(run, HEADER, 1, 2, started_us=5, driven=False, paused=True)
            ]
            assert before.driven
            assert await written(journal, run) == entries
            assert await journal.claim(run) == 2
            await journal.append([entry(run, 3, epoch=2)])
            assert await journal.create(HEADER) == "r2"

    @needs("durability")
    async def test_each_of_two_journals_sees_what_the_other_does_with_the_schedule(
        self, open_journal: OpenJournal
    ) -> None:
        """Entries that it adds, changes and removes, and holds of all."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            assert await two.schedule_revisions() == {}
            added = await one.schedule(PLAN, EntryState(5))
            assert await two.schedule_revisions() == {"s1": 0}
            assert await two.entries() == [added]
            cancelled = EntryState(6, status=EntryStatus.CANCELLED, revision=1)
            await one.change_entry(EntryChange("s1", cancelled))
            assert await two.schedule_revisions() == {"s1": 1}
            await two.remove_entries(["s1"])
            assert await one.schedule_revisions() == {}
            await one.hold_schedule(PLAN.fleet, Hold("anna", "rain", 8))
            assert await two.schedule_hold(PLAN.fleet) == Hold("anna", "rain", 8)

    @needs("durability")
    async def test_two_journals_on_one_storage_share_it(self, open_journal: OpenJournal) -> None:
        """One sees what the other wrote; only one drives a run; a stale one is shut out."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            run = await one.create(HEADER)
            assert await two.create(HEADER) == "r2"
            await one.append([entry(run, 1)])
            assert await written(two, run) == [entry(run, 1)]
            assert (await info(two, run)).driven
            with pytest.raises(JournalError, match=str(os.getpid())):
                await two.claim(run)
            await one.release(run)
            assert not (await info(two, run)).driven
            assert await two.claim(run) == 2
            await two.append([entry(run, 2, epoch=2)])
            with pytest.raises(StaleEpochError):
                await one.append([entry(run, 2)])
            with pytest.raises(JournalError, match=str(os.getpid())):
                await one.claim(run)
            await two.release(run)
            assert await one.claim(run) == 3
            await one.append([entry(run, 3, epoch=3)])
            assert [found.epoch for found in await written(two, run)] == [1, 2, 3]
