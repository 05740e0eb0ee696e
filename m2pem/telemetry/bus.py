"""The fleet bus inside one process: the latest state of each resource, and subscriptions to all."""

import asyncio
from collections import deque
from typing import TypeAlias, Union
from weakref import WeakValueDictionary

from m2pem.api.statistics import SubscriptionStatistics
from m2pem.api.telemetry import PayloadState, TeamState, Telemetry, VehicleState
from m2pem.mission.catalogue import ResourceId

State: TypeAlias = Union[VehicleState, PayloadState]


class Subscription:
    """States published since it was made, for one reader.

    `dropped` counts those that were thrown away, oldest first, because the reader was slow. It ends
    when the bus is closed (after what still waits) or by `aclose`; letting go of it is enough.
    """

    def __init__(self, size: int) -> None:
        if size < 1:
            raise ValueError(f"a subscription holds at least one state, not {size}")
        self.dropped = 0
        self._waiting: deque[Telemetry] = deque(maxlen=size)
        self._reader: asyncio.Future[None] | None = None
        self._closed = False

    def __aiter__(self) -> "Subscription":
        return self

    async def __anext__(self) -> Telemetry:
        while not self._waiting:
            if self._closed:
                raise StopAsyncIteration
            if self._reader is not None:
                raise RuntimeError("a subscription is for one reader; subscribe once for each")
            self._reader = asyncio.get_running_loop().create_future()
            try:
                await self._reader
            finally:
                self._reader = None
        return self._waiting.popleft()

    async def aclose(self) -> None:
        """End it; what waits is thrown away."""
        self._waiting.clear()
        self.end()

    def put(self, state: Telemetry) -> bool:
        """Hand a state to the reader; for the bus alone. Returns whether another was dropped."""
        if self._closed:
            return False
        drops = len(self._waiting) == self._waiting.maxlen
        if drops:
            self.dropped += 1
        self._waiting.append(state)
        self._wake()
        return drops

    def statistics(self) -> SubscriptionStatistics:
        """How far its reader is behind."""
        return SubscriptionStatistics(self._waiting.maxlen or 0, len(self._waiting), self.dropped)

    def end(self) -> None:
        """Let nothing more in; for the bus alone."""
        self._closed = True
        self._wake()

    def _wake(self) -> None:
        if self._reader is not None and not self._reader.done():
            self._reader.set_result(None)


class Bus:
    """Implements `m2pem.api.bus.FleetBus`. Used from the event loop's thread only.

    Subscriptions are served in the order in which they were made, and held weakly: a reader that
    was cancelled leaves nothing behind. `dropped`: states that slow readers did not get, in all.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._latest: dict[ResourceId, State] = {}
        self._subscriptions: WeakValueDictionary[int, Subscription] = WeakValueDictionary()
        self._closed = False

    def latest(self, resource: ResourceId) -> State | None:
        """Return the newest state, or None before the first."""
        return self._latest.get(resource)

    def publish(self, state: Telemetry) -> None:
        """Make a state known; never blocks. After `close` it changes nothing."""
        if self._closed:
            return
        if not isinstance(state, TeamState):
            self._latest[state.resource] = state
        for reference in self._subscriptions.valuerefs():
            subscription = reference()
            if subscription is not None and subscription.put(state):
                self.dropped += 1

    def subscribe(self, size: int = 100) -> Subscription:
        """States from now on, for one reader; `size` of them wait at most."""
        subscription = Subscription(size)
        if self._closed:
            subscription.end()
        else:
            self._subscriptions[id(subscription)] = subscription
        return subscription

    def readers(self) -> tuple[SubscriptionStatistics, ...]:
        """How far each reader is behind."""
        return tuple(each.statistics() for each in list(self._subscriptions.values()))

    def close(self) -> None:
        """End every subscription, after what waits in it; `latest` stays."""
        self._closed = True
        for subscription in list(self._subscriptions.values()):
            subscription.end()
        self._subscriptions.clear()
