"""Turns telemetry into faults: the telemetry of a resource stopped, or a battery is low.

`LinkMonitor` decides and knows no clock; `monitor_links` feeds it from the bus. Each fault is
reported once: that of a link again when it was received again, as it may be commanded then, and
that of a battery only after it rose above the upper level (hysteresis). A payload is monitored by
itself: its vehicle's link and battery are not its own.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from m2pem.api.bus import FleetBus
from m2pem.api.clock import Clock
from m2pem.api.telemetry import LinkState, PayloadState, TeamState, VehicleState
from m2pem.engine.inputs import ResourceFault
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

STALL_US = 500_000
"""A check that is later than this shows that this process was not running, not a lost link."""

SILENT_SHARE = 0.4
"""Of its bound: a link from which nothing came for so long is about to be lost, if others are lost.
Arbiters publish a state when half of it has passed, with a degraded link."""


@dataclass(slots=True)
class _Link:
    bound_us: int
    received_us: int
    never_received: bool = True
    lost: bool = False

    def is_silent(self, now_us: int) -> bool:
        return self.lost or now_us - self.received_us > SILENT_SHARE * self.bound_us


class LinkMonitor:
    """Times are microseconds since the Unix epoch.

    `lost_after_s`: for each resource the maximum time without telemetry, in seconds (its arbiter's
    or the fleet's bound); a resource that is missing here, or whose bound is infinite, needs none.
    `since_us`: when the arbiters were connected; the time counts from then. `critical`,
    `recovered`: fractions of a full battery.
    """

    def __init__(
        self,
        lost_after_s: Mapping[ResourceId, float],
        since_us: int,
        *,
        critical: float = 0.15,
        recovered: float = 0.20,
    ) -> None:
        if not 0 <= critical <= recovered <= 1:
            raise ValueError(
                f"battery levels are fractions, the critical one ({critical}) not above the "
                f"recovered one ({recovered})"
            )
        if silent := [resource for resource, bound in lost_after_s.items() if not bound > 0]:
            raise ValueError(f"the bound of a link is above 0 s: {', '.join(silent)}")
        self._critical = critical
        self._recovered = recovered
        self._low: set[ResourceId] = set()
        self._links = {
            resource: _Link(round(bound_s * US_PER_S), since_us)
            for resource, bound_s in lost_after_s.items()
            if isfinite(bound_s)
        }
        self._next_check_us = self._first_due(since_us)
        self._stalled = False

    @property
    def next_check_us(self) -> int | None:
        """The time of the next necessary `check`; None: none is necessary."""
        return self._next_check_us

    def received(self, state: VehicleState | PayloadState, now_us: int) -> list[ResourceFault]:
        """Process a state that arrived at `now_us`; its `time_us` is of another machine's clock."""
        faults: list[ResourceFault] = []
        link = self._links.get(state.resource)
        if state.link is LinkState.LOST:
            if link is not None and not link.lost:
                faults.append(self._lose(state.resource, link, "its arbiter lost the link"))
        elif link is not None:
            link.received_us, link.never_received, link.lost = now_us, False, False
        if isinstance(state, VehicleState) and state.battery_fraction is not None:
            faults += self._battery(state.resource, state.battery_fraction)
        return faults

    def received_us(self, resource: ResourceId) -> int | None:
        """When a state of a resource was last received; None: its link is not watched."""
        link = self._links.get(resource)
        return None if link is None else link.received_us

    def has_low_battery(self, resource: ResourceId) -> bool:
        """Whether the battery of a resource counts as low."""
        return resource in self._low

    def receives_nothing(self, now_us: int) -> bool:
        """Whether nothing is received any more of all that was received since connecting: each link
        is lost, or silent for two fifths of its bound. False also while states may still wait, as
        this process was not running."""
        due_us = self._next_check_us
        if self._stalled or (due_us is not None and now_us - due_us > STALL_US):
            return False
        were = [each for each in self._links.values() if not each.never_received]
        return bool(were) and all(each.is_silent(now_us) for each in were)

    def check(self, now_us: int) -> list[ResourceFault]:
        """Return a fault for each resource without telemetry for longer than its bound."""
        if self._next_check_us is None or now_us < self._next_check_us:
            return []
        late_us = now_us - self._next_check_us
        if late_us > STALL_US and not self._stalled:
            # This process was not running: states that arrived meanwhile still wait. Only once in a
            # row, as on a fast clock every check is late.
            self._stalled = True
            # Nobody listened for longer than a bound, as while the computer was suspended: each
            # gets its bound to be received again.
            bounds_us = [each.bound_us for each in self._links.values() if each.bound_us < late_us]
            self._next_check_us = now_us + max([STALL_US, *bounds_us])
            return []
        self._stalled = False
        faults = []
        for resource, link in self._links.items():
            silence_us = now_us - link.received_us
            if not link.lost and silence_us > link.bound_us:
                since = " since connecting," if link.never_received else ""
                reason = f"no telemetry{since} for {silence_us / US_PER_S:.1f} s"
                faults.append(self._lose(resource, link, reason))
        self._next_check_us = self._first_due(now_us)
        return faults

    @staticmethod
    def _lose(resource: ResourceId, link: _Link, reason: str) -> ResourceFault:
        link.lost = True
        return ResourceFault(resource, "LINK_LOST", reason, reachable=False)

    def _battery(self, resource: ResourceId, fraction: float) -> list[ResourceFault]:
        if fraction > self._recovered:
            self._low.discard(resource)
        elif fraction < self._critical and resource not in self._low:
            self._low.add(resource)
            reason = f"battery at {fraction:.0%}, below {self._critical:.0%}"
            return [ResourceFault(resource, "BATTERY_LOW", reason, reachable=True)]
        return []

    def _first_due(self, now_us: int) -> int | None:
        # A lost resource may recover and be lost again before its next check: check it at least
        # once in its bound. A state only postpones a check, so `received` need not call this.
        due = (
            (now_us if link.lost else link.received_us) + link.bound_us + 1
            for link in self._links.values()
        )
        return min(due, default=None)


async def monitor_links(
    bus: FleetBus,
    clock: Clock,
    sink: Callable[[ResourceFault], None],
    rules: LinkMonitor,
    left: Callable[[], Awaitable[bool]],
    size: int = 10_000,
) -> None:
    """Hand every fault to `sink` until the bus is closed or this is cancelled.

    `left` is awaited before a lost link is handed over; True: the runs are left to another
    executive, which may receive what this one does not. `size`: how many states may wait while the
    process is busy.
    """

    async def report(faults: Sequence[ResourceFault]) -> None:
        if any(not fault.reachable for fault in faults) and await left():
            return
        for fault in faults:
            sink(fault)

    async def check() -> None:
        while (due_us := rules.next_check_us) is not None:
            await clock.sleep_until(due_us)
            await report(rules.check(clock.now_us()))

    states = bus.subscribe(size)
    async with asyncio.TaskGroup() as group:
        checking = group.create_task(check(), name="watch links")
        async for state in states:
            if isinstance(state, TeamState):
                continue
            await report(rules.received(state, clock.now_us()))
        checking.cancel()
