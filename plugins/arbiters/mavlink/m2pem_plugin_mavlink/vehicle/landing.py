"""The landing of a plane: a part of its mission, behind DO_LAND_START.

Whoever made the landing knows the runway, so it is kept when another mission is stored.
"""

from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.mission_items import MissionItem

_START: int = dialect.MAV_CMD_DO_LAND_START
_LANDS = (dialect.MAV_CMD_NAV_LAND, dialect.MAV_CMD_NAV_VTOL_LAND)

NO_LANDING = (
    "a plane lands by the landing in its mission, and it has none stored: store a mission with "
    "DO_LAND_START, the approach and NAV_LAND"
)


def landing_begins(mission: Sequence[MissionItem]) -> int | None:
    """The item at which the landing of a mission begins (the first DO_LAND_START, else the first
    item that lands); None: it has none."""
    for commands in ((_START,), _LANDS):
        for index, item in enumerate(mission):
            if item.command in commands:
                return index
    return None


def landing(mission: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """The landing of a mission; it goes on to the mission's end."""
    begins = landing_begins(mission)
    return () if begins is None else tuple(mission[begins:])


def without_landing(mission: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """What a mission has before its landing."""
    begins = landing_begins(mission)
    return tuple(mission if begins is None else mission[:begins])
