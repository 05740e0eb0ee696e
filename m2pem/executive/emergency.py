"""STOP and pause: they reach the arbiters at once, and are decided and journaled afterwards.

Nothing here awaits the engine, the journal, a plugin or a print before the cancels and holds are
under way: a disk that hangs, or a mission that never waits, does not delay them.
"""

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from m2pem.api.alerts import AlertSeverity
from m2pem.api.runs import Alert, RunId
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import Step
from m2pem.engine.state import RunStatus
from m2pem.errors import JournalError, M2pemError, OperatorError, StaleEpochError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.dispatcher import Dispatcher, Order
from m2pem.executive.ended_runs import in_words
from m2pem.executive.mark_files import MarkFiles
from m2pem.executive.runner import Runner
from m2pem.mission.catalogue import BehaviorState

ACKNOWLEDGED_WITHIN_S = 1.0
"""An arbiter that has not taken a STOP or hold by then: operators are alerted."""

WRITTEN_WITHIN_S = 1.5
"""So long what an operator does, such as a STOP, waits for the journal before it is said."""


async def written_in_time(write: Callable[[], Awaitable[None]], done: str) -> None:
    """Wait until the journal has what an operator did. `done`: what that is.

    Raises:
        OperatorError: it is not written in time, or cannot be.
    """
    try:
        async with asyncio.timeout(WRITTEN_WITHIN_S):
            await write()
    except TimeoutError:
        why = f"has not written it within {WRITTEN_WITHIN_S:g} s"
    except JournalError as error:
        why = f"cannot write it: {error}"
    else:
        return
    raise OperatorError(f"{done} here, but the journal {why}: it may not outlive a restart")


_NOT_STOPPED = (BehaviorState.LOST, BehaviorState.FAILED)
"""How a behavior ends whose cancel its vehicle may not have received."""


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

    def on_records(self, runner: Runner, records: Iterable[r.Record]) -> None:
        """Say which vehicles of a stopped run were lost, or failed, before they had stopped."""
        if runner.run.state.outcome is not r.RunOutcome.STOPPED:
            return
        for record in records:
            if isinstance(record, r.BehaviorEnded) and record.state in _NOT_STOPPED:
                resources = self._dispatcher.resources_of(record.behavior)
                self._alert("STOP", runner.id, resources, record.reason or record.code)

    def _alert(self, what: str, run: RunId, resources: Iterable[str], why: str) -> None:
        resources = tuple(resources)
        names = ", ".join(resources)
        text = f"{names} may not have received the {what} of {run}: {why}. Use its own stop"
        self._events.publish(
            Alert(run, "NOT_RECEIVED", text, AlertSeverity.CRITICAL, resources, group=what)
        )

    def _watch(self, what: str, run: RunId, orders: Mapping[str, Order]) -> None:
        if orders:
            task = asyncio.create_task(self._alert_if_late(what, run, orders))
            self._watches.add(task)
            task.add_done_callback(self._watches.discard)

    async def _alert_if_late(self, what: str, run: RunId, orders: Mapping[str, Order]) -> None:
        """Say at once which vehicles may go on, and why."""
        tasks = {order.task for order in orders.values() if order.task is not None}
        await asyncio.wait(tasks, timeout=ACKNOWLEDGED_WITHIN_S)
        late: Sequence[tuple[Order, str]] = [
            (order, order.wrong or _waited(order))
            for order in orders.values()
            if order.wrong or not (order.task is None or order.task.done())
        ]
        for order, why in late:
            self._alert(what, run, order.resources, why)


def _waited(order: Order) -> str:
    where = f" on {', '.join(order.hosts)}" if order.hosts else ""
    return f"its arbiter{where} has not taken it within {ACKNOWLEDGED_WITHIN_S:g} s"


def _problem(what: str, asked: "asyncio.Future[Step]") -> str:
    """Why it is not in the journal, or changed nothing; "" when all is well."""
    if not asked.done():
        return (
            f"the {what} went to its vehicles at once, but the journal does not write: "
            "it has not been recorded yet"
        )
    error = asked.exception()
    if isinstance(error, StaleEpochError):
        return (
            f"its vehicles were commanded to hold, and the {what} is not recorded: {error}. "
            f"Ask for the {what} at the other executive, too"
        )
    if isinstance(error, M2pemError):
        return f"the {what} went to its vehicles, but was not recorded: {error}"
    if error is not None:
        raise error
    match asked.result().records:
        case [r.InputIgnored(reason), *_]:
            return in_words(asked.result().input, reason)
    return ""


@dataclass(frozen=True, slots=True)
class StopMark:
    """Who stopped a run, and why."""

    by: str
    reason: str


class StopMarks:
    """The marks of stopped runs of one journal. `file`, `identity`: of the journal."""

    def __init__(self, file: Path | None, identity: UUID) -> None:
        self._files = MarkFiles(file, identity, "stopped")

    def put(self, run: str, mark: StopMark) -> None:
        """Have a mark written; returns at once."""
        self._files.put(run, {"by": mark.by, "reason": mark.reason})

    def remove(self, run: str) -> None:
        """Have the mark of a run removed: the journal has the stop; returns at once."""
        self._files.remove(run)

    def get(self, run: str) -> StopMark | None:
        """The mark of a run that was left without an end; None: it was not stopped."""
        found = self._files.get(run)
        if found is None:
            return None
        return StopMark(str(found.get("by", "")), str(found.get("reason", "")))

    async def close(self) -> None:
        """Let the marks be written."""
        await self._files.close()
