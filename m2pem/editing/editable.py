"""A mission's file as an editor (bpmn-js, and what else reads with bpmn-moddle) can take it.

The model stays the same: what `load_mission` reads of the result is what it reads of the file.
"""

import re

from lxml import etree

from m2pem.api.authoring import Editable
from m2pem.bpmn.files import open_part
from m2pem.bpmn.xml import M2PEM
from m2pem.diagram.interchange import NAMESPACES, add_diagrams, remove_diagrams, undrawn
from m2pem.diagram.layout.model import Element
from m2pem.editing.behaviors import lift_behaviors
from m2pem.editing.flow_references import refer_to_flows
from m2pem.editing.identifiers import name_all, unqualify_references
from m2pem.editing.texts import flatten_texts, set_types

_DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>\n'
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_COMMENT = re.compile(rb"<!--.*?-->|<!\[CDATA\[.*?\]\]>", re.DOTALL)
_MOST_NAMED = 5


def editable(source: bytes, *, anew: bool = False) -> Editable:
    """The same mission for an editor; the same file gives the same bytes.

    `anew`: all diagrams are laid out again, whatever its author drew.

    Raises:
        MissionError: it is no BPMN 2.0.
    """
    root = _with_prefixes(open_part(source, "mission.bpmn").document.root)
    notes = _comments(source)
    if anew:
        remove_diagrams(root)
    lift_behaviors(root)
    notes += flatten_texts(root)
    set_types(root)
    _without_carriage_returns(root)
    notes += name_all(root)
    notes += unqualify_references(root)
    refer_to_flows(root)
    added = add_diagrams(root)
    if added and not anew:
        notes.append(f"Laid out, as the file drew it nowhere: {_some(added)}.")
    missing = undrawn(root)
    if missing:
        notes.append(f"The diagram does not show {_some(missing)}: lay it out anew to see them.")
    etree.indent(root, space="  ")
    return Editable(_DECLARATION + etree.tostring(root, encoding="utf-8"), tuple(notes))


def _without_carriage_returns(root: Element) -> None:
    """An editor writes them as spaces."""
    for element in root.iter(etree.Element):
        for key, value in element.attrib.items():
            if "\r" in value:
                element.set(key, str(value).replace("\r\n", "\n").replace("\r", "\n"))


def _comments(source: bytes) -> list[str]:
    count = sum(each.group().startswith(b"<!--") for each in _COMMENT.finditer(source))
    if not count:
        return []
    comments = "1 XML comment" if count == 1 else f"{count} XML comments"
    return [f"The file has {comments}: an editor does not keep them when it saves."]


def _some(names: list[str]) -> str:
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(names[:_MOST_NAMED]) + more


def _with_prefixes(root: Element) -> Element:
    """The same, with the namespaces declared at its top that may be needed."""
    prefixes = dict(root.nsmap)
    for wanted, uri in {**NAMESPACES, "m2pem": M2PEM[1:-1], "xsi": _XSI}.items():
        if uri in prefixes.values() and any(p for p, u in prefixes.items() if u == uri):
            continue
        prefix, number = wanted, 1
        while prefix in prefixes:
            number += 1
            prefix = f"{wanted}{number}"
        prefixes[prefix] = uri
    made = etree.Element(root.tag, nsmap=prefixes)  # type: ignore[arg-type]  # None: the default
    for key, value in root.attrib.items():
        made.set(key, value)
    made.text = root.text
    made.extend([*root])
    return made
