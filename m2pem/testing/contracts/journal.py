"""The contract of journals (`m2pem.journal.base.Journal`), as tests to inherit.

    class TestMyJournal(JournalContract):
        @pytest.fixture
        def open_journal(self, tmp_path):
            return lambda: MyJournal(tmp_path / "journal")

Needs pytest-asyncio.
"""

import asyncio
import os

import pytest

from m2pem.boot_time import boot_time_s
from m2pem.engine.inputs import BehaviorReported, Continue, PauseRun, Revise, StartRun
from m2pem.engine.records import (
    BehaviorProgressed,
    DataWritten,
    InputIgnored,
    MissionRevised,
    RunClaimed,
    RunEnded,
    RunOutcome,
    RunPaused,
    RunResumed,
    RunStarted,
)
from m2pem.errors import FleetServedError, InternalError, JournalError, StaleEpochError
from m2pem.journal.base import Entry, Journal, RunInfo
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.library import Source
from m2pem.mission.values import Value
from m2pem.testing.contracts.contract import needs
from m2pem.testing.contracts.journal_approvals import JournalApprovals
from m2pem.testing.contracts.journal_harness import (
    ENDED,
    HEADER,
    OpenJournal,
    entry,
    info,
    opened,
    outcomes,
    written,
)
from m2pem.testing.contracts.journal_schedule import JournalSchedule


@pytest.mark.asyncio
class JournalContract(JournalSchedule, JournalApprovals):
    """The contract of a journal: override the fixture `open_journal`."""

    # --- who serves a fleet ---------------------------------------------------------------------

    async def test_an_executive_serves_a_fleet_until_it_leaves_it(self, journal: Journal) -> None:
        """It is named by its process; to ask again changes nothing, and to leave twice neither."""
        page = "https://gcs1:8700/"
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

    # --- runs -----------------------------------------------------------------------------------

    async def test_runs_are_named_in_order(self, journal: Journal) -> None:
        """Runs are named r1, r2, ... in their order."""
        assert [await journal.create(HEADER) for _ in range(3)] == ["r1", "r2", "r3"]
        assert [found.run for found in await journal.runs()] == ["r1", "r2", "r3"]

    async def test_a_new_run_is_driven_and_has_its_header(self, journal: Journal) -> None:
        """Byte for byte: it is what the run is rebuilt from."""
        run = await journal.create(HEADER)
        assert await journal.runs() == [
            RunInfo(run, HEADER, 1, 0, started_us=HEADER.created_us, driven=True)
        ]
        assert await written(journal, run) == []

    async def test_an_unknown_run_is_refused_by_name(self, journal: Journal) -> None:
        """By every method, and whether or not the name looks like one."""
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

    async def test_a_line_follows_the_run(self, journal: Journal) -> None:
        """Started, paused, going on and ended, without reading records."""
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
        await journal.append([entry(run, 7, BehaviorProgressed("b1", 1, BehaviorState.RUNNING))])
        assert (await info(journal, run)).ended_us == HEADER.created_us + 6

    # --- entries --------------------------------------------------------------------------------

    async def test_entries_come_back_as_they_were(self, journal: Journal) -> None:
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
        await journal.create(HEADER)
        for one in some:
            await journal.append([one])
        assert repr(await written(journal, "r1")) == repr(some)

    async def test_reading_starts_after_a_record(self, journal: Journal) -> None:
        """With the entry whose first record comes next."""
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1, InputIgnored("1"), InputIgnored("2"))])
        await journal.append([entry(run, 3), entry(run, 4)])
        for after_seq, expected in {0: [1, 3, 4], 1: [3, 4], 2: [3, 4], 3: [4], 9: []}.items():
            assert [e.seq for e in await written(journal, run, after_seq)] == expected

    async def test_revisions_of_a_mission_are_found(self, journal: Journal) -> None:
        """With their files, among many other entries; those of other runs are not."""
        revision = Revise("9f8e", "b.bpmn", b"<b/>\xff", "c0ffee", (Source("c.bpmn", b"<c/>"),))
        run, other = await journal.create(HEADER), await journal.create(HEADER)
        some = [entry(run, seq) for seq in range(1, 11)]
        revised = MissionRevised("9f8e", "0", "anna", {"A": ""}, (1,), (2,))
        some[4] = entry(run, 5, revised, given=revision)
        some[8] = entry(run, 9, given=revision)
        await journal.append(some)
        await journal.append([entry(other, 1, given=revision)])
        assert list(await journal.revisions(run)) == [some[4], some[8]]
        with pytest.raises(JournalError, match="no run 'r9'"):
            await journal.revisions("r9")

    async def test_a_long_run_is_read_in_order(self, journal: Journal) -> None:
        """Beyond any batch that a journal may read in."""
        run, other = await journal.create(HEADER), await journal.create(HEADER)
        some = [entry(run, seq) for seq in range(1, 2501)]
        await journal.append(some)
        await journal.append([entry(other, 1)])
        assert await written(journal, run) == some

    async def test_one_call_may_write_to_several_runs(self, journal: Journal) -> None:
        """One call may write to several runs, and keeps them apart."""
        runs = [await journal.create(HEADER) for _ in range(3)]
        some = [entry(run, seq) for seq in (1, 2) for run in runs]
        await journal.append(some)
        for run in runs:
            assert await written(journal, run) == [e for e in some if e.run == run]

    async def test_calls_that_wait_together_are_all_written(self, journal: Journal) -> None:
        """Each in its own run, in order."""
        runs = [await journal.create(HEADER) for _ in range(20)]

        async def drive(run: str) -> None:
            for seq in range(1, 6):
                await journal.append([entry(run, seq)])

        await asyncio.gather(*map(drive, runs))
        for run in runs:
            assert [found.seq for found in await written(journal, run)] == [1, 2, 3, 4, 5]

    async def test_a_check_writes_nothing(self, journal: Journal) -> None:
        """It returns, whether a run is driven or not."""
        await journal.check()
        assert await journal.runs() == []
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        await journal.check()
        assert [each.last_seq for each in await journal.runs()] == [1]

    async def test_nothing_to_append_is_no_error(self, journal: Journal) -> None:
        """An empty append writes nothing."""
        run = await journal.create(HEADER)
        await journal.append([])
        assert await written(journal, run) == []

    # --- what is refused ------------------------------------------------------------------------

    async def test_an_entry_that_does_not_follow_is_refused_whole(self, journal: Journal) -> None:
        """A gap, a number that is there already, no record: a bug of the caller."""
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

    async def test_an_older_epoch_is_shut_out(self, journal: Journal) -> None:
        """Nothing of its call is written, not even to runs that it may write to."""
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
        self, journal: Journal
    ) -> None:
        """`check_claim` says so without a record, to an executive that was stopped for a while."""
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
        self, journal: Journal
    ) -> None:
        """The others of its group are written."""
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

    async def test_a_driven_run_cannot_be_claimed(self, journal: Journal) -> None:
        """The process that drives it is named, and nothing changes."""
        run = await journal.create(HEADER)
        with pytest.raises(JournalError, match=str(os.getpid())):
            await journal.claim(run)
        assert (await info(journal, run)).epoch == 1
        await journal.append([entry(run, 1)])

    async def test_a_released_run_can_be_claimed(self, journal: Journal) -> None:
        """Its epoch rises by one, and it is driven again."""
        run = await journal.create(HEADER)
        await journal.release(run)
        await journal.release(run)
        assert not (await info(journal, run)).driven
        assert await journal.claim(run) == 2
        assert (await info(journal, run)).driven
        assert (await info(journal, run)).epoch == 2

    async def test_a_released_run_is_not_written_to(self, journal: Journal) -> None:
        """Another may claim it at any moment."""
        run = await journal.create(HEADER)
        await journal.release(run)
        with pytest.raises(InternalError, match="r1"):
            await journal.append([entry(run, 1)])
        assert await written(journal, run) == []

    async def test_a_claim_lasts_as_long_as_the_journal_says(self, journal: Journal) -> None:
        """Until the end of a lease that it names, which is renewed; else as long as the process."""
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

    async def test_a_cancelled_append_is_whole_or_not_there(self, journal: Journal) -> None:
        """And the journal goes on."""
        run, other = await journal.create(HEADER), await journal.create(HEADER)
        call = asyncio.ensure_future(journal.append([entry(run, 1), entry(run, 2)]))
        await asyncio.sleep(0)
        call.cancel()
        await asyncio.wait([call])
        await journal.append([entry(other, 1)])
        assert [found.seq for found in await written(journal, run)] in ([], [1, 2])
        assert (await info(journal, run)).last_seq == len(await written(journal, run))

    async def test_a_deleted_run_is_gone_and_its_id_is_not_given_again(
        self, journal: Journal
    ) -> None:
        """Other runs are untouched, and the journal says who deleted it."""
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

    async def test_a_run_that_is_driven_is_not_deleted(self, journal: Journal) -> None:
        """Nor is any other run of the same call."""
        ended = await journal.create(HEADER)
        await journal.append([entry(ended, 1, *ENDED)])
        await journal.release(ended)
        driven = await journal.create(HEADER)
        with pytest.raises(JournalError, match=f"{driven} is not deleted: it is driven"):
            await journal.delete([ended, driven], by="ann", unended=True)
        assert [found.run for found in await journal.runs()] == [ended, driven]
        assert await journal.deletions() == []

    async def test_a_run_that_has_not_ended_is_deleted_only_on_purpose(
        self, journal: Journal
    ) -> None:
        """With `unended`."""
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
