"""Events that are caught: signals (broadcast), errors and escalations (outwards, 10.5.1, 13.5).

The three ways to catch: an event or gateway that waits, a boundary event, an event subprocess.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

from tests.reference.diagram import Event, Node, birth, start_of
from tests.reference.marking import Marking, Scope, Work

_MOST_CATCHERS = 5  # of one signal at one moment: all their orders are tried


class TooLargeError(Exception):
    """A reaction has more states than the reference looks at, or does not end."""


@dataclass(frozen=True, slots=True)
class Catcher:
    """`holder` is the number of the work that waits, or of the scope of the event subprocess."""

    holder: int
    node: str
    signal: str


def catchers(marking: Marking) -> Iterator[Catcher]:
    """All that catches a signal now."""
    for scope in marking.scopes():
        if scope.handles_events():
            for handler in scope.level.handlers:
                yield from _signal(scope.number, handler, start_of(handler).event)
        for work in scope.works:
            if work.node.kind in ("catch", "start") and not work.caught:
                yield from _signal(work.number, work.node, work.node.event)
            elif work.node.kind == "event_gateway":
                for flow in scope.level.outgoing[work.node.id]:
                    target = scope.level.by_id[flow.target]
                    yield from _signal(work.number, target, target.event)
            for boundary in scope.level.boundaries[work.node.id]:
                yield from _signal(work.number, boundary, boundary.event)


def _signal(holder: int, node: Node, event: Event | None) -> Iterator[Catcher]:
    if event is not None and event.kind == "signal":
        assert event.name is not None
        yield Catcher(holder, node.id, event.name)


def broadcast(marking: Marking, signal: str) -> list[Marking]:
    """Every catcher of this moment catches, before anything else moves, in some order.

    One that an earlier one has taken away catches no more. All that can be so are returned.
    """
    now = [catcher for catcher in catchers(marking) if catcher.signal == signal]
    if len(now) > _MOST_CATCHERS:
        raise TooLargeError
    results = []
    for order in permutations(now):
        result = marking.copy()
        for catcher in order:
            _catch(result, catcher)
        results.append(result)
    return results


def _catch(marking: Marking, catcher: Catcher) -> None:
    scope = marking.scope(catcher.holder)
    if scope is not None:
        if scope.handles_events():
            begin_handler(marking, scope, scope.level.by_id[catcher.node])
        return
    work = marking.work(catcher.holder)
    if work is None:
        return
    node = work.home.level.by_id[catcher.node]
    if node.kind == "boundary":
        follow_boundary(marking, work, node)
        return
    work.home.works.remove(work)
    if work.node is not node:  # an event-based gateway: the flow to the event, and it is caught
        flow = next(f for f in work.home.level.outgoing[work.node.id] if f.target == node.id)
        marking.taken[flow.id] += 1
    _caught(marking, work.home, node)


def _caught(marking: Marking, scope: Scope, node: Node) -> None:
    """The token is in the event, which has happened, and follows the flows out of it next."""
    scope.works.append(Work(marking.next_number(), node, scope, caught=True))


def put_on_all(marking: Marking, scope: Scope, node: Node, count: int = 1) -> None:
    """A token on every flow out of a node; without any, its path ends."""
    for flow in scope.level.outgoing[node.id]:
        put(marking, scope, flow.id, count)


def put(marking: Marking, scope: Scope, flow: str, count: int) -> None:
    scope.tokens[flow] += count
    marking.taken[flow] += count


def follow_boundary(marking: Marking, work: Work, boundary: Node) -> None:
    """13.5.3: the activity (all its instances) is cancelled or goes on; the flow is followed."""
    if boundary.interrupting:
        work.home.works.remove(work)
    _caught(marking, work.home, boundary)


def begin_handler(marking: Marking, scope: Scope, handler: Node) -> None:
    """13.5.4: an interrupting handler ends all else in the scope, and no other begins."""
    start = start_of(handler)
    if start.interrupting:
        scope.tokens.clear()
        scope.works.clear()
        scope.fired.clear()
        scope.interrupted = True
    add_scope_work(marking, scope, handler)


def add_scope_work(marking: Marking, scope: Scope, node: Node, whole: Work | None = None) -> None:
    """An instance of a subprocess begins, with a token at each of its start events."""
    assert node.inside is not None
    work = Work(marking.next_number(), node, scope, whole=whole)
    work.inside = Scope(marking.next_number(), node.inside, work)
    for begin in node.inside.begins:
        work.inside.tokens[birth(begin.id)] += 1
    if whole is None:
        scope.works.append(work)
    else:
        assert whole.instances is not None
        whole.instances.append(work)


def throw_outwards(marking: Marking, thrower: Work, thrown: Event) -> None:
    """An error or escalation goes from scope to scope until one catches it.

    First the boundary events of the activity that threw it are asked, then the event subprocesses
    of the scope it is in, but for the one that it is thrown in (docs/missions.md), then the
    boundary events of what contains that scope, and so on. An error that nothing catches fails the
    run; such an escalation is forgotten (10.5.1).
    """
    activity: Work | None = thrower
    while activity is not None:
        activity = activity.whole or activity
        scope = activity.home
        for boundary in scope.level.boundaries[activity.node.id]:
            if _matches(boundary.event, thrown):
                follow_boundary(marking, activity, boundary)
                return
        if scope.handles_events():
            for handler in scope.level.handlers:
                if handler is not activity.node and _matches(start_of(handler).event, thrown):
                    begin_handler(marking, scope, handler)
                    return
        activity = scope.owner
    if thrown.kind == "error":
        marking.root, marking.outcome = None, "failed"


def _matches(event: Event | None, thrown: Event) -> bool:
    return event is not None and event.kind == thrown.kind and event.name in (None, thrown.name)
