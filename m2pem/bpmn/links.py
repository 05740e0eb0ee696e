"""Link events: pairs each source with the target of its name (BPMN 2.0.2, table 10.98).

A link is a sequence flow that is not drawn: it joins places of one container, several sources to
one target.
"""

from m2pem.bpmn.reading import Reading
from m2pem.bpmn.rules.events import (
    DANGLING_LINK,
    DUPLICATE_LINK,
    LINK_CATCH_INCOMING,
    LINK_CROSSES_BORDER,
    LINK_NAME,
    LINK_THROW_OUTGOING,
)
from m2pem.bpmn.rules.rule import Rule
from m2pem.mission.elements import (
    Container,
    Event,
    FlowNode,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
)
from m2pem.mission.events import LinkEventDefinition
from m2pem.mission.near import did_you_mean

_set = object.__setattr__


def is_link_target(node: FlowNode) -> bool:
    """Whether tokens come to it from link sources only."""
    return isinstance(node, IntermediateCatchEvent) and _link(node) is not None


def resolve_links(reading: Reading) -> None:
    """Link sources and targets, both ways; says which have no counterpart, or too many."""
    targets: dict[tuple[Container, str], IntermediateCatchEvent] = {}
    sources: dict[IntermediateCatchEvent, list[IntermediateThrowEvent]] = {}
    for node in reading.nodes:
        link = _link(node)
        if link is None:
            continue
        if not link.name:
            _say(
                reading,
                node,
                LINK_NAME,
                "the link event has no name, so nothing says what it is joined to",
                'name it: <linkEventDefinition name="A"/>, and the other end alike',
            )
        elif isinstance(node, IntermediateCatchEvent):
            first = targets.setdefault((node.container, link.name), node)
            if first is not node:
                _say(
                    reading,
                    node,
                    DUPLICATE_LINK,
                    f"the link '{link.name}' has another target, '{first.id}' on line {first.line}",
                    "give it another name, or lead the sources to one of the two",
                )
        _check_flows(reading, node)
    for node in reading.nodes:
        link = _link(node)
        if link is None or not link.name or not isinstance(node, IntermediateThrowEvent):
            continue
        target = targets.get((node.container, link.name))
        if target is None:
            _no_target(reading, node, link, targets)
        else:
            _set(node, "links_to", target)
            sources.setdefault(target, []).append(node)
    for target, found in sources.items():
        _set(target, "linked_from", tuple(found))


def _link(node: FlowNode) -> LinkEventDefinition | None:
    for definition in node.definitions if isinstance(node, Event) else ():
        if isinstance(definition, LinkEventDefinition):
            return definition
    return None


def _check_flows(reading: Reading, node: FlowNode) -> None:
    catches = isinstance(node, IntermediateCatchEvent)
    said = f"into the link target '{node.id}'" if catches else f"out of '{node.id}', a link"
    follows = "what follows the link target"
    for flow in node.incoming if catches else node.outgoing:
        reading.report.error(
            flow.line,
            flow.id,
            LINK_CATCH_INCOMING if catches else LINK_THROW_OUTGOING,
            f"no sequence flow can lead {said}",
            f"lead it to {follows}" if catches else f"let it begin at {follows}",
        )


def _no_target(
    reading: Reading,
    node: FlowNode,
    link: LinkEventDefinition,
    targets: dict[tuple[Container, str], IntermediateCatchEvent],
) -> None:
    near = [name for container, name in targets if container is node.container]
    elsewhere = [each.id for (_, name), each in targets.items() if name == link.name]
    rule, message = DANGLING_LINK, f"the link '{link.name}' has no target"
    remedy = f'add <intermediateCatchEvent> with <linkEventDefinition name="{link.name}"/>'
    if elsewhere:
        rule = LINK_CROSSES_BORDER
        message += f" here: '{elsewhere[0]}' is in another process or subprocess"
        remedy = "links join places of one container: let a sequence flow leave the subprocess"
    _say(reading, node, rule, message, did_you_mean(link.name, near, remedy))


def _say(reading: Reading, node: FlowNode, rule: Rule, message: str, remedy: str) -> None:
    reading.broken.add(node.container)
    reading.report.error(node.line, node.id, rule, message, remedy)
