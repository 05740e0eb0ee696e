"""The journal in a PostgreSQL database, for executives on any number of hosts."""

import os
import socket
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from typing import Any, TypeVar
from uuid import UUID, uuid4

import psycopg

from m2pem.boot_time import boot_time_s
from m2pem.errors import JournalError, StaleEpochError
from m2pem.journal.codec import run_id, run_number
from m2pem.journal.database_journal import DatabaseJournal
from m2pem.journal.fleet_server import FleetServer, command_line
from m2pem.journal.lease import Executive, Lease, end_dead, lease_s, process_space
from m2pem.journal.marks import MarkFile, beside, find_losses
from m2pem.journal.position import RunPosition
from m2pem.journal.postgres_address import PostgresAddress, write_address
from m2pem.journal.postgres_changes import ChangeListener
from m2pem.journal.postgres_database import (
    PostgresConnection,
    check_server,
    connect,
    explained_error,
    identity_of,
    log,
    migrate,
)
from m2pem.journal.standbys import PLACES, standby_of
from m2pem.journal.storage import RetryError
from m2pem.journal.storage_checks import OpenFiles, min_free_mb
from m2pem.journal.transaction import position_columns

T = TypeVar("T")

_TRIES = 10
"""Of a transaction that others get in the way of."""

_BETWEEN_TRIES_S = 0.1

_SERVER = (
    "SELECT host, pid, command, digest, page,"
    " CAST(EXTRACT(EPOCH FROM lease_until - clock_timestamp()) AS double precision)"
    " FROM fleets JOIN executives ON id = executive AND lease_until > clock_timestamp()"
    " WHERE fleet = ? AND resource = ANY(?)"
)

_LIVE = "owners JOIN executives ON id = executive AND lease_until > clock_timestamp()"


class LeasedRuns:
    """The runs that this executive has taken, and has not lost since; see `RunOwners`."""

    def __init__(self, connection: PostgresConnection) -> None:
        self._connection = connection
        self._held: set[int] = set()
        self._lost: set[int] = set()
        self.fleets: dict[str, set[str]] = {}
        """What this executive serves of each fleet, unless its lease has ended since."""
        self.lease: Lease

    def acquire(self, number: int) -> bool:
        """See `RunOwners.acquire`, after `PostgresStorage.fence`."""
        self.lease.begin()
        for fleet in self.fleets:
            self._check_served(fleet)
        taken = self._connection.execute(
            "SELECT 1 FROM owners JOIN executives ON id = executive WHERE run = ?", (number,)
        ).fetchone()
        if taken is not None:
            return False
        self._connection.execute(
            "INSERT INTO owners VALUES (?, ?)"
            " ON CONFLICT (run) DO UPDATE SET executive = excluded.executive",
            (number, self.lease.id),
        )
        self._held.add(number)
        return True

    def _check_served(self, fleet: str) -> None:
        served = self._connection.execute(
            "SELECT count(*) FROM fleets WHERE fleet = ? AND executive = ?",
            (fleet, self.lease.id),
        ).fetchone()
        if served != (len(self.fleets[fleet]),):
            raise JournalError(
                f"nothing is taken: the lease of this executive has ended, and it does not serve "
                f"{fleet} again yet"
            )

    def release(self, number: int) -> None:
        self._held.discard(number)
        self._lost.discard(number)
        if self._lost or not self._held:
            self.lease.wake()

    def mine(self, number: int) -> bool:
        """See `RunOwners.mine`; also one that was lost, until it is released."""
        return number in self._held

    @property
    def any(self) -> bool:
        """Whether a run is taken here."""
        return bool(self._held)

    def lose(self) -> None:
        """Note that the lease has ended, under which all were taken."""
        self._lost.update(self._held)

    def lost(self, number: int) -> bool:
        """Whether the lease has ended since the run was taken."""
        return number in self._lost


class PostgresStorage:
    """The database of an open journal; see `Storage`."""

    errors: tuple[type[Exception], ...] = (psycopg.Error,)
    locking = " FOR UPDATE"

    def __init__(
        self,
        address: PostgresAddress,
        connection: PostgresConnection,
        owners: LeasedRuns,
        files: OpenFiles,
    ) -> None:
        self.place = address.shown
        self._connection = connection
        self.owners = owners
        self._files = files
        self._in_transaction = False
        self._begun = False
        self._excludes = False
        self._tries = 0
        self._unknown = False
        self._written: dict[int, tuple[int, bytes | None]] = {}
        """Epoch and hash of the runs of this executive, as they were written last."""

    @property
    def connection(self) -> PostgresConnection:
        """See `Storage.connection`. The server learns of a transaction with its first statement."""
        if self._in_transaction and not self._begun:
            self._connection.execute("BEGIN")
            self._begun = True
        return self._connection

    def begin(self) -> bool:
        """See `Storage.begin`: the positions of runs that are this executive's stay known."""
        self._in_transaction, self._begun, self._excludes = True, False, False
        return True

    def exclude_others(self) -> None:
        """See `Storage.exclude_others`; appends go on."""
        if not self._excludes:
            self.connection.execute("SELECT 1 FROM identity FOR UPDATE")
            self._excludes = True

    def fence(self, number: int) -> None:
        """See `Storage.fence`. A transaction of it that is under way is ended: the process may
        stand still in the middle of it."""
        self._end_owner("owners", "run", number)

    def _end_owner(self, table: str, column: str, value: int | str) -> None:
        end_dead(self.connection)
        # It can never renew its lease, once its row is gone; one that does so now is waited for.
        ended = self.connection.execute(
            f"DELETE FROM executives USING {table} WHERE executives.id = {table}.executive"
            f" AND {table}.{column} = ? AND lease_until <= clock_timestamp() RETURNING session",
            (value,),
        ).fetchone()
        if ended is not None:
            # Not this connection: the ended lease may have been this executive's own.
            self.connection.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = ?"
                " AND usename = current_user AND pid <> pg_backend_pid()",
                ended,
            )

    def driver(self, number: int, position: RunPosition) -> str:
        """See `Storage.driver`, after `fence`: who is still there had a lease then."""
        row = self.connection.execute(
            "SELECT pid, host, command FROM owners JOIN executives ON id = executive WHERE run = ?",
            (number,),
        ).fetchone()
        if row is None:
            return ""
        pid, host, command = row
        return f"process {pid} on {host} ({command})"

    def refuse_lost(self, number: int) -> None:
        if self.owners.lost(number):
            raise _lost(number)

    def give_up(self, number: int) -> bool:
        self.connection.execute(
            "DELETE FROM owners WHERE run = ? AND executive = ?", (number, self.owners.lease.id)
        )
        self._written.pop(number, None)
        return True

    def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str, page: str
    ) -> FleetServer | None:
        """See `Storage.serve_fleet`: for as long as the lease lasts."""
        lease = self.owners.lease
        self._end_owner("fleets", "fleet", fleet)
        names = list(resources)
        other = self.connection.execute(
            f"{_SERVER} AND id <> ?", (fleet, names, lease.id)
        ).fetchone()
        if other is not None:
            return FleetServer(*other)
        lease.begin()
        lives = self.connection.execute(
            "SELECT 1 FROM executives WHERE id = ? AND lease_until > clock_timestamp()", (lease.id,)
        ).fetchone()
        if lives is None:
            lease.end()
            lease.begin()  # says so
        self.connection.execute(
            "INSERT INTO fleets SELECT ?, resource, ?, ?, ?"
            " FROM unnest(CAST(? AS text[])) AS resource ON CONFLICT (fleet, resource)"
            " DO UPDATE SET executive = excluded.executive, digest = excluded.digest,"
            " page = excluded.page WHERE fleets.executive <> excluded.executive",
            (fleet, lease.id, digest, page, names),
        )
        self.owners.fleets.setdefault(fleet, set()).update(names)
        return None

    def leave_fleet(self, fleet: str) -> None:
        self.owners.fleets.pop(fleet, None)
        self.connection.execute(
            "DELETE FROM fleets WHERE fleet = ? AND executive = ?", (fleet, self.owners.lease.id)
        )

    def add_to_schedule(self, fleet: str, plan: str, state: str, revision: int) -> int:
        (number,) = self.connection.execute(
            "UPDATE identity SET last_entry = last_entry + 1 RETURNING last_entry"
        ).fetchone()  # type: ignore[misc]
        self.connection.execute(
            "INSERT INTO schedule VALUES (?, ?, ?, ?, ?)", (number, fleet, plan, state, revision)
        )
        return int(number)

    def commit(
        self, entries: Sequence[tuple[Any, ...]], positions: Mapping[int, RunPosition], wrote: bool
    ) -> None:
        if not self._begun and not positions:
            self._in_transaction = False
            return
        raw = self._connection.raw
        with raw.pipeline():
            if not self._begun:
                raw.execute("BEGIN")
                self._begun = True
            standings = raw.execute(f"{_STANDINGS} ORDER BY run FOR UPDATE", (list(positions),))
            state = raw.execute(
                "SELECT pg_current_xact_id()::text, pg_postmaster_start_time()::text,"
                " (SELECT lease_until > clock_timestamp() FROM executives WHERE id = %s)"
                if wrote
                else "SELECT '', '', false",
                (self.owners.lease.id,) if wrote else None,
            )
            if entries:
                raw.execute(_INSERT_ENTRIES, _columns(entries))
            if positions:
                rows = [position_columns(*each) for each in positions.items()]
                raw.execute(_WRITE_STANDINGS, _columns(rows))
        there = {number: (epoch, hash_) for number, epoch, hash_ in standings}
        if any(epoch > positions[number].epoch for number, (epoch, _) in there.items()):
            raise RetryError  # another has claimed it: read again, its position says so
        transaction, server, leased = state.fetchone() or ("", "", False)
        if positions and not leased:
            self.owners.lease.end()
            raise RetryError
        for number in positions.keys() & self._written.keys():
            if there.get(number) != self._written.pop(number):
                raise RetryError  # a server without it has taken over: read again, the mark says so
        self._commit(transaction, server, positions)
        self._written.update(_standings_of(positions))

    def _commit(self, transaction: str, server: str, positions: Mapping[int, RunPosition]) -> None:
        self._in_transaction = False
        try:
            self._connection.raw.execute("COMMIT")
        except self.errors as error:
            if not transaction or not self._connection.lost:
                raise
            if not self._was_committed(transaction, server, positions, error):
                raise RetryError from error
        self._tries = 0

    def _was_committed(
        self,
        transaction: str,
        server: str,
        positions: Mapping[int, RunPosition],
        error: Exception,
    ) -> bool:
        """Ask the server what has become of a transaction whose connection was lost.

        One that starts again, or takes over, may give the number of the transaction to another
        one: what was to be written says more than the number.
        """
        while True:
            if not self._connected_again():
                self._unknown = True
                raise error
            try:
                status, now = self._connection.execute(
                    "SELECT pg_xact_status(CAST(? AS xid8)), pg_postmaster_start_time()::text",
                    (transaction,),
                ).fetchone()  # type: ignore[misc]
                rows = self._connection.raw.execute(_STANDINGS, (list(positions),)).fetchall()
            except psycopg.errors.InvalidParameterValue:
                return False  # the server has taken over from another one, and never had it
            except psycopg.OperationalError:
                continue
            if status == "in progress":
                time.sleep(_BETWEEN_TRIES_S)
            elif positions:
                there = {number: (epoch, hash_) for number, epoch, hash_ in rows}
                return there == _standings_of(positions)
            elif now == server:
                return bool(status == "committed")
            else:
                self._unknown = True
                raise error

    def _connected_again(self) -> bool:
        """Connect again, as long as this executive surely has its runs."""
        lease = self.owners.lease
        until_s = lease.until_s if lease.until_s is not None else boot_time_s() + lease.length_s
        while True:
            with suppress(psycopg.Error):
                self._connection.execute("SELECT 1")
                return True
            if boot_time_s() + _BETWEEN_TRIES_S > until_s - lease.length_s / 3:
                return False
            time.sleep(_BETWEEN_TRIES_S)

    def rollback(self) -> None:
        begun, self._in_transaction = self._in_transaction and self._begun, False
        if begun and not self._connection.lost:
            self._connection.execute("ROLLBACK")

    def check(self) -> None:
        """See `Storage.check`: of the marks, the only files."""
        self._files.check()

    def explained(self, error: Exception) -> JournalError:
        explained = explained_error(error, self.place)
        if not self._unknown:
            return explained
        self._unknown = False
        return JournalError(f"{explained}. What was being written may or may not be in it")

    def is_transient(self, error: Exception) -> bool:
        """See `Storage.is_transient`: what a run has written is read again, before more follows."""
        return True

    def is_worth_a_retry(self, error: Exception) -> bool:
        self._tries += 1
        passed = not self._unknown and self._tries < _TRIES
        if isinstance(
            error, (psycopg.errors.DeadlockDetected, psycopg.errors.SerializationFailure)
        ):
            again = passed
        else:
            again = passed and self._connection.lost and self._connected_again()
        if not again:
            self._tries = 0
        return again


def _lost(number: int) -> StaleEpochError:
    return StaleEpochError(
        f"{run_id(number)}: the lease of this executive has ended, so another may have claimed it: "
        "this one must stop driving it"
    )


def _standings_of(positions: Mapping[int, RunPosition]) -> dict[int, tuple[int, bytes | None]]:
    return {number: (each.epoch, each.hash) for number, each in positions.items()}


def _columns(rows: Sequence[tuple[Any, ...]]) -> list[list[Any]]:
    return [list(column) for column in zip(*rows, strict=True)]


_STANDINGS = "SELECT run, epoch, hash FROM standings WHERE run = ANY(%s)"

# As binary parameters (%b): psycopg writes a text's array with a regular expression, by far slower.
_INSERT_ENTRIES = (
    "INSERT INTO entries SELECT run, seq, epoch, at_us, t_us, convert_to(body, 'UTF8'), hash FROM"
    " unnest(%b::bigint[], %b::bigint[], %b::bigint[], %b::bigint[], %b::bigint[], %b::text[],"
    " %b::bytea[]) AS given (run, seq, epoch, at_us, t_us, body, hash)"
)

_WRITE_STANDINGS = (
    "INSERT INTO standings SELECT * FROM unnest(%b::bigint[], %b::bigint[], %b::bigint[],"
    " %b::bigint[], %b::bigint[], %b::int[], %b::text[], %b::text[], %b::bigint[], %b::bytea[],"
    " %b::bytea[]) ON CONFLICT (run) DO UPDATE SET epoch = excluded.epoch, pid = excluded.pid,"
    " started_us = excluded.started_us, last_seq = excluded.last_seq, paused = excluded.paused,"
    " outcome = excluded.outcome, detail = excluded.detail, ended_us = excluded.ended_us,"
    " hash = excluded.hash, seal = excluded.seal"
)


class PostgresJournal(DatabaseJournal):
    """An append that returned is where `synchronous_commit` of the server says, at least on its
    disk; a run belongs to the executive that has taken it for as long as its lease lasts.

    Beside the file of its address, `FILE-mark` has what executives of this host acknowledged last.
    """

    batch_entries = 200

    def __init__(
        self,
        address: PostgresAddress,
        connection: PostgresConnection,
        marks: MarkFile,
        identity: UUID,
        length_s: float,
        session: str,
    ) -> None:
        owners = LeasedRuns(connection)
        executive = Executive(
            socket.gethostname(),
            process_space(),
            os.getpid(),
            command_line(),
            str(address.file),
            session,
        )
        self._lease = owners.lease = Lease(
            # A server's host that is off is given up in time to renew at another one before the
            # runs are held: a third of the lease after the last renewal, this, and one try.
            lambda: connect(address, length_s / 9),
            length_s,
            executive,
            owners.lose,
            lambda: not owners.any,
        )
        self._owners = owners
        self._writing = connection
        self._connect = partial(connect, address, length_s)
        self._pooled = PostgresConnection(self._connect)
        self._changes = ChangeListener(address, length_s, session)
        storage = PostgresStorage(address, connection, owners, OpenFiles([marks.path]))
        super().__init__(address.file, identity, storage, self._pooled, marks)

    @classmethod
    def open(cls, address: PostgresAddress) -> "PostgresJournal":
        """Open a journal, making its tables where they are missing; `close` it in the end.

        What executives of this host acknowledged and is gone is logged as an error, and each run's
        `RunInfo.loss`.

        Raises:
            JournalError: no server answers, it refuses, the database is no journal, ...
        """
        min_free_mb()  # a wrong setting is reported now, not when a run is to begin
        length_s = lease_s()
        shown = address.shown
        session = f"m2pem {uuid4()}"
        # An executive that is stopped or cut off within a transaction keeps others waiting no
        # longer than its lease, after which it could not commit. One that reads has no locks.
        connection = PostgresConnection(lambda: connect(address, length_s / 3, session, length_s))
        with ExitStack() as undo:
            undo.callback(connection.close)
            try:
                check_server(connection.raw, shown)
                migrate(connection.raw, shown)
                identity = identity_of(connection.raw, shown)
                end_dead(connection)
                write_address(address)
                marks = MarkFile(beside(address.file, "mark"), identity)
                undo.callback(marks.close)
                for number, loss in find_losses(connection, marks.read()).items():
                    log.error("%s: %s: %s", shown, run_id(number), loss)
            except psycopg.Error as error:
                raise explained_error(error, shown) from error
            except OSError as error:
                name = error.filename or address.file
                raise JournalError(f"{name} can't be opened: {error.strerror}") from error
            undo.pop_all()
        return cls(address, connection, marks, identity, length_s, session)

    @property
    def owned_until_s(self) -> float | None:
        return self._lease.until_s if self._owners.any else None

    @property
    def lease_s(self) -> float | None:
        return self._lease.length_s

    def abandon(self, fleet: str) -> FleetServer | None:
        try:
            with closing(PostgresConnection(self._connect)) as connection:
                standby = connection.execute(_SERVER, (standby_of(fleet), list(PLACES))).fetchone()
                if standby is None:
                    return None
                self._lease.abandon(connection)
        except psycopg.Error as error:
            raise explained_error(error, self._place) from error
        return FleetServer(*standby)

    async def changed(self, seen: int) -> int:
        self._check_open()
        return await self._changes.changed(seen)

    async def close(self) -> None:
        await self._changes.close()
        await super().close()

    async def check_claim(self, run: str, epoch: int) -> None:
        """See `Journal.check_claim`: also whether the lease, under which it was claimed, lasts."""
        await super().check_claim(run, epoch)
        number = run_number(run)
        found = await self._read(
            lambda: self._pooled.execute(
                f"SELECT 1 FROM {_LIVE} WHERE run = ? AND id = ?", (number, self._lease.id)
            ).fetchone()
        )
        if found is None or self._owners.lost(number):
            raise _lost(number)

    @contextmanager
    def _snapshot(self) -> Iterator[None]:
        self._pooled.execute("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY")
        try:
            yield
        finally:
            if not self._pooled.lost:
                self._pooled.execute("ROLLBACK")

    def _driven(self, numbers: Collection[int]) -> Collection[int]:
        return {row[0] for row in self._pooled.execute(f"SELECT run FROM {_LIVE}")}

    def _fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        row = self._pooled.execute(_SERVER, (fleet, list(resources))).fetchone()
        return None if row is None else FleetServer(*row)

    async def _read(self, work: Callable[[], T]) -> T:
        return await super()._read(partial(self._read_again, work))

    def _read_again(self, work: Callable[[], T]) -> T:
        """Read; if the connection is lost meanwhile, once more over a new one."""
        try:
            return work()
        except psycopg.OperationalError:
            if not self._pooled.lost:
                raise
        until_s = boot_time_s() + self._lease.length_s
        while True:
            try:
                return work()
            except psycopg.OperationalError:
                if not self._pooled.lost or boot_time_s() > until_s:
                    raise
            time.sleep(_BETWEEN_TRIES_S)

    def _finish(self) -> None:
        self._reader.submit(self._pooled.close)
        self._reader.shutdown()
        self._lease.close()
        self._writing.close()
        self._marks.close()
