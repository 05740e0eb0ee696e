"""Whether two missions are the same but for the lines on which things stand."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from m2pem.mission.elements import Element
from m2pem.mission.mission import Mission

_OF_THE_TEXT = frozenset({"line", "source", "warnings", "library", "elements"})
_NOT_LEGAL = "~"
"""In the ids that m2pem makes up for what has none; an editor needs real ones."""


def model_of(mission: Mission, names: Mapping[str, str] | None = None) -> Any:
    """All that a mission is, as plain data; elements within elements by their ids.

    `names`: what ids are called instead.
    """
    return _data(mission, names or {}, whole=True)


def new_names(before: Mission, after: Mission) -> dict[str, str]:
    """The ids of `after` for those that were made up in `before`, by place."""
    pairs = [
        *zip(before.nodes, after.nodes, strict=True),
        *zip(before.flows, after.flows, strict=True),
        *zip(before.processes, after.processes, strict=True),
    ]
    return {one.id: other.id for one, other in pairs if _NOT_LEGAL in one.id}


def _data(value: Any, names: Mapping[str, str], *, whole: bool = False) -> Any:
    if isinstance(value, Element) and not whole:
        return (type(value).__name__, names.get(value.id, value.id))
    if is_dataclass(value) and not isinstance(value, type):
        said = {
            each.name: _parts(getattr(value, each.name, None), names, whole=whole)
            for each in fields(value)
            if each.name not in _OF_THE_TEXT
        }
        return (type(value).__name__, said)
    if isinstance(value, str):
        return names.get(value, value).replace("\r\n", "\n")
    if isinstance(value, Mapping):
        return {names.get(key, key): _data(each, names) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [_data(each, names) for each in value]
    if isinstance(value, frozenset | set):
        return sorted(names.get(str(each), str(each)) for each in value)
    return value if isinstance(value, int | float | bool | None) else repr(value)


def _parts(value: Any, names: Mapping[str, str], *, whole: bool) -> Any:
    """What a mission lists is told whole; what an element names is told by its id."""
    if whole and isinstance(value, tuple):
        return [
            _element(each, names) if isinstance(each, Element) else _data(each, names)
            for each in value
        ]
    return _data(value, names)


def _element(element: Element, names: Mapping[str, str]) -> Any:
    said = {
        each.name: _data(getattr(element, each.name, None), names)
        for each in fields(element)
        if each.name not in _OF_THE_TEXT
    }
    return (type(element).__name__, said)
