"""A mission's file as an editor (bpmn-js, and what else reads with bpmn-moddle) can take it.

The model stays the same: what `load_mission` reads of the result is what it reads of the file.
"""

import re

from lxml import etree

from m2pem.api.authoring import Editable
from m2pem.bpmn.behaviors import is_behavior
from m2pem.bpmn.context import text_of
from m2pem.bpmn.files import open_part
from m2pem.bpmn.xml import M2PEM, XmlError, local, parse_xml
from m2pem.diagram.interchange import NAMESPACES, add_diagrams, remove_diagrams, undrawn
from m2pem.diagram.layout.model import BPMN, Element, children, is_node, referred_id, tag
from m2pem.editing.identifiers import name_all, unqualify_references

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


_TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"
_READ_AS_TEXT = ("documentation", "text")
_KEPT_AS_TEXT = ("script", "conditionExpression")
_EXPRESSIONS = (
    "condition",
    "timeDate",
    "timeDuration",
    "timeCycle",
    "loopCondition",
    "loopCardinality",
    "completionCondition",
    "from",
    "to",
    "messagePath",
    "dataPath",
    "transformation",
    "activationCondition",
)


def flatten_texts(definitions: Element) -> list[str]:
    """Replace texts with elements in them by plain texts; return what was lost, with its place."""
    notes = []
    for element in [*definitions.iter(etree.Element)]:
        name = tag(element)
        if not len(element) or name not in (*_READ_AS_TEXT, *_KEPT_AS_TEXT, *_EXPRESSIONS):
            continue
        if name in _KEPT_AS_TEXT:
            text = _as_written(element)
        else:
            text = text_of(element)
        owner = element.getparent()
        of = "" if owner is None else owner.get("id") or tag(owner)
        what = "script" if name == "script" else name
        notes.append(f"The {what} of {of} has XML elements in it: their text is kept.")
        for child in [*element]:
            element.remove(child)
        element.text = text
    return notes


def set_types(definitions: Element) -> None:
    """Conditions are formal expressions, the only type of theirs that editors know."""
    prefix = next((p for p, uri in definitions.nsmap.items() if uri == BPMN), None)
    for condition in definitions.iter(f"{{{BPMN}}}conditionExpression"):
        said = referred_id(condition.get(_TYPE))
        if said not in ("tFormalExpression", "tExpression"):
            known = f"{prefix}:tFormalExpression" if prefix else "tFormalExpression"
            condition.set(_TYPE, known)


def _as_written(element: Element) -> str:
    parts = [element.text or ""]
    parts += [etree.tostring(each, encoding="unicode") for each in element]
    return "".join(parts).strip()


_BEFORE = ("documentation", "extensionElements", "auditing", "monitoring", "categoryValueRef")


def refer_to_flows(definitions: Element) -> None:
    """Write anew which flows lead to each node, and which away from it, in the file's order."""
    incoming: dict[str, list[str]] = {}
    outgoing: dict[str, list[str]] = {}
    for flow in definitions.iter(f"{{{BPMN}}}sequenceFlow"):
        name = str(flow.get("id"))
        outgoing.setdefault(referred_id(flow.get("sourceRef")), []).append(name)
        incoming.setdefault(referred_id(flow.get("targetRef")), []).append(name)
    for node in [*definitions.iter(etree.Element)]:
        if not is_node(node):
            continue
        for each in [*children(node, "incoming", "outgoing")]:
            node.remove(each)
        place = len([*children(node, *_BEFORE)])
        name = str(node.get("id"))
        wanted = [("incoming", each) for each in incoming.get(name, ())]
        wanted += [("outgoing", each) for each in outgoing.get(name, ())]
        for number, (kind, flow_id) in enumerate(wanted):
            reference = etree.Element(f"{{{BPMN}}}{kind}")
            reference.text = flow_id
            node.insert(place + number, reference)


_SCRIPTS = ("scriptTask", "globalScriptTask")
_FORMAT = {"scriptTask": "scriptFormat", "globalScriptTask": "scriptLanguage"}
_OWN_NAMESPACES = (f"{{{BPMN}}}", M2PEM)
_HEAD = ("type", "name")


def lift_behaviors(definitions: Element) -> None:
    """Move the behavior of each script into its task's extension elements, in one form.

    The other forms (docs/missions.md) are XML in a script: as elements, which editors cannot read,
    or as text.
    """
    for task in definitions.iter(*(f"{{{BPMN}}}{name}" for name in _SCRIPTS)):
        scripts = [*children(task, "script")]
        behavior = _behavior_of(scripts[0]) if len(scripts) == 1 else None
        if behavior is None:
            continue
        task.remove(scripts[0])
        task.attrib.pop(_FORMAT[tag(task)], "")
        extensions_of(task).append(behavior)
    for behavior in [*definitions.iter(f"{M2PEM}behavior")]:
        _in_one_form(behavior)


def extensions_of(element: Element) -> Element:
    """Its extension elements, made if it has none."""
    found = next(children(element, "extensionElements"), None)
    if found is None:
        found = etree.Element(f"{{{BPMN}}}extensionElements")
        element.insert(len([*children(element, "documentation")]), found)
    return found


def _behavior_of(script: Element) -> Element | None:
    """Return the behavior of a script; None if it has none, or something else beside it."""
    if len(script) == 1:
        found = script[0]
    elif len(script) or not (script.text or "").lstrip().startswith("<"):
        return None
    else:
        try:
            found = parse_xml((script.text or "").strip().encode(), declared=False).root
        except XmlError:
            return None
    return _in_own_namespace(found) if is_behavior(found) else None


def _in_own_namespace(element: Element) -> Element:
    """Copy an element; those of BPMN's or no namespace get m2pem's."""
    name = element.tag
    if not name.startswith("{") or name.startswith(_OWN_NAMESPACES):
        name = f"{M2PEM}{local(name)}"
    made = etree.Element(name)
    for key, value in element.attrib.items():
        made.set(str(key).removeprefix(M2PEM), value)
    made.text = element.text
    for child in element:
        made.append(_in_own_namespace(child))
    return made


def _in_one_form(behavior: Element) -> None:
    """Type and name as attributes, values of properties as attributes, no text between."""
    heads = [
        each
        for each in behavior.iterchildren(f"{M2PEM}property")
        if each.get("name") in _HEAD and not len(each)
    ]
    for name in _HEAD:
        mine = [each for each in heads if each.get("name") == name]
        values = {*map(_value, mine), *([behavior.get(name)] if behavior.get(name) else [])}
        if mine and len(values) == 1:
            behavior.set(name, values.pop() or "")
            for each in mine:
                behavior.remove(each)
    for each in behavior.iter(f"{M2PEM}property"):
        if each.get("value") is None and not len(each):
            each.set("value", _value(each))
            each.text = None
    for each in behavior.iter(etree.Element):
        if len(each):
            each.text = None
        each.tail = None


def _value(element: Element) -> str:
    return element.get("value") or (element.text or "").strip()
