"""Missions, uploaded by MAVSDK (its plugin mission_raw)."""

import asyncio
import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.mavsdk_driver import library
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType, item_message
from m2pem_plugin_mavlink.microservices.mission_results import is_temporary, mission_result_words
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.transaction import (
    ExchangeError,
    NoAnswerError,
    RefusedError,
    Transaction,
)

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink

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
"""What its results mean, by their names: MAV_MISSION_RESULT."""


async def carried(link: "MavsdkLink", transaction: Transaction[Any]) -> bool:
    """Have MAVSDK upload a mission; False: it is another exchange."""
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
            transaction.fail(_meant(error))
        else:
            transaction.succeed(None)
    return True


async def cancel_upload(link: "MavsdkLink") -> None:
    """End the upload that goes on, if there is one."""
    with contextlib.suppress(library.failure()):  # there is none
        await link.calls.make(link.missions.cancel_mission_upload())


async def _upload(link: "MavsdkLink", items: Sequence[MissionItem]) -> None:
    """To the end: its progress is told in callbacks, for which somebody must be there."""
    make = library.plugin("mission_raw").MissionPlan
    plan = make([_item(item, sequence, link.address) for sequence, item in enumerate(items)])
    async for _ in link.missions.upload_mission_with_progress(plan):
        pass


def _item(item: MissionItem, sequence: int, target: Address) -> Any:
    fields: Any = item_message(item, sequence, target, MissionType.MISSION)
    names = "seq frame command current autocontinue param1 param2 param3 param4 x y z mission_type"
    make = library.plugin("mission_raw").MissionItem
    return make(**{name: getattr(fields, name) for name in names.split()})


def _meant(error: Exception) -> ExchangeError:
    name = error.result.name if hasattr(error, "result") else ""
    if name not in _RESULTS:  # a time-out, or trouble of its own
        return NoAnswerError(f"upload of the mission: MAVSDK: {library.reason(error)}")
    result = _RESULTS[name]
    reason = f"mission refused: {mission_result_words(result)}"
    return RefusedError(reason, result, temporary=is_temporary(result))
