"""A link to one vehicle: its interface, and what all links share.

`Exchange` runs one transaction over it; `KeyedLock` serializes the transactions that have the same
key.
"""

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Hashable, Iterable, Sequence
from contextlib import asynccontextmanager
from typing import Any, TypeAlias, TypeVar

from m2pem.api import US_PER_S, Clock
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, Transaction
from m2pem_plugin_mavlink.signing.signature import RefusedFrames


class KeyedLock:
    """One lock for each key; waiters are served in their order."""

    def __init__(self) -> None:
        self._locks: dict[Hashable, tuple[asyncio.Lock, int]] = {}

    @asynccontextmanager
    async def locked(self, key: Hashable) -> AsyncIterator[None]:
        """Hold the lock of a key."""
        lock, users = self._locks.get(key) or (asyncio.Lock(), 0)
        self._locks[key] = lock, users + 1
        try:
            async with lock:
                yield
        finally:
            lock, users = self._locks.pop(key)
            if users > 1:
                self._locks[key] = lock, users - 1


T = TypeVar("T")

Listener: TypeAlias = Callable[[Message, Address], None]
"""Called with a message and its sender in the event loop; must not raise."""


class VehicleLink(ABC):
    """The link that exchanges and drivers of a vehicle use. `address` is its autopilot's."""

    def __init__(self, address: Address, clock: Clock) -> None:
        self.address = address
        self._clock = clock
        self._closed = False
        self._exchanges: set[Exchange] = set()

    def now_s(self) -> float:
        """Return the time of the clock of `deadline_s`, in seconds; it never goes back."""
        return self._clock.now_us() / US_PER_S

    @abstractmethod
    def send(self, message: Message) -> None:
        """Send a message; the caller sets its target fields. It may get lost."""

    @abstractmethod
    async def perform(self, transaction: Transaction[T]) -> T:
        """Run an exchange to its end, after others with the same key.

        Raises:
            ExchangeError: it failed.
        """

    async def _exchange(self, transaction: Transaction[Any]) -> None:
        exchange = Exchange(transaction, self, self._clock)
        self._exchanges.add(exchange)
        try:
            await exchange.run()
        finally:
            self._exchanges.discard(exchange)

    def _refuse_closed(self) -> None:
        if self._closed:
            raise ExchangeError("the link was closed")

    def _end_exchanges(self) -> None:
        """Let active exchanges fail, and those that come later."""
        self._closed = True
        for exchange in list(self._exchanges):
            exchange.abort(ExchangeError("the link was closed"))

    @abstractmethod
    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        """Call the listener with all messages of these ids from this system, any component; the
        returned function ends that. Only messages with a listener are decoded."""

    @abstractmethod
    def quality(self) -> LinkQuality | None:
        """Return the quality over the endpoint in use; None if the autopilot has never sent
        anything."""

    @abstractmethod
    def refused(self) -> Sequence[RefusedFrames]:
        """Return which frames of the vehicle were refused for their signatures, by endpoint and
        reason."""

    @abstractmethod
    async def close(self) -> None:
        """Release the vehicle. Active exchanges fail."""


class Exchange:
    """Runs a transaction."""

    def __init__(self, transaction: Transaction[Any], link: VehicleLink, clock: Clock) -> None:
        self._transaction = transaction
        self._link = link
        self._clock = clock
        self._ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting: asyncio.Task[None] | None = None
        self._waits_until_s = math.inf

    async def run(self) -> None:
        """Run the transaction until it is done.

        Raises:
            Exception: what the transaction raised, or `abort` was given.
        """
        stop_listening = self._link.listen(self._transaction.wants, self._receive)
        try:
            self._transaction.begin(self._link.now_s())
            self._go_on()
            await self._ended
        finally:
            stop_listening()
            self._ended.cancel()
            if self._waiting is not None:
                self._waiting.cancel()

    def abort(self, error: Exception) -> None:
        """End the exchange with an error."""
        if not self._ended.done():
            self._ended.set_exception(error)

    def _receive(self, message: Message, sender: Address) -> None:
        if self._ended.done():
            return
        try:
            self._transaction.receive(message, sender, self._link.now_s())
            self._go_on()
        except Exception as error:
            self.abort(error)

    def _go_on(self) -> None:
        """Send the messages of the outbox, and wait for the deadline."""
        transaction = self._transaction
        outbox, transaction.outbox = transaction.outbox, []
        for message in outbox:
            self._link.send(message)
        if transaction.done:
            if not self._ended.done():
                self._ended.set_result(None)
            return
        deadline_s = transaction.deadline_s
        # Deadlines are mostly postponed: the wait for the earlier one then continues by itself.
        if deadline_s is not None and deadline_s < self._waits_until_s:
            if self._waiting is not None:
                self._waiting.cancel()
            self._waits_until_s = deadline_s
            self._waiting = asyncio.create_task(self._wait())

    async def _wait(self) -> None:
        try:
            while not self._ended.done():
                deadline_s = self._transaction.deadline_s
                if deadline_s is None:
                    break
                self._waits_until_s = deadline_s
                await self._clock.sleep_until(math.ceil(deadline_s * US_PER_S))
                deadline_s = self._transaction.deadline_s
                if deadline_s is not None and self._link.now_s() >= deadline_s:
                    self._transaction.expire(self._link.now_s())
                    self._waits_until_s = -math.inf  # only this task waits
                    self._go_on()
        except Exception as error:
            self.abort(error)
        self._waits_until_s = math.inf
