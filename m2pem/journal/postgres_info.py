"""What the database of a journal in PostgreSQL is now: its format and size, and who writes."""

import socket
from contextlib import closing
from dataclasses import dataclass

import psycopg

from m2pem.journal.codec import run_id
from m2pem.journal.postgres_address import PostgresAddress
from m2pem.journal.postgres_database import MIGRATIONS, connect, explained_error
from m2pem.journal.standbys import STANDBY_OF

LATEST_FORMAT = len(MIGRATIONS)
"""The version of the tables that this m2pem writes."""

_WITHIN_S = 5.0


@dataclass(frozen=True, slots=True)
class DatabaseInfo:
    """Format and size in bytes; `server`: its version. `executives`: those whose lease lasts."""

    format: int
    size: int
    server: str
    executives: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExecutiveElsewhere:
    """An executive of another host whose lease lasts: what it serves, and the runs it drives.

    `page`: the address of its web page; "": it has none."""

    host: str
    pid: int
    command: str
    fleets: tuple[str, ...]
    runs: tuple[str, ...]
    page: str

    def __str__(self) -> str:
        return f"process {self.pid}: {self.command}"


def executives_elsewhere(address: PostgresAddress) -> tuple[ExecutiveElsewhere, ...]:
    """Return the executives of other hosts on a journal that was opened before, but standbys.

    Raises:
        JournalError: it cannot be read.
    """
    try:
        with closing(connect(address, _WITHIN_S)) as connection:
            rows = connection.execute(
                "SELECT host, pid, command,"
                " ARRAY(SELECT DISTINCT fleet FROM fleets WHERE executive = id ORDER BY fleet),"
                " ARRAY(SELECT run FROM owners WHERE executive = id ORDER BY run),"
                " COALESCE((SELECT max(page) FROM fleets WHERE executive = id), '')"
                " FROM executives WHERE lease_until > clock_timestamp() AND host <> %s"
                " ORDER BY host, pid",
                (socket.gethostname(),),
            ).fetchall()
    except psycopg.Error as error:
        raise explained_error(error, address.shown) from error
    found = []
    for host, pid, command, served, runs, page in rows:
        fleets = tuple(each for each in served if not each.startswith(STANDBY_OF))
        if fleets or runs or not served:  # not one that only stands by
            ids = tuple(map(run_id, runs))
            found.append(ExecutiveElsewhere(host, pid, command, fleets, ids, page))
    return tuple(found)


def database_info(address: PostgresAddress) -> DatabaseInfo:
    """Return what the database of a journal that was opened before is now.

    Raises:
        JournalError: it cannot be read.
    """
    try:
        with closing(connect(address, _WITHIN_S)) as connection:
            row = connection.execute(
                "SELECT version, pg_database_size(current_database()),"
                " current_setting('server_version') FROM m2pem_format"
            ).fetchone()
            assert row is not None
            executives = connection.execute(
                "SELECT pid, host, command FROM executives WHERE lease_until > clock_timestamp()"
                " ORDER BY host, pid"
            ).fetchall()
    except psycopg.Error as error:
        raise explained_error(error, address.shown) from error
    named = tuple(f"process {pid} on {host}: {command}" for pid, host, command in executives)
    version, size, server = row
    return DatabaseInfo(version, size, server, named)
