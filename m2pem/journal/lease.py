"""The lease of an executive on a journal in PostgreSQL: by it, its runs stay its own.

An executive that serves a fleet or takes a run has a row in the table `executives`, whose lease
ends at a time of the server's clock. It is renewed every third of the lease, over a connection of
its own, so that slow appends do not delay it. Another executive serves the fleet, or takes a run,
when the lease of its owner has ended; it removes the row of the owner then, so that this lease is
never renewed again.

The executive knows by its own clock until when it surely has its runs: the lease counts from the
moment before the last successful renewal was sent. So the clocks of the hosts need not agree. Nor
need those of two servers: on one that takes over, or starts again, each lease lasts its full length
from when the first executive connects to it (`postgres_database.connect`).
"""

import logging
import os
import threading
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import psycopg

from m2pem.boot_time import boot_time_s
from m2pem.errors import JournalError
from m2pem.journal.storage import Connection

log = logging.getLogger("m2pem.journal")

LEASE_VARIABLE = "M2PEM_LEASE_S"
"""The environment variable with the length of the lease, in seconds."""

DEFAULT_S = 5.0
SHORTEST_S = 0.5

ABANDONED_S = 0.5
"""After that another executive has what this one had, whose process ends meanwhile; it needs a
moment to print why."""


def lease_s() -> float:
    """Return the length of a lease, in seconds.

    Raises:
        JournalError: the environment variable is not a number of seconds.
    """
    text = os.environ.get(LEASE_VARIABLE, "").strip()
    try:
        length_s = float(text) if text else DEFAULT_S
    except ValueError:
        length_s = 0.0
    if not SHORTEST_S <= length_s <= 3600:
        raise JournalError(
            f"{LEASE_VARIABLE}={text} is not a number of seconds from {SHORTEST_S:g} to 3600, such "
            f"as {DEFAULT_S:g}"
        )
    return length_s


@dataclass(frozen=True, slots=True)
class Executive:
    """How others find an executive. `processes`: see `process_space`. `control`: beside which its
    control socket is. `session`: the `application_name` of the connection over which it writes."""

    host: str
    processes: str
    pid: int
    command: str
    control: str
    session: str


def process_space() -> str:
    """Name what gives this process its id: this boot of the host, or a container; "": not known."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {os.readlink('/proc/self/ns/pid')}"  # noqa: PTH115  # it is no path
    except OSError:
        return ""


def end_dead(connection: Connection) -> None:
    """End the leases of executives of this host whose processes are gone: a restart need not wait.

    A process whose id has been given again counts as alive, until its lease ends.
    """
    space = process_space()
    if not space:
        return
    living = connection.execute(
        "SELECT id, pid FROM executives WHERE processes = ? AND lease_until > clock_timestamp()",
        (space,),
    ).fetchall()
    for executive, pid in living:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            connection.execute(
                "UPDATE executives SET lease_until = clock_timestamp() WHERE id = ?", (executive,)
            )
        except PermissionError:
            continue  # another user's


class Lease:
    """The lease of one executive; `begin` is called before it serves a fleet or takes a run.

    `id`: of the row in `executives`; a new one when a lease has ended. `may_begin_again`: whether
    nothing is left of what the executive had under a lease that has ended.
    """

    def __init__(
        self,
        connect: Callable[[], psycopg.Connection[Any]],
        length_s: float,
        executive: Executive,
        on_end: Callable[[], None],
        may_begin_again: Callable[[], bool],
    ) -> None:
        self.id: UUID = uuid4()
        self.length_s = length_s
        self.until_s: float | None = None
        """Until when the lease lasts at least, by `boot_time_s`; None: it has not begun."""
        self._connect = connect
        self._executive = executive
        self._on_end = on_end
        self._may_begin_again = may_begin_again
        self._connection: psycopg.Connection[Any] | None = None
        self._ended = False
        self._stop = threading.Event()
        self._wake = threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Register the executive, if it is not.

        Raises:
            JournalError: its lease has ended, and it has not let go of its runs yet.
            psycopg.Error: the server does not answer.
        """
        if self.until_s is None:
            self._register()
            self._thread = threading.Thread(target=self._serve, name="lease", daemon=True)
            self._thread.start()
        elif self._ended or boot_time_s() >= self.until_s:
            raise JournalError(
                "nothing is taken: the lease of this executive has ended, and is not renewed yet"
            )

    def end(self) -> None:
        """Note that the lease has ended: nothing that it covered may be commanded any more."""
        if not self._ended:
            self._ended = True
            self._on_end()
            self.until_s = boot_time_s()

    def wake(self) -> None:
        """Look at once whether a lease may begin again."""
        self._wake.set()

    def abandon(self, connection: Connection) -> None:
        """Renew it no more, and have it end in `ABANDONED_S`: this process ends before that."""
        self._stop.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join(timeout=self.length_s / 3)
        try:
            connection.execute(
                "UPDATE executives SET lease_until = LEAST(lease_until, clock_timestamp()"
                " + ? * interval '1 second') WHERE id = ?",
                (ABANDONED_S, self.id),
            )
        except psycopg.Error as error:
            log.info("the lease is left to end by itself: %s", error)

    def close(self) -> None:
        """Renew it no more, and let others have its runs at once."""
        self._stop.set()
        self._wake.set()
        if self._thread is None:
            return
        self._thread.join(timeout=self.length_s)
        try:
            if self._thread.is_alive():
                return  # the server does not answer: the lease ends by itself
            with self._connected().transaction() as _:
                self._connected().execute("DELETE FROM owners WHERE executive = %s", (self.id,))
                self._connected().execute("DELETE FROM fleets WHERE executive = %s", (self.id,))
                self._connected().execute("DELETE FROM executives WHERE id = %s", (self.id,))
        except psycopg.Error as error:
            log.info("the lease is left to end by itself: %s", error)
        finally:
            if self._connection is not None:
                self._connection.close()

    def _serve(self) -> None:
        pause_s = self.length_s / 3
        while not self._stop.is_set():
            self._wake.wait(pause_s)
            self._wake.clear()
            if self._stop.is_set():
                return
            pause_s = self.length_s / 3 if self._renewed() else self.length_s / 20

    def _renewed(self) -> bool:
        try:
            if self._ended:
                if self._may_begin_again():
                    self.id = uuid4()
                    self._register()
                    self._ended = False
                return not self._ended
            connection = self._connected()
            asked_s = boot_time_s()
            if self.until_s is not None and asked_s >= self.until_s:
                # Also where the server would renew it: its runs are let go of already.
                found = connection.execute("DELETE FROM executives WHERE id = %s", (self.id,))
                renewed = False
            else:
                found = connection.execute(
                    "UPDATE executives SET lease_until = clock_timestamp() + lease"
                    " WHERE id = %s AND lease_until > clock_timestamp()",
                    (self.id,),
                )
                renewed = found.rowcount == 1
        except psycopg.Error as error:
            log.info("the lease is not renewed: %s", error)
            if self._connection is not None:
                self._connection.close()
            return False
        if not renewed:
            log.error("the lease of this executive has ended: others may take its runs")
            self.end()
            return False
        self.until_s = asked_s + self.length_s
        return True

    def _register(self) -> None:
        asked_s = boot_time_s()
        it = self._executive
        connection = self._connected()
        # What is long over says nothing to anyone.
        connection.execute(
            "DELETE FROM executives WHERE lease_until < clock_timestamp() - interval '1 day'"
        )
        connection.execute(
            "INSERT INTO executives VALUES (%s, %s, %s, %s, %s, %s, %s,"
            " clock_timestamp() + %s * interval '1 second', %s * interval '1 second')",
            (self.id, *astuple(it), self.length_s, self.length_s),
        )
        self.until_s = asked_s + self.length_s

    def _connected(self) -> psycopg.Connection[Any]:
        if self._connection is None or self._connection.closed:
            self._connection = self._connect()
        return self._connection
