"""One browser: the changes that are not sent yet, and the messages that are not acknowledged yet.

It holds the names of changed elements, not a queue of changes: the memory for a slow browser is
bounded by the size of the mission and the fleet.
"""

import asyncio
from collections import deque
from typing import Any
from uuid import uuid4

from m2pem.api.run_view import NEWEST, Place
from m2pem_plugin_web.access.roles import Person
from m2pem_plugin_web.live.live_run import LiveRun

WINDOW = 2
"""Most paced messages that a browser has not acknowledged."""

SILENT_S = 10.0
"""A browser that acknowledges no message for so long is disconnected; it may connect again."""

URGENT = 1000
"""Messages that may wait unpaced; a browser that is further behind is disconnected."""

HEARTBEAT_S = 1.0
"""Seconds between frames without a change: they have the mission time, and show the connection."""

LOG_EVERY_S = 0.25


class Unsent:
    """Names of changed elements and states that the browser has not received."""

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
    """The connection to a browser of a person. Times are of the event loop's clock, in seconds."""

    def __init__(self, person: Person | None = None) -> None:
        self.person = person
        self.id = f"page-{uuid4()}"
        self.live: LiveRun | None = None
        self.editing = ""
        """The name of the mission that the page edits."""
        self.watches = False
        """Whether the browser has sent a request."""
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
        """The last record of the watched run that a frame has included."""
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
        """Queue a message before all paced ones."""
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
        """Return a message with its number on this connection."""
        self._seq += 1
        return {"type": message["type"], "seq": self._seq, **message}

    def sent_paced(self, now: float) -> None:
        """Note that the message that was numbered last is a paced one."""
        self._unacked.append((self._seq, now))
        self._framed_at = now

    def acknowledge(self, seq: int) -> None:
        """Process the browser's acknowledgement of all messages up to `seq`."""
        while self._unacked and self._unacked[0][0] <= seq:
            self._unacked.popleft()
        if self.frame_due or self.wants_snapshot:
            self.wake.set()

    @property
    def may_send(self) -> bool:
        """Whether the browser can receive another paced message."""
        return len(self._unacked) < WINDOW

    def is_silent(self, now: float) -> bool:
        """Return whether the browser has not acknowledged a message for too long."""
        return bool(self._unacked) and now - self._unacked[0][1] > SILENT_S

    def due(self, now: float) -> bool:
        """Return whether a frame is due now."""
        if not self.watches or self.wants_snapshot:
            return False
        counted = self.live is not None and self.live.view.seq != self.sent_seq
        return bool(self.unsent) or counted or now - self._framed_at >= HEARTBEAT_S

    def log_due(self, now: float) -> bool:
        """Return whether records are due now."""
        if self.live is None or self.live.view.seq <= self.logged_seq:
            return False
        if now - self._logged_at < LOG_EVERY_S:
            return False
        self._logged_at = now
        return True
