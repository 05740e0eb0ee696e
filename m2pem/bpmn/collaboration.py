"""Collaborations: participants, message flows, lanes, correlation (BPMN 2.0.2, 8.4.2 and 9).

Participants and lanes are for display only, so what is wrong with them is a warning. Message flows
can name the message that an event or task sends or receives: ends that message flows join share
one message, which any of them or of the flows names, else one with the id of the first flow.
"""

from collections.abc import Collection, Iterator

from lxml import etree

from m2pem.bpmn.children import read_children
from m2pem.bpmn.compensation import read_association
from m2pem.bpmn.context import MessageUse, ReadingContext, reference, text_of
from m2pem.bpmn.rules.collaboration import (
    BINDING_PATH,
    BINDING_PROPERTY,
    RETRIEVAL_MESSAGE,
    RETRIEVAL_PATH,
)
from m2pem.bpmn.rules.events import MISSING_REFERENCE
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.xml import BPMN, local
from m2pem.mission.elements import Element, Process, ReceiveTask
from m2pem.mission.events import CorrelationProperty, Message, MessageEventDefinition
from m2pem.mission.expression import Expression
from m2pem.mission.mission import Lane, MessageFlow, Participant
from m2pem.mission.reachability import components
from m2pem.suggestions import suggest_or


def read_collaboration(context: ReadingContext, collaboration: etree._Element) -> None:
    """Read the participants and message flows of a collaboration."""
    context.optional_id(collaboration)
    for element in collaboration:
        name = local(element.tag) if element.tag.startswith(BPMN) else ""
        if name == "association":
            read_association(context, element)
        if name not in ("participant", "messageFlow"):
            continue
        identifier = context.optional_id(element)
        read_children(context, element, identifier)
        head = context.head(element, identifier)
        if name == "participant":
            process_id = reference(element.get("processRef", ""))
            context.participants.append(Participant(*head, process_id))
            continue
        source = reference(element.get("sourceRef", ""))
        target = reference(element.get("targetRef", ""))
        message = reference(element.get("messageRef", ""))
        context.message_flows.append((MessageFlow(*head, source, target), message))


def check_collaborations(context: ReadingContext) -> None:
    """Warn of participants, message flows and lanes that refer to nothing."""
    elements = _drawn(context) if context.message_flows or context.lanes else set()
    processes = {process.id for process in context.processes}
    pools = {participant.id for participant in context.participants}
    for participant in context.participants:
        if participant.process_id:
            _check(context, participant, "processRef", participant.process_id, processes)
    for flow, message in context.message_flows:
        for attribute, end in (("sourceRef", flow.source_id), ("targetRef", flow.target_id)):
            if end not in elements and end not in pools:
                _warn(context, flow, attribute, end, elements)
        if message:
            _check(context, flow, "messageRef", message, context.messages)
    for lane in context.lanes:
        for node_id in lane.node_ids:
            if node_id not in elements and node_id not in context.ids:
                _warn(context, lane, "flowNodeRef", node_id, elements)


def _drawn(context: ReadingContext) -> set[str]:
    """Ids of processes, flow nodes and sequence flows."""
    elements: list[Element] = [*context.processes, *context.nodes]
    elements += [ends.flow for ends in context.flows]
    return {element.id for element in elements}


def _check(
    context: ReadingContext, element: Element, attribute: str, name: str, known: Collection[str]
) -> None:
    if name not in known:
        _warn(context, element, attribute, name, known)


def _warn(
    context: ReadingContext, element: Element, attribute: str, name: str, known: Collection[str]
) -> None:
    context.findings.warning(
        element.line,
        element.id,
        DANGLING_REFERENCE,
        f"{attribute} names '{name}', which does not exist" if name else f"it has no {attribute}",
        suggest_or(name, known, "correct it, or delete it; it has no effect on execution"),
    )


def read_lanes(context: ReadingContext, lane_set: etree._Element, process: Process) -> None:
    """Read all lanes of a lane set, outer ones first."""
    stack = [lane_set]
    while stack:
        outer = stack.pop()
        context.optional_id(outer)
        for element in outer.iterchildren(BPMN + "lane"):
            identifier = context.optional_id(element)
            found = read_children(context, element, identifier)
            context.lanes.append(
                Lane(
                    *context.head(element, identifier),
                    process.id,
                    tuple(reference(text_of(each)) for each in found.of("flowNodeRef")),
                )
            )
            stack += found.of("childLaneSet")


def read_property(context: ReadingContext, element: etree._Element) -> None:
    """Keep a correlationProperty; `resolve_correlation` resolves its references."""
    identifier = context.claim(element)
    if identifier:
        context.correlation_properties[identifier] = element


def read_subscription(context: ReadingContext, element: etree._Element, process: Process) -> None:
    """A process's correlationSubscription, kept until all properties are known."""
    for binding in element.iterchildren(BPMN + "correlationPropertyBinding"):
        context.subscriptions.append((process, binding))


def resolve_correlation(context: ReadingContext) -> tuple[CorrelationProperty, ...]:
    """Look up what properties and subscriptions refer to."""
    found = []
    for identifier, element in context.correlation_properties.items():
        retrieve = dict(_retrievals(context, identifier, element))
        found.append(CorrelationProperty(*context.head(element, identifier), retrieve))
    for process, binding in context.subscriptions:
        name = reference(binding.get("correlationPropertyRef", ""))
        if name not in context.correlation_properties:
            _dangling(context, binding, process.id, "correlationPropertyRef", name)
            continue
        expression = _path(context, binding, "dataPath", process.id)
        if expression is not None:
            object.__setattr__(process, "subscription", {**process.subscription, name: expression})
    return tuple(found)


def _retrievals(
    context: ReadingContext, identifier: str, element: etree._Element
) -> Iterator[tuple[str, Expression]]:
    for each in element.iterchildren(BPMN + "correlationPropertyRetrievalExpression"):
        name = reference(each.get("messageRef", ""))
        if name not in context.messages:
            _dangling(context, each, identifier, "messageRef", name)
            continue
        expression = _path(context, each, "messagePath", identifier)
        if expression is not None:
            yield name, expression


def _path(
    context: ReadingContext, element: etree._Element, tag: str, identifier: str
) -> Expression | None:
    for each in element.iterchildren(BPMN + tag):
        if text_of(each):
            return context.expression_in(each, identifier)
    context.findings.error(
        element,
        identifier,
        RETRIEVAL_PATH if tag == "messagePath" else BINDING_PATH,
        f"it has no {tag}, so nothing says by what messages are matched",
        f"write <{tag}>expression</{tag}>",
    )
    return None


def _dangling(
    context: ReadingContext, element: etree._Element, identifier: str, attribute: str, name: str
) -> None:
    if attribute == "messageRef":
        rule, known = RETRIEVAL_MESSAGE, frozenset(context.messages)
    else:
        rule, known = BINDING_PROPERTY, frozenset(context.correlation_properties)
    context.findings.error(
        element,
        identifier,
        rule,
        f"{attribute} names '{name}', which does not exist" if name else f"it has no {attribute}",
        suggest_or(name, known, "name one in definitions"),
    )


End = tuple[str, bool]
"""Of a message flow: the element's id, and whether it is the one that the message comes to."""


def resolve_messages(context: ReadingContext) -> None:
    """Give a message to every event and task that names none."""
    groups = _groups(context)
    uses = {(use.node_id, use.catches): use for use in context.message_uses}
    agreed: dict[int, Message] = {}
    for flow, message_ref in context.message_flows:
        group = groups[flow.source_id, False]
        named = context.messages.get(message_ref)
        for end in ((flow.source_id, False), (flow.target_id, True)):
            use = uses.get(end)
            named = named or (use.message if use else None)
        if named is not None:
            agreed.setdefault(group, named)
    for flow, _ in context.message_flows:
        group = groups[flow.source_id, False]
        ends = ((flow.source_id, False), (flow.target_id, True))
        if group not in agreed and any(end in uses for end in ends):
            identifier = flow.id or f"{flow.source_id}~{flow.target_id}"
            message = Message(identifier, flow.name, flow.line)
            agreed[group] = context.messages.setdefault(identifier, message)
    for use in context.message_uses:
        if use.message is None:
            _assign(context, use, agreed.get(groups.get((use.node_id, use.catches), -1)))


def _groups(context: ReadingContext) -> dict[End, int]:
    """The connected part of the message flows in which each of their ends is; pools join none.

    What comes to an element and what goes out of it are different messages.
    """
    pools = {participant.id for participant in context.participants}
    neighbors: dict[End, list[End]] = {}
    for flow, _ in context.message_flows:
        source, target = (flow.source_id, False), (flow.target_id, True)
        neighbors.setdefault(source, [])
        neighbors.setdefault(target, [])
        if flow.source_id not in pools and flow.target_id not in pools:
            neighbors[source].append(target)
            neighbors[target].append(source)
    return components(neighbors)


def _assign(context: ReadingContext, use: MessageUse, message: Message | None) -> None:
    if message is None:
        context.findings.warning(
            use.line,
            use.node_id,
            MISSING_REFERENCE,
            f"no message is named and no message flow leads {'to' if use.catches else 'from'} it; "
            f"it has a message of its own, with the id '{use.node_id}'",
            "add messageRef, or draw a message flow",
        )
        message = context.messages.setdefault(use.node_id, Message(use.node_id, use.name, use.line))
    if isinstance(use.holder, MessageEventDefinition | ReceiveTask) or use.holder.behavior is None:
        object.__setattr__(use.holder, "message", message)
