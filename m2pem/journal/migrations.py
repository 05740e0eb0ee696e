"""The tables of the SQLite journal, as a sequence of migrations.

A released step is never changed; a change becomes a new step at the end of
`MIGRATIONS`. `PRAGMA user_version` is how many of them a database has had.
"""

import sqlite3
from collections.abc import Callable
from pathlib import Path
from uuid import uuid4

from m2pem.errors import JournalError

APPLICATION_ID = 0x6D327065
"""Marks a database as a journal of m2pem: "m2pe"."""


def runs_standings_and_entries(connection: sqlite3.Connection) -> None:
    """0.1: runs never change; the position of each is a small row that is often rewritten."""
    connection.execute(
        """CREATE TABLE runs (
            run INTEGER PRIMARY KEY,
            mission_name TEXT NOT NULL,
            mission BLOB NOT NULL,
            process TEXT NOT NULL,
            fleet BLOB NOT NULL,
            simulated INTEGER NOT NULL,
            speed REAL NOT NULL,
            created_us INTEGER NOT NULL
        )"""
    )
    connection.execute(
        """CREATE TABLE standings (
            run INTEGER PRIMARY KEY REFERENCES runs,
            epoch INTEGER NOT NULL,
            pid INTEGER NOT NULL,
            started_us INTEGER NOT NULL,
            last_seq INTEGER NOT NULL,
            paused INTEGER NOT NULL,
            outcome TEXT,
            detail TEXT NOT NULL,
            ended_us INTEGER
        )"""
    )
    connection.execute(
        """CREATE TABLE entries (
            run INTEGER NOT NULL REFERENCES runs,
            seq INTEGER NOT NULL,
            epoch INTEGER NOT NULL,
            at_us INTEGER NOT NULL,
            t_us INTEGER NOT NULL,
            body TEXT NOT NULL,
            PRIMARY KEY (run, seq)
        ) WITHOUT ROWID"""
    )


def other_files_of_missions(connection: sqlite3.Connection) -> None:
    """0.2: the files that a mission calls into or imports are kept with it."""
    connection.execute("ALTER TABLE runs ADD COLUMN library TEXT NOT NULL DEFAULT '[]'")


def identity_of_the_journal(connection: sqlite3.Connection) -> None:
    """0.3: a unique id of the journal, which makes the ids of behaviors globally unique."""
    connection.execute("CREATE TABLE identity (uuid TEXT NOT NULL)")
    connection.execute("INSERT INTO identity VALUES (?)", (str(uuid4()),))


def hash_chain(connection: sqlite3.Connection) -> None:
    """0.4: each entry carries a hash over what was before it; entries from before have none.

    `seal` covers the other columns of the row in `standings`. `marked`: there has been a mark file.
    """
    connection.execute("ALTER TABLE entries ADD COLUMN hash BLOB")
    connection.execute("ALTER TABLE standings ADD COLUMN hash BLOB")
    connection.execute("ALTER TABLE standings ADD COLUMN seal BLOB")
    connection.execute("ALTER TABLE identity ADD COLUMN marked INTEGER NOT NULL DEFAULT 0")


def deletions(connection: sqlite3.Connection) -> None:
    """0.5: the runs that were deleted on request, which therefore count as no loss.

    The position is that of `standings` at that time; `deleted_us` and `deleted_by`: when, and who.
    `emptied`: its entries are removed, too.
    """
    connection.execute(
        """CREATE TABLE deletions (
            run INTEGER PRIMARY KEY,
            epoch INTEGER NOT NULL,
            last_seq INTEGER NOT NULL,
            hash BLOB,
            deleted_us INTEGER NOT NULL,
            deleted_by TEXT NOT NULL,
            emptied INTEGER NOT NULL
        )"""
    )


def schedule(connection: sqlite3.Connection) -> None:
    """0.6: the missions that are to start later, and who holds them (`m2pem.scheduling.entry`).

    `plan` never changes, `state` is replaced; both are JSON. `revision` is that of the state.
    `schedule_holds` has a row for each fleet whose whole schedule is held.
    """
    connection.execute(
        """CREATE TABLE schedule (
            entry INTEGER PRIMARY KEY AUTOINCREMENT,
            fleet TEXT NOT NULL,
            plan TEXT NOT NULL,
            state TEXT NOT NULL,
            revision INTEGER NOT NULL
        )"""
    )
    connection.execute("CREATE TABLE schedule_holds (fleet TEXT PRIMARY KEY, hold TEXT NOT NULL)")


def origin_of_salvaged_runs(connection: sqlite3.Connection) -> None:
    """0.7: where the runs of a salvaged journal come from; no row: nothing was salvaged.

    `uuid`: identity of the other journal, "" if it could not be read.
    """
    connection.execute(
        """CREATE TABLE origin (
            path TEXT NOT NULL,
            uuid TEXT NOT NULL,
            salvaged_us INTEGER NOT NULL,
            salvaged_by TEXT NOT NULL
        )"""
    )


def approvals(connection: sqlite3.Connection) -> None:
    """0.8: who has approved which content of a mission, and who has edited which file.

    `approval` and `edit` are JSON (`m2pem.fleet.approval`). `digest`: of the content, or the file.
    """
    connection.execute(
        """CREATE TABLE approvals (
            fleet TEXT NOT NULL,
            digest TEXT NOT NULL,
            person TEXT NOT NULL,
            approval TEXT NOT NULL,
            PRIMARY KEY (fleet, digest, person)
        )"""
    )
    connection.execute("CREATE TABLE edits (digest TEXT PRIMARY KEY, edit TEXT NOT NULL)")


def alerts(connection: sqlite3.Connection) -> None:
    """0.9: what operators are alerted of, who acknowledged it and who takes care, as JSON."""
    connection.execute(
        """CREATE TABLE alerts (
            fleet TEXT NOT NULL,
            number INTEGER NOT NULL,
            alert TEXT NOT NULL,
            PRIMARY KEY (fleet, number)
        ) WITHOUT ROWID"""
    )


def drawings(connection: sqlite3.Connection) -> None:
    """0.10: versions of the routes, areas and points that operators have handed over, as JSON."""
    connection.execute(
        """CREATE TABLE drawings (
            fleet TEXT NOT NULL,
            number INTEGER NOT NULL,
            drawing TEXT NOT NULL,
            PRIMARY KEY (fleet, number)
        ) WITHOUT ROWID"""
    )


MIGRATIONS: tuple[Callable[[sqlite3.Connection], None], ...] = (
    runs_standings_and_entries,
    other_files_of_missions,
    identity_of_the_journal,
    hash_chain,
    deletions,
    schedule,
    origin_of_salvaged_runs,
    approvals,
    alerts,
    drawings,
)


def check(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a database that is not a journal, or of a newer m2pem. Changes nothing."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if application != APPLICATION_ID and (application or version or tables):
        raise JournalError(f"{path} is a database of another program, not a journal of m2pem")
    if version > len(MIGRATIONS):
        raise JournalError(
            f"{path} was written by a newer m2pem (format {version}; this one knows up to "
            f"{len(MIGRATIONS)}): upgrade m2pem, or use another journal"
        )


def migrate(connection: sqlite3.Connection, path: Path) -> None:
    """Bring the tables up to date, in one transaction. A new database gets all of them.

    Raises:
        JournalError: it is not a journal, or a newer one.
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        check(connection, path)
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        for step in MIGRATIONS[version:]:
            step(connection)
        # PRAGMA takes no parameters.
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:  # on a full disk SQLite itself has rolled back
            connection.execute("ROLLBACK")
        raise
