"""Running one transaction: its messages, and its deadline by the arbiter's clock."""

import asyncio
import math
from typing import Any

from m2pem.api import Clock
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.transaction import Transaction

US_PER_S = 1_000_000


class Exchange:
    """A transaction that goes on."""

    def __init__(self, transaction: Transaction[Any], link: VehicleLink, clock: Clock) -> None:
        self._transaction = transaction
        self._link = link
        self._clock = clock
        self._ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting: asyncio.Task[None] | None = None
        self._waits_until_s = math.inf

    async def run(self) -> None:
        """Returns when the transaction is done.

        Raises:
            Exception: what the transaction raised, or `abort` was given.
        """
        stop_listening = self._link.listen(self._transaction.wants, self._hear)
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
        """End it with an error."""
        if not self._ended.done():
            self._ended.set_exception(error)

    def _hear(self, message: Message, sender: Address) -> None:
        if self._ended.done():
            return
        try:
            self._transaction.receive(message, sender, self._link.now_s())
            self._go_on()
        except Exception as error:
            self.abort(error)

    def _go_on(self) -> None:
        """Send what is to be sent, and wait for the deadline."""
        transaction = self._transaction
        outbox, transaction.outbox = transaction.outbox, []
        for message in outbox:
            self._link.send(message)
        if transaction.done:
            if not self._ended.done():
                self._ended.set_result(None)
            return
        deadline_s = transaction.deadline_s
        # A deadline is mostly moved on; the wait for the earlier one then goes on by itself.
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
                    self._waits_until_s = -math.inf  # this task waits, no other
                    self._go_on()
        except Exception as error:
            self.abort(error)
        self._waits_until_s = math.inf
