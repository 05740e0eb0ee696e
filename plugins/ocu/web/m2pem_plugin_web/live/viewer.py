"""One browser: the changes that are not sent yet, and the messages that are not acknowledged yet.

It holds the names of changed elements, not a queue of changes: the memory for a slow browser is
bounded by the size of the mission and the fleet.
"""

from collections import deque
from typing import NamedTuple
from uuid import uuid4

from m2pem.api.run_view import NEWEST, Place
from m2pem_plugin_web.access.roles import Person
from m2pem_plugin_web.live.live_run import LiveRun
from m2pem_plugin_web.live.messages import Message
from m2pem_plugin_web.live.wire import Wire

WINDOW = 2
"""Most paced messages that a browser has not acknowledged."""

SILENT_S = 10.0
"""A browser that acknowledges no message for so long is disconnected; it may connect again."""

URGENT = 1000
"""Messages that may wait unpaced; a browser that is further behind is disconnected."""

HEARTBEAT_S = 1.0
"""Seconds between frames without a change: they have the mission time, and show the connection."""

_NOTHING: frozenset[str] = frozenset()


class Unsent(NamedTuple):
    """Names of changed elements and states that a browser has not received.

    Browsers that keep up have equal ones, and get one frame that is made once.
    """

    elements: frozenset[Place] = frozenset()
    commands: frozenset[str] = _NOTHING
    vehicles: frozenset[str] = _NOTHING
    payloads: frozenset[str] = _NOTHING
    teams: frozenset[str] = _NOTHING
    holders: frozenset[str] = _NOTHING
    requirements: frozenset[str] = _NOTHING
    debugging: frozenset[str] = _NOTHING

    def __bool__(self) -> bool:
        return any(self)

    def merged(self, later: "Unsent") -> "Unsent":
        """Return these names and later ones."""
        if not self:
            return later
        return Unsent(
            self.elements | later.elements,
            self.commands | later.commands,
            self.vehicles | later.vehicles,
            self.payloads | later.payloads,
            self.teams | later.teams,
            self.holders | later.holders,
            self.requirements | later.requirements,
            self.debugging | later.debugging,
        )


class Viewer:
    """The connection to a browser of a person. Times are of the event loop's clock, in seconds."""

    def __init__(self, wire: Wire, person: Person | None = None) -> None:
        self.wire = wire
        self.person = person
        self.id = f"page-{uuid4()}"
        self.live: LiveRun | None = None
        self.editing = ""
        """The name of the mission that the page edits."""
        self.watches = False
        """Whether the browser has sent a request."""
        self.unsent = Unsent()
        self.wants_snapshot = False
        self.wants_log = False
        self.overrun = False
        self.sent_seq = 0
        """The last record of the watched run that a frame has included."""
        self.logged_seq = 0
        self._urgent: deque[Message] = deque()
        self._seq = 0
        self._unacked: deque[tuple[int, float]] = deque()
        self._framed_at = 0.0

    def watch(self, live: LiveRun | None) -> None:
        """Watch a run (None: only the fleet and the list of runs), from a snapshot on."""
        self.live = live
        self.watches = True
        self.wants_snapshot = True
        self.wants_log = True
        self.unsent = Unsent()
        self.sent_seq = 0
        self.logged_seq = max(0, live.view.seq - NEWEST) if live is not None else 0

    def send_soon(self, message: Message) -> None:
        """Send a message before all paced ones: at once, or when the connection takes more."""
        if self.watches:
            self.send(message)

    def send(self, message: Message) -> None:
        """Send a message, whether or not the browser watches anything."""
        if not self._urgent and self.wire.is_writable:
            self._write(message)
        elif len(self._urgent) >= URGENT:
            self.overrun = True
        else:
            self._urgent.append(message)

    def flush(self) -> None:
        """Send what has waited for the connection."""
        while self._urgent and self.wire.is_writable:
            self._write(self._urgent.popleft())

    def send_paced(self, message: Message, now: float) -> None:
        """Send a snapshot or frame with all that has changed up to now; see `may_send`."""
        self._write(message)
        self._unacked.append((self._seq, now))
        self._framed_at = now
        self.wants_snapshot = False
        self.unsent = Unsent()
        self.sent_seq = self.live.view.seq if self.live is not None else 0

    def send_log(self, message: Message) -> None:
        """Send the newest records up to now."""
        self._write(message)
        self.wants_log = False
        self.logged_seq = self.live.view.seq if self.live is not None else 0

    def _write(self, message: Message) -> None:
        self._seq += 1
        self.wire.write_text(message.head + str(self._seq).encode(), message.rest)

    def acknowledge(self, seq: int) -> None:
        """Process the browser's acknowledgement of all messages up to `seq`."""
        while self._unacked and self._unacked[0][0] <= seq:
            self._unacked.popleft()

    @property
    def may_send(self) -> bool:
        """Whether the browser can receive another paced message."""
        return len(self._unacked) < WINDOW and not self._urgent and self.wire.is_writable

    def is_silent(self, now: float) -> bool:
        """Return whether the browser has not acknowledged a message for too long."""
        return bool(self._unacked) and now - self._unacked[0][1] > SILENT_S

    def due(self, now: float) -> bool:
        """Return whether a frame or snapshot is due now."""
        if not self.watches:
            return False
        counted = self.live is not None and self.live.view.seq != self.sent_seq
        return (
            self.wants_snapshot
            or bool(self.unsent)
            or counted
            or now - self._framed_at >= HEARTBEAT_S
        )

    @property
    def log_due(self) -> bool:
        """Whether records are due now."""
        return self.wants_log and self.live is not None and self.live.view.seq > self.logged_seq
