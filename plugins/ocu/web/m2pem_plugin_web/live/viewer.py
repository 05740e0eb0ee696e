"""One browser: what it has not been sent yet, and how much it has not acknowledged yet.

It holds names of what changed, never a queue of changes: however slow a browser is, what waits
for it is bounded by the size of the mission and the fleet.
"""

import asyncio
from collections import deque
from typing import Any

from m2pem.api.run_view import NEWEST, Place
from m2pem_plugin_web.live.live_run import LiveRun

WINDOW = 2
"""Paced messages that a browser may have on its way or before it."""

SILENT_S = 10.0
"""A browser that acknowledges no message for so long is disconnected; it may connect again."""

URGENT = 1000
"""Messages that may wait unpaced; a browser that is further behind is disconnected."""

HEARTBEAT_S = 1.0
"""Without a change: so that the page knows the mission time, and that it is still connected."""

LOG_EVERY_S = 0.25


class Unsent:
    """Names of what has changed since the browser was sent it."""

    def __init__(self) -> None:
        self.elements: set[Place] = set()
        self.commands: set[str] = set()
        self.vehicles: set[str] = set()
        self.payloads: set[str] = set()
        self.teams: set[str] = set()
        self.holders: set[str] = set()

    def __bool__(self) -> bool:
        return bool(
            self.elements
            or self.commands
            or self.vehicles
            or self.payloads
            or self.teams
            or self.holders
        )


class Viewer:
    """Times are of the event loop's clock, in seconds."""

    def __init__(self) -> None:
        self.live: LiveRun | None = None
        self.watches = False
        """Whether it has asked for anything yet."""
        self.unsent = Unsent()
        self.wants_snapshot = False
        self.frame_due = False
        self.urgent: deque[dict[str, Any]] = deque()
        self.wake = asyncio.Event()
        self.overrun = False
        self._seq = 0
        self._unacked: deque[tuple[int, float]] = deque()
        self._framed_at = 0.0
        self._logged_at = 0.0
        self.sent_seq = 0
        """Of the watched run: the last record that was counted in a frame."""
        self.logged_seq = 0

    def watch(self, live: LiveRun | None) -> None:
        """Watch a run (None: only the fleet and the list of runs), from a snapshot on."""
        self.live = live
        self.watches = True
        self.wants_snapshot = True
        self.sent_seq = 0
        self.logged_seq = max(0, live.view.seq - NEWEST) if live is not None else 0
        self.wake.set()

    def send_soon(self, message: dict[str, Any]) -> None:
        """Queue a message before all that is paced."""
        if not self.watches:
            return
        if len(self.urgent) >= URGENT:
            self.overrun = True
        else:
            self.urgent.append(message)
        self.wake.set()

    def refuse(self, message: dict[str, Any]) -> None:
        """Queue the refusal of a request, whether or not the browser watches anything."""
        self.urgent.append(message)
        self.wake.set()

    def numbered(self, message: dict[str, Any]) -> dict[str, Any]:
        """A message with its number on this connection."""
        self._seq += 1
        return {"type": message["type"], "seq": self._seq, **message}

    def sent_paced(self, now: float) -> None:
        """The message that was numbered last is one that the browser takes in at its own pace."""
        self._unacked.append((self._seq, now))
        self._framed_at = now

    def acknowledge(self, seq: int) -> None:
        """The browser has taken in all up to `seq`."""
        while self._unacked and self._unacked[0][0] <= seq:
            self._unacked.popleft()
        if self.frame_due or self.wants_snapshot:
            self.wake.set()

    @property
    def may_send(self) -> bool:
        """Whether it can take another paced message."""
        return len(self._unacked) < WINDOW

    def is_silent(self, now: float) -> bool:
        """Whether it has not acknowledged a message for too long."""
        return bool(self._unacked) and now - self._unacked[0][1] > SILENT_S

    def due(self, now: float) -> bool:
        """Whether a frame is due now."""
        if not self.watches or self.wants_snapshot:
            return False
        counted = self.live is not None and self.live.view.seq != self.sent_seq
        return bool(self.unsent) or counted or now - self._framed_at >= HEARTBEAT_S

    def log_due(self, now: float) -> bool:
        """Whether records are due now."""
        if self.live is None or self.live.view.seq <= self.logged_seq:
            return False
        if now - self._logged_at < LOG_EVERY_S:
            return False
        self._logged_at = now
        return True
