"""Events of an executive: records, prompts and alerts, for subscribers, observers and logs.

Subscribers get them in the order of commits. No run ever waits for a subscriber.
"""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import suppress
from queue import Full, Queue
from types import TracebackType
from typing import Self
from weakref import WeakValueDictionary

from m2pem.api.alerts import AlertSeverity
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.runs import LOGGED, Alert, RunId
from m2pem.engine.records import Record
from m2pem.errors import OperatorError


class Subscription:
    """ControlEvents for one reader. A reader that falls `size` behind is cut off with an error."""

    def __init__(self, run: RunId | None, size: int) -> None:
        self._run = run
        self._size = size
        self._waiting: deque[ControlEvent] = deque()
        self._wake = asyncio.Event()
        self._overrun = False
        self._ended = False

    @property
    def waiting(self) -> int:
        """How many events its reader has not taken."""
        return len(self._waiting)

    def put(self, events: Sequence[ControlEvent]) -> bool:
        """Add events, but those of another run. Returns whether the reader is cut off now."""
        if self._overrun:
            return False
        if self._run is not None:
            events = [notice for notice in events if notice.run in ("", self._run)]
        room = self._size - len(self._waiting)
        self._overrun = len(events) > room
        self._waiting.extend(events[:room])
        self._wake.set()
        return self._overrun

    def end(self) -> None:
        """Let the reader end after the events that wait."""
        self._ended = True
        self._wake.set()

    def __aiter__(self) -> AsyncIterator[ControlEvent]:
        return self

    async def __anext__(self) -> ControlEvent:
        """Return the next event; the iteration ends with the executive.

        Raises:
            OperatorError: this reader was too slow.
        """
        while not self._waiting:
            if self._overrun:
                raise OperatorError(
                    f"the subscriber fell {self._size} events behind; subscribe again and read"
                    " what was missed with records()"
                )
            if self._ended:
                raise StopAsyncIteration
            self._wake.clear()
            await self._wake.wait()
        return self._waiting.popleft()


class ControlEvents:
    """All subscriptions of an executive, held weakly: a reader that is gone leaves nothing.

    `cut_off`: how many readers were too slow.
    """

    def __init__(self) -> None:
        self.cut_off = 0
        self.on_alert: Callable[[Alert], None] = lambda alert: None
        """Takes each alert, also when nobody subscribes."""
        self._subscriptions: WeakValueDictionary[int, Subscription] = WeakValueDictionary()
        self._ended = False

    @property
    def has_subscribers(self) -> bool:
        """Whether there is a subscription."""
        return bool(self._subscriptions)

    @property
    def waiting(self) -> int:
        """How many events the reader has not taken that is furthest behind."""
        return max((each.waiting for each in list(self._subscriptions.values())), default=0)

    def subscribe(self, run: RunId | None, size: int) -> Subscription:
        """Subscribe to every event from now on, or to those of one run."""
        subscription = Subscription(run, size)
        if self._ended:
            subscription.end()
        else:
            self._subscriptions[id(subscription)] = subscription
        return subscription

    def publish(self, *events: ControlEvent) -> None:
        """Send events to all subscriptions. An alert is published alone."""
        if len(events) == 1 and isinstance(events[0], Alert):
            self.on_alert(events[0])
        for reference in self._subscriptions.valuerefs():
            subscription = reference()
            if subscription is not None and subscription.put(events):
                self.cut_off += 1

    def end(self) -> None:
        """Let every reader come to its end, after what waits for it."""
        self._ended = True
        for subscription in list(self._subscriptions.values()):
            subscription.end()
        self._subscriptions.clear()


MAX_WAITING = 10_000
"""Batches of records that may wait for slow observers; beyond it, records are not observed."""

DRAINED_WITHIN_S = 5.0
"""How long the end of an executive waits for observers."""

_Batch = tuple[RunId, Sequence[Record]]


class RecordObservers:
    """`observe` is called with each batch of committed records, in order.

    From `start` to `close` it is called from a thread; before, and where `start` is never called
    (in virtual time nothing is late), from `put` itself. `dropped`: batches that were not observed.
    """

    def __init__(
        self, observe: Callable[[RunId, Sequence[Record]], None], events: ControlEvents
    ) -> None:
        self._observe = observe
        self._events = events
        self._waiting: Queue[_Batch | None] = Queue(MAX_WAITING)
        self._ended: asyncio.Event | None = None
        self._behind = False
        self.dropped = 0

    @property
    def waiting(self) -> int:
        """How many batches wait."""
        return self._waiting.qsize()

    def start(self) -> None:
        """Observe from a thread. A daemon: an observer that hangs must not keep the program."""
        loop, ended = asyncio.get_running_loop(), asyncio.Event()

        def serve() -> None:
            while (batch := self._waiting.get()) is not None:
                self._observe(*batch)
            with suppress(RuntimeError):  # the executive did not wait so long
                loop.call_soon_threadsafe(ended.set)

        self._ended = ended
        threading.Thread(target=serve, name="observers", daemon=True).start()

    def put(self, run: RunId, records: Sequence[Record]) -> None:
        """Have records observed; never waits for the thread."""
        if self._ended is None:
            self._observe(run, records)
            return
        try:
            self._waiting.put_nowait((run, records))
            self._behind = False
        except Full:
            self.dropped += 1
            if not self._behind:
                text = (
                    f"plugins that observe records are more than {MAX_WAITING:,} inputs behind: "
                    "records are kept from them until they have caught up. The journal has all"
                )
                self._events.publish(Alert("", "OBSERVERS_BEHIND", text))
            self._behind = True

    async def close(self) -> None:
        """Wait until observers have seen what waits, within `DRAINED_WITHIN_S`."""
        if self._ended is None:
            return
        with suppress(Full):
            self._waiting.put_nowait(None)
        try:
            async with asyncio.timeout(DRAINED_WITHIN_S):
                await self._ended.wait()
        except TimeoutError:
            left = self._waiting.qsize()
            text = f"plugins that observe records did not end; {left} inputs were not observed"
            self._events.publish(Alert("", "OBSERVERS_BEHIND", text))


LOGGERS = (
    "m2pem.arbiter",
    "m2pem.dispatch",
    "m2pem.executive",
    "m2pem.face.events",
    "m2pem.plugins",
    "m2pem.teams",
)


class LoggedAlerts(logging.Handler):
    """Publish each warning and error of `LOGGERS` as an alert, between enter and exit.

    Records may say more in `extra`: `resource`, whom it is about; `notice`, that it needs no
    operator; `unlisted`, that the list of alerts has it by itself.
    """

    def __init__(self, events: ControlEvents) -> None:
        super().__init__(logging.WARNING)
        self._events = events

    def __enter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        for name in LOGGERS:
            logging.getLogger(name).addHandler(self)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for name in LOGGERS:
            logging.getLogger(name).removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Any thread may log."""
        severity = AlertSeverity.ERROR if record.levelno >= logging.ERROR else AlertSeverity.WARNING
        if record.levelno >= logging.CRITICAL:
            severity = AlertSeverity.CRITICAL
        if getattr(record, "notice", False):
            severity = AlertSeverity.NOTICE
        about = getattr(record, "resource", "")
        alert = Alert(
            "",
            LOGGED,
            record.getMessage(),
            severity,
            (str(about),) if about else (),
            group=str(record.msg),
            listed=not getattr(record, "unlisted", False),
        )
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._events.publish, alert)
