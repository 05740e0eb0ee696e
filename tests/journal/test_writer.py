"""What a transaction that fails does to those who wait for it, and to the journal."""

import asyncio
import resource
import sqlite3

import pytest

from m2pem.engine.records import InputIgnored
from m2pem.errors import InternalError, JournalError
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written


@pytest.fixture
def connections(monkeypatch):
    """The connections to SQLite that were made; a journal writes over its first one."""
    made, connect = [], sqlite3.connect

    def noted(*arguments, **options):
        made.append(connect(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(sqlite3, "connect", noted)
    return made


@pytest.fixture
def open_journal(tmp_path):
    return lambda: SqliteJournal.open(tmp_path / "journal.db")


def large(run, seq):
    return entry(run, seq, InputIgnored("x" * 100_000))


async def test_a_full_disk_fails_all_that_waited_and_passes(open_journal, connections):
    async with opened(open_journal) as journal:
        writing = connections[0]
        runs = [await journal.create(HEADER) for _ in range(3)]
        writing.execute("PRAGMA max_page_count = 40")
        calls = [journal.append([large(run, 1), large(run, 2)]) for run in runs]
        raised = await asyncio.gather(*calls, return_exceptions=True)
        assert {type(error) for error in raised} == {JournalError}
        assert all("journal.db: the disk is full; make room" in str(error) for error in raised)
        assert len({id(error) for error in raised}) == 3
        assert {found.last_seq for found in await journal.runs()} == {0}
        await journal.append([entry(runs[0], 1)])
        writing.execute("PRAGMA max_page_count = 100000")
        await journal.append([large(runs[1], 1), large(runs[1], 2)])
        assert [found.last_seq for found in await journal.runs()] == [1, 2, 0]


async def test_a_full_disk_leaves_a_claimed_run_free(open_journal, connections):
    async with opened(open_journal) as journal:
        writing = connections[0]
        writing.execute("PRAGMA query_only = ON")
        with pytest.raises(JournalError, match="can only be read; allow writing"):
            await journal.create(HEADER)
        writing.execute("PRAGMA query_only = OFF")
        run = await journal.create(HEADER)
        assert run == "r1"
        await journal.release(run)
        writing.execute("PRAGMA query_only = ON")
        with pytest.raises(JournalError, match="can only be read"):
            await journal.claim(run)
        assert not (await info(journal, run)).driven
        writing.execute("PRAGMA query_only = OFF")
        assert await journal.claim(run) == 2


async def test_another_program_that_keeps_writing_is_told_of(open_journal, connections, tmp_path):
    async with opened(open_journal) as journal:
        writing = connections[0]
        run = await journal.create(HEADER)
        writing.execute("PRAGMA busy_timeout = 20")
        other = sqlite3.connect(tmp_path / "journal.db", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(JournalError, match="another program has kept it locked"):
            await journal.append([entry(run, 1)])
        other.execute("ROLLBACK")
        other.close()
        await journal.append([entry(run, 1)])
        assert len(await written(journal, run)) == 1


async def test_after_a_failed_write_the_journal_writes_no_more(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, unlimited[1]))
        try:
            with pytest.raises(JournalError, match="the disk failed to read or write"):
                await journal.append([large(run, 2), large(run, 3)])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
        for _ in range(2):
            with pytest.raises(JournalError, match=r"writes no more.*start again"):
                await journal.append([entry(run, 2)])
        assert len(await written(journal, run)) == 1
        await journal.release(run)
        assert not (await info(journal, run)).driven
    async with opened(open_journal) as again:
        assert len(await written(again, run)) == 1
        assert await again.claim(run) == 2
        await again.append([entry(run, 2, epoch=2)])


async def test_a_bug_while_writing_fails_its_group_and_not_the_thread(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        too_late = entry(run, 1)
        object.__setattr__(too_late, "at_us", 2**63)
        with pytest.raises(InternalError, match="int too large to convert"):
            await journal.append([too_late])
        await journal.append([entry(run, 1)])
        assert await written(journal, run) == [entry(run, 1)]
