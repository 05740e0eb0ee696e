"""Files that are no journal, or no longer a good one, are refused in plain words, and unharmed."""

import os
import resource
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from m2pem.errors import JournalError
from m2pem.journal.database import LOG_BYTES, open_for_reading, open_for_writing
from m2pem.journal.migrations import MIGRATIONS
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, entry, opened

NOBODY = 65534


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.db"


def refused(path):
    with pytest.raises(JournalError) as raised:
        open_for_writing(path)
    assert str(path) in str(raised.value)
    return str(raised.value)


def test_every_commit_is_synced_to_a_write_ahead_log(path):
    with closing(open_for_writing(path)) as connection:
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert connection.execute("PRAGMA synchronous").fetchone() == (2,)


async def test_small_commits_do_not_make_the_log_longer(path):
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        log = path.with_name("journal.db-wal")
        length = log.stat().st_size
        assert length >= LOG_BYTES
        run = await journal.create(HEADER)
        for seq in range(1, 21):
            await journal.append([entry(run, seq)])
        assert log.stat().st_size == length
    assert path.stat().st_size < LOG_BYTES / 10


def test_a_journal_on_a_disk_without_room_for_a_long_log_is_opened(path):
    open_for_writing(path).close()
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, unlimited[1]))
    try:
        with closing(open_for_writing(path)) as connection:
            assert not connection.in_transaction
            connection.execute("INSERT INTO runs VALUES (1, '', '', '', '', 0, 1, 0, '[]')")
            assert path.with_name("journal.db-wal").stat().st_size < LOG_BYTES
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    with closing(open_for_reading(path)) as connection:
        assert connection.execute("SELECT run FROM runs").fetchall() == [(1,)]


def test_a_new_file_is_its_owners_alone(path):
    with closing(open_for_writing(path)) as connection:
        connection.execute("INSERT INTO runs VALUES (1, '', '', '', '', 0, 1, 0, '[]')")
        for name in ("journal.db", "journal.db-wal", "journal.db-shm"):
            assert path.with_name(name).stat().st_mode & 0o777 == 0o600


def test_names_with_signs_of_urls_are_plain_names(tmp_path):
    path = tmp_path / "a b?mode=ro#%41&é.db"
    open_for_writing(path).close()
    assert [found.name for found in tmp_path.iterdir()] == [path.name]


def test_an_empty_file_becomes_a_journal(path):
    path.touch()
    open_for_writing(path).close()
    assert path.stat().st_size > 0


def test_a_missing_folder_is_named(tmp_path):
    assert f"the folder {tmp_path / 'no'} does not exist" in refused(tmp_path / "no" / "x.db")


def test_a_folder_is_no_journal(tmp_path):
    assert "is a folder; name a file in it" in refused(tmp_path)


def test_something_else_than_a_database_is_left_alone(path):
    path.write_text("waypoints: none\n" * 100)
    assert "not a journal of m2pem, nor any SQLite database" in refused(path)
    assert path.read_text() == "waypoints: none\n" * 100


def test_a_database_of_another_program_is_left_alone(path):
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE photos (name TEXT)")
    before = path.read_bytes()
    assert "a database of another program" in refused(path)
    assert path.read_bytes() == before


def test_a_journal_of_a_newer_release_is_left_alone(path):
    newer = len(MIGRATIONS) + 1
    with closing(open_for_writing(path)) as connection:
        connection.execute(f"PRAGMA user_version = {newer}")
    before = path.read_bytes()
    words = refused(path)
    assert f"written by a newer m2pem (format {newer}" in words
    assert "upgrade m2pem" in words
    assert path.read_bytes() == before


async def write_some(path):
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, seq) for seq in range(1, 500)])


async def test_a_truncated_journal_is_refused(path):
    await write_some(path)
    os.truncate(path, path.stat().st_size // 2)
    assert "it is damaged; use a backup" in refused(path)


@contextmanager
def as_an_ordinary_user(folder: Path) -> Iterator[None]:
    """Root may write anything, so it steps down for as long as this lasts."""
    if os.geteuid() != 0:
        yield
        return
    for each in (folder, *folder.parents):
        if each.stat().st_uid == 0 and each != each.parent:
            each.chmod(each.stat().st_mode | 0o011)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


async def test_damage_that_is_met_while_reading_is_told(path):
    await write_some(path)
    content = bytearray(path.read_bytes())
    first_entry = content.index(b'"InputIgnored"')
    page = first_entry // 4096
    content[page * 4096 : page * 4096 + 64] = os.urandom(64)
    path.write_bytes(content)
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        with pytest.raises(JournalError, match="it is damaged; use a backup"):
            assert [found.seq async for found in journal.read("r1")] != []


def test_a_file_that_may_not_be_written_is_refused(path):
    open_for_writing(path).close()
    path.chmod(0o444)
    with as_an_ordinary_user(path.parent):
        assert "can only be read; allow writing" in refused(path)


def test_a_connection_for_reading_does_not_write(path):
    open_for_writing(path).close()
    with (
        closing(open_for_reading(path)) as connection,
        pytest.raises(sqlite3.OperationalError, match="readonly"),
    ):
        connection.execute("DELETE FROM runs")
