"""The thread that writes: whatever waits when it is free goes into one transaction.

It sleeps on its queue, owns the connection, and wakes each event loop once per transaction.
"""

import asyncio
import sqlite3
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from m2pem.errors import InternalError, JournalError, M2pemError
from m2pem.journal.database import in_plain_words, passes
from m2pem.journal.ledger import Ledger

T = TypeVar("T")


@dataclass(slots=True)
class _Call:
    work: Callable[[Ledger], Any]
    future: asyncio.Future[Any]
    loop: asyncio.AbstractEventLoop
    last: bool = False
    result: Any = None
    error: M2pemError | None = None


@dataclass(slots=True)
class GroupWriter:
    """Carries out calls on a ledger in the order they come, many to a transaction.

    A call that was handed over is carried out even if nobody waits for it any more. `finish` is
    the thread's last act. `commits` counts the transactions that wrote something.
    """

    ledger: Ledger
    path: Path
    finish: Callable[[], None]
    commits: int = 0
    _failed: M2pemError | None = None
    _queue: "SimpleQueue[_Call]" = field(default_factory=SimpleQueue)

    def start(self) -> None:
        """Start the thread. It doesn't keep a process alive that never closes its journal."""
        threading.Thread(target=self._serve, name=f"journal {self.path}", daemon=True).start()

    def submit(self, work: Callable[[Ledger], T]) -> asyncio.Future[T]:
        """Hand over a call; its result, or error, comes after the commit."""
        return self._put(work, last=False)

    def stop(self) -> asyncio.Future[None]:
        """End the thread after what was handed over before."""
        return self._put(lambda _: None, last=True)

    def _put(self, work: Callable[[Ledger], T], last: bool) -> asyncio.Future[T]:
        loop = asyncio.get_running_loop()
        future: asyncio.Future[T] = loop.create_future()
        self._queue.put(_Call(work, future, loop, last))
        return future

    def _serve(self) -> None:
        stopping = False
        while not stopping:
            calls = self._waiting()
            stopping = calls[-1].last
            self._carry_out(calls)
            if stopping:
                self.finish()
            _deliver(calls)

    def _waiting(self) -> list[_Call]:
        calls = [self._queue.get()]
        with suppress(Empty):
            while not calls[-1].last:
                calls.append(self._queue.get_nowait())
        return calls

    def _carry_out(self, calls: Sequence[_Call]) -> None:
        problem = self._failed or self._transact(calls)
        if problem is None:
            return
        for call in calls:
            if call.error is None:
                # One each: whoever raises an exception adds to its traceback.
                call.error = type(problem)(*problem.args)
                call.error.__cause__ = problem.__cause__

    def _transact(self, calls: Sequence[_Call]) -> M2pemError | None:
        """One transaction. What is returned is why nothing of it was written."""
        try:
            self.ledger.begin()
            for call in calls:
                try:
                    call.result = call.work(self.ledger)
                except M2pemError as error:
                    call.error = error
            if self.ledger.commit():
                self.commits += 1
        except JournalError as error:
            return self._withdraw(error, for_good=True)
        except sqlite3.Error as error:
            problem: M2pemError = in_plain_words(error, self.path)
            problem.__cause__ = error
            return self._withdraw(problem, for_good=not passes(error))
        except Exception as error:
            problem = InternalError(f"{self.path}: the journal could not be written: {error!r}")
            problem.__cause__ = error
            return self._withdraw(problem, for_good=False)
        return None

    def _withdraw(self, problem: M2pemError, for_good: bool) -> M2pemError:
        try:
            self.ledger.rollback()
        except sqlite3.Error:
            for_good = True
        if not for_good:
            return problem
        self._failed = JournalError(
            f"{problem}. The journal writes no more, and what was being written may or may not be "
            "in it: mend the cause, start again and resume the runs"
        )
        self._failed.__cause__ = problem.__cause__
        return self._failed


def _deliver(calls: Sequence[_Call]) -> None:
    for loop in {call.loop for call in calls}:
        # A loop that has been closed has nobody who waits.
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(_settle, [call for call in calls if call.loop is loop])


def _settle(calls: Sequence[_Call]) -> None:
    for call in calls:
        if call.future.done():
            continue
        if call.error is not None:
            call.future.set_exception(call.error)
        else:
            call.future.set_result(call.result)
