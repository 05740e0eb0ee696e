"""Reading and writing the data store (FORMATS section 1, "Data").

Every scope may hold values; a name is looked up from the reader's scope outwards, to the process
instance that contains it and no further: a called process has a store of its own.
"""

from collections.abc import Iterator

from m2pem.engine.state import Scope
from m2pem.model.elements import Process
from m2pem.model.values import ReadValue, Value


def _visible(scope: Scope) -> Iterator[Scope]:
    """The scope and those around it, out to its process instance."""
    current: Scope | None = scope
    while current is not None:
        yield current
        if isinstance(current.container, Process):
            return
        current = current.parent


def reader(scope: Scope) -> ReadValue:
    """Reads names as an element in `scope` sees them; a missing name is None."""

    def read(name: str) -> Value:
        for store in _visible(scope):
            if name in store.data:
                return store.data[name]
        return _entry_of_map(scope, name)

    return read


def _entry_of_map(scope: Scope, name: str) -> Value:
    """`item.pose.x` of a map that is stored whole under `item`."""
    head, dot, tail = name.rpartition(".")
    while dot:
        for store in _visible(scope):
            value = store.data.get(head)
            if isinstance(value, dict):
                return _descend(value, tail)
        head, dot, rest = head.rpartition(".")
        tail = f"{rest}.{tail}"
    return None


def _descend(value: Value, path: str) -> Value:
    for key in path.split("."):
        if not isinstance(value, dict):
            return None
        value = value.get(key)
    return value


def store_for(scope: Scope, key: str) -> Scope:
    """Where a write goes: the nearest scope that declares the name, else the process instance."""
    outermost = scope
    for store in _visible(scope):
        for declared in store.container.data:
            if key == declared.key or key.startswith(f"{declared.key}."):
                return store
        outermost = store
    return outermost


def flatten(key: str, value: Value) -> Iterator[tuple[str, Value]]:
    """Writing a map writes `key.entry` for each of its entries, at any depth."""
    pending = [(key, value)]
    while pending:
        name, item = pending.pop()
        if isinstance(item, dict):
            pending.extend((f"{name}.{entry}", item[entry]) for entry in reversed(item))
        else:
            yield name, item
