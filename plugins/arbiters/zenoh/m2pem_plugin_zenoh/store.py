"""What a host keeps on its disk: behaviors it was given, epochs, and reports not yet received.

One SQLite file for each arbiter. Everything is durable when a method returns.
"""

import logging
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from m2pem.api import BehaviorId, BehaviorReport, BehaviorRequest, ResourceId
from m2pem.api.epoch_fence import run_of
from m2pem.errors import PluginError
from m2pem_plugin_zenoh.messages import NOTE, REPORT, STATE, Item, decode_report, encode_report

MOST_ITEMS = 10_000
"""Items that wait for the executive. The oldest that matters least gives way to the newest."""

REMEMBERED = 1_000
"""Behaviors that have ended; the oldest are forgotten."""

_SCHEMA = """
CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS epochs (run TEXT PRIMARY KEY, epoch INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS behaviors (
    place INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT UNIQUE NOT NULL, epoch INTEGER NOT NULL,
    name TEXT NOT NULL, resources TEXT NOT NULL, ended INTEGER NOT NULL, report BLOB);
CREATE TABLE IF NOT EXISTS items (
    number INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL,
    ends INTEGER NOT NULL, content BLOB NOT NULL);
"""


@dataclass(frozen=True, slots=True)
class Kept:
    """A behavior that the host was given. `report`: the last one; None: there is none yet."""

    id: BehaviorId
    epoch: int
    name: str
    resources: tuple[ResourceId, ...]
    ended: bool
    report: BehaviorReport | None


class HostStore:
    """The file of one arbiter. `journal`: whose behaviors these are; "": nobody's yet.

    Raises:
        PluginError: the file cannot be used.
    """

    def __init__(self, path: Path, logger: logging.Logger) -> None:
        self._logger = logger
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._database = sqlite3.connect(path, isolation_level=None)
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=FULL")
            self._database.executescript(_SCHEMA)
            self._database.execute(
                "INSERT OR IGNORE INTO facts VALUES ('store', ?)", (uuid4().hex,)
            )
        except (OSError, sqlite3.Error) as error:
            raise PluginError(
                f"{path}: the state of this host cannot be kept there: {error}; name another "
                "folder with --state"
            ) from error
        self.identity = self._fact("store")

    def close(self) -> None:
        self._database.close()

    # --- whose it is ----------------------------------------------------------------------------

    @property
    def journal(self) -> str:
        return self._fact("journal")

    def begin_journal(self, journal: str) -> None:
        """Forget what another journal's executive has commanded: its ids may come again."""
        with self._database:
            self._database.execute("BEGIN")
            for table in ("epochs", "behaviors", "items"):
                self._database.execute(f"DELETE FROM {table}")  # names from here
            self._database.execute("INSERT OR REPLACE INTO facts VALUES ('journal', ?)", (journal,))

    def _fact(self, name: str) -> str:
        row = self._database.execute("SELECT value FROM facts WHERE name = ?", (name,)).fetchone()
        return str(row[0]) if row else ""

    # --- what the host holds by itself ------------------------------------------------------------

    def held(self) -> frozenset[ResourceId]:
        """Return the resources that the host holds because it was cut off."""
        return frozenset(map(ResourceId, self._fact("held").split()))

    def hold(self, resources: Iterable[ResourceId]) -> None:
        """Note which resources the host holds because it was cut off: these and no others."""
        self._set("held", " ".join(sorted(resources)))

    def greet(self, executive: str) -> bool:
        """Note that an executive has contact; False: another one has taken over from it before."""
        last, before = self._fact("executive"), self._fact("superseded").split()
        if executive in before:
            return False
        if last not in ("", executive):
            kept = " ".join([*before, last][-REMEMBERED:])
            self._set("superseded", kept)
        self._set("executive", executive)
        return True

    def _set(self, name: str, value: str) -> None:
        self._database.execute("INSERT OR REPLACE INTO facts VALUES (?, ?)", (name, value))

    # --- epochs ---------------------------------------------------------------------------------

    def epoch(self, behavior: BehaviorId) -> int:
        """The highest epoch seen for the run of a behavior; 0: none."""
        query = "SELECT epoch FROM epochs WHERE run = ?"
        row = self._database.execute(query, (run_of(behavior),)).fetchone()
        return int(row[0]) if row else 0

    def admit(self, behavior: BehaviorId, epoch: int) -> bool:
        """Whether a command of this epoch is good; it is, if no higher one was seen."""
        highest = self.epoch(behavior)
        if epoch > highest:
            self._database.execute(
                "INSERT OR REPLACE INTO epochs VALUES (?, ?)", (run_of(behavior), epoch)
            )
        return epoch >= highest

    # --- behaviors ------------------------------------------------------------------------------

    def behavior(self, id_: BehaviorId) -> Kept | None:
        """Return a behavior that the host was given; None: it was not."""
        found = self._behaviors("WHERE id = ?", id_)
        return found[0] if found else None

    def going(self) -> Sequence[Kept]:
        """Return the behaviors that have not ended, the oldest first."""
        return self._behaviors("WHERE NOT ended ORDER BY place")

    def begin(self, request: BehaviorRequest) -> None:
        """Note that a behavior is given to the arbiter."""
        with self._database:
            self._database.execute("BEGIN")
            self._database.execute("DELETE FROM behaviors WHERE id = ?", (request.id,))
            self._database.execute(
                "INSERT INTO behaviors (id, epoch, name, resources, ended) VALUES (?, ?, ?, ?, 0)",
                (request.id, request.epoch, request.behavior, " ".join(request.resources)),
            )
            self._database.execute(
                "DELETE FROM behaviors WHERE ended AND place <= "
                "(SELECT MAX(place) FROM behaviors) - ?",
                (REMEMBERED,),
            )

    def raise_epoch(self, id_: BehaviorId, epoch: int) -> None:
        """Note that a behavior belongs to a newer executive."""
        self._database.execute(
            "UPDATE behaviors SET epoch = ? WHERE id = ? AND epoch < ?", (epoch, id_, epoch)
        )

    def _behaviors(self, where: str, *values: str) -> list[Kept]:
        columns = "id, epoch, name, resources, ended, report"
        rows = self._database.execute(f"SELECT {columns} FROM behaviors {where}", values)
        return [
            Kept(
                id_,
                epoch,
                name,
                tuple(map(ResourceId, resources.split())),
                bool(ended),
                None if report is None else decode_report(report),
            )
            for id_, epoch, name, resources, ended, report in rows
        ]

    # --- what the executive has not received ----------------------------------------------------

    def report(self, report: BehaviorReport) -> None:
        """Keep a report of a behavior, to be delivered."""
        content, ends = encode_report(report), report.state.terminal
        with self._database:
            self._database.execute("BEGIN")
            self._database.execute(
                "UPDATE behaviors SET report = ?, ended = ? WHERE id = ?",
                (content, ends, report.id),
            )
            self._add(REPORT, ends, content)

    def state(self, content: bytes) -> None:
        """Keep a state that must not be lost, to be delivered."""
        with self._database:
            self._database.execute("BEGIN")
            self._add(STATE, False, content)

    def note(self, text: str) -> None:
        """Keep what operators must know of, to be delivered."""
        with self._database:
            self._database.execute("BEGIN")
            self._add(NOTE, False, text.encode())

    def waiting(self, most: int) -> list[Item]:
        """Return the oldest items that were not received."""
        rows = self._database.execute(
            "SELECT number, kind, content FROM items ORDER BY number LIMIT ?", (most,)
        )
        return [Item(number, kind, content) for number, kind, content in rows]

    def received(self, number: int) -> None:
        """Let go of all items up to this number."""
        self._database.execute("DELETE FROM items WHERE number <= ?", (number,))

    def _add(self, kind: str, ends: bool, content: bytes) -> None:
        count = self._database.execute("SELECT COUNT(*) FROM items").fetchone()[0]
        if count >= MOST_ITEMS:
            # A report that ends a behavior is the last to go.
            self._database.execute(
                "DELETE FROM items WHERE number = (SELECT number FROM items"
                " ORDER BY ends, kind = 'report', number LIMIT 1)"
            )
            self._logger.warning("%d items wait for the executive: one is dropped", count)
        self._database.execute(
            "INSERT INTO items (kind, ends, content) VALUES (?, ?, ?)",
            (kind, ends, content),
        )
