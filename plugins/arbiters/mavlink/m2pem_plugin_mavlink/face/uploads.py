"""Plans that ground stations upload: the transfer of their items, which the vehicle requests one
after the other (https://mavlink.io/en/services/mission.html).
"""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import MissionItem
from m2pem_plugin_mavlink.face.plan_messages import plan_id
from m2pem_plugin_mavlink.face.requests import Request, Say, acknowledge_plan
from m2pem_plugin_mavlink.protocol.messages import Message, message_type

_logger = logging.getLogger(__name__)

MOST_ITEMS = 1_000
REQUEST_EVERY_S = 1.0
GIVEN_UP_S = 8.0
"""As ArduPilot does: an item is requested again each second, for so long."""

PLAN_TYPES = (0, 1, 2)
ALL_PLANS: int = dialect.MAV_MISSION_TYPE_ALL
NO_PLACE = 2**31 - 1
"""Of `x` and `y`: not given."""

Store = Callable[[Request, int, Sequence[Message]], Awaitable[tuple[int, str]]]
"""Checks and keeps a plan; returns MAV_MISSION_RESULT, and why it is refused."""


@dataclass(slots=True)
class _Transfer:
    """`began`: the request that began it; `type`: MAV_MISSION_TYPE."""

    began: Request
    type: int
    count: int
    items: list[Message] = field(default_factory=list)
    complete: bool = False
    came: asyncio.Event = field(default_factory=asyncio.Event)


class Uploads:
    """One transfer at a time for each vehicle and type of plan. `store` is called at the end."""

    def __init__(
        self, store: Store, begin: Callable[[Coroutine[Any, Any, None]], None], say: Say
    ) -> None:
        """`begin`: runs a coroutine until the face ends. `say` tells a station why its plan is
        refused."""
        self._store = store
        self._begin = begin
        self._say = say
        self._transfers: dict[tuple[int, int], _Transfer] = {}

    def count(self, request: Request) -> None:
        """MISSION_COUNT: a plan is to come."""
        type_, count = request.message.mission_type, request.message.count
        key = request.vehicle.system, type_
        known = self._transfers.get(key)
        if known is not None and not _same_sender(known.began, request):
            acknowledge_plan(request, dialect.MAV_MISSION_DENIED)
        elif known is not None and known.complete:
            return  # it is being checked
        elif type_ not in PLAN_TYPES:
            acknowledge_plan(request, dialect.MAV_MISSION_UNSUPPORTED)
        elif count > MOST_ITEMS:
            acknowledge_plan(request, dialect.MAV_MISSION_NO_SPACE)
        elif known is not None:  # it begins again, or the request was lost
            known.items.clear()
            known.count, known.complete = count, not count
            known.came.set()
        else:
            transfer = self._transfers[key] = _Transfer(request, type_, count)
            transfer.complete = not count
            self._begin(self._receive(key, transfer))

    def item(self, request: Request) -> None:
        """MISSION_ITEM_INT or MISSION_ITEM: the next one is kept, another one requested again."""
        type_ = request.message.mission_type
        transfer = self._transfers.get((request.vehicle.system, type_))
        if transfer is None or transfer.complete or not _same_sender(transfer.began, request):
            return
        if request.message.seq == len(transfer.items):
            transfer.items.append(request.message)
            transfer.complete = len(transfer.items) == transfer.count
            transfer.came.set()
        if not transfer.complete:
            self._ask(transfer)

    def cancelled(self, request: Request) -> None:
        """MISSION_ACK of a station that ends its own transfer."""
        key = request.vehicle.system, request.message.mission_type
        transfer = self._transfers.get(key)
        if (
            request.message.type
            and transfer is not None
            and not transfer.complete
            and _same_sender(transfer.began, request)
        ):
            del self._transfers[key]
            transfer.came.set()

    def _ask(self, transfer: _Transfer) -> None:
        request = transfer.began
        request.answer(
            message_type("MISSION_REQUEST_INT").make(
                **request.source.as_target, seq=len(transfer.items), mission_type=transfer.type
            )
        )

    async def _receive(self, key: tuple[int, int], transfer: _Transfer) -> None:
        request = transfer.began
        try:
            waited = 0.0
            while not transfer.complete:
                if waited or not transfer.items:  # else it was requested when the last one came
                    self._ask(transfer)
                transfer.came.clear()
                try:
                    await asyncio.wait_for(transfer.came.wait(), REQUEST_EVERY_S)
                    waited = 0.0
                except TimeoutError:
                    waited += REQUEST_EVERY_S
                if self._transfers.get(key) is not transfer:
                    return
                if waited >= GIVEN_UP_S:
                    cancelled = dialect.MAV_MISSION_OPERATION_CANCELLED
                    acknowledge_plan(request, cancelled, transfer.type)
                    item = f"item {len(transfer.items)} did not come within {GIVEN_UP_S:g} s"
                    self._say(request.station, request.vehicle, f"the upload is given up: {item}")
                    return
            try:
                result, reason = await self._store(request, transfer.type, transfer.items)
            except Exception:
                _logger.exception("an upload of %s", request.station.name)
                result, reason = dialect.MAV_MISSION_ERROR, "it was not checked: see m2pem's log"
            id_ = plan_id(transfer.items) if result == dialect.MAV_MISSION_ACCEPTED else 0
            acknowledge_plan(request, result, transfer.type, id_)
            if reason:
                self._say(request.station, request.vehicle, reason)
        finally:
            if self._transfers.get(key) is transfer:
                del self._transfers[key]


def _same_sender(one: Request, other: Request) -> bool:
    return (one.station.peer, one.source) == (other.station.peer, other.source)


def mission_items(items: Sequence[Message]) -> list[MissionItem]:
    """Return the items of a plan as those of a file."""
    return [_mission_item(each) for each in items]


def _mission_item(message: Message) -> MissionItem:
    x, y = message.x, message.y
    if message.TYPE.name == "MISSION_ITEM_INT":
        is_local = message.frame == dialect.MAV_FRAME_MISSION
        x, y = (_degrees(each, is_local) for each in (x, y))
    numbers = (message.param1, message.param2, message.param3, message.param4, x, y, message.z)
    params = tuple(each if math.isfinite(each) else None for each in numbers)
    goes_on = bool(message.autocontinue)
    return MissionItem(message.seq, "", message.command, message.frame, params, goes_on)


def _degrees(value: int, is_number: bool) -> float:
    if value == NO_PLACE:
        return math.nan
    return float(value) if is_number else value * 1e-7
