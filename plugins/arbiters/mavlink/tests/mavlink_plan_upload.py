"""Uploads and downloads of plans by pymavlink, as ground stations do them."""

import math
from collections.abc import Sequence
from typing import Any

from mavlink_gcs import GroundStation
from pymavlink.dialects.v20 import ardupilotmega as dialect

Place = tuple[float, float, float]

RELATIVE: int = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
WAYPOINT: int = dialect.MAV_CMD_NAV_WAYPOINT
TAKEOFF: int = dialect.MAV_CMD_NAV_TAKEOFF
LAND: int = dialect.MAV_CMD_NAV_LAND
RETURN: int = dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH


class Item:
    """An item of a plan. `params`: parameters 1 to 4; `place`: latitude, longitude, altitude."""

    def __init__(
        self,
        command: int,
        place: Sequence[float] = (0.0, 0.0, 0.0),
        params: Sequence[float] = (0.0, 0.0, 0.0, math.nan),
        frame: int = RELATIVE,
    ) -> None:
        self.command, self.params, self.frame = command, tuple(params), frame
        scale = 1.0 if frame == dialect.MAV_FRAME_MISSION else 1e7
        self.x, self.y = (round(each * scale) for each in place[:2])
        self.z = place[2]

    def fields(self, number: int) -> tuple[Any, ...]:
        """The fields of MISSION_ITEM_INT from `seq` to `z`."""
        end = (*self.params, self.x, self.y, self.z)
        return (number, self.frame, self.command, number == 0, 1, *end)


async def upload(station: GroundStation, system: int, items: Sequence[Item], type_: int = 0) -> int:
    """Upload a plan as its vehicle requests it; MAV_MISSION_RESULT."""
    since = len(station.received)
    station.mav.mission_count_send(system, 1, len(items), type_)
    while True:
        answer = await station.hears(
            ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"),
            lambda each: each.get_srcSystem() == system and each.mission_type == type_,
            since,
        )
        since = station.received.index(answer, since) + 1
        if answer.get_type() == "MISSION_ACK":
            return int(answer.type)
        item = items[answer.seq]
        station.mav.mission_item_int_send(system, 1, *item.fields(answer.seq), type_)


async def download(station: GroundStation, system: int, type_: int = 0) -> list[Any]:
    """Download a plan: its MISSION_ITEM_INT."""
    since = len(station.received)
    station.mav.mission_request_list_send(system, 1, type_)
    count = (await station.hears("MISSION_COUNT", since=since)).count
    items = []
    for number in range(count):
        station.mav.mission_request_int_send(system, 1, number, type_)
        items.append(
            await station.hears(
                "MISSION_ITEM_INT",
                lambda each: each.seq == number and each.mission_type == type_,  # noqa: B023
                since,
            )
        )
    station.mav.mission_ack_send(system, 1, dialect.MAV_MISSION_ACCEPTED, type_)
    return items
