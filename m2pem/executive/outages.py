"""Outages of a living executive: its computer was suspended, its process stopped, or its event loop
blocked.

Vehicles went on meanwhile without an observer. So each run looks at its vehicles before it
decides or sends anything (`m2pem.executive.recovery.look_again`), as after a restart. STOP and
pause of operators do not wait for that.
"""

import asyncio
from collections.abc import Callable

from m2pem.api.clock import SystemClock
from m2pem.api.runs import Alert
from m2pem.boot_time import boot_time_ns
from m2pem.executive.control_events import ControlEvents

OUTAGE_S = 5.0
"""An executive that did nothing for so long was away, in real seconds."""

CODE = "OUTAGE"

_EVERY_S = 0.5
_NS_PER_S = 1_000_000_000


class Outages:
    """Counts the outages of one executive; `number` is how many there were.

    `length_s`: of the last one, in seconds of the executive's clock. `shortest_s`: real seconds
    from which on it is one. `steady_ns`: time that goes on while the computer is suspended.
    `on_outage` is called for each.
    """

    def __init__(
        self,
        events: ControlEvents,
        shortest_s: float = OUTAGE_S,
        steady_ns: Callable[[], int] = boot_time_ns,
    ) -> None:
        self.number = 0
        self.length_s = 0.0
        self.on_outage: Callable[[], None] = lambda: None
        self._events = events
        self._shortest_ns = round(shortest_s * _NS_PER_S)
        self._steady_ns = steady_ns
        self._seen_ns: int | None = None
        self._speed = 1.0

    async def watch(self, clock: SystemClock) -> None:
        """Notice outages until cancelled."""
        self._speed = clock.speed
        self._seen_ns = self._steady_ns()
        while True:
            await asyncio.sleep(_EVERY_S)
            self.look()

    def look(self) -> None:
        """Notice an outage that has just ended; none before `watch` was begun."""
        if self._seen_ns is None:
            return
        now_ns = self._steady_ns()
        seen_ns, self._seen_ns = self._seen_ns, now_ns
        if now_ns - seen_ns >= self._shortest_ns:
            self.noticed((now_ns - seen_ns) / _NS_PER_S * self._speed)

    def noticed(self, length_s: float) -> None:
        """Count an outage, and tell operators."""
        self.number += 1
        self.length_s = length_s
        text = (
            f"the executive did nothing for {length_s:.0f} s: its computer was suspended, or its "
            "process stopped or blocked. STOP would have reached no vehicle. Each run looks at its "
            "vehicles before it sends anything"
        )
        self._events.publish(Alert("", CODE, text))
        self.on_outage()
