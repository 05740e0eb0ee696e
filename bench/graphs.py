"""The BPMN files that every engine is given, and what must have come of them at the end.

Scripts (`n = n + 1`) and conditions (`n < 7`) are the same text in the languages of all engines, so
all get the same bytes. Ids of tasks begin with "t", those of nothing else do.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
    ' xmlns:m2pem="https://m2pem.org/schema/1" id="bench" targetNamespace="bench">'
)


@dataclass(frozen=True, slots=True)
class Flow:
    """A sequence flow; `condition` is the text of its expression, `id` "" any id."""

    source: str
    target: str
    condition: str = ""
    id: str = ""


@dataclass(frozen=True, slots=True)
class Graph:
    """A process of script tasks. An instance is begun with `given`, and ends with `expected`.

    `tasks`: how often tasks are entered in an instance; `elements`: elements of all kinds, a join
    once.
    """

    xml: bytes
    given: dict[str, int]
    expected: dict[str, int]
    tasks: int
    elements: int
    instances: int = 1


def row(size: int) -> Graph:
    """`size` script tasks, one after the other."""
    names = [f"t{number}" for number in range(size)]
    nodes = [("start", "startEvent"), *((name, "n") for name in names), ("end", "endEvent")]
    flows = path("start", *names, "end")
    return Graph(document(nodes, flows), {"n": 0}, {"n": size}, size, size + 2)


def loop(size: int) -> Graph:
    """A script task that an exclusive gateway sends `size` tokens through, one after the other."""
    nodes = [("start", "startEvent"), ("t", "n"), ("x", "exclusive"), ("end", "endEvent")]
    flows = [
        *path("start", "t", "x"),
        Flow("x", "t", f"n < {size}"),
        Flow("x", "end", id="default"),
    ]
    return Graph(document(nodes, flows), {"n": 0}, {"n": size}, size, 2 * size + 2)


def branches(size: int) -> Graph:
    """A parallel gateway with `size` branches of one script task, and its join."""
    names = [f"t{number}" for number in range(size)]
    nodes = [("start", "startEvent"), ("fork", "parallel"), ("join", "parallel")]
    nodes += [*((name, "done") for name in names), ("end", "endEvent")]
    flows = [*path("start", "fork"), *path("join", "end")]
    flows += [flow for name in names for flow in path("fork", name, "join")]
    # Not a sum: engines whose branches have data of their own would each be right in another way.
    return Graph(document(nodes, flows), {"done": 0}, {"done": 1}, size, size + 4)


def instances(size: int) -> Graph:
    """`size` instances of a process of 20 elements, two branches and a choice among them."""
    left, right = ([f"t{side}{number}" for number in range(4)] for side in "ab")
    nodes = [("start", "startEvent"), ("t1", "n"), ("fork", "parallel")]
    nodes += [*((name, "a") for name in left), *((name, "b") for name in right)]
    nodes += [("join", "parallel"), ("t2", "n"), ("x", "exclusive"), ("t3", "n")]
    nodes += [("t4", "n"), ("t5", "n"), ("t6", "n"), ("t7", "n"), ("end", "endEvent")]
    flows = [*path("start", "t1", "fork", *left, "join"), *path("fork", *right, "join")]
    flows += [*path("join", "t2", "x"), Flow("x", "t3", "n < 0")]
    flows += [Flow("x", "t4", id="default"), *path("t3", "t4", "t5", "t6", "t7", "end")]
    expected = {"n": 6, "a": 1, "b": 1}
    # Of its 20 elements, the task on the way that is not chosen is never entered.
    return Graph(document(nodes, flows), {"n": 0}, expected, 14, 19, size)


GRAPHS = {"row": row, "loop": loop, "branches": branches, "instances": instances}


def path(*names: str) -> list[Flow]:
    """Flows from each element to the next."""
    return [Flow(a, b) for a, b in pairwise(names)]


def document(nodes: Iterable[tuple[str, str]], flows: Iterable[Flow]) -> bytes:
    """A file of one process, BENCH, with `incoming` and `outgoing` as editors write them.

    `nodes`: ids with "startEvent", "endEvent", "userTask", "parallel" or "exclusive" for gateways,
    or the variable that a script task sets to 1 ("n": counts up).
    """
    # Short: with long ids, a row of 100,000 is more than the 20 MiB that m2pem reads.
    flows = [replace(flow, id=flow.id or f"f{number}") for number, flow in enumerate(flows)]
    ends: dict[str, list[str]] = {}
    for flow in flows:
        ends.setdefault(flow.source, []).append(f"<outgoing>{flow.id}</outgoing>")
        ends.setdefault(flow.target, []).insert(0, f"<incoming>{flow.id}</incoming>")
    parts = [_node(name, kind, "".join(sorted(ends[name]))) for name, kind in nodes]
    parts += [_flow(flow) for flow in flows]
    return file(f'<process id="BENCH" isExecutable="true">{"".join(parts)}</process>')


def file(body: str) -> bytes:
    """A BPMN file around root elements."""
    return f"{HEAD}{body}</definitions>".encode()


def _node(name: str, kind: str, ends: str) -> str:
    if kind in ("startEvent", "endEvent", "userTask"):
        return f'<{kind} id="{name}">{ends}</{kind}>'
    if kind in ("parallel", "exclusive"):
        default = ' default="default"' if kind == "exclusive" else ""
        return f'<{kind}Gateway id="{name}"{default}>{ends}</{kind}Gateway>'
    script = "n = n + 1" if kind == "n" else f"{kind} = 1"
    return f'<scriptTask id="{name}">{ends}<script>{script}</script></scriptTask>'


def _flow(flow: Flow) -> str:
    condition = flow.condition.replace("<", "&lt;")
    inside = condition and (
        f'<conditionExpression xsi:type="tFormalExpression">{condition}</conditionExpression>'
    )
    ends = f'id="{flow.id}" sourceRef="{flow.source}" targetRef="{flow.target}"'
    return f"<sequenceFlow {ends}>{inside}</sequenceFlow>"
