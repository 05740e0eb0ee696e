"""Open incidents as operators see them; their choices, checked against run and fleet, and what
follows them."""

import logging
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from m2pem.api.runs import IncidentPreview, IncidentVerdict, OpenIncident, RunId
from m2pem.engine.incidents import behavior_at, move_targets
from m2pem.engine.inputs import IncidentChoice, ResolveIncident, Revise
from m2pem.engine.resolving import replaced_roles, why_refused
from m2pem.engine.state import Behavior, BehaviorPhase, Incident, RunState
from m2pem.errors import OperatorError
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.runner import Runner
from m2pem.executive.supervisor import Supervisor
from m2pem.fleet.allocation import Availability, resources_of, spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Entry
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.suggestions import suggest_or

log = logging.getLogger("m2pem.executive")


def open_incidents(runners: Iterable[Runner], fleet: Fleet) -> list[OpenIncident]:
    """Return the open incidents of runs, in the order in which they opened in each."""
    return [
        _described(runner.run.state, incident, fleet)
        for runner in runners
        for incident in runner.run.state.incidents.values()
    ]


def _described(state: RunState, incident: Incident, fleet: Fleet) -> OpenIncident:
    node = incident.token.node
    behavior = behavior_at(node)
    roles: dict[str, tuple[str, ...]] = {}
    for role in behavior.roles if behavior is not None else ():
        named = resources_of(role, fleet) if role.resource else ()
        roles[role.name] = incident.roles.get(role.name) or named
    return OpenIncident(
        state.run,
        incident.id,
        node.id,
        node.label,
        incident.code,
        incident.reason,
        tuple(incident.choices),
        incident.resources,
        roles,
        {each.id: each.label for each in move_targets(incident.token)},
        incident.operator_role,
    )


class Foresee(Protocol):
    """Explores what follows a choice about an incident or a revision: `outlook_in_subprocess`."""

    async def __call__(
        self,
        run: RunId,
        mission: Mission,
        fleet: Fleet,
        entries: Sequence[Entry],
        choice: ResolveIncident | Revise,
        now_us: int,
        writers: Sequence[str],
    ) -> IncidentPreview:
        """Return whether a run completes after a choice."""
        ...


class IncidentChoices:
    """Checks what operators choose about incidents, and explores what follows.

    `foresee`: what explores it; None: it is not known.
    """

    def __init__(self, supervisor: Supervisor, foresee: Foresee | None) -> None:
        self._supervisor = supervisor
        self._foresee = foresee

    def checked(
        self,
        run: RunId,
        incident: str,
        choice: str,
        data: dict[str, Value],
        to: str,
        roles: Mapping[str, Sequence[str]],
        by: str = "",
    ) -> ResolveIncident:
        """Return the input of an operator's choice, checked by the run and by the fleet as it is
        now, before it is journaled. `incident`: its id, with or without the run's.

        Raises:
            OperatorError: the choice is wrong; the error says what would be right.
        """
        if choice not in list(IncidentChoice):
            otherwise = f"choices are: {', '.join(IncidentChoice)}"
            hint = suggest_or(choice, list(IncidentChoice), otherwise)
            raise OperatorError(f"{choice!r} is no choice about an incident; {hint}")
        fleet, state = self._supervisor.fleet, self._supervisor.runner(run).run.state
        replaced = {role: _members(names, fleet) for role, names in roles.items()}
        incident = incident if "." in incident else f"{run}.{incident}"
        item = ResolveIncident(incident, IncidentChoice(choice), by, data, to, replaced)
        refusal = why_refused(state, fleet, item)
        if not refusal and item.choice is IncidentChoice.RETRY_WITH:
            refusal = _unfit(state, item, self._supervisor.arbiters, self._supervisor.availability)
        if refusal:
            raise OperatorError(f"{run}: {refusal}")
        return item

    async def outlook(self, run: RunId, item: ResolveIncident | Revise) -> IncidentPreview:
        """Explore whether a run completes after a choice or a revision, if this executive can."""
        if self._foresee is None:
            return IncidentPreview(IncidentVerdict.UNKNOWN, "it is not explored here")
        supervisor = self._supervisor
        mission_run = supervisor.runner(run).run
        state = mission_run.state
        entries = [entry async for entry in supervisor.journal.read(run)]
        if sum(len(entry.records) for entry in entries) < state.seq:
            return IncidentPreview(IncidentVerdict.UNKNOWN, "the journal does not have all of it")
        writers = {
            spec.name
            for specs in supervisor.arbiters.catalogue().values()
            for spec in specs
            if spec.writes
        }
        try:
            return await self._foresee(
                run,
                mission_run.begun_with,
                supervisor.fleet,
                entries,
                item,
                supervisor.clock.now_us(),
                sorted(writers),
            )
        except (
            Exception
        ):  # what explores is a help: its fault must not keep operators from deciding
            log.exception("%s: what follows was not explored", run)
            reason = "its exploration broke off; the log of the executive says why"
            return IncidentPreview(IncidentVerdict.UNKNOWN, reason)


def _members(names: Sequence[str], fleet: Fleet) -> tuple[str, ...]:
    found: list[str] = []
    for name in names:
        team = fleet.teams.get(name)
        found += [name] if team is None else spelled_out(team)
    return tuple(dict.fromkeys(found))


def _unfit(
    state: RunState, item: ResolveIncident, arbiters: FleetArbiters, availability: Availability
) -> str:
    """Return why resources cannot fill the roles of a behavior now; "" if they can."""
    incident = state.incidents[item.incident]
    behavior = behavior_at(incident.token.node)
    assert behavior is not None
    roles = replaced_roles(arbiters.fleet, incident, item)
    ids = [ResourceId(each) for each in dict.fromkeys(r for ids in roles.values() for r in ids)]
    for resource in ids:
        if arbiters.graph.spec(resource, behavior.name, behavior.type) is None:
            return f"{resource} offers no {behavior.type.value} behavior {behavior.name}"
        if reason := availability.reason(resource):
            return f"{resource} is unavailable: {reason}"
        holder = availability.holder(resource)
        if holder not in (None, incident.id) and not _is_ending(state, str(holder)):
            return f"{resource} is held by {holder}"
    if arbiters.serving(ids, behavior.name, behavior.type) is None:
        return f"{', '.join(ids)} are served by different arbiters"
    return ""


def _is_ending(state: RunState, holder: str) -> bool:
    found: Behavior | None = state.behaviors.get(holder)
    return found is not None and found.phase is BehaviorPhase.CANCELLING
