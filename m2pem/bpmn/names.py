"""XML namespaces and tags that mission files use."""

from collections.abc import Callable
from typing import cast

from lxml import etree

BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
M2PEM = "{https://m2pem.org/schema/1}"
CAMUNDA = "{http://camunda.org/schema/1.0/bpmn}"
ACTIVITI = "{http://activiti.org/bpmn}"
FLOWABLE = "{http://flowable.org/bpmn}"
ZEEBE = "{http://camunda.org/schema/zeebe/1.0}"

attribute_names = cast("Callable[[etree._Element], list[str]]", etree._Element.keys)
"""The names of an element's attributes, with their namespaces."""


def local(tag: str) -> str:
    """The name without its namespace."""
    return tag.rpartition("}")[2]


_KINDS = {
    "adHocSubProcess": "ad-hoc subprocess",
    "compensateEventDefinition": "compensation event",
    "eventBasedGateway": "event-based gateway",
    "globalTask": "global task",
    "multiInstanceLoopCharacteristics": "multi-instance activity",
    "standardLoopCharacteristics": "loop activity",
    "subProcess": "subprocess",
    "subChoreography": "subchoreography",
}


def kind(tag: str) -> str:
    """What a person calls the elements with this tag ("business rule task")."""
    name = local(tag)
    known = _KINDS.get(name)
    if known is not None:
        return known
    if name.endswith("EventDefinition"):
        name = name.removesuffix("Definition")
    words = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
    return words.strip()


def a(noun: str) -> str:
    """The noun with its indefinite article."""
    return f"an {noun}" if noun[:1] in "aeio" else f"a {noun}"
