"""The journals of rounds: an SQLite file, or a database of a PostgreSQL server of this process."""

import atexit
import sqlite3
from contextlib import closing
from functools import cache
from pathlib import Path

from m2pem.journal import postgres_database
from m2pem.journal.migrations import MIGRATIONS
from m2pem.journal.postgres_address import PostgresAddress, write_address
from tests.chaos.kill_points import POSTGRES, JournalKind
from tests.postgres_server import PostgresServer, start_server

UNDONE = {
    "deletions": ("DROP TABLE deletions",),
    "schedule": ("DROP TABLE schedule", "DROP TABLE schedule_holds"),
    "origin_of_salvaged_runs": ("DROP TABLE origin",),
}
"""How the last steps of migration are undone in a journal with no deletion and no schedule,
which was not salvaged."""


@cache
def _server() -> PostgresServer:
    server = start_server()
    atexit.register(server.remove)
    return server


def make(kind: JournalKind, folder: Path) -> Path:
    """Return the file that names a new journal, in the folder of a round. The journal is empty."""
    file = folder / kind.file
    if kind is POSTGRES:
        url = _server().new_database()
        write_address(PostgresAddress(url, url, file))
    return file


def downgrade(kind: JournalKind, file: Path) -> None:
    """Make a journal of the newest format one of an older m2pem: it is migrated when opened."""
    if kind is POSTGRES:
        if len(postgres_database.MIGRATIONS) > 1:
            raise AssertionError("POSTGRES.migrates, and say here how the last step is undone")
        return
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        while version and MIGRATIONS[version - 1].__name__ in UNDONE:
            version -= 1
            for statement in UNDONE[MIGRATIONS[version].__name__]:
                connection.execute(statement)
        if version == len(MIGRATIONS):
            raise AssertionError(f"say in UNDONE how {MIGRATIONS[-1].__name__} is undone")
        connection.execute(f"PRAGMA user_version = {version}")
        connection.execute("COMMIT")
