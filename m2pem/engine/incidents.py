"""Incidents: errors that no event catches, where the mission or the fleet says `onError: incident`.

The token stays on its element, whose work is over. Its boundary events stay armed, and all else in
the run goes on. What the failed work commanded stays with the run until an operator has decided
(`m2pem.engine.resolving`), or the token is interrupted.
"""

from collections.abc import Iterator

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.inputs import IncidentChoice
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import stop_activity
from m2pem.engine.state import Behavior, RunState, Scope, Token
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import Behavior as BehaviorOfTask
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    BoundaryEvent,
    ComplexGateway,
    Container,
    EndEvent,
    ErrorPolicy,
    EventBasedGateway,
    ExclusiveGateway,
    FlowNode,
    InclusiveGateway,
    ParallelGateway,
    Process,
    ScriptTask,
    SendTask,
    SequenceFlow,
    ServiceTask,
    StartEvent,
    SubProcess,
)
from m2pem.mission.events import ErrorEventDefinition
from m2pem.mission.losses import PREEMPTED

_GATEWAYS = (
    ComplexGateway,
    EventBasedGateway,
    ExclusiveGateway,
    InclusiveGateway,
    ParallelGateway,
)


def opens_incident(x: Execution, token: Token) -> bool:
    """Whether an error at a token that no event catches opens an incident.

    The process of the element says so, else that of its caller, and so on; else the process that
    the run began with; else the fleet.
    """
    return error_policy(x.state, x.fleet, token) is ErrorPolicy.INCIDENT


def error_policy(state: RunState, fleet: Fleet, token: Token) -> ErrorPolicy:
    """Return what an error at a token does that no event catches."""
    said = (each.on_error for each in _processes_of(state, token))
    return next(filter(None, said), fleet.on_error)


def role_for(state: RunState, fleet: Fleet, token: Token) -> str:
    """Return which operators may decide about an incident of a token; "": all."""
    said = (each.incident_role for each in _processes_of(state, token))
    return next(filter(None, said), fleet.incident_role)


def _processes_of(state: RunState, token: Token) -> Iterator[Process]:
    """Return the process of a token's element, its callers, and that with which the run began."""
    scope: Scope | None = token.scope
    while scope is not None:
        yield scope.container.process
        scope = scope.parent
    if state.root is not None:
        yield state.root.container.process


def open_incident(
    x: Execution,
    token: Token,
    code: str,
    reason: str,
    behavior: Behavior | None = None,
    *,
    rearm: bool = False,
) -> None:
    """Stop a token on its element with an incident, and end what it does there.

    `behavior`: the one that failed, which has ended or is being cancelled. `rearm`: an event at the
    element could not be armed. What a task with a greater priority has taken is not kept.
    """
    failed = [] if behavior is None else [behavior]
    failed += _behaviors_of(x.state, token)
    kept = failed[1:] if behavior is not None and code == PREEMPTED else failed
    resources = [resource for each in kept for resource in each.resources]
    resources += _resources_of_incidents(x.state, token)
    stop_activity(x, token, TokenOutcome.TERMINATED)
    node = token.node
    x.emit(
        r.IncidentOpened(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"{x.state.run}.i{x.state.last_incident + 1}",
            code,
            reason,
            choices_for(token),
            tuple(dict.fromkeys(resources)),
            failed[0].roles if failed and failed[0].token == token.id else {},
            rearm,
            role_for(x.state, x.fleet, token),
        )
    )


def _behaviors_of(state: RunState, token: Token) -> list[Behavior]:
    """Return the behaviors of a token and of all within it that are not being cancelled."""
    return [state.behaviors[each.behavior] for each in _tokens_in(token) if each.behavior]


def _resources_of_incidents(state: RunState, token: Token) -> list[str]:
    """Return what the incidents within a token hold, which end with its work."""
    incidents = [state.incidents[each.incident] for each in _tokens_in(token) if each.incident]
    return [resource for each in incidents for resource in each.resources]


def _tokens_in(token: Token) -> Iterator[Token]:
    waiting = [token]
    while waiting:
        each = waiting.pop()
        yield each
        if each.inner is not None:
            waiting.extend(reversed(each.inner.tokens.values()))


def incident_holding(state: RunState, resource: str) -> str:
    """Return the id of the incident that holds a resource; "": none does."""
    for incident in state.incidents.values():
        if resource in incident.resources:
            return incident.id
    return ""


# --- choices ------------------------------------------------------------------------------------


def choices_for(token: Token) -> tuple[IncidentChoice, ...]:
    """Return what an operator can do about an incident of a token, as far as it makes sense there.

    An error end event would only throw its error again; a gateway has no work that could be
    skipped, and which way the token goes is said by moving it.
    """
    node = token.node
    can = [IncidentChoice.SET_DATA, IncidentChoice.END]
    if not (isinstance(node, EndEvent) and _throws_an_error(node)):
        can.append(IncidentChoice.RETRY)
    behavior = behavior_at(node)
    if behavior is not None and behavior.roles:
        can.append(IncidentChoice.RETRY_WITH)
    if not isinstance(node, _GATEWAYS):
        can.append(IncidentChoice.SKIP)
    if move_targets(token):
        can.append(IncidentChoice.MOVE)
    return tuple(choice for choice in IncidentChoice if choice in can)


def _throws_an_error(node: EndEvent) -> bool:
    return any(isinstance(each, ErrorEventDefinition) for each in node.definitions)


def behavior_at(node: FlowNode) -> BehaviorOfTask | None:
    """Return the behavior that a task commands; None: it commands none."""
    return node.behavior if isinstance(node, ScriptTask | ServiceTask | SendTask) else None


def move_targets(token: Token) -> list[FlowNode | SequenceFlow]:
    """Return where a token with an incident can go.

    An instance of a loop or multi-instance activity, and a token that compensates something, cannot
    move.
    """
    if token.instance is not None or token.compensates is not None:
        return []
    return targets_from(token.node)


def targets_from(node: FlowNode) -> list[FlowNode | SequenceFlow]:
    """Return the other elements of a node's scope; none from an ad-hoc or an event subprocess."""
    if is_outside_the_flow(node):
        return []
    return [each for each in targets_in(node.container) if each is not node]


def targets_in(container: Container) -> list[FlowNode | SequenceFlow]:
    """Return the elements of a container to which a token can be moved; none of an ad-hoc one.

    A join must know by which of its flows the token comes, so these stand for it.
    """
    if isinstance(container, AdHocSubProcess):
        return []
    found: list[FlowNode | SequenceFlow] = []
    for each in container.nodes:
        if isinstance(each, StartEvent | BoundaryEvent) or is_outside_the_flow(each):
            continue
        if _joins(each):
            found += each.incoming
        else:
            found.append(each)
    return found


def _joins(node: FlowNode) -> bool:
    if isinstance(node, ParallelGateway | InclusiveGateway):
        return len(node.incoming) > 1
    return isinstance(node, ComplexGateway)


def is_outside_the_flow(node: FlowNode) -> bool:
    """Whether no sequence flow leads to an element: an event subprocess, or what undoes."""
    if isinstance(node, SubProcess) and node.triggered_by_event:
        return True
    return isinstance(node, Activity) and node.for_compensation
