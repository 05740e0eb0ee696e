"""Vehicles that cannot stand still in the air stay at a place by circling it: how far from it.

Sources: the parameter references of ArduPlane (WP_LOITER_RAD, RTL_RADIUS) and PX4 (NAV_LOITER_RAD,
RTL_LOITER_RAD).
"""

from typing import NamedTuple

from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError
from m2pem_plugin_mavlink.vehicle import exchanges
from m2pem_plugin_mavlink.vehicle.heard import Heard
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind

WINGED = frozenset({Kind.PLANE, Kind.VTOL})
"""Kinds that fly on, whatever they are told."""


class _Radii(NamedTuple):
    """Parameters, and what the first one is if nobody has set it, in metres."""

    name: str
    home_name: str
    usual_m: float


_RADII = {
    Firmware.ARDUPILOT: _Radii("WP_LOITER_RAD", "RTL_RADIUS", 60.0),
    Firmware.PX4: _Radii("NAV_LOITER_RAD", "RTL_LOITER_RAD", 80.0),
}


def circles(identity: Identity) -> bool:
    """Whether a vehicle cannot stand still in the air."""
    return identity.kind in WINGED


def suppose(heard: Heard, identity: Identity) -> None:
    """What its makers have set, until it says more."""
    heard.circle_m = heard.home_circle_m = _RADII[identity.firmware].usual_m


async def ask(heard: Heard, identity: Identity, link: VehicleLink) -> None:
    """Ask it for its radii. A negative one is flown counter-clockwise; 0 at home is as elsewhere.

    Raises:
        ExchangeError: it does not tell.
    """
    radii = _RADII[identity.firmware]
    elsewhere_m = abs(await exchanges.parameter(link, identity.firmware, radii.name))
    if elsewhere_m > 0:
        heard.circle_m = heard.home_circle_m = elsewhere_m
    try:
        home_m = abs(await exchanges.parameter(link, identity.firmware, radii.home_name))
    except NoAnswerError:
        return  # older ones have no such parameter
    if home_m > 0:
        heard.home_circle_m = home_m
