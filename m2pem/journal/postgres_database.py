"""The PostgreSQL database of a journal: connecting to it, its tables, and explaining its errors."""

import logging
from collections.abc import Callable
from functools import lru_cache
from typing import Any, LiteralString
from uuid import UUID, uuid4

import psycopg

from m2pem.errors import JournalError
from m2pem.journal.postgres_address import PostgresAddress

log = logging.getLogger("m2pem.journal")

OLDEST_VERSION = 13
"""Of the server: `pg_current_xact_id` and `pg_xact_status` of 64 bits."""

LOCKED_FOR_S = 5.0
"""How long a statement waits for other executives."""

_LOCK = 0x6D327065
"""The advisory lock of who makes or changes the tables: "m2pe"."""


_RENEW_ALL = """DO $$ BEGIN
    UPDATE executives SET lease_until = clock_timestamp() + lease,
        server_start = pg_postmaster_start_time()
        WHERE server_start <> pg_postmaster_start_time();
    EXCEPTION WHEN undefined_table OR undefined_column OR insufficient_privilege THEN NULL;
END $$"""
"""A server that has taken over, or was started again, may have another clock than the one by which
leases were renewed: the first that connects lets each last its full length from then on. What is
excepted: a new database, an old one before `migrate`, and a role that may only read."""

CHANNEL = "m2pem"
"""On which executives are notified of what others change."""


def connection_parameters(within_s: float, session: str = "m2pem") -> dict[str, Any]:
    """Return libpq's parameters of a connection, beside its URL; see `connect`."""
    return {
        "autocommit": True,
        "application_name": session,
        "client_encoding": "UTF8",
        # One of several hosts may be gone: the next one must be reached before a lease ends.
        "connect_timeout": max(2, round(within_s / 3)),
        "target_session_attrs": "primary",
        "tcp_user_timeout": max(1000, round(within_s * 1000)),
        "keepalives_idle": max(1, round(within_s)),
        "keepalives_interval": 1,
        "keepalives_count": 3,
    }


def connect(
    address: PostgresAddress,
    within_s: float,
    session: str = "m2pem",
    idle_within_s: float = 60.0,
) -> psycopg.Connection[Any]:
    """Connect to the server; statements are committed one by one. The checks are those of `open`.

    `within_s`: what the other side does not acknowledge by then is given up, on both sides.
    `session`: what the server calls it. `idle_within_s`: after so long without a statement the
    server gives up a transaction.

    Raises:
        psycopg.Error: see `explained_error`.
    """
    within_ms = max(1000, round(within_s * 1000))
    connection = psycopg.connect(address.url, **connection_parameters(within_s, session))
    try:
        with connection.pipeline():
            # A host that is gone must not keep its locks for hours.
            connection.execute(f"SET tcp_user_timeout = {within_ms}")
            connection.execute(f"SET tcp_keepalives_idle = {max(1, round(within_s))}")
            connection.execute("SET tcp_keepalives_interval = 1")
            connection.execute("SET tcp_keepalives_count = 3")
            connection.execute(f"SET lock_timeout = {round(LOCKED_FOR_S * 1000)}")
            idle_ms = max(1000, round(idle_within_s * 1000))
            connection.execute(f"SET idle_in_transaction_session_timeout = {idle_ms}")
            # What BEGIN begins: rows that another executive has changed are waited for, and seen.
            connection.execute("SET default_transaction_isolation = 'read committed'")
            connection.execute("SET default_transaction_read_only = off")
            connection.execute(_RENEW_ALL)
    except BaseException:
        connection.close()
        raise
    return connection


class PostgresConnection:
    """A connection that is made when it is needed; see `storage.Connection`."""

    def __init__(self, connect: Callable[[], psycopg.Connection[Any]]) -> None:
        self._connect = connect
        self._made: psycopg.Connection[Any] | None = None

    @property
    def raw(self) -> psycopg.Connection[Any]:
        """The connection; a new one if it was lost."""
        if self._made is None or self._made.closed:
            self._made = self._connect()
        return self._made

    @property
    def lost(self) -> bool:
        """Whether there is no connection now."""
        return self._made is None or self._made.closed

    def execute(self, statement: str, parameters: Any = ()) -> psycopg.Cursor[Any]:
        """Carry out a statement that has `?` for its parameters."""
        return self.raw.execute(_translated(statement), parameters or None)

    def close(self) -> None:
        """Close it, if it was made."""
        if self._made is not None:
            self._made.close()
        self._made = None


@lru_cache
def _translated(statement: str) -> LiteralString:
    return statement.replace("?", "%s")


def check_server(connection: psycopg.Connection[Any], shown: str) -> None:
    """Check what a journal needs of a server, and warn of what may lose entries.

    Raises:
        JournalError: it is too old, or the database has another encoding.
    """
    version = connection.info.server_version // 10_000
    if version < OLDEST_VERSION:
        raise JournalError(
            f"{shown}: the server is PostgreSQL {version}; a journal needs {OLDEST_VERSION} or "
            "newer"
        )
    encoding, fsync, replies = _one(
        connection,
        "SELECT current_setting('server_encoding'), current_setting('fsync'),"
        " current_setting('synchronous_commit')",
    )
    if encoding != "UTF8":
        raise JournalError(
            f"{shown}: the encoding of the database is {encoding}: make one with "
            "`CREATE DATABASE ... ENCODING 'UTF8' TEMPLATE template0`"
        )
    if replies == "off":
        # As SQLite's `synchronous`: an executive acts on what a commit says.
        connection.execute("SET synchronous_commit = on")
    if fsync == "off":
        log.warning(
            "%s: the server has fsync = off: entries that were acknowledged may be lost in a crash "
            "of its host",
            shown,
        )


def first_tables(connection: psycopg.Connection[Any]) -> None:
    """0.3: those of the SQLite journal's format 6 (`m2pem.journal.migrations`), and who owns runs.

    `identity.last_entry` is the last number given in `schedule`; its row is the lock of the
    executive that takes a run. `owners` says which executive has a run, for as long as that one is
    in `executives` and its lease has not ended, by the clock of the server.
    """
    for statement in (
        "CREATE TABLE identity (uuid TEXT NOT NULL, last_entry BIGINT NOT NULL)",
        """CREATE TABLE runs (
            run BIGINT PRIMARY KEY,
            mission_name TEXT NOT NULL,
            mission BYTEA NOT NULL,
            process TEXT NOT NULL,
            fleet BYTEA NOT NULL,
            simulated INTEGER NOT NULL,
            speed DOUBLE PRECISION NOT NULL,
            created_us BIGINT NOT NULL,
            library TEXT NOT NULL
        )""",
        # Rewritten at each commit: room in a page keeps its index as it is.
        """CREATE TABLE standings (
            run BIGINT PRIMARY KEY REFERENCES runs,
            epoch BIGINT NOT NULL,
            pid BIGINT NOT NULL,
            started_us BIGINT NOT NULL,
            last_seq BIGINT NOT NULL,
            paused INTEGER NOT NULL,
            outcome TEXT,
            detail TEXT NOT NULL,
            ended_us BIGINT,
            hash BYTEA,
            seal BYTEA
        ) WITH (fillfactor = 50)""",
        """CREATE TABLE entries (
            run BIGINT NOT NULL,
            seq BIGINT NOT NULL,
            epoch BIGINT NOT NULL,
            at_us BIGINT NOT NULL,
            t_us BIGINT NOT NULL,
            body BYTEA NOT NULL,
            hash BYTEA,
            PRIMARY KEY (run, seq)
        )""",
        """CREATE TABLE deletions (
            run BIGINT PRIMARY KEY,
            epoch BIGINT NOT NULL,
            last_seq BIGINT NOT NULL,
            hash BYTEA,
            deleted_us BIGINT NOT NULL,
            deleted_by TEXT NOT NULL,
            emptied INTEGER NOT NULL
        )""",
        """CREATE TABLE schedule (
            entry BIGINT PRIMARY KEY,
            fleet TEXT NOT NULL,
            plan TEXT NOT NULL,
            state TEXT NOT NULL,
            revision BIGINT NOT NULL
        )""",
        "CREATE TABLE schedule_holds (fleet TEXT PRIMARY KEY, hold TEXT NOT NULL)",
        """CREATE TABLE executives (
            id UUID PRIMARY KEY,
            host TEXT NOT NULL,
            processes TEXT NOT NULL,
            pid BIGINT NOT NULL,
            command TEXT NOT NULL,
            control TEXT NOT NULL,
            session TEXT NOT NULL,
            lease_until TIMESTAMPTZ NOT NULL
        ) WITH (fillfactor = 50)""",
        "CREATE TABLE owners (run BIGINT PRIMARY KEY, executive UUID NOT NULL)",
    ):
        connection.execute(statement)
    connection.execute("INSERT INTO identity VALUES (%s, 0)", (str(uuid4()),))


def fleets(connection: psycopg.Connection[Any]) -> None:
    """0.3: which executive serves a vehicle or payload, for as long as its lease lasts."""
    connection.execute(
        "CREATE TABLE fleets"
        " (fleet TEXT NOT NULL, resource TEXT NOT NULL, executive UUID NOT NULL,"
        " digest TEXT NOT NULL, PRIMARY KEY (fleet, resource))"
    )


def notifications(connection: psycopg.Connection[Any]) -> None:
    """0.3: what tells executives of a change of the schedule, or of who serves a fleet."""
    connection.execute(
        "CREATE OR REPLACE FUNCTION m2pem_tell() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
        f" PERFORM pg_notify('{CHANNEL}', current_setting('application_name'));"
        " RETURN NULL; END $$"
    )
    for table in ("schedule", "schedule_holds", "fleets"):
        connection.execute(
            f"CREATE TRIGGER m2pem_tell AFTER INSERT OR UPDATE OR DELETE ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION m2pem_tell()"
        )


def pages(connection: psycopg.Connection[Any]) -> None:
    """0.3: where the web page of an executive is that serves a fleet, or stands by for it."""
    connection.execute("ALTER TABLE fleets ADD COLUMN page TEXT NOT NULL DEFAULT ''")


def server_starts(connection: psycopg.Connection[Any]) -> None:
    """0.3: which start of which server has renewed a lease, by whose clock, and for how long."""
    connection.execute(
        "ALTER TABLE executives"
        " ADD COLUMN lease INTERVAL NOT NULL DEFAULT '5 seconds',"
        " ADD COLUMN server_start TIMESTAMPTZ NOT NULL DEFAULT pg_postmaster_start_time()"
    )
    # Of an older m2pem that still drives: it renews each third, so that two thirds are left.
    connection.execute(
        "UPDATE executives SET lease = GREATEST(lease, (lease_until - clock_timestamp()) * 1.6)"
    )


def approvals(connection: psycopg.Connection[Any]) -> None:
    """0.4: who has approved which content of a mission, and who has edited which file."""
    connection.execute(
        "CREATE TABLE approvals (fleet TEXT NOT NULL, digest TEXT NOT NULL, person TEXT NOT NULL,"
        " approval TEXT NOT NULL, PRIMARY KEY (fleet, digest, person))"
    )
    connection.execute("CREATE TABLE edits (digest TEXT PRIMARY KEY, edit TEXT NOT NULL)")


def alerts(connection: psycopg.Connection[Any]) -> None:
    """0.4: what operators are alerted of, who acknowledged it and who takes care, as JSON."""
    connection.execute(
        "CREATE TABLE alerts (fleet TEXT NOT NULL, number BIGINT NOT NULL, alert TEXT NOT NULL,"
        " PRIMARY KEY (fleet, number))"
    )


def drawings(connection: psycopg.Connection[Any]) -> None:
    """0.5: versions of the routes, areas and points that operators have handed over, as JSON."""
    connection.execute(
        "CREATE TABLE drawings (fleet TEXT NOT NULL, number BIGINT NOT NULL, drawing TEXT NOT NULL,"
        " PRIMARY KEY (fleet, number))"
    )


MIGRATIONS: tuple[Callable[[psycopg.Connection[Any]], None], ...] = (
    first_tables,
    fleets,
    notifications,
    pages,
    server_starts,
    approvals,
    alerts,
    drawings,
)
"""A released step is never changed; a change becomes a new step at the end."""


def migrate(connection: psycopg.Connection[Any], shown: str) -> None:
    """Bring the tables up to date, in one transaction; a new database gets all of them.

    Raises:
        JournalError: it has tables of another program, or is of a newer m2pem.
    """
    if _format(connection, shown) == len(MIGRATIONS):
        return  # who only writes needs no right to make tables
    with connection.transaction():
        connection.execute("SELECT pg_advisory_xact_lock(%s)", (_LOCK,))
        version = _format(connection, shown)
        if version == 0:
            connection.execute("CREATE TABLE m2pem_format (version INTEGER NOT NULL)")
            connection.execute("INSERT INTO m2pem_format VALUES (0)")
        for step in MIGRATIONS[version:]:
            step(connection)
        connection.execute("UPDATE m2pem_format SET version = %s", (len(MIGRATIONS),))


def _format(connection: psycopg.Connection[Any], shown: str) -> int:
    there, tables = _one(
        connection,
        "SELECT to_regclass('m2pem_format') IS NOT NULL,"
        " (SELECT count(*) FROM pg_tables WHERE schemaname = current_schema())",
    )
    if not there:
        if tables:
            raise JournalError(
                f"{shown} is a database of another program, not a journal of m2pem: make one for "
                "it alone"
            )
        return 0
    (version,) = _one(connection, "SELECT version FROM m2pem_format")
    if version > len(MIGRATIONS):
        raise JournalError(
            f"{shown} was written by a newer m2pem (format {version}; this one knows up to "
            f"{len(MIGRATIONS)}): upgrade m2pem, or use another journal"
        )
    return int(version)


def identity_of(connection: psycopg.Connection[Any], shown: str) -> UUID:
    """Return the identity of a journal.

    Raises:
        JournalError: it has none.
    """
    rows = connection.execute("SELECT uuid FROM identity").fetchall()
    try:
        ((text,),) = rows
        return UUID(text)
    except ValueError as error:
        raise JournalError(f"{shown}: it is damaged: its identity cannot be read") from error


def _one(connection: psycopg.Connection[Any], statement: LiteralString) -> Any:
    row = connection.execute(statement).fetchone()
    assert row is not None
    return row


_BY_STATE = {
    "28P01": "the server refuses the password: put the right one into ~/.pgpass",
    "28000": "the server refuses this user: correct the user of the URL, or the server's "
    "pg_hba.conf",
    "3D000": "there is no such database: make it with `createdb`",
    "42501": "the role may not do this: let the owner of the database open it once, and grant the "
    "role SELECT, INSERT, UPDATE and DELETE on its tables",
    "53100": "the disk of the server is full; make room",
    "53300": "the server has too many connections: end some, or raise max_connections (an "
    "executive takes four)",
    "25006": "the server can only be read; it may have become a standby",
    "55P03": f"other executives have kept it locked for {LOCKED_FOR_S:g} s",
    "57P01": "the server is shutting down; start it again",
    "57P03": "the server is starting or shutting down; try again",
    "58030": "the disk of the server failed to read or write",
    "XX001": "it is damaged; restore a backup",
    "XX002": "an index is damaged: `REINDEX DATABASE`, after a backup",
}

# A connection that was refused has no state, only the words of libpq or the server.
_BY_TEXT = {
    "password authentication failed": _BY_STATE["28P01"],
    "no password supplied": "the server wants a password: put it into ~/.pgpass "
    "(host:port:database:user:password, readable by you alone)",
    'database "': _BY_STATE["3D000"],
    'role "': _BY_STATE["28000"],
    "pg_hba.conf": _BY_STATE["28000"],
    "too many": _BY_STATE["53300"],
    "starting up": _BY_STATE["57P03"],
    "shutting down": _BY_STATE["57P03"],
    "translate host name": "no host has that name: correct the URL",
    "hot standby": "the server is a standby, which cannot be written to: name the primary, or all "
    "servers (postgresql://host1,host2/database)",
    "service": "libpq does not know that service: see pg_service.conf",
}

UNREACHABLE = "no PostgreSQL server answers there: start it, or correct host and port of the URL"


def explained_error(error: Exception, shown: str) -> JournalError:
    """Return an error that says what is wrong with a database, and the remedy."""
    state = getattr(error, "sqlstate", None) or ""
    said = " ".join(str(error).split())
    explanation = _BY_STATE.get(state)
    if explanation is None and not state and isinstance(error, psycopg.OperationalError):
        explanation = next((why for text, why in _BY_TEXT.items() if text in said), UNREACHABLE)
    return JournalError(f"{shown}: {explanation or 'PostgreSQL refused'} ({said})")
