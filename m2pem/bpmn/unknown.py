"""Attributes that BPMN does not know: misspelled, without their prefix, or foreign."""

from collections.abc import Collection

from lxml import etree

from m2pem.bpmn.names import a, kind, local
from m2pem.bpmn.vocabulary import ATTRIBUTES
from m2pem.mission.near import near


def unknown_attribute(
    element: etree._Element, name: str, known: Collection[str]
) -> tuple[str, str, str]:
    """The rule, message and remedy; `known` are the names that BPMN has there.

    A name that is like a known one is a rule of its own (`misspelled-attribute`): whoever wrote it
    expects an effect that it does not have.
    """
    message = f"BPMN has no attribute '{name}' for {a(kind(element.tag))}; it is ignored"
    own = ATTRIBUTES.get(local(element.tag), frozenset())
    match = f"m2pem:{name}" if name in own else near(name, known)
    if not match and (owned := near(name, own)):
        match = f"m2pem:{owned}"
    if match:
        return "misspelled-attribute", message, f"did you mean '{match}'?"
    return "unknown-attribute", message, "delete it, or give it its namespace"
