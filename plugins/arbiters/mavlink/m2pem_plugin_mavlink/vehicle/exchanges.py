"""The exchanges that drivers use, one function each. All of them raise `ExchangeError`.

Raises of all of them: `ExchangeError`, see the exchange.
"""

from collections.abc import Sequence

from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.commands import Command, CommandPosition
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage, SetMessageInterval
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.microservices.missions import (
    ClearMission,
    ReadMissionItem,
    SetCurrentItem,
)
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding, ReadParameter
from m2pem_plugin_mavlink.protocol.messages import Message
from m2pem_plugin_mavlink.protocol.transaction import RetryPolicy
from m2pem_plugin_mavlink.vehicle.identity import Firmware

ENCODINGS = {
    Firmware.ARDUPILOT: ParameterEncoding.C_CAST,
    Firmware.PX4: ParameterEncoding.BYTEWISE,
}


_SHORT = RetryPolicy(tries=2, answer_s=1.0)
_IGNORES_POSITION = 0b111
"""POSITION_TARGET_TYPEMASK."""


async def command(link: VehicleLink, command_id: int, *params: float) -> None:
    """Send a command with its first parameters; the others are 0."""
    await link.perform(Command(link.address, command_id, params))


async def command_at(
    link: VehicleLink, command_id: int, params: Sequence[float], place: CommandPosition
) -> None:
    """Send a command with a place."""
    await link.perform(Command(link.address, command_id, params, place=place))


async def message_interval(link: VehicleLink, message_id: int, interval_s: float) -> None:
    """Set the interval of a message, by the vehicle's clock."""
    await link.perform(SetMessageInterval(link.address, message_id, interval_s))


async def request_message(link: VehicleLink, name: str) -> None:
    """Request a message once; listeners receive it."""
    await link.perform(RequestMessage(link.address, name, lambda message: message))


async def position_target(link: VehicleLink) -> tuple[float, float, float]:
    """Return the autopilot's target: latitude and longitude in degrees, metres above mean sea
    level (POSITION_TARGET_GLOBAL_INT in MAV_FRAME_GLOBAL). An autopilot without a target does
    not answer."""
    request = RequestMessage(
        link.address, "POSITION_TARGET_GLOBAL_INT", _target, retry_policy=_SHORT
    )
    return await link.perform(request)


def _target(message: Message) -> tuple[float, float, float] | None:
    """Return the target in the message; None if it has no position."""
    if message.type_mask & _IGNORES_POSITION:
        return None
    return message.lat_int / 1e7, message.lon_int / 1e7, message.alt


async def upload(link: VehicleLink, items: Sequence[MissionItem]) -> None:
    """Store a mission with all its items."""
    await link.perform(UploadMission(link.address, items))


async def download(
    link: VehicleLink, kind: MissionType = MissionType.MISSION
) -> tuple[MissionItem, ...]:
    """Return the stored mission, fence or rally points."""
    return await link.perform(DownloadMission(link.address, kind))


async def clear(link: VehicleLink) -> None:
    """Clear the stored mission."""
    await link.perform(ClearMission(link.address))


async def set_current(link: VehicleLink, sequence: int) -> None:
    """Set the current item of the stored mission."""
    await link.perform(SetCurrentItem(link.address, sequence))


async def mission_item(link: VehicleLink, sequence: int) -> MissionItem:
    """Return one item of the stored mission, outside of a download."""
    return await link.perform(ReadMissionItem(link.address, sequence))


async def parameter(link: VehicleLink, firmware: Firmware, name: str) -> float:
    """Return the value of a parameter."""
    return await link.perform(ReadParameter(link.address, name, ENCODINGS[firmware]))
