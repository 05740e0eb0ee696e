"""What can be laid out of a file that may be unfinished: without what leads nowhere."""

from lxml import etree

from m2pem.diagram.layout.model import Element, children, flow_nodes, is_node, local, name_of, tag


def keep_sound(definitions: Element) -> None:
    """Remove flows between what is not beside each other, and what hangs on nothing."""
    for container in [*definitions.iter(etree.Element)]:
        if tag(container) == "collaboration":
            _keep_flows_between_pools(container, definitions)
        elif tag(container):
            _keep_within(container)


def _keep_within(container: Element) -> None:
    nodes = {name_of(each) for each in flow_nodes(container)}
    for event in [*children(container, "boundaryEvent")]:
        if local(event.get("attachedToRef")) in nodes:
            nodes.add(name_of(event))
        else:
            container.remove(event)
    events = {name_of(each) for each in children(container, "boundaryEvent")}
    for flow in [*children(container, "sequenceFlow")]:
        ends = local(flow.get("sourceRef")), local(flow.get("targetRef"))
        if ends[0] not in nodes or ends[1] not in nodes - events:
            container.remove(flow)


def _keep_flows_between_pools(collaboration: Element, definitions: Element) -> None:
    pools = [*children(collaboration, "participant")]
    known = {name_of(each) for each in pools}
    shown = {local(each.get("processRef")) for each in pools}
    for process in children(definitions, "process"):
        if name_of(process) in shown:
            known |= {name_of(each) for each in process.iter(etree.Element) if is_node(each)}
    for flow in [*children(collaboration, "messageFlow")]:
        if not {local(flow.get("sourceRef")), local(flow.get("targetRef"))} <= known:
            collaboration.remove(flow)
