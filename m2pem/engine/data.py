"""Reading and writing the data store (docs/missions.md, "Data").

Every scope may hold values, and so may the activity that a token is on (its item variable, its
data inputs and outputs). A name belongs to the nearest of them that declares it, outwards from
where it is used, for reads as for writes, else to the process instance; no further: a called
process has its own store. Only what a data store holds is shared by all processes of a run.
"""

from collections.abc import Iterator
from typing import TypeAlias

from m2pem.engine.state import DataStores, Loop, Scope, Token, TokenOrScope
from m2pem.mission.elements import Activity, Process
from m2pem.mission.expression.temporal import NOW
from m2pem.mission.loops import INSTANCE_COUNTS, LOOP_COUNTER
from m2pem.mission.timers import date_text
from m2pem.mission.values import ReadValue, Value, value_within

Store: TypeAlias = TokenOrScope | DataStores
"""What holds values."""


def instance_counts(loop: Loop) -> dict[str, int]:
    """Return what the conditions of a multi-instance activity may read (table 10.31)."""
    active = loop.started - loop.completed - loop.terminated
    counts = (loop.total, active, loop.completed, loop.terminated)
    return dict(zip(INSTANCE_COUNTS, counts, strict=True))


def _outwards(context: TokenOrScope) -> Iterator[Store]:
    """Yield what encloses a token or scope: its scope, the token on the activity around it, ..."""
    current: TokenOrScope | None = context
    while current is not None:
        yield current
        if type(current) is Token:
            current = current.scope
            continue
        assert isinstance(current, Scope)
        if current.loop is None and isinstance(current.container, Process):
            if current.shared.keys:
                yield current.shared
            return
        current = current.owner


def _holds(context: Store, name: str) -> bool:
    """Whether a store has a value under exactly this name."""
    if type(context) is Token:
        return (context.own is not None and name in context.own) or (
            context.instance is not None and name == LOOP_COUNTER
        )
    if isinstance(context, DataStores):
        return name in context.data
    assert isinstance(context, Scope)
    return name in context.data or (_counts_instances(context) and name in INSTANCE_COUNTS)


def _counts_instances(scope: Scope) -> bool:
    """Whether a scope holds instances of a multi-instance activity, not of a standard loop."""
    return scope.loop is not None and scope.loop.total >= 0


def _value(context: Store, name: str) -> Value:
    if type(context) is Token:
        if context.own is not None and name in context.own:
            return context.own[name]
        return context.instance
    if isinstance(context, DataStores):
        return context.data[name]
    assert isinstance(context, Scope)
    if context.loop is not None and name in INSTANCE_COUNTS:
        return instance_counts(context.loop)[name]
    return context.data[name]


def _declares(context: Store, name: str) -> bool:
    """Whether a store declares the name, or the name that it begins with."""
    if type(context) is Token:
        declared_here = _own_data(context)
        if context.own is None and not declared_here:
            return False
        head = name.partition(".")[0]
        own = context.own or ()
        return name in own or head in own or name in declared_here or head in declared_here
    if isinstance(context, DataStores):
        return name in context.keys or any(name.startswith(f"{key}.") for key in context.keys)
    assert isinstance(context, Scope)
    if context.loop is not None:
        return False
    return any(
        name == declared.key or name.startswith(f"{declared.key}.")
        for declared in context.container.data
    )


def _own_data(token: Token) -> frozenset[str]:
    """Return the keys of the activity that a token is on; those of a loop are its instances'."""
    node = token.node
    if not isinstance(node, Activity) or (node.loop is not None and token.instance is None):
        return frozenset()
    return node.own_data


def reader(context: TokenOrScope) -> ReadValue:
    """Return a function that reads names as seen from a token or scope; a missing one is None."""

    def read(name: str) -> Value:
        for each in _outwards(context):
            if _holds(each, name):
                return _value(each, name)
            if _declares(each, name):
                break
        return _time(context) if name == NOW else _entry_of_map(context, name)

    return read


def _time(context: TokenOrScope) -> str | None:
    """When the input that is decided came. What is decided with it is in the records, once."""
    now_us = (context.scope if isinstance(context, Token) else context).shared.now_us
    return None if now_us is None else date_text(now_us)


def _entry_of_map(context: TokenOrScope, name: str) -> Value:
    """Read an entry, `item.pose.x`, of a map that is stored as one value under `item`."""
    head, dot, tail = name.rpartition(".")
    while dot:
        for each in _outwards(context):
            value = _value(each, head) if _holds(each, head) else None
            if isinstance(value, dict):
                return value_within(value, tail)
            if _declares(each, head):
                break
        head, dot, rest = head.rpartition(".")
        tail = f"{rest}.{tail}"
    return None


def store_for(context: TokenOrScope, key: str) -> Store:
    """Return where a key is written: the nearest store that declares it, else the process."""
    node = context.node if isinstance(context, Token) else None
    if isinstance(node, Activity) and node.data_flow.keeps_result:
        return context
    process: Store = context
    for each in _outwards(context):
        if _declares(each, key):
            return each
        if isinstance(each, Scope):
            process = each
    return process


def flatten(key: str, value: Value) -> Iterator[tuple[str, Value]]:
    """Yield `key.entry` and its value for each entry of a map, at any depth."""
    pending = [(key, value)]
    while pending:
        name, item = pending.pop()
        if isinstance(item, dict):
            pending.extend((f"{name}.{entry}", item[entry]) for entry in reversed(item))
        else:
            yield name, item
