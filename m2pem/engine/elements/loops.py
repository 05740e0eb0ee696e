"""Standard loops and multi-instance activities (BPMN 2.0.2, clauses 13.3.6 and 13.3.7).

The token on the activity is the outer instance: boundary events belong to it. It opens a scope in
which each inner instance, or each round of a standard loop, is a token on the same activity. Those
of a parallel activity are all there before the first of them works.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace

from m2pem.engine import records as r
from m2pem.engine.compensation import enable_compensation, throw_compensation
from m2pem.engine.data import instance_counts, reader, store_for
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome, Trigger
from m2pem.engine.scopes import close_scope, end_tokens
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error, throw_escalation
from m2pem.engine.triggering import send, throw_signal, trigger
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Activity
from m2pem.mission.events import (
    CompensateEventDefinition,
    ErrorEventDefinition,
    EscalationEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
)
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import describe
from m2pem.mission.loops import LOOP_COUNTER, InstanceBehavior, MultiInstance, StandardLoop
from m2pem.mission.values import ReadValue, Value

MAX_PARALLEL = 1_000_000
"""Instances of one activity that may be active at a time, because of memory."""

ROUNDS_UNKNOWN = -1


# --- the beginning ------------------------------------------------------------------------------


def begin_loop(x: Execution, outer: Token, loop: StandardLoop | MultiInstance) -> bool:
    """Begin the instances of the activity that a token has entered. True: there are none."""
    if isinstance(loop, MultiInstance):
        return _begin_multi_instance(x, outer, loop)
    goes_on = _begins(x, outer, loop)
    if goes_on:
        _enter_instance(x, _open(x, outer, ROUNDS_UNKNOWN, None))
    return goes_on is False


def _begin_multi_instance(x: Execution, outer: Token, loop: MultiInstance) -> bool:
    items: tuple[Value, ...] | None = None
    try:
        if loop.collection is not None:
            items = _items(loop.collection, reader(outer))
            total = len(items)
        else:
            assert loop.cardinality is not None
            total = instance_count(loop.cardinality, reader(outer))
        if total > MAX_PARALLEL and not loop.sequential:
            raise ExpressionError(f"{total} parallel instances are more than {MAX_PARALLEL}")
    except ExpressionError as error:
        throw_error(x, outer, "EXPRESSION", f"instances of {outer.node.id}: {error}")
        return False
    if not total:
        _write_outputs(x, outer, loop, [])
        return True
    scope = _open(x, outer, total, items)
    if loop.sequential:
        _enter_instance(x, scope)
    else:
        begin_instances(x, scope)
    return False


def _items(collection: Expression, read: ReadValue) -> tuple[Value, ...]:
    value = collection.evaluate(read)
    if not isinstance(value, list):
        text = collection.text.strip()
        raise ExpressionError(f"the collection {text!r} is {describe(value)}, not a list")
    return tuple(value)


def _open(x: Execution, outer: Token, total: int, items: tuple[Value, ...] | None) -> Scope:
    node = outer.node
    number = x.state.last_scope + 1
    x.emit(
        r.ScopeOpened(number, x.process_of(node), node.id, outer.scope.id, outer.id, total, items)
    )
    return x.state.scopes[number]


def begin_instances(x: Execution, scope: Scope) -> None:
    """Begin the next instance of a parallel activity, before any other step is done."""
    loop = scope.loop
    assert loop is not None
    if loop.started < loop.total:
        _enter_instance(x, scope)
    if loop.started < loop.total:
        x.queue.appendleft(scope)


def _enter_instance(x: Execution, scope: Scope) -> None:
    """Put a token for the next instance, with its item, on the activity."""
    assert scope.owner is not None
    assert scope.loop is not None
    node = scope.owner.node
    number = scope.loop.started
    token = x.enter(x.state.last_token + 1, node, scope, instance=number)
    assert isinstance(node, Activity)
    if scope.loop.items is not None and isinstance(node.loop, MultiInstance) and node.loop.item:
        x.write_into(token, token, node.loop.item, scope.loop.items[number])


# --- the end of an instance ---------------------------------------------------------------------


def instance_done(x: Execution, token: Token, outcome: TokenOutcome) -> Iterator[Token]:
    """Complete an instance, and yield the outer instances that have completed with it.

    What an instance throws may end other instances: these are handled after it, not within it.
    """
    if x.ended_instances is not None:
        x.ended_instances.append((token, outcome))
        return
    x.ended_instances = deque([(token, outcome)])
    while x.ended_instances:
        ended, how = x.ended_instances.popleft()
        if x.state.tokens.get(ended.id) is ended:
            outer = _end_instance(x, ended, how)
            if outer is not None:
                yield outer
    x.ended_instances = None


def _end_instance(x: Execution, token: Token, outcome: TokenOutcome) -> Token | None:
    """Remove an instance, and go on with the others. Return the outer instance if it completed."""
    scope = token.scope
    outer = scope.owner
    assert outer is not None
    assert isinstance(outer.node, Activity)
    loop = outer.node.loop
    if isinstance(loop, StandardLoop):
        enable_compensation(x, token)
        x.leave(token, outcome)
        return _next_round(x, token, outer, loop)
    assert loop is not None
    assert scope.loop is not None
    if loop.output_collection and not collect_output(x, token, loop):
        return None
    enable_compensation(x, token)
    x.leave(token, outcome)
    if outcome is TokenOutcome.COMPLETED and not _throw_events_of_completion(x, token, outer, loop):
        return None
    if loop.completion is not None:
        enough = _condition_holds(x, outer, loop.completion, reader(token), "completion condition")
        if enough is None:
            return None
        if enough:
            end_tokens(x, scope, TokenOutcome.INTERRUPTED)
            return _finish(x, scope, outer, loop)
    if scope.loop.started < scope.loop.total:
        if loop.sequential:  # those of a parallel activity begin by themselves
            _enter_instance(x, scope)
    elif not scope.tokens:
        return _finish(x, scope, outer, loop)
    return None


def _throw_events_of_completion(
    x: Execution, token: Token, outer: Token, loop: MultiInstance
) -> bool:
    """Throw the events of an instance's completion. False: that ended the outer instance."""
    scope = token.scope
    assert scope.loop is not None
    for condition, events in events_of_completion(loop, first=scope.loop.completed == 1):
        due = condition is None or _condition_holds(
            x, outer, condition, reader(token), "behavior condition"
        )
        for definition in events if due else ():
            throw_event(x, outer, scope, definition)
            if x.state.scopes.get(scope.id) is not scope:
                return False
        if x.state.scopes.get(scope.id) is not scope:
            return False
    return True


def _finish(x: Execution, scope: Scope, outer: Token, loop: MultiInstance) -> Token:
    assert scope.loop is not None
    outputs = [scope.loop.outputs.get(number) for number in range(scope.loop.total)]
    close_scope(x, scope, TokenOutcome.COMPLETED)
    _write_outputs(x, outer, loop, outputs)
    return outer


def _write_outputs(x: Execution, outer: Token, loop: MultiInstance, outputs: list[Value]) -> None:
    key = loop.output_collection
    if key:
        x.write_into(store_for(outer, key), outer, key, outputs)


# --- rounds -------------------------------------------------------------------------------------


def _begins(x: Execution, outer: Token, loop: StandardLoop) -> bool | None:
    if loop.maximum == 0:
        return False
    if not loop.test_before or loop.condition is None:
        return True
    return _condition_holds(
        x, outer, loop.condition, _with_loop_counter(reader(outer), 0), "loop condition"
    )


def _next_round(x: Execution, token: Token, outer: Token, loop: StandardLoop) -> Token | None:
    """Begin another round after that of `token`; return the outer instance if there is none."""
    scope = token.scope
    assert scope.loop is not None
    rounds = scope.loop.started
    goes_on: bool | None = loop.maximum is None or rounds < loop.maximum
    if goes_on and loop.condition is not None:
        read = _with_loop_counter(reader(token), rounds)
        goes_on = _condition_holds(x, outer, loop.condition, read, "loop condition")
    if goes_on:
        _enter_instance(x, scope)
    elif goes_on is False:
        close_scope(x, scope, TokenOutcome.COMPLETED)
        return outer
    return None


def _with_loop_counter(read: ReadValue, rounds: int) -> ReadValue:
    """Read names with the loop counter of the next round: the number of rounds so far."""
    return lambda name: rounds if name == LOOP_COUNTER else read(name)


def _condition_holds(
    x: Execution, outer: Token, condition: Expression, read: ReadValue, what: str
) -> bool | None:
    """Evaluate a condition; None: it could not be evaluated, and error EXPRESSION was thrown."""
    try:
        return condition.holds(read)
    except ExpressionError as error:
        throw_error(x, outer, "EXPRESSION", f"{what} of {outer.node.id}: {error}")
        return None


def instance_count(cardinality: Expression, read: ReadValue) -> int:
    """Return the number of instances that a cardinality expression gives.

    Raises:
        ExpressionError: the cardinality is not a natural number.
    """
    value = cardinality.evaluate(read)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        text = cardinality.text.strip()
        raise ExpressionError(f"the cardinality {text!r} is {describe(value)}, not 0, 1, 2, ...")
    return value


# --- outputs ------------------------------------------------------------------------------------


def collect_output(x: Execution, token: Token, loop: MultiInstance) -> bool:
    """Keep the output of an instance, if any. False: error EXPRESSION was thrown."""
    if loop.output is None:
        value = _assembled(token.own or {}, loop.output_item)
    else:
        try:
            value = loop.output.evaluate(reader(token))
        except ExpressionError as error:
            throw_error(x, token, "EXPRESSION", f"output of {token.node.id}: {error}")
            return False
    if value is not None:
        node, number = token.node, token.instance
        assert number is not None
        process = x.process_of(node)
        x.emit(r.InstanceOutput(token.id, process, node.id, token.scope.id, number, value))
    return True


def _assembled(own: Mapping[str, Value], key: str) -> Value:
    """Return a value, or the map that was written entry by entry (`key.entry`)."""
    value = own.get(key)
    entries = [name for name in own if name.startswith(f"{key}.")]
    if not entries:
        return value
    result: dict[str, Value] = dict(value) if isinstance(value, dict) else {}
    for name in entries:
        *path, last = name[len(key) + 1 :].split(".")
        place = result
        for part in path:
            inside = place.get(part)
            place[part] = inside = dict(inside) if isinstance(inside, dict) else {}
            place = inside
        place[last] = own[name]
    return result


# --- events -------------------------------------------------------------------------------------


def events_of_completion(
    loop: MultiInstance, *, first: bool
) -> Iterator[tuple[Expression | None, tuple[EventDefinition, ...]]]:
    """Yield what the completion of an instance throws, with its condition (None: always)."""
    match loop.behavior:
        case InstanceBehavior.NONE:
            yield None, loop.events
        case InstanceBehavior.ONE if first:
            yield None, loop.events
        case InstanceBehavior.COMPLEX:
            for each in loop.complex:
                yield each.condition, each.events


def throw_event(x: Execution, outer: Token, scope: Scope, definition: EventDefinition) -> None:
    """Throw an event from a multi-instance activity; its own boundary events catch first."""
    node = outer.node
    match definition:
        case SignalEventDefinition(signal=signal):
            place = (x.process_of(node), node.id, outer.scope.id)
            x.emit(r.SignalThrown(signal.id, outer.id, *place))
            assert scope.loop is not None
            default = signal.id == node.id  # it carries the runtime attributes (table 10.29)
            throw_signal(x, signal.id, {**instance_counts(scope.loop)} if default else {})
        case MessageEventDefinition(message=message):
            _throw_message(x, outer, message.id)
        case CompensateEventDefinition():  # the activity does not wait for it
            throw_compensation(x, outer, replace(definition, wait=False))
        case EscalationEventDefinition(escalation=escalation):
            assert escalation is not None
            throw_escalation(x, outer, escalation)
        case ErrorEventDefinition(error=error):
            assert error is not None
            throw_error(x, outer, error.code, f"thrown by an instance of {node.label}")


def _throw_message(x: Execution, outer: Token, message: str) -> None:
    node = outer.node
    for wait in (outer.waits or {}).values():
        if wait.trigger is Trigger.MESSAGE and wait.ref == message:
            place = (x.process_of(node), node.id, outer.scope.id)
            x.emit(r.MessageThrown(message, outer.id, *place))
            trigger(x, wait, {})
            return
    send(x, outer, message)
