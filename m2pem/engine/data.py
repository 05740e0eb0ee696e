"""Reading and writing the data store (docs/missions.md, "Data").

Every scope may hold values, and so may the activity that a token is on (its item variable, its
data inputs and outputs). A name belongs to the nearest of them that declares it, outwards from
where it is used, for reads as for writes, else to the process instance; no further: a called
process has its own store. Only what a data store holds is shared by all processes of a run.
"""

from collections.abc import Iterator
from typing import TypeAlias

from m2pem.engine.state import Loop, Scope, Shared, Token
from m2pem.mission.elements import Activity, Process
from m2pem.mission.loops import INSTANCE_COUNTS, LOOP_COUNTER
from m2pem.mission.values import ReadValue, Value

Place: TypeAlias = Token | Scope
"""Where a name is used."""

Store: TypeAlias = Place | Shared
"""Where a name is held."""


def instance_counts(loop: Loop) -> dict[str, int]:
    """What the conditions of a multi-instance activity may read (BPMN 2.0.2, table 10.31)."""
    active = loop.started - loop.completed - loop.terminated
    counts = (loop.total, active, loop.completed, loop.terminated)
    return dict(zip(INSTANCE_COUNTS, counts, strict=True))


def _outwards(place: Place) -> Iterator[Store]:
    """What encloses a place: its token, the scope, the token on the activity around it, ..."""
    current: Place | None = place
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


def _holds(place: Store, name: str) -> bool:
    """Whether a value is there under exactly this name."""
    if type(place) is Token:
        return (place.own is not None and name in place.own) or (
            place.instance is not None and name == LOOP_COUNTER
        )
    if isinstance(place, Shared):
        return name in place.data
    assert isinstance(place, Scope)
    return name in place.data or (_counts_instances(place) and name in INSTANCE_COUNTS)


def _counts_instances(scope: Scope) -> bool:
    """Whether it holds the instances of a multi-instance activity: a standard loop has none."""
    return scope.loop is not None and scope.loop.total >= 0


def _value(place: Store, name: str) -> Value:
    if type(place) is Token:
        if place.own is not None and name in place.own:
            return place.own[name]
        return place.instance
    if isinstance(place, Shared):
        return place.data[name]
    assert isinstance(place, Scope)
    if place.loop is not None and name in INSTANCE_COUNTS:
        return instance_counts(place.loop)[name]
    return place.data[name]


def _declares(place: Store, name: str) -> bool:
    """Whether the name, or the name that it begins with, is this place's own."""
    if type(place) is Token:
        declared_here = _own_data(place)
        if place.own is None and not declared_here:
            return False
        head = name.partition(".")[0]
        own = place.own or ()
        return name in own or head in own or name in declared_here or head in declared_here
    if isinstance(place, Shared):
        return name in place.keys or any(name.startswith(f"{key}.") for key in place.keys)
    assert isinstance(place, Scope)
    if place.loop is not None:
        return False
    return any(
        name == declared.key or name.startswith(f"{declared.key}.")
        for declared in place.container.data
    )


def _own_data(token: Token) -> frozenset[str]:
    """Keys of the activity that a token is on: of each instance, not of the whole of them."""
    node = token.node
    if not isinstance(node, Activity) or (node.loop is not None and token.instance is None):
        return frozenset()
    return node.own_data


def reader(place: Place) -> ReadValue:
    """Reads names as an element sees them whose token, or scope, this is; a missing one is None."""

    def read(name: str) -> Value:
        for each in _outwards(place):
            if _holds(each, name):
                return _value(each, name)
            if _declares(each, name):
                break
        return _entry_of_map(place, name)

    return read


def _entry_of_map(place: Place, name: str) -> Value:
    """`item.pose.x` of a map that is stored whole under `item`."""
    head, dot, tail = name.rpartition(".")
    while dot:
        for each in _outwards(place):
            value = _value(each, head) if _holds(each, head) else None
            if isinstance(value, dict):
                return _descend(value, tail)
            if _declares(each, head):
                break
        head, dot, rest = head.rpartition(".")
        tail = f"{rest}.{tail}"
    return None


def _descend(value: Value, path: str) -> Value:
    for key in path.split("."):
        if not isinstance(value, dict):
            return None
        value = value.get(key)
    return value


def store_for(place: Place, key: str) -> Store:
    """Where a write goes: the nearest place that declares the name, else the process instance."""
    process: Store = place
    for each in _outwards(place):
        if _declares(each, key):
            return each
        if isinstance(each, Scope):
            process = each
    return process


def flatten(key: str, value: Value) -> Iterator[tuple[str, Value]]:
    """Writing a map writes `key.entry` for each of its entries, at any depth."""
    pending = [(key, value)]
    while pending:
        name, item = pending.pop()
        if isinstance(item, dict):
            pending.extend((f"{name}.{entry}", item[entry]) for entry in reversed(item))
        else:
            yield name, item
