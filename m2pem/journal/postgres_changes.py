"""How executives on a journal in PostgreSQL notify each other of changes, by NOTIFY and LISTEN.

Triggers notify in the transaction of the change (`postgres_database.notifications`), and name the
session that made it.
"""

import asyncio
import logging

import psycopg

from m2pem.journal.postgres_address import PostgresAddress
from m2pem.journal.postgres_database import CHANNEL, connection_parameters

log = logging.getLogger("m2pem.journal")

_AGAIN_S = 0.5
"""Between the loss of the connection and the next try to listen."""


class ChangeListener:
    """Counts what other executives change, over a connection of its own, from the first `changed`
    on. `session`: that of this executive, whose own changes do not count."""

    def __init__(self, address: PostgresAddress, within_s: float, session: str) -> None:
        self._address = address
        self._within_s = within_s
        self._session = session
        self._changes = 0
        self._condition = asyncio.Condition()
        self._listening: asyncio.Task[None] | None = None

    async def changed(self, seen: int) -> int:
        """See `Journal.changed`."""
        if self._listening is None:
            self._listening = asyncio.create_task(self._listen(), name="changes of the journal")
        async with self._condition:
            await self._condition.wait_for(lambda: self._changes > seen)
        return self._changes

    async def _listen(self) -> None:
        while True:
            try:
                async with await psycopg.AsyncConnection.connect(
                    self._address.url, **connection_parameters(self._within_s)
                ) as connection:
                    await connection.execute(f"LISTEN {CHANNEL}")
                    await self._notify()  # of what was changed before it listened
                    async for notification in connection.notifies():
                        if notification.payload != self._session:
                            await self._notify()
            except psycopg.Error as error:
                log.info("no notification of what other executives change: %s", error)
            await asyncio.sleep(_AGAIN_S)

    async def _notify(self) -> None:
        async with self._condition:
            self._changes += 1
            self._condition.notify_all()

    async def close(self) -> None:
        """Listen no more."""
        if self._listening is not None:
            self._listening.cancel()
            await asyncio.wait([self._listening])
