"""A vehicle's link through MAVSDK: implements `VehicleLink`."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Sequence
from typing import Any, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock
from m2pem_plugin_mavlink.link.vehicle_link import KeyedLock, Listener, VehicleLink
from m2pem_plugin_mavlink.mavsdk_driver import json_fields, library
from m2pem_plugin_mavlink.microservices.mission_items import (
    MissionItem,
    MissionType,
    item_message,
    mission_result_words,
    refusal,
)
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.protocol.messages import Address, Message, types_by_id
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import (
    ExchangeError,
    NoAnswerError,
    Transaction,
)
from m2pem_plugin_mavlink.signing.signature import RefusedFrames

T = TypeVar("T")


class PendingCalls:
    """Calls into MAVSDK. A call runs in a thread and cannot be stopped: it continues when its
    waiter is cancelled, and the objects that it uses must exist until it returns."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[Any]] = set()

    @property
    def pending(self) -> bool:
        """Whether a call is active."""
        return bool(self._tasks)

    async def make(self, call: Coroutine[Any, Any, T]) -> T:
        """Make a call; raise what it raises."""
        task = asyncio.get_running_loop().create_task(call)
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return await asyncio.shield(task)

    def _done(self, task: "asyncio.Task[Any]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # else asyncio logs that it was never retrieved

    async def finish(self) -> None:
        """Wait until all calls have returned; each does so soon, as MAVSDK waits for no vehicle
        long."""
        while self._tasks:
            await asyncio.wait(self._tasks)


_RESULTS: dict[str, int] = {
    "ERROR": dialect.MAV_MISSION_ERROR,
    "BUSY": dialect.MAV_MISSION_ERROR,
    "UNSUPPORTED": dialect.MAV_MISSION_UNSUPPORTED,
    "TOO_MANY_MISSION_ITEMS": dialect.MAV_MISSION_NO_SPACE,
    "INVALID_ARGUMENT": dialect.MAV_MISSION_INVALID,
    "INVALID_SEQUENCE": dialect.MAV_MISSION_INVALID_SEQUENCE,
    "DENIED": dialect.MAV_MISSION_DENIED,
    "TRANSFER_CANCELLED": dialect.MAV_MISSION_OPERATION_CANCELLED,
}
"""The MAV_MISSION_RESULT of each result of MAVSDK, by its name."""


async def upload_with_mavsdk(link: "MavsdkLink", transaction: Transaction[Any]) -> bool:
    """Let MAVSDK upload a mission; return False if the transaction is something else."""
    if not isinstance(transaction, UploadMission) or not transaction.items:
        return False
    if transaction.mission_type is not MissionType.MISSION:
        return False
    transaction.begin(link.now_s())  # it fails if there is an item that cannot be sent
    if not transaction.done:
        try:
            await link.calls.make(_upload(link, transaction.items))
        except asyncio.CancelledError:
            await cancel_upload(link)
            raise
        except library.failure() as error:
            transaction.fail(_transaction_error(error))
        else:
            transaction.succeed(None)
    return True


async def cancel_upload(link: "MavsdkLink") -> None:
    """Cancel the active upload, if there is one."""
    with contextlib.suppress(library.failure()):  # there is none
        await link.calls.make(link.missions.cancel_mission_upload())


async def _upload(link: "MavsdkLink", items: Sequence[MissionItem]) -> None:
    """Upload to the end; its progress comes in callbacks, which must be read."""
    make = library.plugin("mission_raw").MissionPlan
    plan = make([_item(item, sequence, link.address) for sequence, item in enumerate(items)])
    async for _ in link.missions.upload_mission_with_progress(plan):
        pass


def _item(item: MissionItem, sequence: int, target: Address) -> Any:
    fields: Any = item_message(item, sequence, target, MissionType.MISSION)
    names = "seq frame command current autocontinue param1 param2 param3 param4 x y z mission_type"
    make = library.plugin("mission_raw").MissionItem
    return make(**{name: getattr(fields, name) for name in names.split()})


def _transaction_error(error: Exception) -> ExchangeError:
    name = error.result.name if hasattr(error, "result") else ""
    if name not in _RESULTS:  # a timeout, or an error of MAVSDK itself
        return NoAnswerError(f"upload of the mission: MAVSDK: {library.reason(error)}")
    result = _RESULTS[name]
    return refusal(f"mission refused: {mission_result_words(result)}", result)


_logger = logging.getLogger(__name__)

UNSENT = 50
"""Most messages that wait to be sent; the oldest are dropped."""


class MavsdkLink(VehicleLink):
    """The link of a vehicle, from when MAVSDK has found its system id (`attach`) to `close`, which
    calls `leave` at last.

    What is sent before is dropped. Messages are handed to listeners in the event loop. Missions are
    uploaded by MAVSDK. What else is exchanged goes message by message, as over other links:
    MAVSDK would repeat commands that must not be given twice, and hold a thread for each question.
    """

    def __init__(
        self, address: Address, clock: Clock, leave: Callable[[], Awaitable[None]]
    ) -> None:
        super().__init__(address, clock)
        self.calls = PendingCalls()
        self.missions: Any = None
        self.may_send: Callable[[], bool] = lambda: True
        """Nothing is sent while it is false."""
        self._direct: Any = None
        self._leave = leave
        self._listeners: dict[int, list[Listener]] = {}
        self._readers: dict[int, asyncio.Task[None]] = {}
        self._unsent: deque[Message] = deque(maxlen=UNSENT)
        self._sender: asyncio.Task[None] | None = None
        self._locks = KeyedLock()

    # --- life -----------------------------------------------------------------------------------

    @property
    def attached(self) -> bool:
        """Whether MAVSDK has found the vehicle."""
        return self._direct is not None

    def attach(self, system: Any) -> None:
        """MAVSDK has found the vehicle: subscribe to its messages."""
        self._direct = library.plugin("mavlink_direct").MavlinkDirectAsync(system)
        self.missions = library.plugin("mission_raw").MissionRawAsync(system)
        for id_ in self._listeners:
            self._read(id_)

    async def close(self) -> None:
        """Unsubscribe, and wait for active calls. Active exchanges fail."""
        if self._closed:
            return
        self._end_exchanges()
        tasks = list(self._readers.values())
        if self._sender is not None:
            tasks.append(self._sender)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._readers.clear()
        self._listeners.clear()
        if self.attached:
            await self._let_go()
        await self._leave()

    async def _let_go(self) -> None:
        if self.calls.pending:
            await cancel_upload(self)
        await self.calls.finish()
        self._direct.destroy()
        self.missions.destroy()

    # --- VehicleLink ----------------------------------------------------------------------------

    def send(self, message: Message) -> None:
        if self._closed or not self.attached or not self.may_send():
            return
        self._unsent.append(message)
        if self._sender is None or self._sender.done():
            self._sender = _begin(self._send_all())

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
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
        async with self._locks.locked(transaction.key):
            self._refuse_closed()
            if not self.attached:
                raise NoAnswerError(f"system {self.address.system} has sent no message yet")
            if not await upload_with_mavsdk(self, transaction):
                await self._exchange(transaction)
        return transaction.outcome()

    def quality(self) -> LinkQuality | None:
        """Return None: MAVSDK does not report lost frames."""
        return None

    def refused(self) -> Sequence[RefusedFrames]:
        """Return nothing: MAVSDK checks no signatures."""
        return ()

    # --- receiving ------------------------------------------------------------------------------

    def _read(self, id_: int) -> None:
        if id_ not in self._readers:
            self._readers[id_] = _begin(self._hand_over(id_))

    async def _hand_over(self, id_: int) -> None:
        type_ = types_by_id()[id_]
        async with contextlib.aclosing(self._direct.subscribe_message(type_.name)) as messages:
            async for each in messages:
                listeners = self._listeners.get(id_)
                if not listeners:
                    continue
                try:
                    message = json_fields.read(type_, each.fields_json)
                except (TypeError, ValueError) as error:
                    _logger.debug("MAVSDK handed over a %s: %s", type_.name, error)
                    continue
                sender = Address(each.system_id, each.component_id)
                for listener in tuple(listeners):
                    listener(message, sender)

    # --- sending --------------------------------------------------------------------------------

    async def _send_all(self) -> None:
        make = library.plugin("mavlink_direct").MavlinkMessage
        while self._unsent:
            message = self._unsent.popleft()
            fields = json_fields.written(message)
            wrapped = make(message.TYPE.name, fields_json=fields)
            try:
                await self.calls.make(self._direct.send_message(wrapped))
            except library.failure() as error:
                name, reason = message.TYPE.name, library.reason(error)
                _logger.warning("MAVSDK does not send %s %s: %s", name, fields, reason)


def _begin(work: Coroutine[Any, Any, None]) -> "asyncio.Task[None]":
    return asyncio.get_running_loop().create_task(work)
