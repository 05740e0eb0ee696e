"""Open incidents as operators see them, and their choices, checked against run and fleet."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from m2pem.api.runs import OpenIncident
from m2pem.engine.incidents import behavior_at, move_targets
from m2pem.engine.inputs import IncidentChoice, ResolveIncident
from m2pem.engine.resolving import replaced_roles, why_refused
from m2pem.engine.state import Behavior, BehaviorPhase, Incident, RunState
from m2pem.errors import OperatorError
from m2pem.executive.runner import Runner
from m2pem.fleet.allocation import Availability, resources_of, spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value
from m2pem.suggestions import suggest_or

if TYPE_CHECKING:
    from m2pem.executive.fleet_connections import FleetArbiters


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


def choice_input(
    incident: str,
    choice: str,
    data: Mapping[str, Value],
    to: str,
    roles: Mapping[str, Sequence[str]],
    by: str,
    fleet: Fleet,
) -> ResolveIncident:
    """Return the input of an operator's choice.

    Raises:
        OperatorError: there is no such choice.
    """
    if choice not in list(IncidentChoice):
        otherwise = f"choices are: {', '.join(IncidentChoice)}"
        hint = suggest_or(choice, list(IncidentChoice), otherwise)
        raise OperatorError(f"{choice!r} is no choice about an incident; {hint}")
    replaced = {role: _members(names, fleet) for role, names in roles.items()}
    return ResolveIncident(incident, IncidentChoice(choice), by, dict(data), to, replaced)


def _members(names: Sequence[str], fleet: Fleet) -> tuple[str, ...]:
    found: list[str] = []
    for name in names:
        team = fleet.teams.get(name)
        found += [name] if team is None else spelled_out(team)
    return tuple(dict.fromkeys(found))


def refuse_wrong_choice(
    runner: Runner, item: ResolveIncident, arbiters: "FleetArbiters", availability: Availability
) -> None:
    """Check a choice before it is journaled: by the run, and by the fleet as it is now.

    Raises:
        OperatorError: it is wrong; the error says what would be right.
    """
    state = runner.run.state
    refusal = why_refused(state, arbiters.fleet, item)
    if not refusal and item.choice is IncidentChoice.RETRY_WITH:
        refusal = _unfit(state, item, arbiters, availability)
    if refusal:
        raise OperatorError(f"{runner.id}: {refusal}")


def _unfit(
    state: RunState, item: ResolveIncident, arbiters: "FleetArbiters", availability: Availability
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
