import asyncio
import os
import tracemalloc

import pytest

from m2pem.engine.records import InputIgnored
from m2pem.errors import JournalError
from m2pem.journal.codec import encode_body
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal import JournalContract
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written


class TestSqliteJournal(JournalContract):
    unsupported = {"notification": "followers look each second"}  # noqa: RUF012

    @pytest.fixture
    def open_journal(self, tmp_path):
        return lambda: SqliteJournal.open(tmp_path / "journal.db")


@pytest.fixture
def open_journal(tmp_path):
    return lambda: SqliteJournal.open(tmp_path / "journal.db")


async def test_calls_that_wait_together_share_a_commit(open_journal):
    async with opened(open_journal) as journal:
        runs = [await journal.create(HEADER) for _ in range(100)]
        before = journal.commits
        for seq in range(1, 6):
            await asyncio.gather(*(journal.append([entry(run, seq)]) for run in runs))
        assert 5 <= journal.commits - before <= 25
        assert {found.last_seq for found in await journal.runs()} == {5}


async def test_an_append_alone_takes_one_commit_and_reading_none(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        before = journal.commits
        for seq in range(1, 6):
            await journal.append([entry(run, seq)])
        await written(journal, run)
        await journal.release(run)
        assert journal.commits - before == 5


async def test_a_group_larger_than_a_statement_is_written_whole(open_journal):
    async with opened(open_journal) as journal:
        runs = [await journal.create(HEADER) for _ in range(101)]
        some = [entry(run, seq) for run in runs for seq in (1, 2, 3)]
        before = journal.commits
        await journal.append(some)
        assert journal.commits - before == 1
        for run in runs:
            assert await written(journal, run) == [found for found in some if found.run == run]


async def test_reading_takes_memory_for_a_batch_not_for_the_run(open_journal):
    text = "x" * 100_000
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        for first in range(1, 300, 10):
            some = [entry(run, first + n, InputIgnored(f"{text}{first + n}")) for n in range(10)]
            await journal.append(some)
        del some
        tracemalloc.start()
        try:
            count = 0
            async for _ in journal.read(run):
                count += 1
            peak_bytes = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert count == 300
        assert peak_bytes < 6_000_000


@pytest.mark.parametrize("act", ["create", "claim"])
async def test_what_a_cancelled_call_took_is_let_go_of(open_journal, act):
    async with opened(open_journal) as journal:
        taken = "r2" if act == "create" else await journal.create(HEADER)
        if act == "claim":
            await journal.release(taken)
        else:
            await journal.create(HEADER)
        call = asyncio.ensure_future(
            journal.create(HEADER) if act == "create" else journal.claim(taken)
        )
        await asyncio.sleep(0)
        call.cancel()
        await asyncio.wait([call])
        assert call.cancelled()
        # Waiting for it in turns through the writing thread: first it is done, then let go of.
        epoch = 1 if act == "create" else 2
        while (
            (found := (await journal.runs())[-1]).run != taken
            or found.epoch < epoch
            or found.driven
        ):
            await journal.release("r9")
        assert await journal.claim(taken) == found.epoch + 1


async def test_a_cancelled_claim_that_fails_takes_nothing_from_who_drives(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        call = asyncio.ensure_future(journal.claim(run))
        await asyncio.sleep(0)
        call.cancel()
        await asyncio.wait([call])
        await journal.append([entry(run, 1)])
        assert (await info(journal, run)).driven


async def test_a_cancelled_release_still_lets_go(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        call = asyncio.ensure_future(journal.release(run))
        await asyncio.sleep(0)
        call.cancel()
        await asyncio.wait([call])
        while (await info(journal, run)).driven:
            await journal.release("r9")
        assert await journal.claim(run) == 2


async def test_a_cancelled_close_still_closes(open_journal):
    journal = open_journal()
    run = await journal.create(HEADER)
    call = asyncio.ensure_future(journal.close())
    await asyncio.sleep(0)
    call.cancel()
    await asyncio.wait([call])
    async with opened(open_journal) as again:
        while (await info(again, run)).driven:
            await again.release("r9")
        assert await again.claim(run) == 2


def test_a_journal_serves_one_event_loop_after_another(open_journal):
    journal = open_journal()
    run = asyncio.run(journal.create(HEADER))
    asyncio.run(journal.append([entry(run, 1)]))
    assert asyncio.run(written(journal, run)) == [entry(run, 1)]
    asyncio.run(journal.close())


def test_a_loop_that_ends_before_its_append_leaves_the_writer_alive(open_journal):
    journal = open_journal()
    run = asyncio.run(journal.create(HEADER))

    async def leave_early():
        call = asyncio.ensure_future(journal.append([entry(run, 1)]))
        await asyncio.sleep(0)
        assert not call.done()

    asyncio.run(leave_early())
    asyncio.run(journal.append([entry(run, 2)]))
    assert [found.seq for found in asyncio.run(written(journal, run))] == [1, 2]
    asyncio.run(journal.close())


async def test_many_journals_open_a_new_file_at_once(tmp_path):
    path = tmp_path / "journal.db"
    journals = await asyncio.gather(
        *(asyncio.to_thread(SqliteJournal.open, path) for _ in range(8))
    )
    runs = await asyncio.gather(*(journal.create(HEADER) for journal in journals))
    assert sorted(runs) == [f"r{number}" for number in range(1, 9)]
    await asyncio.gather(
        *(journal.append([entry(run, 1)]) for journal, run in zip(journals, runs, strict=True))
    )
    assert {found.last_seq for found in await journals[0].runs()} == {1}
    for journal in journals:
        await journal.close()


async def test_symbolic_links_lead_to_the_same_locks(tmp_path):
    (tmp_path / "link.db").symlink_to(tmp_path / "journal.db")
    async with opened(lambda: SqliteJournal.open(tmp_path / "journal.db")) as one:
        run = await one.create(HEADER)
        async with opened(lambda: SqliteJournal.open(tmp_path / "link.db")) as two:
            with pytest.raises(JournalError, match=f"r1 is driven by process {os.getpid()}"):
                await two.claim(run)


async def test_an_entry_of_a_newer_release_is_named(open_journal, tmp_path, monkeypatch):
    def of_a_newer_release(entry):
        return encode_body(entry).replace(b"InputIgnored", b"NotYetKnown")

    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        monkeypatch.setattr("m2pem.journal.database_journal.encode_body", of_a_newer_release)
        await journal.append([entry(run, 2)])
    async with opened(open_journal) as journal:
        reading = journal.read(run)
        with pytest.raises(JournalError, match=r"journal\.db: r1, record 2: .*newer m2pem"):
            _ = [found async for found in reading]


async def test_a_journal_keeps_its_name_and_another_has_another(open_journal, tmp_path):
    async with opened(open_journal) as journal:
        identity = journal.identity
    async with opened(open_journal) as again:
        assert again.identity == identity
    async with opened(lambda: SqliteJournal.open(tmp_path / "other.db")) as other:
        assert other.identity != identity
        assert other.file == tmp_path / "other.db"
