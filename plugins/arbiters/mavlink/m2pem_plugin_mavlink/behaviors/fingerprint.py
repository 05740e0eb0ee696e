"""Tells whether a vehicle has the mission that it was given, without keeping the mission."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.mission_items import MissionItem

_LAST_NAVIGATION_COMMAND: int = dialect.MAV_CMD_NAV_LAST
_SAME_FRAMES = {5: 0, 6: 3, 11: 10}
"""The frames with integer coordinates, by those without; autopilots send back either."""

_HEIGHT_STEP_M = 0.02
"""Autopilots keep altitudes in centimetres, or as short floats."""


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Of the items that have a place: how many there are, where, and how high in all."""

    count: int
    places: int
    height_m: float

    def fits(self, other: "Fingerprint") -> bool:
        """Whether they are of the same mission, but for what storing it changes."""
        off_m = abs(self.height_m - other.height_m)
        same = (self.count, self.places) == (other.count, other.places)
        return same and off_m <= _HEIGHT_STEP_M * max(1, self.count) + 1e-6 * abs(self.height_m)


def fingerprint(items: Sequence[MissionItem]) -> Fingerprint:
    """The fingerprint of a mission."""
    placed = [item for item in items if is_navigation(item)]
    lines = "\n".join(
        f"{item.command} {_SAME_FRAMES.get(item.frame, item.frame)}"
        f" {round(item.latitude_deg * 1e7)} {round(item.longitude_deg * 1e7)}"
        for item in placed
    )
    return Fingerprint(
        len(placed),
        zlib.crc32(lines.encode()),
        sum(item.altitude_m for item in placed),
    )


def is_navigation(item: MissionItem) -> bool:
    """Whether the vehicle moves for it, and says that it was reached."""
    return item.command <= _LAST_NAVIGATION_COMMAND
