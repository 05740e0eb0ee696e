"""Monitors of the executive's own process: its event loop, and the disk of its journal.

    async with LoopMonitor(executive.events, executive.health):
        ...

A plugin that blocks the event loop delays everything, STOP included. A thread sees that the loop
does not turn, and reads off its stack which module blocks it. If another executive stands by, the
thread then ends the process, so that operators are served again.
"""

import asyncio
import logging
import sys
import threading
import time
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from types import FrameType
from typing import Self

from m2pem.api.alerts import AlertSeverity
from m2pem.api.runs import Alert
from m2pem.errors import JournalError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.health import ExecutiveHealth
from m2pem.journal.base import Journal
from m2pem.journal.storage_checks import space_shortage

log = logging.getLogger("m2pem.loop")

TICK_S = 0.1
LATE_AFTER_S = 0.5
"""A loop that has not turned for so long is blocked."""

LEFT_AFTER_S = 2.5
"""A blocked process ends after so long, if its journal has no lease."""

ASKED_EACH_S = 1.0
"""Between two questions of a blocked process, who stands by."""


class LeaveToStandby:
    """Ends the process whose event loop is blocked, if another executive stands by for its fleet.

    `end` ends the process at once; its argument is for people. `after_s`: half the lease of the
    journal, which the executive surely still has then.
    """

    def __init__(self, journal: Journal, fleet: str, end: Callable[[str], None]) -> None:
        self.after_s = journal.lease_s / 2 if journal.lease_s else LEFT_AFTER_S
        self._journal = journal
        self._fleet = fleet
        self._end = end

    def act(self, why: str) -> None:
        """End the process, from any thread; return if no other executive stands by."""
        try:
            standby = self._journal.abandon(self._fleet)
        except JournalError as error:
            log.warning("who stands by is not known: %s", error)
            return
        if standby is not None:
            self._end(f"{why}: this executive ends, and leaves its missions to {standby}")


class LoopMonitor:
    """Watch the event loop in which the block runs.

    While the loop is blocked, the log says so; operators get an alert as soon as it turns again.
    `health` notes it, too. `leave`: ends the process after a while; None: it is never ended.
    """

    def __init__(
        self, events: ControlEvents, health: ExecutiveHealth, leave: LeaveToStandby | None = None
    ) -> None:
        self._events = events
        self._health = health
        self._leave = leave
        self._ticked_s = time.monotonic()
        self._ended = threading.Event()
        self._blocked_by = ""
        self._blocked_s = 0.0

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()
        self._tick()
        threading.Thread(target=self._watch, name="loop monitor", daemon=True).start()
        return self

    async def __aexit__(self, *reason: object) -> None:
        self._ended.set()
        self._timer.cancel()

    def _tick(self) -> None:
        now_s = time.monotonic()
        late_s = now_s - self._ticked_s - TICK_S
        self._ticked_s = now_s
        if self._blocked_by:
            # The loop may have turned while the thread was about to name what kept it.
            blocked_s = max(late_s, self._blocked_s)
            text = (
                f"nothing was done for {blocked_s:.1f} s, and STOP would not have been either: "
                f"{self._blocked_by} blocked the executive"
            )
            self._blocked_by = ""
            self._events.publish(Alert("", "BLOCKED", text, AlertSeverity.ERROR))
            self._health.blocked(text)
        self._timer = self._loop.call_later(TICK_S, self._tick)

    def _watch(self) -> None:
        woken_s, used_s = time.monotonic(), time.process_time()
        seen_s = watched_s = asked_s = 0.0
        while not self._ended.wait(TICK_S):
            slept_s, worked_s = time.monotonic() - woken_s, time.process_time() - used_s
            woken_s, used_s = woken_s + slept_s, used_s + worked_s
            if slept_s > LATE_AFTER_S and worked_s < slept_s / 2:
                continue  # the whole process was stopped: see `StallMonitor`
            # Only what this thread has seen counts, and no time in which the process was stopped.
            if seen_s != self._ticked_s:
                seen_s, watched_s, asked_s = self._ticked_s, 0.0, 0.0
            watched_s += slept_s
            leave = self._leave if self._blocked_by else None
            if leave is not None and watched_s >= max(leave.after_s, asked_s):
                asked_s = watched_s + ASKED_EACH_S
                leave.act(f"{self._blocked_by} has blocked it for {watched_s:.1f} s")
            late_s = time.monotonic() - self._ticked_s - TICK_S
            if late_s < LATE_AFTER_S or self._blocked_by:
                continue
            frame = sys._current_frames().get(self._thread)
            self._blocked_s = late_s
            self._blocked_by = blocking(frame)
            log.error(
                "%s blocks the executive: STOP reaches no vehicle until it returns. Use the "
                "vehicles' own stop. An arbiter that may block runs in a process of its own with "
                "`m2pem arbiter-host`: then it delays no other vehicle",
                self._blocked_by,
            )


def blocking(frame: FrameType | None) -> str:
    """Where a stack is: "m2pem_plugin_x.arbiter, cancel, line 3".

    Of what the loop runs, the innermost code of a plugin, if there is any; else of another library,
    else of m2pem. What runs the loop itself does not count.
    """
    plugins = {each.module.partition(".")[0] for each in entry_points(group="m2pem")}
    found: dict[str, str] = {}
    while frame is not None and frame.f_code.co_name != "run_forever":
        module = str(frame.f_globals.get("__name__", "?"))
        package = module.partition(".")[0]
        if package == "m2pem":
            owner = "m2pem"
        elif package in plugins:
            owner = "plugin"
        else:
            owner = "" if package in sys.stdlib_module_names else "library"
        found.setdefault(owner, f"{module}, {frame.f_code.co_name}, line {frame.f_lineno}")
        frame = frame.f_back
    return found.get("plugin") or found.get("library") or found.get("m2pem") or "an unknown module"


log = logging.getLogger("m2pem.executive")

EVERY_S = 10.0
"""Between two looks at the disk, in real seconds."""

AGAIN_AFTER = 30
"""Looks after which the same warning is given again: operators come and go."""

CODE = "JOURNAL_SPACE"


async def watch_space(journal: Path, events: ControlEvents) -> None:
    """Look at the disk until cancelled. A disk that hangs keeps nothing else waiting."""
    short_for = 0
    while True:
        try:
            text = await asyncio.to_thread(space_shortage, journal)
        except OSError as error:
            log.warning("%s: its disk cannot be asked for free space: %s", journal, error.strerror)
            text = ""
        if text and short_for % AGAIN_AFTER == 0:
            events.publish(Alert("", CODE, text, AlertSeverity.ERROR, group=CODE))
        elif not text and short_for:
            text = f"there is room again in {journal.parent}"
            events.publish(Alert("", CODE, text, AlertSeverity.NOTICE, clears=True))
            text = ""
        short_for = short_for + 1 if text else 0
        await asyncio.sleep(EVERY_S)
