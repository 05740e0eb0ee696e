"""What both generators of random models share: the elements they may use, and a level being drawn.

`ELEMENTS` is the switch: models are made of those that are named in it, and of user tasks, none
start and end events, which every model has.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from random import Random

from tests.reference.diagram import Event, Flow, Is, Level, Loop, Many, Node

ELEMENTS = frozenset(
    {
        "task",  # a task that does nothing
        "exclusive",
        "parallel",
        "inclusive",
        "complex",
        "event_gateway",
        "conditional",  # conditional and default flows out of an activity
        "several_starts",
        "typed_start",  # a start event of the process that waits for a signal
        "no_start",  # a subprocess that begins where no flow comes in
        "subprocess",
        "terminate",
        "error",
        "escalation",
        "throw_signal",
        "catch_signal",
        "boundary",
        "link",
        "quantity",  # startQuantity and completionQuantity
        "standard_loop",
        "multi_instance",
        "event_subprocess",
    }
)
SIGNALS = ("go", "stop", "turn")
ERRORS = ("E1", "E2")
ESCALATIONS = ("X1", "X2")


@dataclass
class Draft:
    """A model being made. `budget`: how many blocks or nodes may still come."""

    dice: Random
    budget: int
    elements: frozenset[str] = ELEMENTS
    numbers: dict[str, int] = field(default_factory=dict)
    users: list[str] = field(default_factory=list)

    def name(self, prefix: str) -> str:
        self.numbers[prefix] = self.numbers.get(prefix, 0) + 1
        return f"{prefix}{self.numbers[prefix]}"

    def chance(self, percent: int) -> bool:
        return self.dice.randrange(100) < percent

    def may(self, element: str, percent: int) -> bool:
        """Whether to use an element now, if it may be used at all."""
        return self.chance(percent) and element in self.elements

    def pick(self, weights: dict[str, int]) -> str:
        """One of these by weight; a name that is an element must be switched on."""
        known = {each: n for each, n in weights.items() if each in self.elements or each in _FREE}
        return self.dice.choices(list(known), list(known.values()))[0]

    def condition(self) -> Is:
        return Is(self.dice.choice(self.users or ["U1"]), self.dice.choice("ab"))

    def signal(self) -> Event:
        return Event("signal", self.dice.choice(SIGNALS))

    # --- nodes ----------------------------------------------------------------------------------

    def user(self) -> Node:
        name = self.name("U")
        self.users.append(name)
        return self.decorated(Node(name, "user"))

    def decorated(self, node: Node) -> Node:
        """An activity, perhaps repeating, perhaps with quantities."""
        repeat: Loop | Many | None = None
        if self.may("standard_loop", 8):
            maximum = self.dice.choice((None, 2, 3))
            asked = Is(node.id, "a") if node.kind == "user" else self.condition()
            repeat = Loop(asked, self.chance(30), maximum if node.kind == "user" else 2)
        elif self.may("multi_instance", 8):
            count = self.dice.choice((0, 1, 2, 2, 2, 3))
            enough = self.dice.choice((None, None, 1, 2))
            repeat = Many(count, self.chance(40), enough)
        start = 2 if self.may("quantity", 4) else 1
        completion = 2 if self.may("quantity", 4) else 1
        return replace(node, repeat=repeat, start_quantity=start, completion_quantity=completion)

    def end(self, *, inside: bool) -> Node:
        kind = self.pick(
            {"none": 12, "terminate": 3, "error": 3, "escalation": 2, "throw_signal": 3}
        )
        if kind == "error" and not inside and self.chance(60):
            kind = "none"  # it would only fail the run
        events = {
            "terminate": Event("terminate"),
            "error": Event("error", self.dice.choice(ERRORS)),
            "escalation": Event("escalation", self.dice.choice(ESCALATIONS)),
            "throw_signal": self.signal(),
        }
        return Node(self.name("e"), "end", events.get(kind))

    def thrower(self) -> Node:
        """An intermediate throw event."""
        kind = self.pick({"throw_signal": 3, "escalation": 2, "none": 0 if self.throws() else 1})
        event = {
            "throw_signal": self.signal(),
            "escalation": Event("escalation", self.dice.choice(ESCALATIONS)),
        }.get(kind)
        return Node(self.name("i"), "throw", event)

    def throws(self) -> bool:
        return bool({"throw_signal", "escalation"} & self.elements)

    def catcher(self) -> Node:
        return Node(self.name("c"), "catch", self.signal())

    def boundary(self, host: Node, taken: Sequence[Event]) -> Node | None:
        """A boundary event that no other one of its activity could be taken for."""
        kind = self.pick({"throw_signal": 0, "none": 4, "error": 2, "escalation": 2})
        if host.kind != "subprocess":
            kind = "none"
        event = self.signal()
        if kind != "none":
            names = ERRORS if kind == "error" else ESCALATIONS
            event = Event(kind, self.dice.choice((*names, None)))
        for other in taken:
            if other.kind == event.kind and (None in (other.name, event.name) or other == event):
                return None
        interrupting = event.kind == "error" or self.chance(50)
        return Node(
            self.name("b"), "boundary", event, attached_to=host.id, interrupting=interrupting
        )

    def handler(self, inside: Level, event: Event) -> Node:
        """An event subprocess around `inside`, whose only start event is made typed here."""
        start = next(node for node in inside.nodes if node.kind == "start")
        interrupting = event.kind == "error" or self.chance(50)
        typed = replace(start, event=event, interrupting=interrupting)
        nodes = tuple(typed if node is start else node for node in inside.nodes)
        return Node(self.name("H"), "event_subprocess", inside=Level(nodes, inside.flows))

    def handled(self) -> Event:
        kind = self.pick({"none": 4, "error": 2, "escalation": 2})
        names = {"error": ERRORS, "escalation": ESCALATIONS}.get(kind)
        return Event(kind, self.dice.choice((*names, None))) if names else self.signal()


_FREE = ("none", "leaf", "user", "sequence", "loop")


@dataclass
class LevelDraft:
    """Nodes and flows of a process or subprocess."""

    draft: Draft
    nodes: list[Node] = field(default_factory=list)
    flows: list[Flow] = field(default_factory=list)

    def add(self, node: Node) -> Node:
        self.nodes.append(node)
        return node

    def connect(self, source: str, target: str, condition: Is | None = None) -> Flow:
        flow = Flow(self.draft.name("f"), source, target, condition)
        self.flows.append(flow)
        return flow

    def set_default(self, node_id: str, flow: Flow) -> None:
        place = next(n for n, node in enumerate(self.nodes) if node.id == node_id)
        self.nodes[place] = replace(self.nodes[place], default=flow.id)

    def level(self) -> Level:
        return Level(tuple(self.nodes), tuple(self.flows))
