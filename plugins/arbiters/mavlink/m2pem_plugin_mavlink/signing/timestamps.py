"""The timestamps of signatures: none is used twice, and none is accepted twice.

A timestamp counts 10 microseconds since 2015-01-01. Those that are sent follow the computer's
clock, and go on from the last one where the clock goes back. They are reserved ahead in a database,
so that after a crash none is used again. What was received last of each stream is kept there, too:
frames that were recorded before a restart are refused after it.
"""

import logging
import sqlite3
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from m2pem_plugin_mavlink.signing.key_file import SigningError

EPOCH_S = 1_420_070_400
UNITS_PER_S = 100_000
AHEAD = 10 * UNITS_PER_S
"""So far ahead of the last timestamp are others reserved."""

FILE = "mavlink-signing.db"
WAIT_S = 0.5
"""For another process that writes."""

_logger = logging.getLogger(__name__)

Stream = tuple[int, int]
"""The sender, system + 256 * component, and its link id."""


def clock_timestamp() -> int:
    """Return the timestamp of now by the computer's clock."""
    return max(int((time.time() - EPOCH_S) * UNITS_PER_S), 0)


class TimestampStore:
    """The database of a state folder, for all keys and all processes that use the folder.

    Raises:
        SigningError: it cannot be opened or written.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        self._lock = threading.Lock()
        try:
            self.path.touch(0o600)
            self._database = sqlite3.connect(
                self.path, timeout=WAIT_S, isolation_level=None, check_same_thread=False
            )
            try:
                self._database.executescript(
                    "PRAGMA synchronous=EXTRA;"
                    "CREATE TABLE IF NOT EXISTS reserved(key TEXT PRIMARY KEY, until INTEGER);"
                    "CREATE TABLE IF NOT EXISTS received(key TEXT, sender INTEGER, link INTEGER,"
                    " timestamp INTEGER, PRIMARY KEY(key, sender, link));"
                )
            except BaseException:
                self._database.close()
                raise
        except (OSError, sqlite3.Error) as error:
            raise self._error("cannot be used", error) from None

    def read(self, key: str) -> tuple[int, dict[Stream, int]]:
        """Return the first timestamp of a key that is free, and the last ones received."""
        try:
            with self._lock:
                row = self._database.execute("SELECT until FROM reserved WHERE key=?", (key,))
                until = (row.fetchone() or (0,))[0]
                rows = self._database.execute(
                    "SELECT sender, link, timestamp FROM received WHERE key=?", (key,)
                )
                return int(until), {(sender, link): at for sender, link, at in rows}
        except sqlite3.Error as error:
            raise self._error("cannot be read", error) from None

    def write(self, changes: Iterable["Change"]) -> None:
        """Reserve timestamps and store those received; none goes back."""
        try:
            with self._lock:
                self._database.execute("BEGIN IMMEDIATE")
                try:
                    for change in changes:
                        self._write(change)
                except BaseException:
                    self._database.execute("ROLLBACK")
                    raise
                self._database.execute("COMMIT")
        except sqlite3.Error as error:
            raise self._error("cannot be written", error) from None

    def _write(self, change: "Change") -> None:
        self._database.execute(
            "INSERT INTO reserved VALUES(?, ?)"
            " ON CONFLICT DO UPDATE SET until=max(until, excluded.until)",
            (change.key, change.until),
        )
        self._database.executemany(
            "INSERT INTO received VALUES(?, ?, ?, ?)"
            " ON CONFLICT DO UPDATE SET timestamp=max(timestamp, excluded.timestamp)",
            ((change.key, *stream, at) for stream, at in change.received.items()),
        )

    def close(self) -> None:
        with self._lock:
            self._database.close()

    def _error(self, problem: str, error: Exception) -> SigningError:
        return SigningError(
            f"{self.path}, which keeps the timestamps of signatures, {problem}: {error}"
        )


@dataclass(frozen=True, slots=True)
class Change:
    """What is to be stored of a key: `until` is the first timestamp that is not reserved."""

    key: str
    until: int
    received: Mapping[Stream, int]


class Timestamps:
    """The timestamps of one key. `store` None: they are not kept, and after a restart only the
    clock tells which are new. `latest`: the last one that was sent or received."""

    def __init__(
        self, store: TimestampStore | None, key: str, clock: Callable[[], int] = clock_timestamp
    ) -> None:
        self._store = store
        self._key = key
        self._clock = clock
        self.received: dict[Stream, int] = {}
        self._reserved = 0
        if store is not None:
            self._reserved, self.received = store.read(key)
        self.latest = self._reserved - 1

    def next(self) -> int:
        """Return a timestamp for a frame to be sent.

        A vehicle must be commanded also where the disk fails: then the timestamp is not reserved.
        """
        stamp = max(self.latest + 1, self._clock())
        if stamp >= self._reserved and self._store is not None:
            try:
                self._store.write((Change(self._key, stamp + AHEAD, {}),))
            except SigningError as error:
                _logger.warning("%s", error)
            self._reserved = stamp + AHEAD
        self.latest = stamp
        return stamp

    def now(self) -> int:
        """Return the present timestamp, which may be ahead of the clock."""
        return max(self.latest, self._clock())

    @property
    def is_due(self) -> bool:
        """Whether further timestamps must soon be reserved."""
        return self._store is not None and self._reserved - self.now() < AHEAD / 2

    def change(self) -> Change:
        """Return what to store; call `stored` when it is."""
        return Change(self._key, max(self.now() + AHEAD, self._reserved), dict(self.received))

    def stored(self, change: Change) -> None:
        """A change was stored: `next` then need not wait for the disk."""
        self._reserved = max(self._reserved, change.until)
