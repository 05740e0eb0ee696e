"""Which vehicles stay armed when a run has ended, and what an operator may do about it."""

from collections.abc import Iterable

from m2pem.api.bus import FleetBus
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.fleet.fleet import Domain, Vehicle
from m2pem.mission.catalogue import ResourceId

ALOFT_M = 1.0
"""Higher above its home, an aircraft flies."""


def describe_armed_vehicles(free: Iterable[Vehicle], bus: FleetBus) -> str:
    """A sentence about those of some vehicles that say that they are armed, or said so before their
    links were lost; "": there are none."""
    armed = [(state, each.domain) for each in free if (state := _armed(bus, each.id))]
    if not armed:
        return ""
    flying = any(_height(*each) for each in armed)
    ways = "land, return to launch or disarm" if flying else "disarm"
    return (
        f"{'; '.join(_how(*each) for each in armed)}. Nothing commands "
        f"{'it' if len(armed) == 1 else 'them'} now: {ways} by another mission, or by the "
        "vehicle's own ground station or remote control"
    )


def _armed(bus: FleetBus, resource: ResourceId) -> VehicleState | None:
    state = bus.latest(resource)
    return state if isinstance(state, VehicleState) and state.armed else None


def _how(state: VehicleState, domain: Domain) -> str:
    height = _height(state, domain)
    how = f"{f' in {state.mode}' if state.mode else ''}{height}"
    if state.link is LinkState.LOST:
        comma = "," if height else ""
        may = "bring it down" if domain is Domain.AIR else "move or stop it"
        return (
            f"{state.resource} was armed{how}{comma} when its link was lost; what it does now is "
            f"not known, its own failsafe may {may}"
        )
    return f"{state.resource} stays armed{how}"


def _height(state: VehicleState, domain: Domain) -> str:
    height_m = state.altitude_above_home_m
    aloft = domain is Domain.AIR and height_m is not None and height_m > ALOFT_M
    return f", {height_m:.0f} m above its home" if aloft else ""
