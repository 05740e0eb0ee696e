"""Correlation: which messages are for which instance (BPMN 2.0.2, clause 8.4.2)."""

from collections.abc import Iterator

from lxml import etree

from m2pem.bpmn.names import BPMN, M2PEM, ZEEBE
from m2pem.bpmn.reading import Reading, reference, text_of
from m2pem.bpmn.rules.collaboration import (
    BINDING_PATH,
    BINDING_PROPERTY,
    RETRIEVAL_MESSAGE,
    RETRIEVAL_PATH,
)
from m2pem.mission.elements import Process
from m2pem.mission.events import CorrelationProperty
from m2pem.mission.expression import Expression
from m2pem.mission.near import did_you_mean


def read_property(reading: Reading, element: etree._Element) -> None:
    """A correlationProperty; what it refers to is looked up by `resolve_correlation`."""
    identifier = reading.claim(element)
    if identifier:
        reading.correlation_properties[identifier] = element


def correlation_key(
    reading: Reading, element: etree._Element, identifier: str
) -> Expression | None:
    """The key of a message: `m2pem:correlationKey`, or Zeebe's subscription."""
    text = element.get(M2PEM + "correlationKey", "")
    where = element
    for extensions in element.iterchildren(BPMN + "extensionElements"):
        for each in extensions.iterchildren(ZEEBE + "subscription"):
            text = text or each.get("correlationKey", "")
            where = each
    return reading.expression(where, identifier, text) if text.strip() else None


def read_subscription(reading: Reading, element: etree._Element, process: Process) -> None:
    """A process's correlationSubscription, kept until all properties are known."""
    for binding in element.iterchildren(BPMN + "correlationPropertyBinding"):
        reading.subscriptions.append((process, binding))


def resolve_correlation(reading: Reading) -> tuple[CorrelationProperty, ...]:
    """Look up what properties and subscriptions refer to."""
    found = []
    for identifier, element in reading.correlation_properties.items():
        retrieve = dict(_retrievals(reading, identifier, element))
        line = reading.report.line(element)
        found.append(CorrelationProperty(identifier, element.get("name", ""), line, retrieve))
    for process, binding in reading.subscriptions:
        name = reference(binding.get("correlationPropertyRef", ""))
        if name not in reading.correlation_properties:
            _dangling(reading, binding, process.id, "correlationPropertyRef", name)
            continue
        expression = _path(reading, binding, "dataPath", process.id)
        if expression is not None:
            object.__setattr__(process, "subscription", {**process.subscription, name: expression})
    return tuple(found)


def _retrievals(
    reading: Reading, identifier: str, element: etree._Element
) -> Iterator[tuple[str, Expression]]:
    for each in element.iterchildren(BPMN + "correlationPropertyRetrievalExpression"):
        name = reference(each.get("messageRef", ""))
        if name not in reading.messages:
            _dangling(reading, each, identifier, "messageRef", name)
            continue
        expression = _path(reading, each, "messagePath", identifier)
        if expression is not None:
            yield name, expression


def _path(
    reading: Reading, element: etree._Element, tag: str, identifier: str
) -> Expression | None:
    for each in element.iterchildren(BPMN + tag):
        if text_of(each):
            return reading.expression(each, identifier, text_of(each), each.get("language"))
    reading.report.error(
        element,
        identifier,
        RETRIEVAL_PATH if tag == "messagePath" else BINDING_PATH,
        f"it has no {tag}, so nothing says by what messages are matched",
        f"write <{tag}>expression</{tag}>",
    )
    return None


def _dangling(
    reading: Reading, element: etree._Element, identifier: str, attribute: str, name: str
) -> None:
    if attribute == "messageRef":
        rule, known = RETRIEVAL_MESSAGE, frozenset(reading.messages)
    else:
        rule, known = BINDING_PROPERTY, frozenset(reading.correlation_properties)
    reading.report.error(
        element,
        identifier,
        rule,
        f"{attribute} names '{name}', which does not exist" if name else f"it has no {attribute}",
        did_you_mean(name, known, "name one that stands in definitions"),
    )
