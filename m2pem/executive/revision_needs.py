"""What a new version of a running mission needs and others have: named in its plan, with what
happens to the task then."""

from collections.abc import Iterator, Mapping

from m2pem.api.runs import RunId
from m2pem.engine.revision.plan import called
from m2pem.executive.runner import Runner
from m2pem.executive.waiting_tasks import holder_label
from m2pem.fleet.allocation import Availability, resources_of
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import Behavior, Role, ServiceCall
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.difference import Difference
from m2pem.mission.elements import Element


class NeedsOfRevisions:
    """Compares what tasks need with who has it now.

    `taken`: the operators who have resources.
    """

    def __init__(
        self,
        fleet: Fleet,
        availability: Availability,
        taken: Mapping[ResourceId, str],
        runners: Mapping[RunId, Runner],
    ) -> None:
        self._fleet = fleet
        self._availability = availability
        self._taken = taken
        self._runners = runners

    def busy(self, run: RunId, difference: Difference) -> tuple[str, ...]:
        """Return, as sentences, what new and changed tasks of a run name and others have."""
        elements = (*difference.added, *(each.element for each in difference.changed))
        return tuple(
            f"{called(element)} needs {resource}, which {holder}: {_then(role)}"
            for element in elements
            for role in _roles(element)
            for resource in resources_of(role, self._fleet)
            if (holder := self._other_holder(run, resource))
        )

    def _other_holder(self, run: RunId, resource: ResourceId) -> str:
        """Return who else has a resource, as the rest of a sentence; "": no one else."""
        holder = self._availability.holder(resource)
        own = holder is not None and holder.partition(".")[0] == run
        if own:
            return ""
        if holder is not None:
            label = holder_label(self._runners, holder)
            return f"{label} has now" if label else f"run {holder.partition('.')[0]} uses now"
        operator = self._taken.get(resource)
        return "" if operator is None else f"operator {operator} has now"


def _roles(element: Element) -> Iterator[Role]:
    for asked in (getattr(element, "behavior", None), getattr(element, "call", None)):
        if isinstance(asked, Behavior | ServiceCall):
            yield from asked.roles


def _then(role: Role) -> str:
    if role.need is not None and role.need.waits:
        limit = ", as long as its limit lets it" if role.need.wait_limit is not None else ""
        return f"the task waits until that is free{limit}"
    if role.optional:
        return "the task does without it, unless that is free when it starts"
    return "the task ends with error RESOURCE_UNAVAILABLE, unless that is free when it starts"
