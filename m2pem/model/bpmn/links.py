"""Link events: joins each source to the target of its name (BPMN 2.0.2, table 10.98).

A link is a sequence flow that is not drawn: it joins places of one container, several sources to
one target. Which of them have no counterpart, or too many, is said by rules.
"""

from m2pem.model.bpmn.reading import Reading
from m2pem.model.elements import (
    Container,
    Event,
    FlowNode,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
)
from m2pem.model.events import LinkEventDefinition

_set = object.__setattr__


def is_link_target(node: FlowNode) -> bool:
    """Whether tokens come to it from link sources only."""
    return isinstance(node, IntermediateCatchEvent) and bool(_names(node))


def resolve_links(reading: Reading) -> None:
    """Link sources and targets, both ways."""
    targets: dict[tuple[Container, str], IntermediateCatchEvent] = {}
    sources: dict[IntermediateCatchEvent, list[IntermediateThrowEvent]] = {}
    for node in reading.nodes:
        if isinstance(node, IntermediateCatchEvent):
            for name in _names(node):
                targets.setdefault((node.container, name), node)
    for node in reading.nodes:
        if isinstance(node, IntermediateThrowEvent):
            for name in _names(node):
                target = targets.get((node.container, name))
                if target is None:
                    reading.broken.add(node.container)
                else:
                    _set(node, "links_to", target)
                    sources.setdefault(target, []).append(node)
    for target, found in sources.items():
        _set(target, "linked_from", tuple(found))


def _names(node: Event) -> list[str]:
    return [each.name for each in node.definitions if isinstance(each, LinkEventDefinition)]
