"""Reading and writing the data store (docs/missions.md, "Data").

Every scope may hold values. A name belongs to the nearest enclosing scope that declares it, for
reads as for writes, else to the process instance; no further: a called process has its own store.
"""

from collections.abc import Iterator

from m2pem.engine.state import Scope
from m2pem.model.elements import Process
from m2pem.model.values import ReadValue, Value


def _stores(scope: Scope, name: str) -> Iterator[Scope]:
    """Where a name may be: outwards to the scope that declares it, else to the process."""
    current: Scope | None = scope
    while current is not None:
        yield current
        container = current.container
        if isinstance(container, Process):
            return
        for declared in container.data:
            if name == declared.key or name.startswith(f"{declared.key}."):
                return
        current = current.parent


def reader(scope: Scope) -> ReadValue:
    """Reads names as an element in `scope` sees them; a missing name is None."""

    def read(name: str) -> Value:
        for store in _stores(scope, name):
            if name in store.data:
                return store.data[name]
        return _entry_of_map(scope, name)

    return read


def _entry_of_map(scope: Scope, name: str) -> Value:
    """`item.pose.x` of a map that is stored whole under `item`."""
    head, dot, tail = name.rpartition(".")
    while dot:
        for store in _stores(scope, head):
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
    *_, outermost = _stores(scope, key)
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
