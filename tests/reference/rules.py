"""The steps of the token game: which nodes can fire, and what firing does (13.3 to 13.5).

A step is one node of one scope that consumes tokens, or one work that has done all it has to do.
It gives every marking that may come of it: more than one only where a signal is thrown, since
who catches it first is open.
"""

from dataclasses import dataclass

from tests.reference.catching import (
    add_scope_work,
    broadcast,
    put,
    put_on_all,
    throw_outwards,
)
from tests.reference.diagram import (
    ACTIVITIES,
    WAITING_FOR_START,
    Event,
    Flow,
    Is,
    Loop,
    Many,
    Node,
    birth,
    is_link_target,
    start_of,
)
from tests.reference.joins import complex_is_activated, complex_resets, inclusive_is_activated
from tests.reference.marking import Marking, Scope, Work

NO_FLOW = Event("error", "NO_FLOW")


@dataclass(frozen=True, slots=True)
class Step:
    """`what` is fire (a node of a scope), reset (a complex gateway), begin (an activity that
    repeats) or done (a work; a run)."""

    what: str
    number: int
    node: str


def steps(marking: Marking) -> list[Step]:
    """All that can happen next without anything from outside."""
    found = []
    for scope in marking.scopes():
        for node in scope.level.nodes:
            if complex_resets(scope, node):
                found.append(Step("reset", scope.number, node.id))
            elif _can_fire(scope, node):
                found.append(Step("fire", scope.number, node.id))
        found += [Step("begin", w.number, w.node.id) for w in scope.works if w.has_not_begun]
    for work in marking.works():
        empty = work.inside is not None and work.inside.is_empty()
        if empty or work.caught or work.node.kind == "task":
            found.append(Step("done", work.number, work.node.id))
    if marking.root is not None and marking.root.is_empty():
        found.append(Step("done", marking.root.number, ""))
    return found


def take(marking: Marking, step: Step) -> list[Marking]:
    """The markings after a step; the given one stays as it is."""
    results = _take(marking, step)
    for after in results:
        enter_what_waits(after)
    return results


def enter_what_waits(marking: Marking) -> None:
    """A token that comes to an event is in it, and waits (13.5.2): nothing comes in between.

    Likewise one that comes to an activity with something to catch at its boundary (13.5.3), or to a
    subprocess with an event subprocess (13.5.4).
    """
    entering = True
    while entering:
        entering = False
        for scope in list(marking.scopes()):
            for node in scope.level.nodes:
                while _waits(scope, node) and _can_fire(scope, node):
                    _fire(marking, scope, node)
                    entering = True


def _waits(scope: Scope, node: Node) -> bool:
    match node.kind:
        case "start":
            return node.event is not None and scope.owner is None
        case "catch":
            return not is_link_target(node)
        case "event_gateway":
            return True
        case "task" | "user" | "subprocess":
            events = [boundary.event for boundary in scope.level.boundaries[node.id]]
            if node.inside is not None and node.repeat is None:
                events += [start_of(handler).event for handler in node.inside.handlers]
            return any(event is not None and event.kind == "signal" for event in events)
        case _:
            return False


def _take(marking: Marking, step: Step) -> list[Marking]:
    after = marking.copy()
    if step.what == "begin":
        whole = after.work(step.number)
        assert whole is not None
        _begin_whole(after, whole)
        return [after]
    if step.what == "done":
        work = after.work(step.number)
        if work is None:
            after.root, after.outcome = None, "completed"
        else:
            finish(after, work)
        return [after]
    scope = after.scope(step.number)
    assert scope is not None
    node = scope.level.by_id[step.node]
    if step.what == "reset":
        _reset(after, scope, node)
        return [after]
    return _fire(after, scope, node)


def _can_fire(scope: Scope, node: Node) -> bool:
    entries = scope.level.entries[node.id]
    if not any(scope.tokens[flow] for flow in entries):
        return False
    if node.kind == "parallel":
        return all(scope.tokens[flow] for flow in entries)
    if node.kind == "inclusive":
        return inclusive_is_activated(scope, node)
    if node.kind == "complex":
        return complex_is_activated(scope, node)
    return sum(scope.tokens[flow] for flow in entries) >= node.start_quantity


def _consume(scope: Scope, flow: str) -> None:
    scope.tokens[flow] -= 1
    if not scope.tokens[flow]:
        del scope.tokens[flow]


def _fire(marking: Marking, scope: Scope, node: Node) -> list[Marking]:
    present = [flow for flow in scope.level.entries[node.id] if scope.tokens[flow]]
    if node.kind in ("parallel", "inclusive", "complex"):
        for flow in present:
            _consume(scope, flow)
    else:
        # Which of them is no matter: nothing remembers the flow that a token came on.
        for _ in range(node.start_quantity):
            _consume(scope, next(f for f in scope.level.entries[node.id] if scope.tokens[f]))
    match node.kind:
        case "task" | "user" | "subprocess":
            _begin_activity(marking, scope, node)
        case "end" | "throw":
            return _throw(marking, scope, node)
        case "complex":
            if len(present) < len(scope.level.entries[node.id]):
                # Table 13.5 has it wait for its reset, and reset at once, also when no other flow
                # is left; the engine has no second phase then (its documented choice).
                scope.fired[node.id] = frozenset(present)
            _leave(marking, scope, node, waiting_for_start=True)
        case "exclusive" | "inclusive" | "parallel":
            _leave(marking, scope, node)
        case "start" if node.event is None or scope.owner is not None:
            put_on_all(marking, scope, node)
        case "catch" if is_link_target(node):
            put_on_all(marking, scope, node)
        case "start" | "catch" | "event_gateway":
            scope.works.append(Work(marking.next_number(), node, scope))
        case kind:
            raise AssertionError(f"no rule for {kind}")
    return [marking]


def _leave(
    marking: Marking, scope: Scope, node: Node, *, waiting_for_start: bool | None = None
) -> None:
    """Tokens go out of an activity or gateway by the conditions of its flows (tables 13.1-13.5)."""
    outgoing = scope.level.outgoing[node.id]
    if not outgoing:
        return
    if node.kind == "parallel":
        chosen = list(outgoing)
    else:
        names = marking.answers
        if waiting_for_start is not None:
            names = {**names, WAITING_FOR_START: waiting_for_start}
        chosen = [f for f in outgoing if f.id != node.default and holds(f.condition, names)]
        if waiting_for_start is False:
            # Table 13.5 sends a token where a condition is true; a flow without one had its token
            # at the activation (documented choice of the engine: docs/missions.md, "Complex").
            chosen = [flow for flow in chosen if flow.condition is not None]
        asked = chosen
        if node.kind in ACTIVITIES:  # flows without a condition are a parallel split (13.3.1)
            asked = [flow for flow in chosen if flow.condition is not None]
        if not asked and node.default is not None:
            chosen.append(scope.level.flow_by_id[node.default])
        if node.kind == "exclusive":
            chosen = chosen[:1]
    if chosen:
        _put_all(marking, scope, chosen, node.completion_quantity)
    elif waiting_for_start is not False:  # a complex gateway that resets may produce nothing
        # The token that finds no way is still in the node while it throws. That an activity's own
        # boundary events may catch it is documented (docs/missions.md, "Errors that m2pem throws").
        thrower = Work(marking.next_number(), node, scope)
        scope.works.append(thrower)
        throw_outwards(marking, thrower, NO_FLOW)


def _put_all(marking: Marking, scope: Scope, flows: list[Flow], count: int) -> None:
    for flow in flows:
        put(marking, scope, flow.id, count)


def holds(condition: Is | None, names: dict[str, str | bool]) -> bool:
    return condition is None or names.get(condition.name) == condition.value


def _reset(marking: Marking, scope: Scope, gateway: Node) -> None:
    before = scope.fired.pop(gateway.id)
    for flow in scope.level.entries[gateway.id]:
        if scope.tokens[flow] and flow not in before:
            _consume(scope, flow)
    _leave(marking, scope, gateway, waiting_for_start=False)


def _throw(marking: Marking, scope: Scope, node: Node) -> list[Marking]:
    """The event happens while the token is in the node; then it goes on, if it is still there."""
    event = node.event
    work = Work(marking.next_number(), node, scope)
    scope.works.append(work)
    results = [marking]
    match event:
        case None:
            pass
        case Event("terminate"):
            _terminate(marking, scope)
        case Event("signal", name):
            assert name is not None
            results = broadcast(marking, name)
        case Event("link"):
            target = next(n for n in scope.level.nodes if is_link_target(n) and n.event == event)
            scope.tokens[birth(target.id)] += 1
        case Event("error" | "escalation"):
            throw_outwards(marking, work, event)
        case _:
            raise AssertionError(f"no rule for throwing {event}")
    for result in results:
        thrower = result.work(work.number)
        if thrower is not None:
            thrower.home.works.remove(thrower)
            put_on_all(result, thrower.home, node)
    return results


def _terminate(marking: Marking, scope: Scope) -> None:
    """13.5.6: all in the scope ends; what contains it goes on."""
    if scope.owner is None:
        marking.root, marking.outcome = None, "terminated"
        return
    scope.tokens.clear()
    scope.works.clear()
    scope.fired.clear()
    scope.terminated = True


def _begin_activity(marking: Marking, scope: Scope, node: Node) -> None:
    if node.repeat is None:
        _begin_instance(marking, scope, node, None)
        return
    scope.works.append(Work(marking.next_number(), node, scope, instances=[]))


def _begin_whole(marking: Marking, whole: Work) -> None:
    repeat = whole.node.repeat
    if isinstance(repeat, Many) and not repeat.sequential:
        while whole.begun < repeat.count:
            _begin_next(marking, whole)
    _repeat_or_end(marking, whole)


def _begin_instance(marking: Marking, scope: Scope, node: Node, whole: Work | None) -> None:
    if node.kind == "subprocess":
        add_scope_work(marking, scope, node, whole)
        return
    work = Work(marking.next_number(), node, scope, whole=whole)
    if whole is None:
        scope.works.append(work)
    else:
        assert whole.instances is not None
        whole.instances.append(work)


def _begin_next(marking: Marking, whole: Work) -> None:
    whole.begun += 1
    _begin_instance(marking, whole.home, whole.node, whole)


def finish(marking: Marking, work: Work) -> None:
    """An activity, an instance of one, an event subprocess or a caught event has done its work."""
    whole = work.whole
    if whole is not None:
        assert whole.instances is not None
        whole.instances.remove(work)
        if work.inside is None or not work.inside.terminated:
            whole.completed += 1  # table 10.30 counts those that were terminated apart
        _repeat_or_end(marking, whole)
        return
    work.home.works.remove(work)
    if work.caught:
        put_on_all(marking, work.home, work.node)
    elif work.node.kind != "event_subprocess":
        _leave(marking, work.home, work.node)


def _repeat_or_end(marking: Marking, whole: Work) -> None:
    """13.3.6 and 13.3.7: whether another instance begins, or the activity has completed."""
    if whole.instances and not _has_enough(whole):
        return
    if not _has_enough(whole) and _goes_on(marking, whole):
        _begin_next(marking, whole)
        return
    whole.home.works.remove(whole)
    _leave(marking, whole.home, whole.node)


def _has_enough(whole: Work) -> bool:
    many = whole.node.repeat
    return (
        isinstance(many, Many)
        and many.enough is not None
        and bool(whole.completed)  # the condition is looked at when an instance completes
        and whole.completed >= many.enough
    )


def _goes_on(marking: Marking, whole: Work) -> bool:
    repeat = whole.node.repeat
    if isinstance(repeat, Many):
        return whole.begun < repeat.count
    assert isinstance(repeat, Loop)
    if repeat.maximum is not None and whole.begun >= repeat.maximum:
        return False
    if not repeat.before and not whole.begun:
        return True
    return holds(repeat.condition, marking.answers)
