"""Which vehicles of a fleet share space, and which tasks wait for it (docs/fleets.md)."""

from collections.abc import Iterable
from dataclasses import replace

from m2pem.fleet.fleet import Domain, Fleet, OnConflict
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId

STOPS = frozenset({"hold", "drive_stop"})
"""Never refused: it is no safer not to stop."""

BY_HAND = frozenset({"teleop"})
"""A person drives or flies, who sees to it: the vehicle counts where it is seen."""

ONE_BY_ONE = frozenset({"bridge_crossing"})
"""Team behaviors of which one member moves at a time."""


def separated_vehicles(fleet: Fleet) -> tuple[ResourceId, ...]:
    """Return the vehicles that are kept apart: those of a domain with a separation, if there are
    two."""
    domains = set(fleet.surface_separation_m)
    if fleet.vertical_separation_m is not None:
        domains.add(Domain.AIR)
    of_domain = {
        domain: [each.id for each in fleet.vehicles.values() if each.domain is domain]
        for domain in domains
    }
    return tuple(
        each.id for each in fleet.vehicles.values() if len(of_domain.get(each.domain, ())) > 1
    )


def participants_of(fleet: Fleet) -> tuple[ResourceId, ...]:
    """Return the vehicles that are kept apart, or that count in a shared space."""
    separated = set(separated_vehicles(fleet))
    counting = {domain for space in fleet.shared_space.values() for domain in space.domains}
    return tuple(
        each.id
        for each in fleet.vehicles.values()
        if each.id in separated or each.domain in counting
    )


def waits_for_space(fleet: Fleet) -> bool:
    return bool(_waiting_domains(fleet))


def may_wait_for_space(
    fleet: Fleet, kind: BehaviorType, name: str, resources: Iterable[str]
) -> bool:
    """Whether the task of a behavior waits if there is no space for it. `resources`: that it is to
    have."""
    if kind is BehaviorType.PAYLOAD or name in STOPS or name in BY_HAND:
        return False
    domains = _waiting_domains(fleet)
    if not domains:
        return False
    vehicles = (fleet.vehicles.get(ResourceId(each)) for each in resources)
    return any(each is not None and each.domain in domains for each in vehicles)


def without_space(fleet: Fleet) -> Fleet:
    """Return a fleet in which no task waits for space."""
    if not fleet.shared_space and fleet.on_conflict is OnConflict.REFUSE:
        return fleet
    return replace(fleet, shared_space={}, on_conflict=OnConflict.REFUSE)


def _waiting_domains(fleet: Fleet) -> set[Domain]:
    found = {
        domain for space in fleet.shared_space.values() if space.waits for domain in space.domains
    }
    if fleet.on_conflict is OnConflict.WAIT:
        found.update(fleet.vehicles[each].domain for each in separated_vehicles(fleet))
    return found
