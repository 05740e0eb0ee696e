"""Texts that have elements in them: editors that read BPMN stumble over these."""

from lxml import etree

from m2pem.bpmn.context import text_of
from m2pem.diagram.layout.model import BPMN, Element, local, tag

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
    """Make plain texts of those with elements in them; tells what was lost, where."""
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
        said = local(condition.get(_TYPE))
        if said not in ("tFormalExpression", "tExpression"):
            known = f"{prefix}:tFormalExpression" if prefix else "tFormalExpression"
            condition.set(_TYPE, known)


def _as_written(element: Element) -> str:
    parts = [element.text or ""]
    parts += [etree.tostring(each, encoding="unicode") for each in element]
    return "".join(parts).strip()
