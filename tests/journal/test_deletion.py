"""What a deletion leaves of an SQLite journal: whole chains, no loss, and no entries."""

import sqlite3
from contextlib import closing

import pytest

from m2pem.errors import JournalError
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import ENDED, HEADER, entry, opened, written


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.db"


@pytest.fixture
def open_journal(path):
    return lambda: SqliteJournal.open(path)


async def with_ended_runs(open_journal, count, entries=3):
    async with opened(open_journal) as journal:
        for _ in range(count):
            run = await journal.create(HEADER)
            await journal.append([entry(run, seq) for seq in range(1, entries + 1)])
            await journal.append([entry(run, entries + 1, *ENDED)])


def ask(path, statement):
    with closing(sqlite3.connect(path)) as connection, connection:
        return connection.execute(statement).fetchall()


async def test_the_chains_of_other_runs_are_whole_after_a_deletion(open_journal, caplog):
    await with_ended_runs(open_journal, 3)
    async with opened(open_journal) as journal:
        await journal.delete(["r2"], by="ann")
    async with opened(open_journal) as journal:
        assert [(line.run, line.loss) for line in await journal.runs()] == [
            ("r1", None),
            ("r3", None),
        ]
        assert [len(await written(journal, run)) for run in ("r1", "r3")] == [4, 4]
        assert await journal.create(HEADER) == "r4"
    assert caplog.records == []


@pytest.mark.parametrize(
    "change",
    [
        "DELETE FROM deletions",
        "UPDATE deletions SET last_seq = 3",
        "UPDATE deletions SET hash = ''",
    ],
)
async def test_a_deletion_that_does_not_fit_what_was_acknowledged_is_a_loss(
    open_journal, path, change
):
    await with_ended_runs(open_journal, 1)
    async with opened(open_journal) as journal:
        await journal.delete(["r1"], by="ann")
    ask(path, change)
    async with opened(open_journal) as journal:
        (line,) = await journal.runs()
        assert line.gone


async def test_a_run_that_has_lost_entries_is_not_deleted(open_journal, path):
    await with_ended_runs(open_journal, 1)
    before = path.read_bytes()
    async with opened(open_journal) as journal:
        await journal.claim("r1")
        await journal.append([entry("r1", 6, epoch=2)])
    path.write_bytes(before)
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="r1 is not deleted: the journal has lost records"):
            await journal.delete(["r1"], by="ann")


async def test_no_entry_of_a_long_run_is_left(open_journal, path):
    await with_ended_runs(open_journal, 1, entries=4500)
    async with opened(open_journal) as journal:
        await journal.delete(["r1"], by="ann")
    assert ask(path, "SELECT count(*) FROM entries") == [(0,)]
    assert ask(path, "SELECT emptied FROM deletions") == [(1,)]


async def test_what_a_deletion_left_when_it_was_killed_goes_with_the_next_one(open_journal, path):
    await with_ended_runs(open_journal, 2)
    async with opened(open_journal) as journal:
        await journal.delete(["r1"], by="ann")
    ask(path, "UPDATE deletions SET emptied = 0")
    ask(path, "INSERT INTO entries SELECT 1, seq, epoch, at_us, t_us, body, hash FROM entries")
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="r1 was deleted"):
            await written(journal, "r1")
        await journal.delete(["r2"], by="ann")
    assert ask(path, "SELECT count(*) FROM entries") == [(0,)]


async def test_a_deletion_that_is_written_while_a_run_goes_on_delays_it_by_a_transaction(
    open_journal,
):
    await with_ended_runs(open_journal, 1, entries=4500)
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        before = journal.commits
        await journal.delete(["r1"], by="ann")
        assert journal.commits - before >= 4  # the run's end, and its entries in three parts
        await journal.append([entry(run, 1)])
