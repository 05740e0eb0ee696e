"""Who has which vehicle: the missions, or an operator who took it to steer it by hand.

While an operator has a resource, no mission gets it; every run's journal says so.
"""

import asyncio
from collections.abc import Callable, Collection, Container, Iterable, Mapping
from typing import TYPE_CHECKING

from m2pem.api.allocation import TakeEffect
from m2pem.bpmn.one_task import is_one_task
from m2pem.engine.elements.behaviors import preview_control_taken
from m2pem.engine.incidents import error_policy
from m2pem.engine.inputs import ControlReturned, ControlTaken
from m2pem.engine.state import Behavior, RunState
from m2pem.errors import BusyError, OperatorError
from m2pem.executive.runner import Runner
from m2pem.fleet.allocation import Availability, resources_of_mission
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import OnLoss
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest

if TYPE_CHECKING:
    from m2pem.executive.fleet_connections import FleetArbiters

UNNAMED_OPERATOR = "an operator"


class Handover:
    """Operators take resources from the missions, and give them back.

    `why_not_free`: why a resource that is given back is not free yet (it is lost), or "".
    """

    def __init__(self, arbiters: "FleetArbiters", availability: Availability) -> None:
        self._known = arbiters.resources
        self._fleet = arbiters.fleet
        self._availability = availability
        self.taken: dict[ResourceId, str] = {}
        self.why_not_free: Callable[[ResourceId], str] = lambda _: ""

    async def take(self, name: str, by: str, runners: Iterable[Runner]) -> None:
        """Give a resource to an operator: no behavior gets it, and what it did is given up.

        Raises:
            OperatorError: there is no such resource, or an operator has it.
        """
        resource = self.known(name)
        holder = self.taken.get(resource)
        if holder is not None:
            raise OperatorError(f"{resource} is with {holder}")
        self.taken[resource] = by or UNNAMED_OPERATOR
        self._withdraw(resource)
        await _submit(runners, ControlTaken(resource, by or UNNAMED_OPERATOR))

    def preview(self, name: str, runners: Iterable[Runner]) -> list[TakeEffect]:
        """What `take` of a resource would end now in each run.

        Raises:
            OperatorError: the fleet has no such resource.
        """
        resource = self.known(name)
        return [
            TakeEffect(
                runner.id,
                behavior.id,
                behavior.element,
                state.label_of(behavior.element),
                catcher.label if catcher is not None else "",
                on_loss is OnLoss.REASSIGN,
                on_loss is OnLoss.ASK
                or (
                    catcher is None
                    and on_loss is not OnLoss.REASSIGN
                    and self._opens_incident(state, behavior)
                ),
                is_one_task(state.mission),
            )
            for runner in runners
            if not runner.done.is_set() and (state := runner.run.state)
            for behavior, catcher, on_loss in preview_control_taken(state, resource)
        ]

    def _opens_incident(self, state: RunState, behavior: Behavior) -> bool:
        token = state.tokens[behavior.token]
        return error_policy(state, self._fleet, token) is ErrorPolicy.INCIDENT

    async def give_back(
        self,
        resource: ResourceId,
        by: str,
        runners: Iterable[Runner],
        holder: str = "",
        reason: str = "",
    ) -> None:
        """Give what an operator has back to the missions. `holder`: the operator who has it, if
        `by` is another; `reason`: why, then."""
        del self.taken[resource]
        self._availability.restore(resource)
        if why := self.why_not_free(resource):
            self._availability.withdraw(resource, why)
        await _submit(runners, ControlReturned(resource, by, holder, reason))

    def pass_on(self, resource: ResourceId, to: str) -> None:
        """Another operator has a resource from now on that an operator has."""
        self.taken[resource] = to
        self._withdraw(resource)

    def by_name(self, lent: Collection[ResourceId] = ()) -> dict[str, str]:
        """What is taken, and by whom: for a run that begins, without what is lent to that run."""
        return {
            str(resource): holder for resource, holder in self.taken.items() if resource not in lent
        }

    def take_up(self, taken: Mapping[str, str]) -> None:
        """After a restart: who had what, by the journal of a run."""
        for name, holder in taken.items():
            resource = ResourceId(name)
            if resource not in self.taken:
                self.taken[resource] = holder
                self._withdraw(resource)

    def lent_to(self, state: RunState) -> frozenset[ResourceId]:
        """Return what an operator has taken and commands by a run: one of a behavior that was
        commanded from outside of a mission."""
        if not is_one_task(state.mission):
            return frozenset()
        return frozenset(
            resource
            for resource in resources_of_mission(state.mission, self._fleet)
            if self.taken.get(resource) == state.by and resource not in state.taken
        )

    def restore(self, resource: ResourceId) -> None:
        """Free a resource whose link is restored, unless an operator has it."""
        if resource in self.taken:
            self._withdraw(resource)
        else:
            self._availability.restore(resource)

    def holders(self) -> dict[ResourceId, str]:
        """Return who has each resource: an operator, a behavior, a request; "" if it is free."""
        return {
            resource: self.taken.get(resource) or self._availability.holder(resource) or ""
            for resource in self._known
        }

    def _withdraw(self, resource: ResourceId) -> None:
        self._availability.withdraw(resource, f"with {self.taken[resource]}")

    def known(self, name: str) -> ResourceId:
        """Return a resource of the fleet by its name.

        Raises:
            OperatorError: the fleet has no such resource.
        """
        resource = ResourceId(name)
        if resource not in self._known:
            hint = suggest(name, self._known, "vehicles and payloads")
            raise OperatorError(f"the fleet has no {name!r}; {hint}")
        return resource


async def _submit(runners: Iterable[Runner], item: ControlTaken | ControlReturned) -> None:
    """Have all runs decide an input, and wait until they have.

    All get it at once: a run that is given the resource meanwhile knows that it may have it.
    """
    await asyncio.gather(*(each.submit(item) for each in runners if not each.done.is_set()))


def refuse_busy_resources(
    mission: Mission,
    fleet: Fleet,
    taken: Mapping[ResourceId, str],
    holder: Callable[[ResourceId], str | None],
    over: Container[str],
) -> None:
    """Check that everything that a mission names is free now.

    `taken`: the operators who have resources. `holder`: the behavior that holds a resource.
    `over`: runs that have ended; a vehicle may still be stopping for one.

    Raises:
        BusyError: it is not; the error says who has what, and what to do.
    """
    runs: dict[str, list[ResourceId]] = {}
    operators: dict[str, list[ResourceId]] = {}
    for resource in resources_of_mission(mission, fleet):
        if (operator := taken.get(resource)) is not None:
            operators.setdefault(operator, []).append(resource)
        elif (behavior := holder(resource)) is not None:
            runs.setdefault(behavior.partition(".")[0], []).append(resource)
    if not runs and not operators:
        return
    who = [f"run {run} uses {_list(names)}" for run, names in runs.items()]
    who += [f"{operator} has {_list(names)}" for operator, names in operators.items()]
    do = [
        f"wait until {_list(names)} has stopped: run {run} has ended"
        if run in over
        else f"wait until run {run} is done with {_list(names)}, or stop it"
        for run, names in runs.items()
    ]
    do += [f"have {operator} give back {_list(names)}" for operator, names in operators.items()]
    raise BusyError(
        f"the mission was not started, because what it needs is busy: {'; '.join(who)}. "
        f"First {'; '.join(do)}: a task for what is busy ends with RESOURCE_UNAVAILABLE",
        {
            str(resource): holder
            for having in (runs, operators)
            for holder, names in having.items()
            for resource in names
        },
    )


def _list(names: list[ResourceId]) -> str:
    return ", ".join(names)
