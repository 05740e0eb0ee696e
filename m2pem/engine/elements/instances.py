"""What the instances of a multi-instance activity give and throw (BPMN 2.0.2, table 10.29)."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from m2pem.engine import records as r
from m2pem.engine.compensation import throw_compensation
from m2pem.engine.data import instance_counts, reader
from m2pem.engine.execution import Execution
from m2pem.engine.messaging import send
from m2pem.engine.records import Trigger
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error, throw_escalation
from m2pem.engine.triggering import throw_signal, trigger
from m2pem.errors import ExpressionError
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
from m2pem.mission.loops import InstanceBehavior, MultiInstance
from m2pem.mission.values import ReadValue, Value


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
