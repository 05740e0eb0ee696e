"""Which messages are for which receiver (BPMN 2.0.2, clause 8.4.2).

The keys of a message are the values of its correlation properties, and of its own correlation key,
where it is thrown. A receiver matches when each of its own keys is equal: the value that its
process subscribes to, else the value that its instance has sent or received under that property
before. A key that is null on either side is not set yet, and matches.
"""

from m2pem.engine.data import reader
from m2pem.engine.execution import Execution
from m2pem.engine.state import Scope, Token, TokenOrScope
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Process
from m2pem.mission.events import CorrelationProperty
from m2pem.mission.expression import Expression
from m2pem.mission.values import ReadValue, Value

OWN_KEY = "key"
"""The name of a message's own correlation key among its keys."""


def key_in_data(correlation: CorrelationProperty) -> str:
    """Return the name under which a process instance's data holds the value of a property."""
    name = correlation.name if correlation.name.isidentifier() else correlation.id
    return f"correlation.{name}"


def keys_of(
    x: Execution, message: str, data: dict[str, Value], sender: TokenOrScope | None
) -> dict[str, Value]:
    """Return the keys of a message that is thrown.

    Raises:
        ExpressionError: a key cannot be evaluated.
    """
    around: ReadValue = reader(sender) if sender is not None else lambda _: None

    def read(name: str) -> Value:
        return data[name] if name in data else around(name)

    keys: dict[str, Value] = {}
    for each in x.mission.correlation_properties:
        if message in each.retrieve:
            keys[each.id] = each.retrieve[message].evaluate(read)
    own = x.mission.messages[message].correlation_key
    if own is not None:
        keys[OWN_KEY] = own.evaluate(read)
    return {name: value for name, value in keys.items() if value is not None}


def matches(x: Execution, message: str, keys: dict[str, Value], context: TokenOrScope) -> bool:
    """Whether a token or scope that waits matches a message with these keys."""
    return all(
        expected is None or expected == keys[name]
        for name, expected in _expected(x, message, keys, context)
    )


def _expected(
    x: Execution, message: str, keys: dict[str, Value], context: TokenOrScope
) -> list[tuple[str, Value]]:
    read = reader(context)
    instance = instance_of(context)
    subscription = instance.container.process.subscription
    expected: list[tuple[str, Value]] = []
    for each in x.mission.correlation_properties:
        if each.id in keys:
            chosen = subscription.get(each.id)
            known = instance.data.get(key_in_data(each))
            expected.append((each.id, known if chosen is None else _value(chosen, read)))
    own = x.mission.messages[message].correlation_key
    if own is not None and OWN_KEY in keys:
        expected.append((OWN_KEY, _value(own, read)))
    return expected


def _value(expression: Expression, read: ReadValue) -> Value:
    """Evaluate the key that a receiver expects; None: it cannot be evaluated yet."""
    try:
        return expression.evaluate(read)
    except ExpressionError:
        return None


def remember_keys(x: Execution, token: Token, keys: dict[str, Value]) -> None:
    """Keep a message's keys in the process instance that has sent or received it."""
    instance = instance_of(token)
    for each in x.mission.correlation_properties:
        known = each.id in instance.container.process.subscription
        if each.id in keys and not known and instance.data.get(key_in_data(each)) is None:
            x.write_into(instance, token, key_in_data(each), keys[each.id])


def instance_of(context: TokenOrScope) -> Scope:
    """Return the process instance of a token or scope."""
    scope = context.scope if isinstance(context, Token) else context
    while scope.loop is not None or not isinstance(scope.container, Process):
        assert scope.parent is not None
        scope = scope.parent
    return scope
