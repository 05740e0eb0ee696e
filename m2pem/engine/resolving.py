"""Resolving incidents: what an operator's choice does, and why a choice is refused.

A choice is checked when it comes, and again when it is decided, as another operator may have been
first (`why_refused`).
"""

from m2pem.engine import records as r
from m2pem.engine.data import flatten
from m2pem.engine.elements.activities import activate_later
from m2pem.engine.elements.gateways import split_inclusive
from m2pem.engine.execution import Execution
from m2pem.engine.incidents import behavior_at, move_targets
from m2pem.engine.inputs import IncidentChoice, ResolveIncident
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import error_path
from m2pem.engine.state import Incident, RunState, Token
from m2pem.engine.throwing import catcher_of_error, fail_run, throw_error
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import Element, FlowNode, InclusiveGateway, SequenceFlow
from m2pem.suggestions import suggest, suggest_or

# --- checks -------------------------------------------------------------------------------------


def why_refused(state: RunState, fleet: Fleet, item: ResolveIncident) -> str:
    """Return why a choice cannot be made, and what would be right; "" if it can."""
    incident = state.incidents.get(item.incident)
    if incident is None:
        return f"incident {item.incident} is not open: it was resolved, or its task was interrupted"
    if item.choice not in incident.choices:
        offered = ", ".join(incident.choices)
        label = incident.token.node.label
        return f"{item.choice.value!r} makes no sense for {label!r}; its choices are: {offered}"
    for earlier in state.deferred:
        if (
            isinstance(earlier, ResolveIncident)
            and earlier.incident == item.incident
            and earlier.choice is not IncidentChoice.SET_DATA
        ):
            return f"incident {item.incident} was resolved by {earlier.by or 'another'}"
    return _misplaced(item) or _wrong_value(state, fleet, incident, item)


def _misplaced(item: ResolveIncident) -> str:
    for choice, given, what in (
        (IncidentChoice.SET_DATA, item.data, "data"),
        (IncidentChoice.MOVE, item.to, "an element to move to"),
        (IncidentChoice.RETRY_WITH, item.roles, "resources for roles"),
    ):
        if given and item.choice is not choice:
            return f"{what} is only given with {choice.value}, not with {item.choice.value}"
        if not given and item.choice is choice:
            return f"{choice.value} needs {what}"
    return ""


def _wrong_value(state: RunState, fleet: Fleet, incident: Incident, item: ResolveIncident) -> str:
    match item.choice:
        case IncidentChoice.MOVE:
            return _wrong_target(state, incident.token, item.to)
        case IncidentChoice.RETRY_WITH:
            return _wrong_roles(fleet, incident, item)
    return ""


def _wrong_target(state: RunState, token: Token, target: str) -> str:
    targets: dict[str, Element] = {each.id: each for each in move_targets(token)}
    if target in targets:
        return ""
    node = state.mission.elements.get(target)
    if isinstance(node, FlowNode) and any(flow.id in targets for flow in node.incoming):
        flows = ", ".join(flow.id for flow in node.incoming)
        return f"{target} joins several sequence flows: say by which the token comes: {flows}"
    where = token.node.container.id
    hint = suggest_or(target, list(targets), f"it can go to: {', '.join(targets)}")
    return f"the token cannot move to {target!r} in {where}; {hint}"


def _wrong_roles(fleet: Fleet, incident: Incident, item: ResolveIncident) -> str:
    behavior = behavior_at(incident.token.node)
    assert behavior is not None
    known = {role.name: role for role in behavior.roles}
    for name, resources in item.roles.items():
        if name not in known:
            hint = suggest_or(name, list(known), f"its roles are: {', '.join(known)}")
            return f"{behavior.name} of {incident.token.node.label} has no role {name!r}; {hint}"
        for resource in resources:
            there = (*fleet.vehicles, *fleet.payloads)
            if resource not in there:
                hint = suggest(resource, there, "vehicles and payloads")
                return f"the fleet has no {resource!r}; {hint}"
    roles = replaced_roles(fleet, incident, item)
    counted: dict[str, str] = {}
    for name, resources in roles.items():
        for resource in resources:
            if counted.setdefault(resource, name) != name:
                return f"{resource} cannot fill both {counted[resource]!r} and {name!r}"
    return ""


def replaced_roles(
    fleet: Fleet, incident: Incident, item: ResolveIncident
) -> dict[str, tuple[str, ...]]:
    """Return who fills roles of the behavior that starts again: what the operator says. A role that
    names its resource, and of which the operator says nothing, is filled by who had it, else by
    what the mission names. What is left out is chosen when the task starts again."""
    behavior = behavior_at(incident.token.node)
    assert behavior is not None
    found: dict[str, tuple[str, ...]] = {}
    for role in behavior.roles:
        chosen = item.roles.get(role.name, ())
        if role.resource and not chosen:
            chosen = incident.roles.get(role.name) or resources_of(role, fleet)
        if chosen:
            found[role.name] = tuple(chosen)
    return found


# --- choices ------------------------------------------------------------------------------------


def resolve_incident(x: Execution, item: ResolveIncident) -> None:
    """Carry out an operator's choice about an incident."""
    if refusal := why_refused(x.state, x.fleet, item):
        x.ignore(refusal)
        return
    incident = x.state.incidents[item.incident]
    token = incident.token
    if item.choice is IncidentChoice.SET_DATA:
        place = (token.id, x.process_of(token.node), token.node.id, token.scope.id)
        x.emit(r.IncidentUpdated(*place, incident.id, item.by))
        for key, value in item.data.items():
            for name, entry in flatten(key, value):
                x.write(token, name, entry)
        return
    _end(x, incident, item)
    match item.choice:
        case IncidentChoice.RETRY | IncidentChoice.RETRY_WITH:
            _begin_anew(x, token)
        case IncidentChoice.SKIP:
            x.handlers[type(token.node)].complete(x, token)
        case IncidentChoice.MOVE:
            _move(x, token, item.to)
        case IncidentChoice.END:
            if catcher_of_error(token, incident.code) is not None:  # an operator was asked before
                throw_error(x, token, incident.code, incident.reason)
            else:
                fail_run(x, token, incident.code, incident.reason, error_path(token))


def _end(x: Execution, incident: Incident, item: ResolveIncident) -> None:
    token = incident.token
    roles = {}
    if item.choice is IncidentChoice.RETRY_WITH:
        roles = replaced_roles(x.fleet, incident, item)
    x.emit(
        r.IncidentResolved(
            token.id,
            x.process_of(token.node),
            token.node.id,
            token.scope.id,
            incident.id,
            item.choice,
            item.by,
            item.to,
            roles,
            incident.resources,
        )
    )


def _begin_anew(x: Execution, token: Token) -> None:
    node = token.node
    if isinstance(node, InclusiveGateway) and len(node.incoming) > 1:
        split_inclusive(x, token, node)  # it has consumed the other tokens already
    else:
        activate_later(x, token)


def _move(x: Execution, token: Token, target: str) -> None:
    scope = token.scope
    element = x.mission.elements[target]
    x.leave(token, TokenOutcome.FAILED)
    if isinstance(element, SequenceFlow):
        process = x.process_of(element.source)
        x.emit(r.FlowTaken(token.id, process, element.source.id, scope.id, element.id))
        x.enter(token.id, element.target, scope, element)
    else:
        assert isinstance(element, FlowNode)
        x.enter(token.id, element, scope)
