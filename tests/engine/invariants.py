"""What is always true of a run's state between two inputs."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass

from m2pem.engine.state import BehaviorPhase, RunState, RunStatus, Scope
from m2pem.mission.elements import Activity, BoundaryEvent, Element
from m2pem.mission.mission import Mission


def check_state(state: RunState) -> None:
    """Assert that all references in the state agree, and that nothing is left over."""
    _check_tokens(state)
    _check_waits(state)
    _check_work(state)
    for scope in state.scopes.values():
        _check_done(scope, looked_at=-scope.id not in state.yielded)
    if state.status is RunStatus.ENDED:
        assert not state.tokens
        assert not state.scopes
        assert not state.waits
        assert not state.allocations
        assert not state.prompts
        assert not state.services
        assert not state.incidents
        assert not state.yielded
        assert all(b.phase is BehaviorPhase.CANCELLING for b in state.behaviors.values())
        assert not state.kept_messages
        assert not state.deferred
        assert not state.timers
        assert not state.dates


def check_bound(state: RunState) -> None:
    """Assert that every element which the state refers to is one of its mission."""
    seen: set[int] = set()
    waiting: list[object] = [getattr(state, each.name) for each in fields(state)]
    elements = {id(each) for each in state.mission.elements.values()}
    while waiting:
        each = waiting.pop()
        if id(each) in seen or isinstance(each, Mission):
            continue
        seen.add(id(each))
        if isinstance(each, Element):
            assert id(each) in elements, f"{each.id} is not in the mission of the run"
        elif isinstance(each, Mapping):
            waiting += [*each.keys(), *each.values()]
        elif isinstance(each, (list, tuple)):
            waiting += each
        elif is_dataclass(each) and not isinstance(each, type):
            waiting += [getattr(each, part.name) for part in fields(each)]


def _check_tokens(state: RunState) -> None:
    tokens = [token for scope in state.scopes.values() for token in scope.tokens.values()]
    assert {token.id: token for token in tokens} == state.tokens
    for scope in state.scopes.values():
        assert scope.owner is None or state.tokens[scope.owner.id] is scope.owner
        assert scope.owner is None or scope.owner.inner is scope
        assert scope.parent is None or state.scopes[scope.parent.id] is scope.parent
        for node, join in scope.joins.items():
            for flow, waiting in join.by_flow.items():
                assert waiting, "an empty flow is absent"
                assert flow in node.incoming
                assert all(scope.tokens[t.id] is t and t.node is node for t in waiting)
        _check_loop(scope)
    for token in tokens:
        assert token.scope.tokens[token.id] is token
        assert token.node.container is token.scope.container
        assert token.inner is None or state.scopes[token.inner.id] is token.inner
        busy = [token.behavior, token.allocation, token.service, token.inner, token.incident]
        assert sum(bool(each) for each in busy) <= 1
        assert not (token.incident and token.prompt)


def _check_done(scope: Scope, *, looked_at: bool) -> None:
    claims: dict[int, int] = {}
    for number, compensation in (scope.compensations or {}).items():
        assert compensation.id == number
        assert compensation.scope is scope
        assert compensation.begins is None, "it has begun"
        assert compensation.left or compensation.token or not looked_at, "it has ended"
        claims |= {completion.id: number for completion in compensation.left}
        waiter, token = compensation.waiter, compensation.token
        assert waiter is None or (waiter.compensations or {})[number] is compensation
        assert token is None or token.compensates is compensation
        assert token is None or scope.tokens[token.id] is token
    for token in scope.tokens.values():
        assert token.kept_scope is None, "a kept scope belongs to its completed activity"
        compensates = token.compensates
        assert compensates is None or (scope.compensations or {})[compensates.id] is compensates
    kept = [scope]
    for each in kept:
        for number, completion in (each.compensable or {}).items():
            assert completion.id == number
            assert completion.scope is each
            assert completion.node.container is each.container
            assert completion.claimed_by == (claims.get(number, 0) if each is scope else 0)
            if completion.kept_scope is None:
                assert completion.node.compensation is not None
            else:
                inner = completion.kept_scope
                assert inner.parent is each
                assert inner.owner is None
                assert not inner.tokens
                assert not inner.waits
                assert not inner.joins
                assert not inner.compensations
                kept.append(inner)


def _check_loop(scope: Scope) -> None:
    """Instances are in the scope of their loop, and nothing else is."""
    loop, owner = scope.loop, scope.owner
    if loop is None:
        assert all(token.instance is None for token in scope.tokens.values())
        return
    assert owner is not None
    assert owner.instance is None
    assert isinstance(owner.node, Activity)
    assert owner.node.loop is not None
    assert all(token.node is owner.node for token in scope.tokens.values())
    numbers = [token.instance for token in scope.tokens.values() if token.compensates is None]
    assert len(set(numbers)) == len(numbers) == loop.started - loop.completed - loop.terminated
    assert loop.total < 0 or loop.started <= loop.total
    assert set(loop.outputs) <= set(range(loop.started))


def _check_waits(state: RunState) -> None:
    of_tokens = {
        wait.id: wait for token in state.tokens.values() for wait in (token.waits or {}).values()
    }
    of_scopes = {
        wait.id: wait for scope in state.scopes.values() for wait in (scope.waits or {}).values()
    }
    assert not of_tokens.keys() & of_scopes.keys()
    assert of_tokens | of_scopes == state.waits
    assert all(wait.token is None for wait in of_scopes.values())
    for heap in (state.timers, state.dates):
        assert not heap or heap[0][1] in state.waits
    caught = {wait.id: wait for each in state.catchers.values() for wait in each.values()}
    timed = {number for _, number in (*state.timers, *state.dates)}
    for wait in state.waits.values():
        places = (wait.id in caught, wait.id in timed, wait.id in state.conditions)
        assert sum(places) == 1
        assert (wait.trigger.value == "condition") == places[2]
    assert set(state.conditions) <= set(state.waits)
    assert set(caught) <= set(state.waits)
    for (trigger, ref), waits in state.catchers.items():
        assert waits, "a key without catchers is absent"
        for message in state.kept_messages.get(ref, ()) if trigger.value == "message" else ():
            assert message.keys, "a kept message and a wait that matches it"


def _check_work(state: RunState) -> None:
    held: dict[str, list[str]] = {}
    for behavior in state.behaviors.values():
        for resource in behavior.resources:
            held.setdefault(resource, []).append(behavior.id)
        if behavior.phase is not BehaviorPhase.CANCELLING:
            assert state.tokens[behavior.token].behavior == behavior.id
    assert {name: sorted(ids) for name, ids in state.held.items()} == {
        name: sorted(ids) for name, ids in held.items()
    }
    for resource, holders in state.held.items():
        active = [h for h in holders if state.behaviors[h].phase is not BehaviorPhase.CANCELLING]
        assert len(active) <= 1, f"{resource} is commanded by {active}"
    for token in state.tokens.values():
        if token.behavior:
            assert state.behaviors[token.behavior].phase is not BehaviorPhase.CANCELLING
    for request in state.allocations.values():
        assert state.tokens[request.token.id] is request.token
        assert request.token.allocation == request.id
        assert not request.deadline or request.deadline in state.waits
    for prompt in state.prompts.values():
        assert state.tokens[prompt.token.id] is prompt.token
        assert prompt.token.prompt == prompt.id
    assert {token.incident for token in state.tokens.values()} - {""} == set(state.incidents)
    for incident in state.incidents.values():
        assert state.tokens[incident.token.id] is incident.token
        assert incident.token.incident == incident.id
        own = {wait.node for wait in (incident.token.waits or {}).values()}
        assert all(isinstance(node, BoundaryEvent) for node in own)
        assert incident.choices
    kept = [each for incident in state.incidents.values() for each in incident.resources]
    assert len(set(kept)) == len(kept), "two incidents hold one resource"
    for service in state.services.values():
        assert state.tokens[service.token.id] is service.token
