"""Which messages are for which receiver (BPMN 2.0.2, clause 8.4.2).

A message has keys: what its correlation properties, and its own correlation key, give where it is
thrown. A receiver takes it when each key that it has is the same: what its process subscribes to,
else what its instance has sent or received under that property before. A key that is null, on
either side, is no key yet, and fits.
"""

from m2pem.engine.data import Place, reader
from m2pem.engine.execution import Execution
from m2pem.engine.state import Scope, Token
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Process
from m2pem.mission.events import CorrelationProperty
from m2pem.mission.expression import Expression
from m2pem.mission.values import ReadValue, Value

OWN_KEY = "key"
"""Under which a message's own correlation key stands among its keys."""


def stored(correlation: CorrelationProperty) -> str:
    """The name in a process instance's data under which the value of a property is kept."""
    name = correlation.name if correlation.name.isidentifier() else correlation.id
    return f"correlation.{name}"


def keys_of(
    x: Execution, message: str, data: dict[str, Value], sender: Place | None
) -> dict[str, Value]:
    """The keys of a message that is thrown.

    Raises:
        ExpressionError: one cannot be evaluated.
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


def fits(x: Execution, message: str, keys: dict[str, Value], place: Place) -> bool:
    """Whether somebody who waits at a place takes a message with these keys."""
    return all(
        expected is None or expected == keys[name]
        for name, expected in _expected(x, message, keys, place)
    )


def _expected(
    x: Execution, message: str, keys: dict[str, Value], place: Place
) -> list[tuple[str, Value]]:
    read = reader(place)
    instance = instance_of(place)
    subscription = instance.container.process.subscription
    expected: list[tuple[str, Value]] = []
    for each in x.mission.correlation_properties:
        if each.id in keys:
            chosen = subscription.get(each.id)
            known = instance.data.get(stored(each))
            expected.append((each.id, known if chosen is None else _value(chosen, read)))
    own = x.mission.messages[message].correlation_key
    if own is not None and OWN_KEY in keys:
        expected.append((OWN_KEY, _value(own, read)))
    return expected


def _value(expression: Expression, read: ReadValue) -> Value:
    """What a receiver expects; one whose key cannot be worked out has none yet."""
    try:
        return expression.evaluate(read)
    except ExpressionError:
        return None


def remember(x: Execution, token: Token, keys: dict[str, Value]) -> None:
    """Keep a message's properties for the instance that has sent or received it."""
    instance = instance_of(token)
    for each in x.mission.correlation_properties:
        known = each.id in instance.container.process.subscription
        if each.id in keys and not known and instance.data.get(stored(each)) is None:
            x.write_into(instance, token, stored(each), keys[each.id])


def instance_of(place: Place) -> Scope:
    """The process instance that a place is in."""
    scope = place.scope if isinstance(place, Token) else place
    while scope.loop is not None or not isinstance(scope.container, Process):
        assert scope.parent is not None
        scope = scope.parent
    return scope
