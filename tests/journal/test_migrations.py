import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from m2pem.errors import JournalError
from m2pem.journal import migrations
from m2pem.journal.migrations import MIGRATIONS, check, migrate

PATH = Path("journal.db")


@pytest.fixture
def connection():
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        yield connection


def schema(connection):
    return connection.execute("SELECT sql FROM sqlite_master ORDER BY name").fetchall()


def version(connection):
    return connection.execute("PRAGMA user_version").fetchone()[0]


def add_a_note(connection):
    connection.execute("ALTER TABLE runs ADD COLUMN note TEXT NOT NULL DEFAULT ''")


def test_a_new_database_gets_every_step(connection):
    migrate(connection, PATH)
    assert version(connection) == len(MIGRATIONS)
    tables = {row[0] for row in connection.execute("SELECT name FROM sqlite_master")}
    assert {"runs", "standings", "entries"} <= tables


def test_migrating_again_changes_nothing(connection):
    migrate(connection, PATH)
    before = schema(connection)
    migrate(connection, PATH)
    assert schema(connection) == before


def test_an_older_database_gets_the_steps_that_it_lacks(connection, monkeypatch):
    monkeypatch.setattr(migrations, "MIGRATIONS", MIGRATIONS[:1])
    migrate(connection, PATH)
    connection.execute("INSERT INTO runs VALUES (1, 'm', '', 'P', '', 0, 1, 0)")
    monkeypatch.setattr(migrations, "MIGRATIONS", (*MIGRATIONS, add_a_note))
    migrate(connection, PATH)
    assert version(connection) == len(MIGRATIONS) + 1
    assert connection.execute("SELECT mission_name, library, note FROM runs").fetchall() == [
        ("m", "[]", "")
    ]


def test_a_step_that_fails_leaves_the_database_as_it_was(connection, monkeypatch):
    def fail(connection):
        add_a_note(connection)
        connection.execute("nonsense")

    migrate(connection, PATH)
    before = schema(connection)
    monkeypatch.setattr(migrations, "MIGRATIONS", (*MIGRATIONS, fail))
    with pytest.raises(sqlite3.OperationalError):
        migrate(connection, PATH)
    assert schema(connection) == before
    assert version(connection) == len(MIGRATIONS)


def test_an_empty_database_marked_by_another_program_is_refused(connection):
    connection.execute("PRAGMA application_id = 77")
    with pytest.raises(JournalError, match=r"journal\.db is a database of another program"):
        check(connection, PATH)
