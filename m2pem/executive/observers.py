"""Plugins that observe records: called from a thread, so that a slow one delays no mission."""

import asyncio
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from queue import Full, Queue

from m2pem.api.control import Alert, RunId
from m2pem.engine.records import Record
from m2pem.executive.notices import Notices

MAX_WAITING = 10_000
"""Batches of records that may wait for slow observers; beyond it, records are not observed."""

DRAINED_WITHIN_S = 5.0
"""How long the end of an executive waits for observers."""

_Batch = tuple[RunId, Sequence[Record]]


class Observers:
    """`observe` is called with each batch of committed records, in order.

    From `start` to `close` it is called from a thread; before, and where `start` is never called
    (in virtual time nothing is late), from `put` itself.
    """

    def __init__(
        self, observe: Callable[[RunId, Sequence[Record]], None], notices: Notices
    ) -> None:
        self._observe = observe
        self._notices = notices
        self._waiting: Queue[_Batch | None] = Queue(MAX_WAITING)
        self._ended: asyncio.Event | None = None
        self._behind = False

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
            if not self._behind:
                text = (
                    f"plugins that observe records are more than {MAX_WAITING:,} inputs behind: "
                    "records are kept from them until they have caught up. The journal has all"
                )
                self._notices.publish(Alert("", "OBSERVERS_BEHIND", text))
            self._behind = True

    async def close(self) -> None:
        """Let them observe what waits, within `DRAINED_WITHIN_S`."""
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
            self._notices.publish(Alert("", "OBSERVERS_BEHIND", text))
