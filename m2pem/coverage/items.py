"""Coverage items: what of a mission scenarios may see, and what the records of a run show of it.

An item is an element, a sequence flow, an end event, an event that catches something (a boundary
event, the start event of an event subprocess), or an error that no event catches and that ends the
run. Which of those errors can occur, the diagram does not say: the checker does
(`m2pem.coverage.reach`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from m2pem.engine import records as r
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission


class Kind(StrEnum):
    """The kind of an item. The values are those of `m2pem test --format json`."""

    ELEMENT = "element"
    FLOW = "flow"
    END = "end"
    EVENT = "event"
    ERROR = "error"


PLURALS = {
    Kind.ELEMENT: "elements",
    Kind.FLOW: "sequence flows",
    Kind.END: "end events",
    Kind.EVENT: "boundary and start events",
    Kind.ERROR: "uncaught errors",
}


@dataclass(frozen=True, slots=True)
class Item:
    """An item. `id`: of the element or flow, or the code of the error. `label`: for people; it
    contains the id. `line`: of `file`; 0 for an error."""

    kind: Kind
    id: str
    label: str
    file: str = ""
    line: int = 0

    @property
    def key(self) -> str:
        """What distinguishes it from other items of the mission."""
        return error_key(self.id) if self.kind is Kind.ERROR else self.id


def error_key(code: str) -> str:
    """Return the key of an error that ends the run. No element has such an id (XML: NCName)."""
    return f"error {code}"


def error_item(code: str) -> Item:
    """Return the item of an error that ends the run."""
    return Item(Kind.ERROR, code, f"error {code}, uncaught")


def items_of(mission: Mission) -> list[Item]:
    """Return all items that the diagram has, in the order of the XML, flows after nodes."""
    nodes = [
        Item(_kind(node), node.id, _label(node), mission.file_of(node), node.line)
        for node in mission.nodes
        if not e.undoes(node)
    ]
    flows = [
        Item(Kind.FLOW, flow.id, _flow_label(flow), mission.file_of(flow.source), flow.line)
        for flow in mission.flows
    ]
    return nodes + flows


def _kind(node: e.FlowNode) -> Kind:
    if isinstance(node, e.EndEvent):
        return Kind.END
    catches = isinstance(node, e.StartEvent) and (
        isinstance(node.container, e.SubProcess) and node.container.triggered_by_event
    )
    return Kind.EVENT if catches or isinstance(node, e.BoundaryEvent) else Kind.ELEMENT


def _label(node: e.FlowNode) -> str:
    name = " ".join(node.name.split())
    return f"{node.kind} {node.id}" + (f" '{name}'" if name else "")


def _flow_label(flow: e.SequenceFlow) -> str:
    return f"flow {flow.id} ({flow.source.id} to {flow.target.id})"


def seen_in(records: Iterable[r.Record]) -> frozenset[str]:
    """Return the keys of all items that a run has reached, by its records."""
    seen: set[str] = set()
    awaited: dict[int, str] = {}
    last: r.ErrorThrown | None = None
    for record in records:
        match record:
            case r.EventAwaited(wait=wait, element=element):
                awaited[wait] = element
            case r.EventTriggered(wait=wait):
                seen.add(awaited.get(wait, ""))
            case r.FlowTaken(flow=flow):
                seen.add(flow)
            case r.TokenEntered(element=element) | r.GatewayActivated(element=element):
                seen.add(element)
            case r.ErrorThrown() | r.EscalationThrown():
                seen.add(record.caught_by)
                if isinstance(record, r.ErrorThrown):
                    last = record
            case r.CompensationBegan(activity=activity):
                seen.add(activity)
            case r.RunEnded(outcome=r.RunOutcome.FAILED) if last and not last.caught_by:
                seen.add(error_key(last.code))
            case _:
                pass
    return frozenset(seen - {""})
