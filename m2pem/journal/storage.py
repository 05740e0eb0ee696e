"""What differs between the databases of a journal: the connection, ownership of runs, errors.

All statements are written for both, with `?` for parameters; see `transaction` and
`database_journal`.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Protocol

from m2pem.errors import JournalError
from m2pem.journal.fleet_server import FleetServer
from m2pem.journal.position import RunPosition


class Rows(Protocol):
    """The rows that a statement found."""

    def fetchone(self) -> Any:
        """Return the next row; None: there is none."""

    def fetchall(self) -> list[Any]:
        """Return the rows that are left."""

    def __iter__(self) -> Iterator[Any]:
        """Yield the rows that are left."""

    def close(self) -> None:
        """Read no more of them."""


class Connection(Protocol):
    """A connection to a database."""

    def execute(self, statement: str, parameters: Sequence[Any] = ..., /) -> Rows:
        """Carry out one statement."""


class RunOwners(Protocol):
    """The runs that this executive drives, and whether others drive one. Called by any thread."""

    def acquire(self, number: int) -> bool:
        """Take a run, within a transaction; False when it is taken already, be it here.

        Raises:
            OSError: it cannot be taken.
        """

    def release(self, number: int) -> None:
        """Drive a run no more, if it was taken here."""

    def mine(self, number: int) -> bool:
        """Whether a run was taken here."""


class RetryError(Exception):
    """Nothing of the transaction was written, and its calls are to be carried out again."""


class Storage(Protocol):
    """The database of one open journal. Used by the writing thread alone."""

    @property
    def place(self) -> str:
        """What names the journal in messages; never a password."""

    @property
    def errors(self) -> tuple[type[Exception], ...]:
        """What statements raise."""

    @property
    def connection(self) -> Connection:
        """Carries out statements within a transaction."""

    @property
    def locking(self) -> str:
        """What a query ends with so that no other transaction changes the row that it finds."""

    @property
    def owners(self) -> RunOwners:
        """Who drives which run."""

    def fence(self, number: int) -> None:
        """Let the owner of a run write to it no more, if it has lost the run; within a transaction
        that excludes others."""

    def driver(self, number: int, position: RunPosition) -> str:
        """Who drives a run, in words; "": no living executive."""

    def refuse_lost(self, number: int) -> None:
        """Check that a run that was taken here is still this executive's.

        Raises:
            StaleEpochError: it may be another's.
        """

    def give_up(self, number: int) -> bool:
        """Note that a run is free, within a transaction; False: it is noted elsewhere."""

    def begin(self) -> bool:
        """Start a transaction; False: what is known of positions holds no more."""

    def exclude_others(self) -> None:
        """Let no other executive take or delete runs, or change the schedule, until the end of the
        transaction."""

    def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str, page: str
    ) -> FleetServer | None:
        """Serve these of a fleet, within a transaction that excludes others; returns who else
        serves one of them, and None when all are served here.

        Raises:
            OSError: it cannot be noted.
        """

    def leave_fleet(self, fleet: str) -> None:
        """Serve a fleet no more, if it is served here; within a transaction."""

    def add_to_schedule(self, fleet: str, plan: str, state: str, revision: int) -> int:
        """Add a row to the table `schedule`; returns its number, which was never given before."""

    def commit(
        self, entries: Sequence[tuple[Any, ...]], positions: Mapping[int, RunPosition], wrote: bool
    ) -> None:
        """Write rows of `entries` and of `standings`, and make the transaction durable.

        `wrote`: statements of the transaction have written something.

        Raises:
            RetryError: another executive has taken one of the runs, or the connection was lost.
        """

    def rollback(self) -> None:
        """Write nothing of the transaction, if there is one."""

    def check(self) -> None:
        """Check that what was written is where it will be read.

        Raises:
            JournalError: files were removed or replaced.
        """

    def explained(self, error: Exception) -> JournalError:
        """Return an error that says what is wrong, and the remedy."""

    def is_transient(self, error: Exception) -> bool:
        """Whether a later transaction may succeed."""

    def is_worth_a_retry(self, error: Exception) -> bool:
        """Whether the same calls should be carried out again: nothing of them was written, and the
        cause has passed."""
