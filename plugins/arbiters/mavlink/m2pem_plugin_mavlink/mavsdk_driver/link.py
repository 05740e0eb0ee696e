"""A vehicle's link through MAVSDK: implements `VehicleLink`."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable, Hashable, Iterable
from typing import Any, TypeVar

from m2pem.api import Clock
from m2pem_plugin_mavlink.link.vehicle_link import Listener
from m2pem_plugin_mavlink.mavsdk_driver import json_fields, library
from m2pem_plugin_mavlink.mavsdk_driver.calls import Calls
from m2pem_plugin_mavlink.mavsdk_driver.exchange import exchange
from m2pem_plugin_mavlink.protocol.messages import Address, Message, types_by_id
from m2pem_plugin_mavlink.protocol.transaction import Transaction

T = TypeVar("T")

US_PER_S = 1_000_000
AUTOPILOT_COMPONENT = 1
UNSENT = 50
"""So many messages wait to be sent; of more, the oldest are dropped."""


class MavsdkLink:
    """The link of a vehicle, from when MAVSDK has found its system id (`attach`) to `close`.

    What is sent before that is dropped. Messages are handed to listeners in the event loop.
    """

    def __init__(self, system_id: int, clock: Clock, logger: logging.Logger) -> None:
        self.address = Address(system_id, AUTOPILOT_COMPONENT)
        self.calls = Calls()
        self.direct: Any = None
        self.missions: Any = None
        self._clock = clock
        self._logger = logger
        self._listeners: dict[int, list[Listener]] = {}
        self._readers: dict[int, asyncio.Task[None]] = {}
        self._unsent: deque[Message] = deque(maxlen=UNSENT)
        self._sender: asyncio.Task[None] | None = None
        self._turns: dict[Hashable, asyncio.Lock] = {}

    def now_s(self) -> float:
        """The clock that was lent, in seconds."""
        return self._clock.now_us() / US_PER_S

    async def sleep(self, seconds: float) -> None:
        """Wait, by the clock that was lent."""
        await self._clock.sleep(seconds)

    # --- life -----------------------------------------------------------------------------------

    @property
    def attached(self) -> bool:
        """Whether MAVSDK has found it."""
        return self.direct is not None

    def attach(self, system: Any) -> None:
        """MAVSDK has found it: begin to listen."""
        direct = library.require("mavsdk.asyncio.plugins.mavlink_direct")
        mission_raw = library.require("mavsdk.asyncio.plugins.mission_raw")
        self.direct = direct.MavlinkDirectAsync(system)
        self.missions = mission_raw.MissionRawAsync(system)
        for id_ in self._listeners:
            self._read(id_)

    async def close(self) -> None:
        """Listen no more, and let what is on its way come back."""
        tasks = [*self._readers.values(), *([self._sender] if self._sender else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._readers.clear()
        self._listeners.clear()
        if self.missions is not None and self.calls.pending:
            for cancel in (
                self.missions.cancel_mission_upload,
                self.missions.cancel_mission_download,
            ):
                with contextlib.suppress(library.failure()):  # there is none to cancel
                    await self.calls.make(cancel())
        await self.calls.finish()
        for plugin in (self.direct, self.missions):
            if plugin is not None:
                plugin.destroy()

    # --- VehicleLink ----------------------------------------------------------------------------

    def send(self, message: Message) -> None:
        """Send a message; nothing is said of its arrival."""
        if not self.attached:
            return
        self._unsent.append(message)
        if self._sender is None or self._sender.done():
            self._sender = asyncio.get_running_loop().create_task(self._send_all())

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        """Hand over all messages with these ids of this system, any component."""
        ids = tuple(ids)
        for id_ in ids:
            self._listeners.setdefault(id_, []).append(listener)
            if self.attached:
                self._read(id_)

        def end() -> None:
            for id_ in ids:
                with contextlib.suppress(KeyError, ValueError):
                    self._listeners[id_].remove(listener)

        return end

    async def perform(self, transaction: Transaction[T]) -> T:
        """Run an exchange to its end, after those with the same key.

        Raises:
            ExchangeError: it failed.
        """
        async with self._turns.setdefault(transaction.key, asyncio.Lock()):
            return await exchange(self, transaction)

    # --- inside ---------------------------------------------------------------------------------

    def _read(self, id_: int) -> None:
        if id_ not in self._readers:
            task = asyncio.get_running_loop().create_task(self._hand_over(id_))
            self._readers[id_] = task

    async def _hand_over(self, id_: int) -> None:
        type_ = types_by_id()[id_]
        async with contextlib.aclosing(self.direct.subscribe_message(type_.name)) as messages:
            async for each in messages:
                listeners = self._listeners.get(id_)
                if not listeners:
                    continue
                try:
                    message = json_fields.read(type_, each.fields_json)
                except (TypeError, ValueError) as error:
                    self._logger.debug("MAVSDK handed over a %s: %s", type_.name, error)
                    continue
                sender = Address(each.system_id, each.component_id)
                for listener in tuple(listeners):
                    listener(message, sender)

    async def _send_all(self) -> None:
        direct = library.require("mavsdk.asyncio.plugins.mavlink_direct")
        while self._unsent:
            message = self._unsent.popleft()
            try:
                await self.calls.make(self.direct.send_message(wrapped(direct, message)))
            except library.failure() as error:
                self._logger.debug("MAVSDK does not send a %s: %s", message.TYPE.name, error)


def wrapped(direct: Any, message: Message) -> Any:
    """A message as MAVSDK takes it; `direct`: its module."""
    return direct.MavlinkMessage(message.TYPE.name, fields_json=json_fields.written(message))
