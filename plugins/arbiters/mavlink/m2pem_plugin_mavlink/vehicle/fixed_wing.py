"""Vehicles that cannot stop in the air: the radius of their loiter, their landing sequence.

Sources: the parameter references of ArduPlane (WP_LOITER_RAD, RTL_RADIUS) and PX4 (NAV_LOITER_RAD,
RTL_LOITER_RAD).
"""

from collections.abc import Sequence
from typing import NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.parameters import ReadParameter
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind
from m2pem_plugin_mavlink.vehicle.state import AutopilotState

WINGED = frozenset({Kind.PLANE, Kind.VTOL})
"""Kinds that cannot stop in the air."""


class _Radii(NamedTuple):
    """Parameters, and the default of the first one, in metres."""

    name: str
    home_name: str
    usual_m: float


_RADII = {
    Firmware.ARDUPILOT: _Radii("WP_LOITER_RAD", "RTL_RADIUS", 60.0),
    Firmware.PX4: _Radii("NAV_LOITER_RAD", "RTL_LOITER_RAD", 80.0),
}


def assume_default_radii(state: AutopilotState, identity: Identity) -> None:
    """Set the radii to the defaults of the autopilot, until it reports them."""
    state.loiter_radius_m = state.home_loiter_radius_m = _RADII[identity.firmware].usual_m


async def read_radii(state: AutopilotState, identity: Identity, link: VehicleLink) -> None:
    """Read the radii. A negative one means counter-clockwise; 0 at home means the same as
    elsewhere.

    Raises:
        ExchangeError: the vehicle does not answer.
    """
    radii, encoding = _RADII[identity.firmware], identity.firmware.encoding
    elsewhere_m = await link.perform(ReadParameter(link.address, radii.name, encoding))
    if abs(elsewhere_m) > 0:
        state.loiter_radius_m = state.home_loiter_radius_m = abs(elsewhere_m)
    try:
        home_m = await link.perform(ReadParameter(link.address, radii.home_name, encoding))
    except NoAnswerError:
        return  # older autopilots do not have this parameter
    if abs(home_m) > 0:
        state.home_loiter_radius_m = abs(home_m)


_START: int = dialect.MAV_CMD_DO_LAND_START
_LANDS = (dialect.MAV_CMD_NAV_LAND, dialect.MAV_CMD_NAV_VTOL_LAND)

NO_LANDING = (
    "a plane lands by the landing in its mission, and it has none stored: store a mission with "
    "DO_LAND_START, the approach and NAV_LAND"
)


def landing_start(mission: Sequence[MissionItem]) -> int | None:
    """Return the item at which the landing sequence begins (the first DO_LAND_START, else the first
    item that lands); None if there is none."""
    for commands in ((_START,), _LANDS):
        for index, item in enumerate(mission):
            if item.command in commands:
                return index
    return None


def landing_items(mission: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return the landing sequence of a mission, to the mission's end."""
    begins = landing_start(mission)
    return () if begins is None else tuple(mission[begins:])


def remove_landing(mission: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return the items before the landing sequence."""
    begins = landing_start(mission)
    return tuple(mission if begins is None else mission[:begins])
