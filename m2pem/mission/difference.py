"""The difference between two versions of a mission: what a revision of a running one changes.

Elements are matched by their id. What only says where something is written or drawn (lines of the
file, the diagram) makes no difference, nor does the order of elements, but for that of the sequence
flows that leave a gateway.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from typing import TypeAlias

from m2pem.mission.elements import DataObject, Element, FlowNode, SequenceFlow
from m2pem.mission.expression import Expression
from m2pem.mission.mission import Mission

Plain: TypeAlias = object
"""Values that compare by what they say: texts, numbers, and tuples of them."""

_PLACES = frozenset({"line", "index", "file", "qualifier"})
"""Where something is in its file."""

_LINKS = frozenset({"incoming", "outgoing", "boundary", "nodes", "flows", "entries"})
_CONTENTS = frozenset({"event_subprocesses", "subscription"})
"""Links to elements that are compared themselves."""


def plain(value: object) -> Plain:
    """Return a value as one that compares by content; an element in it is its id."""
    if isinstance(value, Expression):
        return ("expression", value.dialect.value, value.text)
    if isinstance(value, DataObject):
        return value.key
    if isinstance(value, Element):
        return value.id
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return tuple(sorted((str(key), plain(item)) for key, item in value.items()))
    if isinstance(value, frozenset):
        return tuple(sorted(map(str, value)))
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    if is_dataclass(value) and not isinstance(value, type):
        said = ((each.name, plain(getattr(value, each.name))) for each in fields(value))
        return (type(value).__name__, *(each for each in said if each[0] not in _PLACES))
    return value


def aspects(element: Element) -> dict[str, Plain]:
    """Return what an element says about itself, by the name of its field."""
    names = [each.name for each in fields(element)]
    skipped = _PLACES | _LINKS | _CONTENTS
    found = {name: plain(getattr(element, name)) for name in names if name not in skipped}
    found["kind"] = element.kind
    if isinstance(element, SequenceFlow):
        found["ends"] = (element.source.id, element.target.id)
    return found


@dataclass(frozen=True, slots=True)
class ElementChange:
    """An element that both versions have. `what`: the names of the fields that differ."""

    element: Element
    before: Element
    what: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Difference:
    """What a new version of a mission adds, removes and changes; the elements are those of the new
    version, the removed ones those of the old. `geometries`: names of routes, areas and points of
    the files themselves that are other ones, new or gone. `files`: names of files of which the
    content differs, whether or not an element does."""

    added: tuple[Element, ...]
    removed: tuple[Element, ...]
    changed: tuple[ElementChange, ...]
    geometries: tuple[str, ...]
    files: tuple[str, ...]

    @property
    def is_empty(self) -> bool:
        """Whether a run of one version does all that a run of the other does."""
        return not (self.added or self.removed or self.changed or self.geometries)


def difference(old: Mission, new: Mission) -> Difference:
    """Compare two versions of a mission, element by element."""
    names = dict.fromkeys((*old.geometries, *new.geometries))
    return Difference(
        tuple(each for id_, each in new.elements.items() if id_ not in old.elements),
        tuple(each for id_, each in old.elements.items() if id_ not in new.elements),
        tuple(_changes(old, new)),
        tuple(each for each in names if old.geometries.get(each) != new.geometries.get(each)),
        tuple(_changed_files(old, new)),
    )


def _changes(old: Mission, new: Mission) -> Iterable[ElementChange]:
    for id_, element in new.elements.items():
        before = old.elements.get(id_)
        if before is None:
            continue
        was, now = aspects(before), aspects(element)
        what = [name for name in dict.fromkeys((*was, *now)) if was.get(name) != now.get(name)]
        if _order(before) != _order(element):
            what.append("order of its sequence flows")
        if what:
            yield ElementChange(element, before, tuple(what))


def _order(element: Element) -> Plain:
    """Return the order in which the conditions of a node are read, where that matters."""
    if isinstance(element, FlowNode) and len(element.outgoing) > 1:
        return tuple(flow.id for flow in element.outgoing if flow.condition is not None)
    return ()


def _changed_files(old: Mission, new: Mission) -> Iterable[str]:
    if old.source != new.source:
        yield new.file
    was = {each.name: each.data for each in old.library}
    now = {each.name: each.data for each in new.library}
    for name in dict.fromkeys((*was, *now)):
        if was.get(name) != now.get(name):
            yield name
