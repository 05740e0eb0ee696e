"""Standard loops and multi-instance activities (BPMN 2.0.2, clauses 13.3.6 and 13.3.7).

The token on the activity is the outer instance: boundary events belong to it. It opens a scope in
which each inner instance, or each round of a standard loop, is a token on the same activity. Those
of a parallel activity are all there before the first of them works.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace

from m2pem.engine import records as r
from m2pem.engine.compensation import enable, throw_compensation
from m2pem.engine.data import instance_counts, reader, store_for
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome, Trigger
from m2pem.engine.scopes import close, empty
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
"""Instances that may be active at a time: what memory can be expected to hold."""

ROUNDS_UNKNOWN = -1


# --- the beginning ------------------------------------------------------------------------------


def begin_loop(x: Execution, whole: Token, loop: StandardLoop | MultiInstance) -> bool:
    """Begin the instances of the activity that a token has come to. True: there are none."""
    if isinstance(loop, MultiInstance):
        return _begin_multi_instance(x, whole, loop)
    goes_on = _begins(x, whole, loop)
    if goes_on:
        _enter_instance(x, _open(x, whole, ROUNDS_UNKNOWN, None))
    return goes_on is False


def _begin_multi_instance(x: Execution, whole: Token, loop: MultiInstance) -> bool:
    items: tuple[Value, ...] | None = None
    try:
        if loop.collection is not None:
            items = _items(loop.collection, reader(whole))
            total = len(items)
        else:
            assert loop.cardinality is not None
            total = natural(loop.cardinality, reader(whole))
        if total > MAX_PARALLEL and not loop.sequential:
            raise ExpressionError(f"{total} parallel instances are more than {MAX_PARALLEL}")
    except ExpressionError as error:
        throw_error(x, whole, "EXPRESSION", f"instances of {whole.node.id}: {error}")
        return False
    if not total:
        _write_outputs(x, whole, loop, [])
        return True
    scope = _open(x, whole, total, items)
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


def _open(x: Execution, whole: Token, total: int, items: tuple[Value, ...] | None) -> Scope:
    node = whole.node
    number = x.state.last_scope + 1
    x.emit(
        r.ScopeOpened(number, x.process_of(node), node.id, whole.scope.id, whole.id, total, items)
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
    """The work of an instance is done. Gives the wholes that have completed with it.

    What an instance throws may end other instances: they come after it, not within it.
    """
    if x.ended_instances is not None:
        x.ended_instances.append((token, outcome))
        return
    x.ended_instances = deque([(token, outcome)])
    while x.ended_instances:
        ended, how = x.ended_instances.popleft()
        if x.state.tokens.get(ended.id) is ended:
            whole = _settle(x, ended, how)
            if whole is not None:
                yield whole
    x.ended_instances = None


def _settle(x: Execution, token: Token, outcome: TokenOutcome) -> Token | None:
    """Take an instance off, and go on with the others. Gives the whole if it has completed."""
    scope = token.scope
    whole = scope.owner
    assert whole is not None
    assert isinstance(whole.node, Activity)
    loop = whole.node.loop
    if isinstance(loop, StandardLoop):
        enable(x, token)
        x.leave(token, outcome)
        return _next_round(x, token, whole, loop)
    assert loop is not None
    assert scope.loop is not None
    if loop.output_collection and not collect(x, token, loop):
        return None
    enable(x, token)
    x.leave(token, outcome)
    if outcome is TokenOutcome.COMPLETED and not _throw_all(x, token, whole, loop):
        return None
    if loop.completion is not None:
        enough = _holds(x, whole, loop.completion, reader(token), "completion condition")
        if enough is None:
            return None
        if enough:
            empty(x, scope, TokenOutcome.INTERRUPTED)
            return _finish(x, scope, whole, loop)
    if scope.loop.started < scope.loop.total and loop.sequential:
        _enter_instance(x, scope)
    elif not scope.tokens:
        return _finish(x, scope, whole, loop)
    return None


def _throw_all(x: Execution, token: Token, whole: Token, loop: MultiInstance) -> bool:
    """Throw what the completion of an instance throws. False: that ended the whole."""
    scope = token.scope
    assert scope.loop is not None
    for condition, events in occasions(loop, first=scope.loop.completed == 1):
        due = condition is None or _holds(x, whole, condition, reader(token), "behavior condition")
        for definition in events if due else ():
            throw(x, whole, scope, definition)
            if x.state.scopes.get(scope.id) is not scope:
                return False
        if x.state.scopes.get(scope.id) is not scope:
            return False
    return True


def _finish(x: Execution, scope: Scope, whole: Token, loop: MultiInstance) -> Token:
    assert scope.loop is not None
    outputs = [scope.loop.outputs.get(number) for number in range(scope.loop.total)]
    close(x, scope, TokenOutcome.COMPLETED)
    _write_outputs(x, whole, loop, outputs)
    return whole


def _write_outputs(x: Execution, whole: Token, loop: MultiInstance, outputs: list[Value]) -> None:
    key = loop.output_collection
    if key:
        x.write_into(store_for(whole, key), whole, key, outputs)


# --- rounds -------------------------------------------------------------------------------------


def _begins(x: Execution, whole: Token, loop: StandardLoop) -> bool | None:
    if loop.maximum == 0:
        return False
    if not loop.test_before or loop.condition is None:
        return True
    return _holds(x, whole, loop.condition, _counting(reader(whole), 0), "loop condition")


def _next_round(x: Execution, token: Token, whole: Token, loop: StandardLoop) -> Token | None:
    """Begin another round after that of `token`; gives the whole if there is none."""
    scope = token.scope
    assert scope.loop is not None
    rounds = scope.loop.started
    goes_on: bool | None = loop.maximum is None or rounds < loop.maximum
    if goes_on and loop.condition is not None:
        read = _counting(reader(token), rounds)
        goes_on = _holds(x, whole, loop.condition, read, "loop condition")
    if goes_on:
        _enter_instance(x, scope)
    elif goes_on is False:
        close(x, scope, TokenOutcome.COMPLETED)
        return whole
    return None


def _counting(read: ReadValue, rounds: int) -> ReadValue:
    """Between two rounds the counter is that of the next: how many there have been."""
    return lambda name: rounds if name == LOOP_COUNTER else read(name)


def _holds(
    x: Execution, whole: Token, condition: Expression, read: ReadValue, what: str
) -> bool | None:
    """Whether a condition is true; None: it could not be evaluated, and its error was thrown."""
    try:
        return condition.holds(read)
    except ExpressionError as error:
        throw_error(x, whole, "EXPRESSION", f"{what} of {whole.node.id}: {error}")
        return None


def natural(cardinality: Expression, read: ReadValue) -> int:
    """How many instances a cardinality asks for.

    Raises:
        ExpressionError: it is no natural number.
    """
    value = cardinality.evaluate(read)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        text = cardinality.text.strip()
        raise ExpressionError(f"the cardinality {text!r} is {describe(value)}, not 0, 1, 2, ...")
    return value


# --- outputs ------------------------------------------------------------------------------------


def collect(x: Execution, token: Token, loop: MultiInstance) -> bool:
    """Keep what an instance gives, if anything. False: a wrong expression's error was thrown."""
    if loop.output is None:
        value = _whole(token.own or {}, loop.output_item)
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


def _whole(own: Mapping[str, Value], key: str) -> Value:
    """A value, or the map that was written entry by entry (`key.entry`)."""
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


def occasions(
    loop: MultiInstance, *, first: bool
) -> Iterator[tuple[Expression | None, tuple[EventDefinition, ...]]]:
    """What the completion of an instance throws, each under its condition (None is true)."""
    match loop.behavior:
        case InstanceBehavior.NONE:
            yield None, loop.events
        case InstanceBehavior.ONE if first:
            yield None, loop.events
        case InstanceBehavior.COMPLEX:
            for each in loop.complex:
                yield each.condition, each.events


def throw(x: Execution, whole: Token, scope: Scope, definition: EventDefinition) -> None:
    """Throw from a multi-instance activity; its own boundary events are the first to catch."""
    node = whole.node
    match definition:
        case SignalEventDefinition(signal=signal):
            place = (x.process_of(node), node.id, whole.scope.id)
            x.emit(r.SignalThrown(signal.id, whole.id, *place))
            assert scope.loop is not None
            default = signal.id == node.id  # it carries the runtime attributes (table 10.29)
            throw_signal(x, signal.id, {**instance_counts(scope.loop)} if default else {})
        case MessageEventDefinition(message=message):
            _throw_message(x, whole, message.id)
        case CompensateEventDefinition():  # it goes on meanwhile, as it works itself
            throw_compensation(x, whole, replace(definition, wait=False))
        case EscalationEventDefinition(escalation=escalation):
            assert escalation is not None
            throw_escalation(x, whole, escalation)
        case ErrorEventDefinition(error=error):
            assert error is not None
            throw_error(x, whole, error.code, f"thrown by an instance of {node.label}")


def _throw_message(x: Execution, whole: Token, message: str) -> None:
    node = whole.node
    for wait in (whole.waits or {}).values():
        if wait.trigger is Trigger.MESSAGE and wait.ref == message:
            place = (x.process_of(node), node.id, whole.scope.id)
            x.emit(r.MessageThrown(message, whole.id, *place))
            trigger(x, wait, {})
            return
    send(x, whole, message)
