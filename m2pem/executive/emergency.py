"""STOP and pause: they reach the arbiters at once, and are decided and journaled afterwards.

Nothing here awaits the engine, the journal, a plugin or a print before the cancels and holds are
under way: a disk that hangs, or a mission that never waits, does not delay them.
"""

import asyncio
import json
import logging
import os
import threading
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Queue
from uuid import UUID

from m2pem.api.runs import Alert, RunId
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import Step
from m2pem.engine.state import RunStatus
from m2pem.errors import M2pemError, OperatorError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.dispatcher import Dispatcher, Order
from m2pem.executive.ended_runs import in_words
from m2pem.executive.runner import Runner
from m2pem.executive.runtime_directory import runtime_directory

ACKNOWLEDGED_WITHIN_S = 1.0
"""An arbiter that has not taken a STOP or hold by then: operators are alerted."""

WRITTEN_WITHIN_S = 1.5
"""How long an operator's STOP or pause waits for the journal, before it says how things are."""


class EmergencyCommands:
    """STOP and pause of the runs of one executive. `marks` keep a stop until the journal has it."""

    def __init__(self, dispatcher: Dispatcher, events: ControlEvents, marks: "StopMarks") -> None:
        self._dispatcher = dispatcher
        self._events = events
        self._marks = marks
        self._watches: set[asyncio.Task[None]] = set()

    def stop(self, runner: Runner, by: str, reason: str) -> "asyncio.Future[Step]":
        """Send the cancels of a run; the future is done when its stop is in the journal.

        A run that the journal failed is stopped, too: its vehicles may still be held. The future
        has that failure then.

        Raises:
            OperatorError: the run has ended.
        """
        if runner.done.is_set() and runner.failure is None:
            return runner.submit(i.StopRun(by, reason))
        self._marks.put(runner.id, StopMark(by, reason))
        orders = self._dispatcher.stop_at_once(runner.id, runner.epoch)
        self._watch("STOP", runner.id, orders)
        try:
            return runner.submit_stop(i.StopRun(by, reason), frozenset(orders))
        except M2pemError as error:
            failed: asyncio.Future[Step] = asyncio.get_running_loop().create_future()
            failed.set_exception(error)
            return failed

    def stop_all(
        self, runners: Iterable[Runner], by: str, reason: str
    ) -> "dict[RunId, asyncio.Future[Step]]":
        """Send the cancels of every run that has not ended; by run: when its stop is recorded.

        A run that the journal failed is one of them: its vehicles are held, or were to be.
        """
        return {
            runner.id: self.stop(runner, by, reason)
            for runner in runners
            if not runner.done.is_set() or runner.failure is not None
            if runner.run.state.status is not RunStatus.ENDED
        }

    def pause(self, runner: Runner, by: str) -> "asyncio.Future[Step]":
        """Send the holds of a run; the future is done when its pause is in the journal.

        Raises:
            M2pemError: the run has ended, or can decide nothing any more.
        """
        if runner.can_pause:
            orders = self._dispatcher.hold_at_once(runner.id)
            self._watch("pause", runner.id, orders)
            held = {resource for order in orders.values() for resource in order.resources}
            return runner.submit_pause(i.PauseRun(by), frozenset(map(str, held)))
        return runner.submit(i.PauseRun(by))

    def hold(self, run: RunId, resources: Iterable[str]) -> None:
        """Hold what failed work of a run commanded, before the incident is journaled."""
        self._watch("hold", run, self._dispatcher.hold_resources_at_once(resources))

    async def written(self, what: str, asked: "Mapping[RunId, asyncio.Future[Step]]") -> None:
        """Wait until the journal has what was asked of runs, within `WRITTEN_WITHIN_S`.

        Raises:
            OperatorError: it has not, or a run ignored it; each run is named.
        """
        if asked:
            await asyncio.wait(asked.values(), timeout=WRITTEN_WITHIN_S)
        problems = [
            f"{run}: {problem}" for run, each in asked.items() if (problem := _problem(what, each))
        ]
        if problems:
            raise OperatorError("; ".join(problems))

    def _watch(self, what: str, run: RunId, orders: Mapping[str, Order]) -> None:
        if orders:
            task = asyncio.create_task(self._alert_if_late(what, run, orders))
            self._watches.add(task)
            task.add_done_callback(self._watches.discard)

    async def _alert_if_late(self, what: str, run: RunId, orders: Mapping[str, Order]) -> None:
        """Say at once which vehicles may go on, and why."""
        tasks = {order.task for order in orders.values() if order.task is not None}
        await asyncio.wait(tasks, timeout=ACKNOWLEDGED_WITHIN_S)
        waited = f"its arbiter has not taken it within {ACKNOWLEDGED_WITHIN_S:g} s"
        late: Sequence[tuple[Order, str]] = [
            (order, order.wrong or waited)
            for order in orders.values()
            if order.wrong or not (order.task is None or order.task.done())
        ]
        for order, why in late:
            names = ", ".join(order.resources)
            text = f"{names} may not have received the {what} of {run}: {why}. Use its own stop"
            self._events.publish(Alert(run, "NOT_RECEIVED", text))


def _problem(what: str, asked: "asyncio.Future[Step]") -> str:
    """Why it is not in the journal, or changed nothing; "" when all is well."""
    if not asked.done():
        return (
            f"the {what} went to its vehicles at once, but the journal does not write: "
            "it has not been recorded yet"
        )
    error = asked.exception()
    if isinstance(error, M2pemError):
        return f"the {what} went to its vehicles, but was not recorded: {error}"
    if error is not None:
        raise error
    match asked.result().records:
        case [r.InputIgnored(reason), *_]:
            return in_words(asked.result().input, reason)
    return ""


CLOSED_WITHIN_S = 1.0

log = logging.getLogger("m2pem.executive")


@dataclass(frozen=True, slots=True)
class StopMark:
    """Who stopped a run, and why."""

    by: str
    reason: str


class StopMarks:
    """The marks of one journal. `file`: where the journal is; None: in memory, as the marks
    are then.

    `identity`: of the journal, so that the marks of a removed journal do not stop the runs of the
    next one at its place.
    """

    def __init__(self, file: Path | None, identity: UUID) -> None:
        self._identity = str(identity)
        self._put: dict[str, StopMark] = {}
        self._places: dict[str, Queue[tuple[Path, bytes | None]]] = {}
        if file is not None:
            self._places[f"{file}-stopped-"] = Queue()
            with suppress(OSError):
                self._places[f"{runtime_directory()}/{identity}-stopped-"] = Queue()
        self._started = False

    def put(self, run: str, mark: StopMark) -> None:
        """Have a mark written; returns at once."""
        self._put[run] = mark
        content = {"journal": self._identity, "by": mark.by, "reason": mark.reason}
        self._queue(run, json.dumps(content).encode())

    def remove(self, run: str) -> None:
        """Have the mark of a run removed: the journal has the stop; returns at once."""
        self._put.pop(run, None)
        if self._started:
            self._queue(run, None)

    def get(self, run: str) -> StopMark | None:
        """The mark of a run that was left without an end; None: it was not stopped."""
        if (mark := self._put.get(run)) is not None:
            return mark
        for place in self._places:
            try:
                content = json.loads(Path(f"{place}{run}").read_bytes())
            except (OSError, ValueError):
                continue
            if content.get("journal") == self._identity:
                self._start()  # there is something to remove
                return StopMark(str(content.get("by", "")), str(content.get("reason", "")))
        return None

    async def close(self) -> None:
        """Wait until what was asked for is done, at most `CLOSED_WITHIN_S`: a disk may hang."""
        if self._started:
            with suppress(TimeoutError):
                async with asyncio.timeout(CLOSED_WITHIN_S):
                    # Not in a thread that waits: the program would wait for that one in the end.
                    while any(queue.unfinished_tasks for queue in self._places.values()):  # noqa: ASYNC110
                        await asyncio.sleep(0.01)

    def _queue(self, run: str, content: bytes | None) -> None:
        self._start()
        for place, queue in self._places.items():
            queue.put((Path(f"{place}{run}"), content))

    def _start(self) -> None:
        if self._started:
            return
        self._started = True
        for queue in self._places.values():
            # A thread for each place, as one may hang; a daemon, as a hanging one must not keep
            # the program from ending.
            threading.Thread(target=_serve, args=(queue,), name="stop marks", daemon=True).start()


def _serve(queue: "Queue[tuple[Path, bytes | None]]") -> None:
    while True:
        path, content = queue.get()
        try:
            if content is None:
                path.unlink(missing_ok=True)
            else:
                _write(path, content)
        except OSError as error:
            log.warning("%s: the mark of a stopped run: %s", path, error.strerror)
        finally:
            queue.task_done()


def _write(path: Path, content: bytes) -> None:
    new = path.with_name(f"{path.name}.new")
    descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
    try:
        os.write(descriptor, content)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    new.rename(path)
