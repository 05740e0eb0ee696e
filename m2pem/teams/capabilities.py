"""Which team behaviors the members' own behaviors allow. Imports nothing that runs them."""

from collections.abc import Callable, Mapping, Sequence

from m2pem.api.arbiter import Arbiter
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import TEAM_NEEDS, lacking
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId


class Capabilities:
    """The vehicle behaviors and team behaviors of a fleet's members, by their own arbiters."""

    def __init__(self, fleet: Fleet, arbiter_of: Callable[[ResourceId], Arbiter]) -> None:
        self._fleet = fleet
        self._arbiter_of = arbiter_of
        self._in_teams = {member for team in fleet.teams.values() for member in team.members}

    def alone(self, resource: ResourceId) -> Mapping[str, BehaviorSpec]:
        """Return a vehicle's own behaviors that the fleet allows, by name."""
        vehicle = self._fleet.vehicles.get(resource)
        allowed = vehicle.behaviors if vehicle is not None else ()
        return {
            spec.name: spec
            for spec in self._arbiter_of(resource).catalogue(resource)
            if spec.type is BehaviorType.VEHICLE and (allowed is None or spec.name in allowed)
        }

    def together(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the team behaviors in which a vehicle can take part."""
        if resource not in self._in_teams:
            return ()
        alone = self.alone(resource)
        return tuple(
            spec
            for (name, type_), spec in SHARED.items()
            if type_ is BehaviorType.TEAM and name in TEAM_NEEDS and not lacking(name, alone)
        )
