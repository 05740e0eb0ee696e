"""Group commit: one thread writes all calls that wait for it in one transaction.

The thread owns the connection. It wakes each event loop once per transaction.
"""

import asyncio
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from m2pem.errors import InternalError, JournalError, M2pemError
from m2pem.journal.storage import RetryError, Storage
from m2pem.journal.transaction import WriteTransaction

T = TypeVar("T")


@dataclass(slots=True)
class _Call:
    work: Callable[[WriteTransaction], Any]
    future: asyncio.Future[Any]
    loop: asyncio.AbstractEventLoop
    last: bool = False
    result: Any = None
    error: M2pemError | None = None


@dataclass(slots=True)
class GroupWriter:
    """Carries out calls in the order of their submission, many to a transaction.

    A submitted call is carried out even if its caller was cancelled. `finish` is called last in
    the thread. `commits` counts the transactions that wrote something.
    """

    transaction: WriteTransaction
    storage: Storage
    finish: Callable[[], None]
    commits: int = 0
    _failed: M2pemError | None = None
    _queue: "SimpleQueue[_Call]" = field(default_factory=SimpleQueue)

    def start(self) -> None:
        """Start the thread, as a daemon: a process that never closes its journal can still end."""
        threading.Thread(
            target=self._serve, name=f"journal {self.storage.place}", daemon=True
        ).start()

    def submit(self, work: Callable[[WriteTransaction], T]) -> asyncio.Future[T]:
        """Submit a call; its result, or error, is set after the commit."""
        return self._put(work, last=False)

    def stop(self) -> asyncio.Future[None]:
        """End the thread after what was submitted before."""
        return self._put(lambda _: None, last=True)

    def _put(self, work: Callable[[WriteTransaction], T], last: bool) -> asyncio.Future[T]:
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
                # One each: raising an exception adds to its traceback.
                call.error = type(problem)(*problem.args)
                call.error.__cause__ = problem.__cause__

    def _transact(self, calls: Sequence[_Call]) -> M2pemError | None:
        """Write one transaction. An error that is returned says why nothing of it was written."""
        try:
            while not self._write(calls):
                self.transaction.rollback()
        except JournalError as error:
            return self._withdraw(error, for_good=True)
        except self.storage.errors as error:
            problem: M2pemError = self.storage.explained(error)
            problem.__cause__ = error
            return self._withdraw(problem, for_good=not self.storage.is_transient(error))
        except Exception as error:
            place = self.storage.place
            problem = InternalError(f"{place}: the journal could not be written: {error!r}")
            problem.__cause__ = error
            return self._withdraw(problem, for_good=False)
        return None

    def _write(self, calls: Sequence[_Call]) -> bool:
        """Carry out the calls; False: nothing was written, and they are to be carried out again."""
        try:
            self.transaction.begin()
            for call in calls:
                call.error = None
                try:
                    call.result = call.work(self.transaction)
                except M2pemError as error:
                    call.error = error
            if self.transaction.commit():
                self.commits += 1
        except RetryError:
            return False
        except self.storage.errors as error:
            if self.storage.is_worth_a_retry(error):
                return False
            raise
        return True

    def _withdraw(self, problem: M2pemError, for_good: bool) -> M2pemError:
        try:
            self.transaction.rollback()
        except self.storage.errors:
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
        # No call waits in a loop that has been closed.
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
