"""A neutral description of a BPMN model: what the reference plays, and what is written as XML.

Only what the token game needs. The order of `Level.flows` is the order in the file.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

TASKS = ("task", "user")
ACTIVITIES = (*TASKS, "subprocess")
GATEWAYS = ("exclusive", "parallel", "inclusive", "complex", "event_gateway")
WAITING_FOR_START = "waitingForStart"


@dataclass(frozen=True, slots=True)
class Is:
    """The condition that `name` has `value`: the last answer to the user task of that name."""

    name: str
    value: str | bool


@dataclass(frozen=True, slots=True)
class Flow:
    id: str
    source: str
    target: str
    condition: Is | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """`kind` is signal, error, escalation, link or terminate; `name` None catches every one."""

    kind: str
    name: str | None = None


@dataclass(frozen=True, slots=True)
class Loop:
    """Standard loop (10.3.8): goes on while the condition is true, `maximum` times at most."""

    condition: Is
    before: bool
    maximum: int | None


@dataclass(frozen=True, slots=True)
class Many:
    """Multi-instance (10.3.8); it completes early when `enough` of its instances have."""

    count: int
    sequential: bool
    enough: int | None


@dataclass(frozen=True)
class Node:
    """`kind` is start, end, catch, throw, boundary, event_subprocess, an activity or a gateway."""

    id: str
    kind: str
    event: Event | None = None
    default: str | None = None
    inside: "Level | None" = None
    attached_to: str | None = None
    interrupting: bool = True
    repeat: Loop | Many | None = None
    start_quantity: int = 1
    completion_quantity: int = 1
    needed: int = 1  # a complex gateway's: that many of its incoming flows have a token


@dataclass(frozen=True)
class Level:
    """The content of a process or of a subprocess."""

    nodes: tuple[Node, ...]
    flows: tuple[Flow, ...]

    @cached_property
    def by_id(self) -> dict[str, Node]:
        return {node.id: node for node in self.nodes}

    @cached_property
    def flow_by_id(self) -> dict[str, Flow]:
        return {flow.id: flow for flow in self.flows}

    @cached_property
    def incoming(self) -> dict[str, tuple[Flow, ...]]:
        return {n.id: tuple(f for f in self.flows if f.target == n.id) for n in self.nodes}

    @cached_property
    def outgoing(self) -> dict[str, tuple[Flow, ...]]:
        return {n.id: tuple(f for f in self.flows if f.source == n.id) for n in self.nodes}

    @cached_property
    def entries(self) -> dict[str, tuple[str, ...]]:
        """The flows into each node; one that has none gets the tokens born at it by `birth`."""
        return {
            n.id: tuple(f.id for f in self.incoming[n.id]) or (birth(n.id),) for n in self.nodes
        }

    @cached_property
    def targets(self) -> dict[str, str]:
        """The node that each flow, drawn or of birth, leads to."""
        return {flow: node for node, flows in self.entries.items() for flow in flows}

    @cached_property
    def boundaries(self) -> dict[str, tuple[Node, ...]]:
        return {n.id: tuple(b for b in self.nodes if b.attached_to == n.id) for n in self.nodes}

    @cached_property
    def reachable(self) -> dict[tuple[tuple[str, ...], str], frozenset[str]]:
        """Memory of `tests.reference.joins`: flows reached from some, without visiting a node."""
        return {}

    @cached_property
    def handlers(self) -> tuple[Node, ...]:
        """The event subprocesses."""
        return tuple(node for node in self.nodes if node.kind == "event_subprocess")

    @cached_property
    def begins(self) -> tuple[Node, ...]:
        """Where tokens are born when an instance begins (10.5.2, 13.3.4)."""
        starts = tuple(node for node in self.nodes if node.kind == "start")
        return starts or tuple(
            node
            for node in self.nodes
            if not self.incoming[node.id]
            and node.kind not in ("boundary", "event_subprocess")
            and not is_link_target(node)
        )


def birth(node_id: str) -> str:
    """The flow, drawn nowhere, on which tokens come to a node that has no incoming flow."""
    return f"*{node_id}"


def is_link_target(node: Node) -> bool:
    return node.kind == "catch" and node.event is not None and node.event.kind == "link"


def start_of(handler: Node) -> Node:
    """The start event of an event subprocess: it has exactly one (10.3.5)."""
    assert handler.inside is not None
    return next(node for node in handler.inside.nodes if node.kind == "start")


def levels(level: Level) -> Iterator[Level]:
    """This level and all those inside."""
    yield level
    for node in level.nodes:
        if node.inside is not None:
            yield from levels(node.inside)


def all_nodes(level: Level) -> Iterator[Node]:
    for each in levels(level):
        yield from each.nodes
