"""Which resources fill the roles of a task, and which of them are free (paper, section 4.2)."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
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
    """Return every resource that roles of a mission name, each once, in the order of its tasks.

    Those that a task waits for are left out: it starts whoever has them.
    """
    found = dict.fromkeys(
        resource
        for role in roles_of_mission(mission)
        if role.need is None
        for resource in resources_of(role, fleet)
    )
    return tuple(found)


def roles_of_mission(mission: Mission) -> Iterator[Role]:
    """Yield the roles of all tasks, in the order of the tasks; a role comes once for each task."""
    for asked in asked_by(mission):
        yield from asked.roles


def asked_by(mission: Mission) -> Iterator[Behavior | ServiceCall]:
    """Yield the behaviors and service calls of all tasks, in the order of the tasks."""
    for task in mission.activities():
        for asked in (getattr(task, "behavior", None), getattr(task, "call", None)):
            if isinstance(asked, Behavior | ServiceCall):
                yield asked


def spelled_out(team: Team) -> tuple[ResourceId, ...]:
    """The members of a team, its lead first."""
    return (team.lead, *(member for member in team.members if member != team.lead))


def is_behavior(holder: str | None) -> bool:
    """Whether the id of what holds a resource is that of a behavior ("r1.b2"), or of a request for
    one, not of an incident, or of what a run keeps between tasks. None: nothing holds it."""
    return holder is not None and not holder.partition(".")[2].startswith(("i", "k"))


MANNED = "manned"


class Availability:
    """The one ledger of an executive, across all its runs. Behavior ids are unique in it.

    Requests for resources (`m2pem.executive.allocator`) hold what was chosen for them by their own
    id, and incidents what their failed work commanded. What a run keeps between tasks is held by
    the id of that beneath the behaviors of those. `on_change`: is called when a resource may be
    free, or is not available any more.

    A behavior that took a resource over from one which is being cancelled may end first: the
    resource is then held by the one before again.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._resources = frozenset({*fleet.vehicles, *fleet.payloads})
        self._unavailable = {v.id: MANNED for v in fleet.vehicles.values() if v.manned}
        self._lent: dict[ResourceId, str] = {}
        self._holders: dict[ResourceId, list[str]] = {}  # the last one holds it
        self.on_change: Callable[[], None] = lambda: None

    def withdraw(self, resource: ResourceId, reason: str) -> None:
        """No behavior gets the resource until `restore`. Its holder, if any, keeps holding it.

        Raises:
            KeyError: the fleet has no such resource.
        """
        if resource not in self._resources:
            raise KeyError(resource)
        self._unavailable[resource] = reason
        self._lent.pop(resource, None)
        self.on_change()

    def lend(self, resource: ResourceId, run: str) -> None:
        """Let behaviors of one run get a resource that is unavailable: the operator who has it
        commands it by that run. It lasts until `withdraw` or `restore`."""
        self._lent[resource] = run

    def is_lent(self, resource: ResourceId) -> bool:
        """Whether a run commands a resource now for the operator who has it."""
        holder = self.holder(resource)
        return holder is not None and holder.partition(".")[0] == self._lent.get(resource)

    def restore(self, resource: ResourceId) -> None:
        """Behaviors may get the resource again; a manned vehicle, too, once it is handed over."""
        self._unavailable.pop(resource, None)
        self._lent.pop(resource, None)
        self.on_change()

    def reason(self, resource: ResourceId) -> str:
        """Why a resource is unavailable, or "" when it is not."""
        if resource not in self._resources:
            return "not in the fleet"
        return self._unavailable.get(resource, "")

    def holder(self, resource: ResourceId) -> str | None:
        """The behavior that holds a resource."""
        holders = self._holders.get(resource)
        return holders[-1] if holders else None

    def withdrawn(self) -> Mapping[ResourceId, str]:
        """Return what is unavailable, and why."""
        return self._unavailable

    def held(self) -> Iterator[tuple[ResourceId, str]]:
        """Yield each resource that something holds, and what holds it."""
        for resource, holders in self._holders.items():
            if holders:
                yield resource, holders[-1]

    def is_held(self, behavior: str) -> bool:
        """Whether a behavior has not ended, even if what it held has passed on to another one."""
        return any(behavior in holders for holders in self._holders.values())

    def held_by(self, behavior: str) -> tuple[ResourceId, ...]:
        """What a behavior holds."""
        return tuple(r for r, holders in self._holders.items() if holders[-1] == behavior)

    def acquire(
        self, resources: Iterable[ResourceId], behavior: str, preempts: Collection[str] = ()
    ) -> str | None:
        """Give all of `resources` to `behavior`, or none.

        `preempts`: behaviors that are being cancelled, and what the run keeps between tasks; what
        they hold passes to the new one at once. Returns None, or why not, for a person. Asking
        again for what is held is no error.
        """
        wanted = tuple(dict.fromkeys(resources))
        refusals = [self._refusal(resource, behavior, preempts) for resource in wanted]
        if any(refusals):
            return "; ".join(refusal for refusal in refusals if refusal)
        self.adopt(wanted, behavior)
        return None

    def adopt(self, resources: Iterable[ResourceId], behavior: str) -> None:
        """Note that a behavior has resources, which is not to be refused: its arbiter has it."""
        for resource in resources:
            holders = self._holders.setdefault(resource, [])
            if behavior in holders:
                holders.remove(behavior)
            holders.append(behavior)

    def keep(self, resource: ResourceId, keeping: str) -> None:
        """Note that a run keeps a resource between tasks: it is held when nothing else holds it."""
        self._holders.setdefault(resource, []).insert(0, keeping)

    def _refusal(self, resource: ResourceId, behavior: str, preempts: Collection[str]) -> str:
        reason = self.reason(resource)
        if reason and self._lent.get(resource) != behavior.partition(".")[0]:
            return f"{resource} is unavailable: {reason}"
        holder = self.holder(resource)
        if holder not in (None, behavior) and holder not in preempts:
            return f"{resource} is held by behavior {holder}"
        return ""

    def release(self, behavior: str) -> None:
        """The behavior has ended. What passed on to another one stays with that."""
        for resource, holders in list(self._holders.items()):
            if behavior in holders:
                holders.remove(behavior)
            if not holders:
                del self._holders[resource]
        self.on_change()

    def hand_on(self, request: str, behavior: str) -> None:
        """Give what is held for a request to the behavior that was requested for it."""
        for holders in self._holders.values():
            if request in holders:
                holders[holders.index(request)] = behavior
