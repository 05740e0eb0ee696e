"""`incoming` and `outgoing` of flow nodes: the flows say it all, but editors look here."""

from lxml import etree

from m2pem.diagram.layout.model import BPMN, Element, children, is_node, local

_BEFORE = ("documentation", "extensionElements", "auditing", "monitoring", "categoryValueRef")


def refer_to_flows(definitions: Element) -> None:
    """Write anew which flows lead to each node, and which away from it, in the file's order."""
    incoming: dict[str, list[str]] = {}
    outgoing: dict[str, list[str]] = {}
    for flow in definitions.iter(f"{{{BPMN}}}sequenceFlow"):
        name = str(flow.get("id"))
        outgoing.setdefault(local(flow.get("sourceRef")), []).append(name)
        incoming.setdefault(local(flow.get("targetRef")), []).append(name)
    for node in [*definitions.iter(etree.Element)]:
        if not is_node(node):
            continue
        for each in [*children(node, "incoming", "outgoing")]:
            node.remove(each)
        place = len([*children(node, *_BEFORE)])
        name = str(node.get("id"))
        wanted = [("incoming", each) for each in incoming.get(name, ())]
        wanted += [("outgoing", each) for each in outgoing.get(name, ())]
        for number, (kind, flow_id) in enumerate(wanted):
            reference = etree.Element(f"{{{BPMN}}}{kind}")
            reference.text = flow_id
            node.insert(place + number, reference)
