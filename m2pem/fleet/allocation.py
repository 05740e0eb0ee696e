"""Static allocation: which resources of the fleet fill the roles of a task (paper, section 4.2)."""

from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.errors import M2pemError
from m2pem.fleet.fleet import Fleet, Team
from m2pem.mission.behavior import Behavior, Role, RoleKind, ServiceCall
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission


@dataclass(frozen=True, slots=True)
class Allocation:
    """`resources`: all that the task holds, each once, in the order of the roles. `roles`: who
    fills each role; a team is spelled out, its lead first. Optional roles may be absent."""

    resources: tuple[ResourceId, ...]
    roles: Mapping[str, tuple[ResourceId, ...]]


class AllocationError(M2pemError):
    """A role that is not optional names a resource that the fleet lacks."""


def allocate(task: Behavior | ServiceCall, fleet: Fleet) -> Allocation:
    """Fill the roles of a behavior or service.

    Raises:
        AllocationError: names the role, its resource and the fleet file.
    """
    roles: dict[str, tuple[ResourceId, ...]] = {}
    for role in task.roles:
        resources = resources_of(role, fleet)
        if resources:
            roles[role.name] = resources
        elif not role.optional:
            raise AllocationError(
                f"role '{role.name}': {fleet.file} has no {role.kind.value} '{role.resource}'"
            )
    held = dict.fromkeys(resource for resources in roles.values() for resource in resources)
    return Allocation(tuple(held), roles)


def resources_of(role: Role, fleet: Fleet) -> tuple[ResourceId, ...]:
    """What fills a role; nothing when the fleet lacks it."""
    resource = ResourceId(role.resource)
    match role.kind:
        case RoleKind.VEHICLE:
            return (resource,) if resource in fleet.vehicles else ()
        case RoleKind.PAYLOAD:
            return (resource,) if resource in fleet.payloads else ()
        case RoleKind.TEAM:
            team = fleet.teams.get(role.resource)
            return spelled_out(team) if team else ()


def resources_of_mission(mission: Mission, fleet: Fleet) -> tuple[ResourceId, ...]:
    """Return every resource that roles of a mission name, each once, in the order of its tasks."""
    found = dict.fromkeys(
        resource
        for task in mission.activities()
        for asked in (getattr(task, "behavior", None), getattr(task, "call", None))
        if isinstance(asked, Behavior | ServiceCall)
        for role in asked.roles
        for resource in resources_of(role, fleet)
    )
    return tuple(found)


def spelled_out(team: Team) -> tuple[ResourceId, ...]:
    """The members of a team, its lead first."""
    return (team.lead, *(member for member in team.members if member != team.lead))
