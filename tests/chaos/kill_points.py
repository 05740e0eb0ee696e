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
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from inspect import iscoroutinefunction
from pathlib import Path
from typing import Any
from unittest import mock

RANDOM = "at a random moment"
"""The name of no point: the process is killed from outside."""


REPLACED = "stopped beyond its lease"
"""The name of no point: the process is stopped (SIGSTOP), and goes on when a standby has taken
over. Only where claims hold for a lease: on one computer, a stopped process keeps its locks."""

WAIT_FOR_ANSWER = 1
"""`psycopg.waiting.Wait.R`, which most executives need not import."""


class When(StrEnum):
    """Where in a call of the function the process dies."""

    BEFORE = "before"
    AFTER = "after"
    AT_COMMIT = "at each COMMIT of the SQLite connection that it returns"
    AT_STATEMENT = "at each statement of the connection that it is given"
    SENT = "when the last statement of the PostgreSQL transaction is sent, and not answered"


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
    """A kind of journal. `type`: `module:name` of its class. `file`: its name in the folder of a
    round; others are beside it. `lease_s`: of its executives; "": there is none."""

    name: str
    type: str
    file: str
    points: tuple[KillPoint, ...]
    lease_s: str = ""


_TRANSACTION = "m2pem.journal.transaction:WriteTransaction"
_MARKS = "m2pem.journal.marks:MarkFile"

_MARKED = (
    KillPoint("group commit: before the mark", f"{_MARKS}.write", When.BEFORE),
    KillPoint("group commit: after the mark", f"{_MARKS}.write", When.AFTER),
    KillPoint("group commit: not acknowledged yet", f"{_TRANSACTION}.commit", When.AFTER),
    KillPoint("create: before the mark's slot", f"{_MARKS}.reserve", When.BEFORE),
)

SQLITE = JournalKind(
    "sqlite",
    "m2pem.journal.sqlite:SqliteJournal",
    "journal.db",
    (
        KillPoint("group commit: begun", f"{_TRANSACTION}.begin", When.AFTER),
        KillPoint(
            "group commit: before COMMIT",
            "m2pem.journal.sqlite:open_for_writing",
            When.AT_COMMIT,
        ),
        *_MARKED,
        KillPoint("migration", "m2pem.journal.database:migrate", When.AT_STATEMENT, opening=True),
    ),
)

_STORAGE = "m2pem.journal.postgres:PostgresStorage"
_LEASE = "m2pem.journal.lease:Lease"

POSTGRES = JournalKind(
    "postgres",
    "m2pem.journal.postgres:PostgresJournal",
    "journal.postgresql",
    (
        KillPoint("group commit: begun", f"{_TRANSACTION}.begin", When.AFTER),
        KillPoint("group commit: rows not written", f"{_STORAGE}.commit"),
        KillPoint("group commit: before COMMIT", f"{_STORAGE}._commit"),
        KillPoint("group commit: COMMIT sent", f"{_STORAGE}._commit", When.SENT),
        *_MARKED,
        KillPoint("migration", "m2pem.journal.postgres:migrate", When.AT_STATEMENT, opening=True),
        KillPoint("lease: begun", f"{_LEASE}.begin", When.AFTER),
        KillPoint("lease: before a renewal", f"{_LEASE}._renewed"),
        KillPoint("lease: renewed", f"{_LEASE}._renewed", When.AFTER),
        KillPoint("lease: before it is given up", f"{_LEASE}.close"),
        KillPoint("open: leases of the dead ended", "m2pem.journal.postgres:end_dead", When.AFTER),
        KillPoint("serve: not committed", f"{_STORAGE}.serve_fleet", When.AFTER),
        KillPoint("claim: before the fence", f"{_STORAGE}.fence", resuming=True),
        KillPoint("claim: fenced", f"{_STORAGE}.fence", When.AFTER, resuming=True),
        KillPoint(
            "claim: taken, not committed",
            "m2pem.journal.postgres:LeasedRuns.acquire",
            When.AFTER,
        ),
        KillPoint("release: not committed", f"{_STORAGE}.give_up", When.AFTER),
    ),
    lease_s="5",
)
JOURNALS: Mapping[str, JournalKind] = {each.name: each for each in (SQLITE, POSTGRES)}

_ROS_CALLS = "m2pem_plugin_ros.runtime.calls:Calls"
_ROS_VEHICLE = "m2pem_plugin_ros.vehicle:Vehicle"
POINTS_OF_ARBITERS: Mapping[str, tuple[KillPoint, ...]] = {
    "m2pem_plugin_ros.arbiter:RosArbiter": (
        KillPoint("ROS: a request or goal is sent, not answered", f"{_ROS_CALLS}._wait"),
        KillPoint("ROS: a request or goal is answered", f"{_ROS_CALLS}._wait", When.AFTER),
        KillPoint("ROS: the vehicle says that it goes on", f"{_ROS_VEHICLE}.progress"),
        KillPoint("ROS: the vehicle says that it has ended", f"{_ROS_VEHICLE}.ended"),
    )
}

_DISPATCHER = "m2pem.executive.dispatcher:Dispatcher"
_TAKEOVER = "m2pem.executive.run_takeover"


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
        KillPoint("resume: replayed", f"{_TAKEOVER}:claim", resuming=True),
        KillPoint("resume: before a query", f"{arbiter}.query", resuming=True),
        KillPoint("resume: after a query", f"{arbiter}.query", When.AFTER, resuming=True),
        KillPoint("resume: before posting", f"{_DISPATCHER}.adopt", resuming=True),
        KillPoint("resume: posted", f"{_TAKEOVER}:take_over", When.AFTER, resuming=True),
        KillPoint(
            "resume: taken up", "m2pem.executive.runner:Runner.take_up", When.AFTER, resuming=True
        ),
        *POINTS_OF_ARBITERS.get(arbiter, ()),
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
    def around(connection: Any, *arguments: Any, **named: Any) -> Any:
        with _watched(connection, passed):
            return function(connection, *arguments, **named)

    return around


@contextmanager
def _watched(connection: Any, passed: Callable[[], None]) -> Iterator[None]:
    """Have `passed` called at each statement of a connection within the block."""
    if isinstance(connection, sqlite3.Connection):
        connection.set_trace_callback(lambda _: passed())
        try:
            yield
        finally:
            connection.set_trace_callback(None)
    else:
        with mock.patch.object(connection, "execute", _before(connection.execute, passed)):
            yield


def _sent(function: Callable[..., Any], passed: Callable[[], None]) -> Callable[..., Any]:
    def until_sent(steps: Generator[Any, Any, Any]) -> Generator[Any, Any, Any]:
        wanted, sent = next(steps), False
        while True:
            # psycopg waits for the answer alone when all of the statement has been sent.
            if wanted == WAIT_FOR_ANSWER and not sent:
                sent = True
                passed()
            try:
                wanted = steps.send((yield wanted))
            except StopIteration as end:
                return end.value

    @functools.wraps(function)
    def around(storage: Any, *arguments: Any, **named: Any) -> Any:
        raw = storage.connection.raw
        wait = raw.wait
        with mock.patch.object(raw, "wait", lambda steps, **more: wait(until_sent(steps), **more)):
            return function(storage, *arguments, **named)

    return around


_WRAPPERS = {
    When.BEFORE: _before,
    When.AFTER: _after,
    When.AT_COMMIT: _at_commit,
    When.AT_STATEMENT: _at_statement,
    When.SENT: _sent,
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


def die_when(names: Iterable[str], points: Mapping[str, KillPoint], armed: Path) -> None:
    """Have this process killed at a point when a file arms it: the name of the point, and in the
    next line the passage, counted from when it is armed."""
    left: dict[str, int] = {}

    def passed(name: str) -> None:
        try:
            point, passage = armed.read_text(encoding="utf-8").splitlines()
        except (FileNotFoundError, ValueError):  # it is not armed, or just being so
            left.clear()
            return
        if point == name:
            left[name] = left.get(name, int(passage)) - 1
            if not left[name]:
                os.kill(os.getpid(), signal.SIGKILL)

    for name in names:
        install(points[name], functools.partial(passed, name))


def count(points: Iterable[KillPoint], into: Path) -> None:
    """Have the passages of points counted, and written to a file when this process ends."""
    counts: Counter[str] = Counter()
    for point in points:
        install(point, functools.partial(counts.update, [point.name]))
    atexit.register(lambda: into.write_text(json.dumps(counts), encoding="utf-8"))
