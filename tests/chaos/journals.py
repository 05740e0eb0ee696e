"""The journals of rounds: an SQLite file, or a database of a PostgreSQL server of this process."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import psycopg

from m2pem.journal import migrations, postgres_database
from m2pem.journal.postgres_address import PostgresAddress, read_address, write_address
from tests.chaos.kill_points import POSTGRES, JournalKind
from tests.postgres_server import shared_server

UNDONE = {
    "deletions": ("DROP TABLE deletions",),
    "schedule": ("DROP TABLE schedule", "DROP TABLE schedule_holds"),
    "origin_of_salvaged_runs": ("DROP TABLE origin",),
    "approvals": ("DROP TABLE approvals", "DROP TABLE edits"),
    "alerts": ("DROP TABLE alerts",),
    "drawings": ("DROP TABLE drawings",),
    "fleets": ("DROP TABLE fleets",),
    "notifications": ("DROP FUNCTION m2pem_tell CASCADE",),
    "pages": ("ALTER TABLE fleets DROP COLUMN page",),
    "server_starts": ("ALTER TABLE executives DROP COLUMN lease, DROP COLUMN server_start",),
}
"""How the last steps of migration are undone in a journal with no deletion and no schedule,
which was not salvaged, and whose executives are dead."""


def make(kind: JournalKind, folder: Path) -> Path:
    """Return the file that names a new journal, in the folder of a round. The journal is empty."""
    file = folder / kind.file
    if kind is POSTGRES:
        url = shared_server().new_database()
        write_address(PostgresAddress(url, url, file))
    return file


def downgrade(kind: JournalKind, file: Path) -> None:
    """Make a journal of the newest format one of an older m2pem: it is migrated when opened.

    One whose executive was killed before it had made it is left as it is.
    """
    if kind is POSTGRES:
        steps = [each.__name__ for each in postgres_database.MIGRATIONS]
        statements, version = _undone(steps)
        with psycopg.connect(read_address(file).url) as server:
            if server.execute("SELECT to_regclass('m2pem_format')").fetchone() == (None,):
                return
            if server.execute("SELECT version FROM m2pem_format").fetchone() != (len(steps),):
                return
            for statement in statements:
                server.execute(statement.encode())
            server.execute("UPDATE m2pem_format SET version = %s", (version,))
        return
    steps = [each.__name__ for each in migrations.MIGRATIONS]
    statements, version = _undone(steps)
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        if connection.execute("PRAGMA user_version").fetchone() != (len(steps),):
            return
        connection.execute("BEGIN IMMEDIATE")
        for statement in (*statements, f"PRAGMA user_version = {version}", "COMMIT"):
            connection.execute(statement)


def _undone(steps: Sequence[str]) -> tuple[list[str], int]:
    """Return what undoes the last steps of migration, and how many are left."""
    left = len(steps)
    while left and steps[left - 1] in UNDONE:
        left -= 1
    if left == len(steps):
        raise AssertionError(f"say in UNDONE how {steps[-1]} is undone")
    return [statement for step in steps[: left - 1 : -1] for statement in UNDONE[step]], left
