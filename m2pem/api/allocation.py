"""Vehicles, payloads and space as operators see them: who has them, which tasks wait for them, and
what a start or a take would do with them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from m2pem.api.runs import RunId
from m2pem.findings import Finding, has_errors
from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class RoleAssignment:
    """What a role of a mission runs on in a fleet.

    `resource`: the vehicle, payload or team that the mission names; "": what fills the role is
    chosen when its task starts. `resources`: those of the fleet; empty: the fleet lacks it.
    """

    role: str
    resource: str
    resources: tuple[ResourceId, ...]

    def __str__(self) -> str:
        if not self.resource:
            return f"{self.role}: chosen when its task starts"
        if not self.resources:
            return f"{self.role}: {self.resource}, which the fleet lacks"
        team = "" if self.resources == (self.resource,) else f"{self.resource}: "
        return f"{self.role}: {team}{', '.join(self.resources)}"


@dataclass(frozen=True, slots=True)
class StartPreview:
    """What would begin with a mission: `file` as it was given, and its process with its name.

    `findings`: those of `MissionControl.check`; an error among them refuses the start. `busy`: the
    reason why the start has to be confirmed, which says who has what; "" when all is free.
    `unapproved`: who must approve the mission before it may start; "": no person. `name` and
    `process` are "" if the mission cannot be read.
    """

    file: str
    name: str = ""
    process: str = ""
    findings: tuple[Finding, ...] = ()
    roles: tuple[RoleAssignment, ...] = ()
    busy: str = ""
    unapproved: str = ""

    @property
    def refused(self) -> bool:
        """Whether the mission cannot start."""
        return has_errors(self.findings) or bool(self.unapproved)


@dataclass(frozen=True, slots=True)
class TakeEffect:
    """What taking a resource would end now: a behavior of a task ends with error TAKEN_OVER.

    `task` is the task's label. `caught_by`: the label of the event that catches the error, where
    the mission goes on; "": no event catches it, and the run fails. `reassigned`: the error comes
    only if no other can do the rest of the task. `asks`: an incident opens in its place.
    `direct`: it was commanded outside of a mission, and is stopped; nothing fails.
    """

    run: RunId
    behavior: str
    element: str
    task: str
    caught_by: str = ""
    reassigned: bool = False
    asks: bool = False
    direct: bool = False

    def __str__(self) -> str:
        if self.direct:
            return f"{self.run}: {self.task}, which was commanded, is stopped"
        if self.asks:
            return f"{self.run}: an incident opens, which asks what is done with {self.task}"
        ends = f"{self.run}: {self.task} ends with error TAKEN_OVER"
        if self.reassigned:
            ends = f"{self.run}: another does the rest of {self.task}, or it"
            ends += " ends with error TAKEN_OVER"
        if self.caught_by:
            return f"{ends}; the mission goes on at {self.caught_by}"
        return f"{ends}. TAKEN_OVER is not handled: the mission will fail"


@dataclass(frozen=True, slots=True)
class SpaceHolder:
    """A vehicle that has a place in a shared space. `behavior`: "" if it is at rest there; `lost`:
    nothing is received from it."""

    vehicle: ResourceId
    behavior: str = ""
    lost: bool = False

    def __str__(self) -> str:
        what = "lost" if self.lost else self.behavior or "at rest there"
        return f"{self.vehicle} ({what})"


@dataclass(frozen=True, slots=True)
class WaitingTask:
    """A task that waits for vehicles or payloads that are not free, or for space
    (docs/allocation.md).

    `allocation`: the id of its request. `task` is the task's label. Times are seconds: since it
    asked, and until it gives up (None: it waits without a limit, or its run is about to answer).
    `holders`: the behaviors, requests and operators who have what it could use, by resource; or
    who has the space that it needs, by the name of the shared space or of the vehicle in its way.
    """

    run: RunId
    allocation: str
    element: str
    task: str
    behavior: str
    waited_s: float
    left_s: float | None
    priority: int
    reason: str
    holders: Mapping[str, str]

    def in_short(self) -> str:
        """Return which task waits, and since when."""
        return f"{self.task} of {self.run} waits since {self.waited_s:.0f} s"

    def __str__(self) -> str:
        limit = "without a limit" if self.left_s is None else f"for {self.left_s:.0f} s at most"
        priority = f" with priority {self.priority}" if self.priority else ""
        return (
            f"{self.run}: {self.task} waits since {self.waited_s:.0f} s and {limit}{priority}: "
            f"{self.reason}"
        )


def blocked_by(incident: str, waiting: Iterable[WaitingTask]) -> list[WaitingTask]:
    """Return those of the tasks that wait for what an incident holds. `incident`: its id."""
    return [each for each in waiting if incident in each.holders.values()]


@dataclass(frozen=True, slots=True)
class SharedSpaceState:
    """A shared space of the fleet file now: how many vehicles may be in it, who has a place, and
    which tasks wait for one, in the order of service."""

    name: str
    capacity: int
    holders: tuple[SpaceHolder, ...] = ()
    waiting: tuple[WaitingTask, ...] = ()

    def __str__(self) -> str:
        who = ", ".join(map(str, self.holders)) or "free"
        wait = "".join(f"; {each.in_short()}" for each in self.waiting)
        return f"{self.name} ({len(self.holders)} of {self.capacity} taken): {who}{wait}"


@dataclass(frozen=True, slots=True)
class SharedSpaceChanged:
    """Who has places in shared space, or waits for one, has changed; `MissionControl.shared_space`
    has it. It concerns all runs."""

    run: str = ""
