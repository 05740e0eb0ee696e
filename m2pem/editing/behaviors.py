"""Behaviors as the editor writes them: `m2pem:behavior` in the extension elements of the task.

The other forms (docs/missions.md) are XML in a script: as elements, which editors cannot read at
all, or as text.
"""

from lxml import etree

from m2pem.bpmn.behaviors import is_behavior
from m2pem.bpmn.xml import M2PEM, XmlError, local, parse_xml
from m2pem.diagram.layout.model import BPMN, Element, children, tag

_SCRIPTS = ("scriptTask", "globalScriptTask")
_FORMAT = {"scriptTask": "scriptFormat", "globalScriptTask": "scriptLanguage"}
_OURS = (f"{{{BPMN}}}", M2PEM)
_HEAD = ("type", "name")


def lift_behaviors(definitions: Element) -> None:
    """Move the behavior of each script into its task's extension elements, in one form."""
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
    """What a script carries; None when it carries no behavior, or something beside it."""
    if len(script) == 1:
        found = script[0]
    elif len(script) or not (script.text or "").lstrip().startswith("<"):
        return None
    else:
        try:
            found = parse_xml((script.text or "").strip().encode(), declared=False).root
        except XmlError:
            return None
    return _ours(found) if is_behavior(found) else None


def _ours(element: Element) -> Element:
    """The same in m2pem's namespace, as far as it is ours."""
    name = element.tag
    if not name.startswith("{") or name.startswith(_OURS):
        name = f"{M2PEM}{local(name)}"
    made = etree.Element(name)
    for key, value in element.attrib.items():
        made.set(str(key).removeprefix(M2PEM), value)
    made.text = element.text
    for child in element:
        made.append(_ours(child))
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
