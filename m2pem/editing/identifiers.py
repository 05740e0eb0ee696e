"""Ids as editors want them: on all that is drawn, none twice, and in ASCII letters.

bpmn-moddle leaves out, without a word, what has another id: a UUID that begins with a digit, say.
"""

import re
from collections.abc import Iterator

from lxml import etree

from m2pem.diagram.interchange import NAMESPACES
from m2pem.diagram.layout.model import BPMN, Element, is_node, tag

_LEGAL = re.compile(r"([a-z][\w.-]*:)?[a-z_][\w.-]*", re.IGNORECASE | re.ASCII)
_NEED_ONE = frozenset(
    {
        "association",
        "collaboration",
        "dataInputAssociation",
        "dataObject",
        "dataObjectReference",
        "dataOutputAssociation",
        "dataStoreReference",
        "group",
        "lane",
        "laneSet",
        "messageFlow",
        "participant",
        "process",
        "sequenceFlow",
        "textAnnotation",
    }
)
_MEANT_BY_ID = {
    "dataInput": "name",
    "dataObject": "name",
    "dataObjectReference": "name",
    "dataOutput": "name",
    "dataStore": "name",
    "dataStoreReference": "name",
    "error": "errorCode",
    "escalation": "escalationCode",
    "message": "name",
    "property": "name",
    "signal": "name",
}
"""The attribute that says what else the id would say: a key of the data store, a code."""
_SPACES = (f"{{{BPMN}}}", *(f"{{{uri}}}" for uri in NAMESPACES.values()))
_ATTRIBUTES = re.compile(r".*Refs?|default|calledElement|bpmnElement|(source|target)Element")
_ELEMENTS = re.compile(r".*Refs?|incoming|outgoing")
_WITHOUT_EFFECT = frozenset(
    {"flowNodeRef", "inMessageRef", "outMessageRef", "supportedInterfaceRef"}
)


def name_all(definitions: Element) -> list[str]:
    """Give an id to whatever can be drawn, and another where the one it has will not do.

    Returns what has changed.
    """
    named = 0
    renamed: dict[str, str] = {}
    notes = []
    taken = {each.get("id") or "" for each in _elements(definitions)}
    seen: set[str] = set()
    for element in _elements(definitions):
        old = element.get("id") or ""
        if not old and (tag(element) in _NEED_ONE or is_node(element)):
            kind = tag(element)
            element.set("id", _new(f"{kind[:1].upper()}{kind[1:]}_1", taken))
            named += 1
        elif old and not _LEGAL.fullmatch(old):
            renamed[old] = renamed.get(old) or _new(_legal(old), taken)
            _say_what_the_id_said(element, old)
            element.set("id", renamed[old])
            if tag(element):
                notes.append(f"{old} is {renamed[old]} now: editors refuse such an id.")
        elif old and old in seen:
            element.set("id", _new(f"{old}_2", taken))
            if tag(element):
                notes.append(f"Two elements are called {old}: one is {element.get('id')} now.")
        seen.add(element.get("id") or "")
    if renamed:
        _refer(definitions, renamed)
    if named:
        notes.append(f"{named} elements had no id, and have one now.")
    return notes


def unqualify_references(definitions: Element) -> list[str]:
    """`tns:Flow` is `Flow` to an editor, where that is what the file calls an element of it.

    References to nothing, without effect on execution, are left out; returns which.
    """
    known = {each.get("id") or "" for each in _elements(definitions)}
    short = {}
    for text in _references(definitions):
        _, colon, name = text.rpartition(":")
        if colon and name in known and text not in known:
            short[text] = name
    if short:
        _refer(definitions, short)
    notes = []
    for element in [*definitions.iter(*(f"{{{BPMN}}}{name}" for name in _WITHOUT_EFFECT))]:
        text = (element.text or "").strip()
        owner = element.getparent()
        if text not in known and owner is not None:
            owner.remove(element)
            notes.append(f"The {tag(element)} of {owner.get('id', '')} to {text} names nothing.")
    return notes


def _elements(definitions: Element) -> Iterator[Element]:
    return (each for each in definitions.iter(etree.Element) if each.tag.startswith(_SPACES))


def _new(wanted: str, taken: set[str]) -> str:
    stem, _, number = wanted.rpartition("_")
    if not stem or not number.isdigit():
        stem, number = wanted, "1"
        if wanted not in taken:
            taken.add(wanted)
            return wanted
    count = int(number)
    while (name := f"{stem}_{count}") in taken:
        count += 1
    taken.add(name)
    return name


def _legal(identifier: str) -> str:
    return "_" + re.sub(r"[^\w.-]", "_", identifier, flags=re.ASCII)


def _say_what_the_id_said(element: Element, old: str) -> None:
    attribute = _MEANT_BY_ID.get(tag(element))
    if attribute is not None and not element.get(attribute):
        element.set(attribute, old)


def _references(definitions: Element) -> Iterator[str]:
    for element in _elements(definitions):
        for key, value in element.attrib.items():
            if _ATTRIBUTES.fullmatch(str(key)):
                yield str(value).strip()
        if _ELEMENTS.fullmatch(element.tag.rpartition("}")[2]):
            yield (element.text or "").strip()


def _refer(definitions: Element, names: dict[str, str]) -> None:
    """Rename an id in all references."""
    for element in _elements(definitions):
        for key, value in element.attrib.items():
            if _ATTRIBUTES.fullmatch(str(key)):
                element.set(key, _renamed(str(value), names))
        if _ELEMENTS.fullmatch(element.tag.rpartition("}")[2]) and element.text:
            element.text = _renamed(element.text, names)


def _renamed(text: str, names: dict[str, str]) -> str:
    stripped = text.strip()
    return names.get(stripped) or names.get(stripped.rpartition(":")[2]) or text
