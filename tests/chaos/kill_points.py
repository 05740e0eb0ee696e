"""Points of m2pem at which its process is killed, without a hook in m2pem itself.

A function is wrapped by its name, in the process that is to die: at its n-th passage that process
sends itself SIGKILL. A name that is not there any more is an error.
"""

import atexit
import functools
import importlib
import json
import os
import signal
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from inspect import iscoroutinefunction
from pathlib import Path
from typing import Any

RANDOM = "at a random moment"
"""The name of no point: the process is killed from outside."""


class When(StrEnum):
    """Where in a call of the function the process dies."""

    BEFORE = "before"
    AFTER = "after"
    AT_COMMIT = "at each COMMIT of the SQLite connection that it returns"
    AT_STATEMENT = "at each statement of the SQLite connection that it is given"


@dataclass(frozen=True, slots=True)
class KillPoint:
    """`target`: `module:name` of a function or method. `resuming`: it is passed only when
    interrupted runs are taken up. `opening`: it is passed only when a journal is opened."""

    name: str
    target: str
    when: When = When.BEFORE
    resuming: bool = False
    opening: bool = False


@dataclass(frozen=True, slots=True)
class JournalKind:
    """A kind of journal. `type`: `module:name` of its class. `url`: with `{folder}` of a round."""

    name: str
    type: str
    url: str
    points: tuple[KillPoint, ...]


_TRANSACTION = "m2pem.journal.transaction:WriteTransaction"
_MARKS = "m2pem.journal.marks:MarkFile"

SQLITE = JournalKind(
    "sqlite",
    "m2pem.journal.sqlite:SqliteJournal",
    "{folder}/journal.db",
    (
        KillPoint("group commit: begun", f"{_TRANSACTION}.begin", When.AFTER),
        KillPoint(
            "group commit: before COMMIT",
            "m2pem.journal.sqlite:open_for_writing",
            When.AT_COMMIT,
        ),
        KillPoint("group commit: before the mark", f"{_MARKS}.write", When.BEFORE),
        KillPoint("group commit: after the mark", f"{_MARKS}.write", When.AFTER),
        KillPoint("group commit: not acknowledged yet", f"{_TRANSACTION}.commit", When.AFTER),
        KillPoint("create: before the mark's slot", f"{_MARKS}.reserve", When.BEFORE),
        KillPoint("migration", "m2pem.journal.database:migrate", When.AT_STATEMENT, opening=True),
    ),
)
JOURNALS: Mapping[str, JournalKind] = {SQLITE.name: SQLITE}

_DISPATCHER = "m2pem.executive.dispatcher:Dispatcher"
_SUPERVISOR = "m2pem.executive.supervisor"


def executive_points(journal: JournalKind, arbiter: str) -> tuple[KillPoint, ...]:
    """Return the points that every executive has. `arbiter`: `module:name` of the class."""
    return (
        KillPoint("decided, not committed", f"{journal.type}.append"),
        KillPoint(
            "committed, not published",
            "m2pem.executive.journal_loss:JournalLossPrompts.on_records",
        ),
        KillPoint("committed, not dispatched", f"{_DISPATCHER}.start"),
        KillPoint("dispatched, not started", f"{arbiter}.start"),
        KillPoint("started, not reported", f"{arbiter}.start", When.AFTER),
        KillPoint("reported, not decided", f"{_DISPATCHER}.reported"),
        KillPoint("ended, not released", f"{_DISPATCHER}.ended"),
        KillPoint("created, not begun", f"{journal.type}.create", When.AFTER),
        KillPoint("resume: claimed", f"{journal.type}.claim", When.AFTER, resuming=True),
        KillPoint("resume: replayed", f"{_SUPERVISOR}:claim", resuming=True),
        KillPoint("resume: before a query", f"{arbiter}.query", resuming=True),
        KillPoint("resume: after a query", f"{arbiter}.query", When.AFTER, resuming=True),
        KillPoint("resume: before posting", f"{_DISPATCHER}.adopt", resuming=True),
        KillPoint("resume: posted", f"{_SUPERVISOR}:take_over", When.AFTER, resuming=True),
        KillPoint(
            "resume: taken up", "m2pem.executive.runner:Runner.take_up", When.AFTER, resuming=True
        ),
    )


def points_of(journal: JournalKind, arbiter: str) -> Mapping[str, KillPoint]:
    """Return all points of an executive, by name."""
    return {each.name: each for each in (*executive_points(journal, arbiter), *journal.points)}


@dataclass(frozen=True, slots=True)
class Place:
    """Where a function is: `owner`, a module or a class, has it as `name`."""

    owner: Any
    name: str

    @property
    def function(self) -> Callable[..., Any]:
        """The function itself."""
        found: Callable[..., Any] = getattr(self.owner, self.name)
        return found


def place_of(target: str) -> Place:
    """Find a function by `module:name` or `module:class.name`.

    Raises:
        LookupError: it is not there.
    """
    module, _, path = target.partition(":")
    *owners, name = path.split(".")
    try:
        owner: Any = importlib.import_module(module)
        for each in owners:
            owner = getattr(owner, each)
        getattr(owner, name)
    except (ImportError, AttributeError) as error:
        raise LookupError(
            f"{target} is not there any more ({error}): correct the kill point"
        ) from error
    return Place(owner, name)


def install(point: KillPoint, passed: Callable[[], None]) -> None:
    """Have `passed` called at each passage of a point, in this process."""
    place = place_of(point.target)
    setattr(place.owner, place.name, _WRAPPERS[point.when](place.function, passed))


def _before(function: Callable[..., Any], passed: Callable[[], None]) -> Callable[..., Any]:
    @functools.wraps(function)
    def around(*arguments: Any, **named: Any) -> Any:
        passed()
        return function(*arguments, **named)

    return around


def _after(function: Callable[..., Any], passed: Callable[[], None]) -> Callable[..., Any]:
    @functools.wraps(function)
    def around(*arguments: Any, **named: Any) -> Any:
        result = function(*arguments, **named)
        passed()
        return result

    @functools.wraps(function)
    async def around_later(*arguments: Any, **named: Any) -> Any:
        result = await function(*arguments, **named)
        passed()
        return result

    return around_later if iscoroutinefunction(function) else around


def _at_commit(function: Callable[..., Any], passed: Callable[[], None]) -> Callable[..., Any]:
    # SQLite calls it when a statement begins to run.
    def look(statement: str) -> None:
        if statement.startswith("COMMIT"):
            passed()

    @functools.wraps(function)
    def around(*arguments: Any, **named: Any) -> Any:
        connection: sqlite3.Connection = function(*arguments, **named)
        connection.set_trace_callback(look)
        return connection

    return around


def _at_statement(function: Callable[..., Any], passed: Callable[[], None]) -> Callable[..., Any]:
    @functools.wraps(function)
    def around(connection: sqlite3.Connection, *arguments: Any, **named: Any) -> Any:
        connection.set_trace_callback(lambda _: passed())
        try:
            return function(connection, *arguments, **named)
        finally:
            connection.set_trace_callback(None)

    return around


_WRAPPERS = {
    When.BEFORE: _before,
    When.AFTER: _after,
    When.AT_COMMIT: _at_commit,
    When.AT_STATEMENT: _at_statement,
}


# --- in the process that is to die ----------------------------------------------------------------


def die_at(point: KillPoint, passage: int) -> None:
    """Have this process killed at the n-th passage (from 1) of a point."""
    left = passage

    def passed() -> None:
        nonlocal left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    install(point, passed)


def count(points: Iterable[KillPoint], into: Path) -> None:
    """Have the passages of points counted, and written to a file when this process ends."""
    counts: Counter[str] = Counter()
    for point in points:
        install(point, functools.partial(counts.update, [point.name]))
    atexit.register(lambda: into.write_text(json.dumps(counts), encoding="utf-8"))
