"""The chain of entries, and the mark of what was acknowledged."""

import sqlite3
import stat
from contextlib import closing

import pytest

from m2pem.engine.records import RunEnded, RunOutcome, RunPaused, RunResumed
from m2pem.errors import JournalError
from m2pem.journal import migrations
from m2pem.journal.database import open_for_writing
from m2pem.journal.hash_chain import entry_hash, header_hash
from m2pem.journal.migrations import MIGRATIONS
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.db"


@pytest.fixture
def open_journal(path):
    return lambda: SqliteJournal.open(path)


async def fill(open_journal, count):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        for seq in range(1, count + 1):
            await journal.append([entry(run, seq)])


def change(path, statement, *parameters):
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(statement, parameters)


def lose_tail(path, last_seq):
    """As a log without its tail would leave it: whole and sealed, but shorter."""
    saved = path.with_name("before.db")
    saved.replace(path)
    with closing(sqlite3.connect(path)) as connection:
        (found,) = connection.execute("SELECT max(seq) FROM entries").fetchone()
    assert (found or 0) == last_seq


async def with_lost_tail(open_journal, path, kept, lost):
    await fill(open_journal, kept)
    path.with_name("before.db").write_bytes(path.read_bytes())
    async with opened(open_journal) as journal:
        epoch = await journal.claim("r1")
        for seq in range(kept + 1, kept + lost + 1):
            await journal.append([entry("r1", seq, epoch=epoch)])
    lose_tail(path, kept)


async def test_each_entry_has_the_hash_of_what_was_before_it_and_its_own_content(
    open_journal, path
):
    await fill(open_journal, 3)
    with closing(sqlite3.connect(path)) as connection:
        before = header_hash(connection.execute("SELECT * FROM runs").fetchone())
        rows = connection.execute(
            "SELECT seq, epoch, at_us, t_us, CAST(body AS BLOB), hash FROM entries ORDER BY seq"
        ).fetchall()
    assert len(rows) == 3
    for *content, found in rows:
        before = entry_hash(before, *content)
        assert found == before


@pytest.mark.parametrize(
    ("damage", "seq"),
    [
        ("UPDATE entries SET body = replace(body, 'nr 3', 'nr 4') WHERE seq = 3", 3),
        ("UPDATE entries SET at_us = at_us + 1 WHERE seq = 2", 2),
        ("UPDATE entries SET hash = NULL WHERE seq = 2", 2),
        ("DELETE FROM entries WHERE seq = 2", 3),
        ("DELETE FROM entries WHERE seq = 5", 5),
        ("UPDATE runs SET mission = x'00'", 1),
    ],
)
async def test_the_first_entry_that_does_not_fit_is_named(open_journal, path, damage, seq):
    await fill(open_journal, 5)
    change(path, damage)
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match=rf"journal\.db: r1, record {seq}: it"):
            await written(journal, "r1")


async def test_reading_on_from_a_record_checks_the_chain_from_there(open_journal, path):
    await fill(open_journal, 5)
    change(path, "UPDATE entries SET t_us = t_us + 1 WHERE seq = 4")
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="r1, record 4"):
            await written(journal, "r1", 2)
        assert [found.seq for found in await written(journal, "r1", 4)] == [5]


async def test_a_changed_standing_is_told(open_journal, path):
    await fill(open_journal, 2)
    change(path, "UPDATE standings SET paused = 1")
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="run 1: its row in the table `standings` is damag"):
            await journal.runs()


async def test_a_journal_from_before_the_chain_is_read_resumed_and_chained_on(
    open_journal, path, monkeypatch
):
    monkeypatch.setattr(migrations, "MIGRATIONS", MIGRATIONS[:3])
    with closing(open_for_writing(path)) as connection:
        connection.execute("INSERT INTO runs VALUES (1, 'm', x'00', 'P', x'', 0, 1.0, 7, '[]')")
        connection.execute("INSERT INTO standings VALUES (1, 1, 1, 7, 2, 0, NULL, '', NULL)")
        body = '[{"input":"Tick"},[{"record":"InputIgnored","reason":"x"}]]'
        for seq in (1, 2):
            connection.execute("INSERT INTO entries VALUES (1, ?, 1, 8, 9, ?)", (seq, body))
    monkeypatch.undo()
    async with opened(open_journal) as journal:
        assert [found.seq for found in await written(journal, "r1")] == [1, 2]
        epoch = await journal.claim("r1")
        await journal.append([entry("r1", seq, epoch=epoch) for seq in (3, 4)])
        assert [found.seq for found in await written(journal, "r1")] == [1, 2, 3, 4]
        assert [found.seq for found in await written(journal, "r1", 1)] == [2, 3, 4]
        assert (await info(journal, "r1")).loss is None
    change(path, "UPDATE entries SET hash = NULL WHERE seq = 4")
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="r1, record 4"):
            await written(journal, "r1")


async def test_a_lost_tail_is_told_with_what_was_acknowledged_and_what_is_found(
    open_journal, path, caplog
):
    await with_lost_tail(open_journal, path, 3, 2)
    async with opened(open_journal) as journal:
        assert "r1: the journal has lost records: it acknowledged record 5, and its last one " in (
            caplog.text
        )
        loss = (await info(journal, "r1")).loss
        assert (loss.acknowledged, loss.found, loss.records, loss.resumable) == (5, 3, 2, True)


async def test_a_loss_is_remembered_until_the_run_goes_on(open_journal, path):
    await with_lost_tail(open_journal, path, 3, 2)
    async with opened(open_journal) as journal:
        epoch = await journal.claim("r1")
        assert epoch == 3
        await journal.append([entry("r1", seq, RunPaused(1), epoch=epoch) for seq in (4, 5, 6)])
    async with opened(open_journal) as journal:
        assert str((await info(journal, "r1")).loss).endswith("something else is in its place")
        with pytest.raises(JournalError, match=r"no run begins: r1: .*`m2pem resume r1`"):
            await journal.create(HEADER)
        epoch = await journal.claim("r1")
        await journal.append([entry("r1", 7, RunResumed(1), epoch=epoch)])
        assert (await info(journal, "r1")).loss is None
        assert await journal.create(HEADER) == "r2"


async def test_a_run_that_is_gone_whole_is_told_and_its_number_not_given_again(open_journal, path):
    await fill(open_journal, 2)
    path.with_name("before.db").write_bytes(path.read_bytes())
    await fill(open_journal, 1)
    lose_tail(path, 2)
    async with opened(open_journal) as journal:
        gone = await info(journal, "r2")
        assert str(gone.loss) == "the journal has lost the run: it acknowledged 1 records of it"
        assert not gone.loss.resumable
        with pytest.raises(JournalError, match=r"r2: .*`m2pem runs --accept-loss r2`"):
            await journal.create(HEADER)
        await journal.accept_loss("r2")
        assert [each.run for each in await journal.runs()] == ["r1"]
        assert await journal.create(HEADER) == "r3"


async def test_only_a_loss_that_cannot_be_asked_about_is_accepted(open_journal, path):
    await with_lost_tail(open_journal, path, 3, 2)
    async with opened(open_journal) as journal:
        with pytest.raises(JournalError, match="r1 can be resumed"):
            await journal.accept_loss("r1")
        with pytest.raises(JournalError, match="r2 has lost nothing"):
            await journal.accept_loss("r2")


async def test_a_crash_between_commit_and_mark_is_no_loss(open_journal, path):
    await fill(open_journal, 2)
    mark = path.with_name("journal.db-mark").read_bytes()
    async with opened(open_journal) as journal:
        epoch = await journal.claim("r1")
        ended = RunEnded(RunOutcome.COMPLETED, "")
        await journal.append([entry("r1", 3, epoch=epoch), entry("r1", 4, ended, epoch=epoch)])
    path.with_name("journal.db-mark").write_bytes(mark)
    async with opened(open_journal) as journal:
        assert (await info(journal, "r1")).loss is None


@pytest.mark.parametrize("harm", ["replaced", "removed", "emptied"])
async def test_a_journal_that_is_not_that_of_the_mark_is_refused(open_journal, path, harm):
    await fill(open_journal, 2)
    if harm == "replaced":
        async with opened(lambda: SqliteJournal.open(path.with_name("other.db"))):
            pass
        path.with_name("other.db").replace(path)
    elif harm == "removed":
        path.unlink()
    else:
        path.write_bytes(b"")
    with pytest.raises(JournalError, match=r"journal\.db-mark is the mark of another journal: jou"):
        open_journal()
    path.with_name("journal.db-mark").unlink()
    async with opened(open_journal) as journal:
        assert list(await journal.runs()) == []


async def test_a_missing_mark_is_told_once_and_begun_again(open_journal, path, caplog):
    await fill(open_journal, 2)
    path.with_name("journal.db-mark").unlink()
    async with opened(open_journal):
        assert "journal.db-mark is missing" in caplog.text
    caplog.clear()
    path.with_name("before.db").write_bytes(path.read_bytes())
    await fill(open_journal, 1)
    assert caplog.text == ""
    lose_tail(path, 2)
    async with opened(open_journal) as journal:
        assert (await info(journal, "r2")).loss is not None


async def test_a_damaged_mark_is_told(open_journal, path):
    await fill(open_journal, 2)
    mark = path.with_name("journal.db-mark")
    content = bytearray(mark.read_bytes())
    content[20] ^= 1
    mark.write_bytes(content)
    with pytest.raises(JournalError, match=r"journal\.db-mark is damaged"):
        open_journal()


async def test_a_torn_write_of_the_mark_leaves_the_one_before_it(open_journal, path):
    await fill(open_journal, 4)
    mark = path.with_name("journal.db-mark")
    content = bytearray(mark.read_bytes())
    for place in (128, 192):
        torn = bytearray(content)
        torn[place + 30 : place + 64] = bytes(34)
        mark.write_bytes(torn)
        async with opened(open_journal) as journal:
            assert (await info(journal, "r1")).loss is None


async def test_the_mark_is_its_owners_alone(open_journal, path):
    await fill(open_journal, 1)
    mode = path.with_name("journal.db-mark").stat().st_mode
    assert stat.S_IMODE(mode) == 0o600


@pytest.mark.parametrize("what", ["", "-wal", "-lock", "-mark"])
@pytest.mark.parametrize("harm", ["removed", "replaced"])
async def test_files_that_go_away_during_a_run_are_noticed_at_the_next_commit(
    open_journal, path, what, harm
):
    file = path.with_name(f"journal.db{what}")
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        content = file.read_bytes()
        file.rename(file.with_name("moved"))
        if harm == "replaced":
            file.write_bytes(content)
        problem = rf"journal\.db{what} was {harm} while it was in use.* writes no more"
        with pytest.raises(JournalError, match=problem):
            await journal.append([entry(run, 2)])
        with pytest.raises(JournalError, match="writes no more"):
            await journal.append([entry(run, 2)])
