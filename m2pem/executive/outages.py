"""Times in which this process did not run: its computer was suspended, it was stopped (SIGSTOP), or
its event loop was blocked.

`StallMonitor` finds them. `Ownership` acts on those after which the executive may have lost its
runs, and `Outages` on longer ones: vehicles went on without an observer, so each run looks at its
vehicles before it decides or sends anything (`m2pem.executive.recovery.look_again`), as after a
restart. STOP and pause of operators do not wait for that.
"""

import asyncio
from collections.abc import Callable

from m2pem.api.runs import Alert
from m2pem.boot_time import boot_time_s
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.counts import LATE_BOUNDS_S, Durations

TICK_S = 0.25

OUTAGE_S = 5.0
"""An executive that did nothing for so long was away, in real seconds."""

CODE = "OUTAGE"


class StallMonitor:
    """Finds the stalls of this process while `watch` runs."""

    def __init__(self) -> None:
        self._actions: list[tuple[float, Callable[[float], None]]] = []
        self._tick_s = TICK_S
        self._seen_s: float | None = None
        self.lateness = Durations(LATE_BOUNDS_S)
        """How late the event loop was, at each look of `watch`."""

    def after(self, shortest_s: float, act: Callable[[float], None]) -> None:
        """Have `act` called with the length of each stall of `shortest_s` or more, in real
        seconds."""
        self._actions.append((shortest_s, act))
        self._tick_s = min(self._tick_s, shortest_s / 4)

    async def watch(self) -> None:
        """Find stalls until cancelled."""
        self._seen_s = boot_time_s()
        try:
            while True:
                due_s = boot_time_s() + self._tick_s
                await asyncio.sleep(self._tick_s)
                self.lateness.add(max(0.0, boot_time_s() - due_s))
                self.look()
        finally:
            self._seen_s = None

    def look(self) -> None:
        """Find a stall that has just ended, before anything else is done."""
        if self._seen_s is None:
            return
        now_s = boot_time_s()
        seen_s, self._seen_s = self._seen_s, now_s
        for shortest_s, act in self._actions:
            if now_s - seen_s >= shortest_s:
                act(now_s - seen_s)


class Outages:
    """Counts the outages of one executive; `number` is how many there were.

    `length_s`: of the last one, in seconds of the executive's clock, of which `speed` pass in a
    real one. `shortest_s`: real seconds from which on a stall is one. `on_outage` is called for
    each.
    """

    def __init__(
        self,
        events: ControlEvents,
        stalls: StallMonitor,
        shortest_s: float = OUTAGE_S,
        speed: float = 1.0,
    ) -> None:
        self.number = 0
        self.length_s = 0.0
        self.on_outage: Callable[[], None] = lambda: None
        self._events = events
        stalls.after(shortest_s, lambda stalled_s: self.noticed(stalled_s * speed))

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
