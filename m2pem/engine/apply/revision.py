"""What a revision does to the state: all that refers to elements is bound to the new version.

Elements are found by their ids. The record comes after the work of tokens whose element is not in
the new version has ended and they have left it, so that each id is there: the plan of the revision
(`m2pem.engine.revision`) has seen to it.
"""

from m2pem.engine import records as r
from m2pem.engine.apply.events import end_wait, node_of
from m2pem.engine.apply.tokens import is_join
from m2pem.engine.state import CompletedActivity, Join, RunState, Scope, Token
from m2pem.mission.elements import (
    Activity,
    CallActivity,
    Container,
    Process,
    SequenceFlow,
    SubProcess,
)


def mission_revised(state: RunState, record: r.MissionRevised) -> None:
    """Bind the state to the new version of the mission."""
    for number in record.disarmed:
        end_wait(state, state.waits[number])
    for number in record.restarted:
        state.tokens[number].lost_work = None
    assert state.new_mission is not None
    state.mission, state.new_mission = state.new_mission, None
    state.shared.keys = state.mission.data_stores
    for scope in state.scopes.values():  # the outer ones come first
        _bind_scope(state, scope)
    if state.root is not None and state.root.id not in state.scopes:  # other processes go on
        state.root.container = _container(state, state.root)
    for scope in state.scopes.values():
        for number, completion in (scope.compensable or {}).items():
            assert number == completion.id
            _bind_completed(state, completion)
        for compensation in (scope.compensations or {}).values():
            if compensation.begins is not None:
                _bind_completed(state, compensation.begins[1])
    for wait in state.waits.values():
        wait.node = node_of(state, wait.node.id)


def _bind_scope(state: RunState, scope: Scope) -> None:
    scope.container = _container(state, scope)
    for token in scope.tokens.values():
        _bind_token(state, token)
    scope.joins = {}
    for token in scope.tokens.values():
        if token.flow is not None and is_join(token.node):
            join = scope.joins.setdefault(token.node, Join())
            join.by_flow.setdefault(token.flow, []).append(token)
    scope.gathered = {node_of(state, node.id): each for node, each in scope.gathered.items()}
    activated = {}
    for node, used in scope.activated.items():
        again = node_of(state, node.id)
        ids = {flow.id for flow in used}
        activated[again] = tuple(flow for flow in again.incoming if flow.id in ids)
    scope.activated = activated
    entries = {node.id: node for node in scope.container.entries}
    scope.chosen = [entries[node.id] for node in scope.chosen if node.id in entries]
    scope.begun = {entries[node.id]: None for node in scope.begun if node.id in entries}


def _container(state: RunState, scope: Scope) -> Container:
    """Return the container of a scope in the new version; that of its owner is known already."""
    owner = scope.owner
    if owner is None:
        container = state.mission.elements[scope.container.id]
        assert isinstance(container, Process)
        return container
    node = node_of(state, owner.node.id)
    if scope.loop is not None:
        return node.container
    return _inside(node)


def _inside(node: object) -> Container:
    if isinstance(node, CallActivity):
        return node.called
    assert isinstance(node, Process | SubProcess)
    return node


def _bind_token(state: RunState, token: Token) -> None:
    token.node = node_of(state, token.node.id)
    flow = state.mission.elements.get(token.flow.id) if token.flow is not None else None
    arrives = isinstance(flow, SequenceFlow) and flow.target is token.node
    token.flow = flow if arrives and isinstance(flow, SequenceFlow) else None


def _bind_completed(state: RunState, completion: CompletedActivity) -> None:
    """Bind a completed activity that can be undone, with all that completed in it."""
    waiting = [completion]
    while waiting:
        each = waiting.pop()
        node = node_of(state, each.node.id)
        assert isinstance(node, Activity)
        each.node = node
        kept = each.kept_scope
        if kept is not None:
            kept.container = node.container if kept.loop is not None else _inside(node)
            waiting.extend((kept.compensable or {}).values())
