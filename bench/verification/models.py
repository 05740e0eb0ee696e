"""BPMN files of parallel branches, of which all checkers are given the same bytes.

Tasks are user tasks: they take time, so that those of different branches come in any order.
"""

from itertools import pairwise

from bench.graphs import file

SHAPES = ("plain", "timer", "error", "failures")
"""`timer`: all branches are in a subprocess that a timer interrupts; `error`: in one that an error
end event in one more branch interrupts; `failures`: the tasks are services, and each of them that
fails interrupts."""

TASK = (
    '<extensionElements><m2pem:prompt>?</m2pem:prompt><m2pem:decision value="done"/>'
    "</extensionElements>"
)


SERVICE = '<extensionElements><m2pem:service class="Detector"/></extensionElements>'


def branches(count: int, tasks: int, shape: str = "plain") -> str:
    """A file with so many branches of so many tasks each, t0_0 and so on."""
    drawing = _Drawing()
    drawing.node("startEvent", "s")
    drawing.node("parallelGateway", "fork")
    drawing.flow("s", "fork")
    drawing.node("parallelGateway", "join")
    for number in range(count):
        row = [f"t{number}_{place}" for place in range(tasks)]
        for name in row:
            if shape == "failures":
                drawing.node("serviceTask", name, SERVICE)
            else:
                drawing.node("userTask", name, TASK)
        for one, other in pairwise(["fork", *row, "join"]):
            drawing.flow(one, other)
    if shape == "error":
        _perhaps_an_error(drawing)
    drawing.node("endEvent", "e")
    drawing.flow("join", "e")
    inside = drawing.text()
    if shape != "plain":
        inside = _around(inside, shape)
    return file(f'<process id="BENCH" isExecutable="true">{inside}</process>').decode()


def _perhaps_an_error(drawing: "_Drawing") -> None:
    """A branch that goes to the join, or ends with an error."""
    timer = "<timerEventDefinition><timeDuration>PT{}M</timeDuration></timerEventDefinition>"
    drawing.node("eventBasedGateway", "which")
    drawing.node("intermediateCatchEvent", "good", timer.format(1))
    drawing.node("intermediateCatchEvent", "bad", timer.format(2))
    drawing.node("endEvent", "error", "<errorEventDefinition/>")
    for one, other in (("fork", "which"), ("which", "good"), ("which", "bad"), ("bad", "error")):
        drawing.flow(one, other)
    drawing.flow("good", "join")


def _around(inside: str, shape: str) -> str:
    event = (
        "<timerEventDefinition><timeDuration>PT5M</timeDuration></timerEventDefinition>"
        if shape == "timer"
        else "<errorEventDefinition/>"
    )
    drawing = _Drawing("w")
    drawing.node("startEvent", "S")
    drawing.node("subProcess", "SUB", inside)
    drawing.node("endEvent", "E")
    drawing.node("boundaryEvent", "B", event, ' attachedToRef="SUB"')
    drawing.node("endEvent", "EB")
    for one, other in (("S", "SUB"), ("SUB", "E"), ("B", "EB")):
        drawing.flow(one, other)
    return drawing.text()


class _Drawing:
    """Elements and flows, with `incoming` and `outgoing` as editors write them."""

    def __init__(self, flows: str = "f") -> None:
        """`flows`: what the ids of flows begin with."""
        self._letter = flows
        self._nodes: dict[str, tuple[str, str, str]] = {}
        self._flows: list[tuple[str, str]] = []

    def node(self, kind: str, name: str, inside: str = "", attributes: str = "") -> None:
        self._nodes[name] = (kind, inside, attributes)

    def flow(self, source: str, target: str) -> None:
        self._flows.append((source, target))

    def text(self) -> str:
        ends: dict[str, list[str]] = {name: [] for name in self._nodes}
        flows = ""
        for number, (source, target) in enumerate(self._flows):
            name = f"{self._letter}{number}"
            ends[source].append(f"<outgoing>{name}</outgoing>")
            ends[target].insert(0, f"<incoming>{name}</incoming>")
            flows += f'<sequenceFlow id="{name}" sourceRef="{source}" targetRef="{target}"/>'
        return "".join(map(self._node, ends, ends.values())) + flows

    def _node(self, name: str, ends: list[str]) -> str:
        kind, inside, attributes = self._nodes[name]
        # The order of the standard: extensions, then flows, then what the element itself holds.
        before, inside = (inside, "") if inside.startswith("<extension") else ("", inside)
        flows = "".join(sorted(ends))
        return f'<{kind} id="{name}"{attributes}>{before}{flows}{inside}</{kind}>'
