"""Which message an event sends or receives when only message flows say so.

Diagrams of several pools often draw the message flow and name no message. Places that message
flows join then share one message: the one that any of them or of the flows names, else one that
is made up, with the id of the first flow.
"""

from m2pem.bpmn.reading import MessageUse, Reading
from m2pem.bpmn.rules.events import MISSING_REFERENCE
from m2pem.mission.elements import ReceiveTask
from m2pem.mission.events import Message, MessageEventDefinition

End = tuple[str, bool]
"""Of a message flow: the element's id, and whether it is the one that the message comes to."""


def resolve_messages(reading: Reading) -> None:
    """Give a message to every event and task that names none."""
    groups = _groups(reading)
    uses = {(use.node_id, use.catches): use for use in reading.message_uses}
    agreed: dict[int, Message] = {}
    for flow, message_ref in reading.message_flows:
        group = groups[flow.source_id, False]
        named = reading.messages.get(message_ref)
        for end in ((flow.source_id, False), (flow.target_id, True)):
            use = uses.get(end)
            named = named or (use.message if use else None)
        if named is not None:
            agreed.setdefault(group, named)
    for flow, _ in reading.message_flows:
        group = groups[flow.source_id, False]
        ends = ((flow.source_id, False), (flow.target_id, True))
        if group not in agreed and any(end in uses for end in ends):
            identifier = flow.id or f"{flow.source_id}~{flow.target_id}"
            message = Message(identifier, flow.name, flow.line)
            agreed[group] = reading.messages.setdefault(identifier, message)
    for use in reading.message_uses:
        if use.message is None:
            _assign(reading, use, agreed.get(groups.get((use.node_id, use.catches), -1)))


def _groups(reading: Reading) -> dict[End, int]:
    """The connected part of the message flows in which each of their ends is; pools join none.

    What comes to an element and what goes out of it are different messages.
    """
    pools = {participant.id for participant in reading.participants}
    neighbors: dict[End, list[End]] = {}
    for flow, _ in reading.message_flows:
        source, target = (flow.source_id, False), (flow.target_id, True)
        neighbors.setdefault(source, [])
        neighbors.setdefault(target, [])
        if flow.source_id not in pools and flow.target_id not in pools:
            neighbors[source].append(target)
            neighbors[target].append(source)
    groups: dict[End, int] = {}
    for number, start in enumerate(neighbors):
        waiting = [start]
        while waiting:
            end = waiting.pop()
            if end not in groups:
                groups[end] = number
                waiting += neighbors[end]
    return groups


def _assign(reading: Reading, use: MessageUse, message: Message | None) -> None:
    if message is None:
        reading.report.warning(
            use.line,
            use.node_id,
            MISSING_REFERENCE,
            f"no message is named and no message flow leads {'to' if use.catches else 'from'} it; "
            f"it has a message of its own, with the id '{use.node_id}'",
            "add messageRef, or draw a message flow",
        )
        message = reading.messages.setdefault(use.node_id, Message(use.node_id, use.name, use.line))
    if isinstance(use.holder, MessageEventDefinition | ReceiveTask) or use.holder.behavior is None:
        object.__setattr__(use.holder, "message", message)
