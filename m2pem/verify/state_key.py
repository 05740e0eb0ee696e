"""What distinguishes states of a run that go on differently: everything but ids and the time of
day."""

from collections.abc import Collection
from typing import Any, TypeAlias

import msgspec

from m2pem.engine.execution import received_messages
from m2pem.engine.records import Trigger
from m2pem.engine.state import CompletedActivity, RunState, RunStatus, Scope, Token, Wait

Key: TypeAlias = tuple[Any, ...]


class NotKnownError(Exception):
    """The exploration cannot say what follows; the text says why."""


def state_key(state: RunState, now_us: int, earlier: Collection[str]) -> Key:
    """Return the key of a state at `now_us` (microseconds since the Unix epoch): of two states with
    the same one, one is explored for both. `earlier`: ids of incidents that count otherwise."""
    if state.status is RunStatus.ENDED:
        return ("ended", state.outcome, state.detail)
    return _StateKey(state, now_us, earlier).key()


class _StateKey:
    def __init__(self, state: RunState, now_us: int, earlier: Collection[str]) -> None:
        self._state = state
        self._now_us = now_us
        self._mission_time_us = state.mission_time_us(now_us)
        self._earlier = earlier
        self._places = {token: place for place, token in enumerate(state.tokens)}
        self._waits: dict[int, int] = {}

    def key(self) -> Key:
        state = self._state
        received = received_messages(state.mission)  # others are for a later revision
        kept = {
            ref: [(each.data, each.keys) for each in messages]
            for ref, messages in state.kept_messages.items()
            if ref in received
        }
        return (
            state.status,
            tuple(self._scope(each) for each in state.scopes.values() if each.parent is None),
            self._order(),
            _encoded(state.shared.data),
            _encoded(kept),
            tuple(state.taken),
            tuple(sorted((b.name, b.element, b.phase) for b in state.behaviors.values())),
        )

    def _order(self) -> Key:
        """Return in which order what comes reaches those that wait for it."""
        state = self._state
        timers = [number for heap in (state.timers, state.dates) for _, number in sorted(heap)]
        several = [list(each) for each in state.catchers.values() if len(each) > 1]
        orders = (*several, list(state.conditions), timers)
        return tuple(sorted(tuple(self._waits.get(n, -1) for n in each) for each in orders))

    def _scope(self, scope: Scope) -> Key:
        places, loop = self._places, scope.loop
        return (
            scope.container.id,
            _encoded(scope.data),
            tuple(self._token(token) for token in scope.tokens.values()),
            tuple(
                (node.id, flow.id, tuple(places[token.id] for token in tokens))
                for node, join in scope.joins.items()
                for flow, tokens in join.by_flow.items()
            ),
            self._waits_of(scope.waits),
            loop
            and (
                *(loop.total, loop.started, loop.completed, loop.terminated),
                _encoded(loop.items),
                _encoded(sorted(loop.outputs.items())),  # JSON has no numbers as keys
            ),
            tuple((n.id, tuple(places[t.id] for t in ts)) for n, ts in scope.gathered.items()),
            tuple((node.id, tuple(f.id for f in flows)) for node, flows in scope.activated.items()),
            tuple(node.id for node in scope.chosen),
            tuple(node.id for node in scope.begun),
            (scope.completing, scope.interrupted, scope.cancelled, scope.reopened),
            tuple(self._completed(each) for each in (scope.compensable or {}).values()),
            tuple(
                (
                    tuple(list(scope.compensable or {}).index(each.id) for each in them.left),
                    them.waiter and places[them.waiter.id],
                    them.token and places.get(them.token.id),
                )
                for them in (scope.compensations or {}).values()
            ),
        )

    def _completed(self, done: CompletedActivity) -> Key:
        inside = done.kept_scope and self._scope(done.kept_scope)
        return (done.node.id, done.instance, _encoded(done.own), inside, bool(done.claimed_by))

    def _token(self, token: Token) -> Key:
        state = self._state
        behavior = state.behaviors.get(token.behavior)
        incident = state.incidents.get(token.incident)
        return (
            token.node.id,
            token.flow.id if token.flow is not None else "",
            token.instance,
            _encoded(token.own),
            (behavior.name, behavior.phase, behavior.resources) if behavior is not None else (),
            bool(token.prompt),
            bool(token.service),
            incident and (incident.code, incident.id in self._earlier),
            (token.armed, token.ended_early),
            self._waits_of(token.waits),
            token.inner and self._scope(token.inner),
        )

    def _waits_of(self, waits: dict[int, Wait] | None) -> Key:
        return tuple(self._wait(wait) for wait in (waits or {}).values())

    def _wait(self, wait: Wait) -> Key:
        self._waits[wait.id] = len(self._waits)
        due_us = 0
        if wait.trigger is Trigger.TIMER:
            due_us = wait.due_us - (self._now_us if wait.calendar else self._mission_time_us)
        ready = self._state.conditions.get(wait.id, False)
        return (wait.node.id, wait.trigger, wait.ref, due_us, wait.left, wait.cycle, ready)


def _encoded(data: object) -> bytes:
    return msgspec.json.encode(data, order="deterministic")
