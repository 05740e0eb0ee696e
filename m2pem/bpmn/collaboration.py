"""Collaborations and lanes: kept for display, so what is wrong in them is a warning."""

from collections.abc import Collection

from lxml import etree

from m2pem.bpmn.compensation import read_association
from m2pem.bpmn.names import BPMN, local
from m2pem.bpmn.reading import Reading, reference
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.scan import scan
from m2pem.mission.elements import Element
from m2pem.mission.mission import MessageFlow, Participant
from m2pem.mission.near import did_you_mean


def read_collaboration(reading: Reading, collaboration: etree._Element) -> None:
    """Participants and message flows."""
    reading.optional_id(collaboration)
    for element in collaboration:
        name = local(element.tag) if element.tag.startswith(BPMN) else ""
        if name == "association":
            read_association(reading, element)
        if name not in ("participant", "messageFlow"):
            continue
        identifier = reading.optional_id(element)
        scan(reading, element, identifier)
        label = element.get("name", "")
        line = reading.report.line(element)
        if name == "participant":
            process_id = reference(element.get("processRef", ""))
            reading.participants.append(Participant(identifier, label, line, process_id))
            continue
        source = reference(element.get("sourceRef", ""))
        target = reference(element.get("targetRef", ""))
        message = reference(element.get("messageRef", ""))
        reading.message_flows.append(
            (MessageFlow(identifier, label, line, source, target), message)
        )


def check_collaborations(reading: Reading) -> None:
    """Warn of participants, message flows and lanes that refer to nothing."""
    elements = _drawn(reading) if reading.message_flows or reading.lanes else set()
    processes = {process.id for process in reading.processes}
    pools = {participant.id for participant in reading.participants}
    for participant in reading.participants:
        if participant.process_id:
            _check(reading, participant, "processRef", participant.process_id, processes)
    for flow, message in reading.message_flows:
        for attribute, end in (("sourceRef", flow.source_id), ("targetRef", flow.target_id)):
            if end not in elements and end not in pools:
                _warn(reading, flow, attribute, end, elements)
        if message:
            _check(reading, flow, "messageRef", message, reading.messages)
    for lane in reading.lanes:
        for node_id in lane.node_ids:
            if node_id not in elements and node_id not in reading.ids:
                _warn(reading, lane, "flowNodeRef", node_id, elements)


def _drawn(reading: Reading) -> set[str]:
    """Ids of processes, flow nodes and sequence flows."""
    elements: list[Element] = [*reading.processes, *reading.nodes]
    elements += [ends.flow for ends in reading.flows]
    return {element.id for element in elements}


def _check(
    reading: Reading, element: Element, attribute: str, name: str, known: Collection[str]
) -> None:
    if name not in known:
        _warn(reading, element, attribute, name, known)


def _warn(
    reading: Reading, element: Element, attribute: str, name: str, known: Collection[str]
) -> None:
    reading.report.warning(
        element.line,
        element.id,
        DANGLING_REFERENCE,
        f"{attribute} names '{name}', which does not exist" if name else f"it has no {attribute}",
        did_you_mean(name, known, "correct it, or delete it; it has no effect on execution"),
    )
