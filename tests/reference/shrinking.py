"""Making a model that shows a difference as small as it can be."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from tests.reference.diagram import Flow, Level, Node


def shrunk(model: Level, shows: Callable[[Level], bool]) -> Level:
    """A model none of whose simplifications `shows` what this one does."""
    simpler: Level | None = model
    while simpler is not None:
        model = simpler
        simpler = next((each for each in simplifications(model) if shows(each)), None)
    return model


def simplifications(level: Level) -> Iterator[Level]:
    """Models with one thing less, the boldest first."""
    for node in level.nodes:
        yield _without(level, node)
        if len(level.incoming[node.id]) == 1 and level.outgoing[node.id]:
            yield _bypassed(level, node)
    for node in level.nodes:
        for simple in _simpler_nodes(node):
            yield replace(level, nodes=_swapped(level.nodes, node, simple))
    for flow in level.flows:
        yield _without_flow(level, flow)
        if flow.condition is not None:
            plain = replace(flow, condition=None)
            flows = tuple(plain if each is flow else each for each in level.flows)
            yield replace(level, flows=flows)


def _swapped(nodes: tuple[Node, ...], old: Node, new: Node) -> tuple[Node, ...]:
    return tuple(new if each is old else each for each in nodes)


def _without(level: Level, node: Node) -> Level:
    gone = {node.id} | {boundary.id for boundary in level.boundaries[node.id]}
    kept = tuple(f for f in level.flows if f.source not in gone and f.target not in gone)
    nodes = tuple(each for each in level.nodes if each.id not in gone)
    return _tidy(Level(nodes, kept))


def _bypassed(level: Level, node: Node) -> Level:
    """Without a node: the flow that led to it leads to where its first one led."""
    before, after = level.incoming[node.id][0], level.outgoing[node.id][0]
    if before.target == after.target:
        return _without(level, node)
    short = replace(before, target=after.target)
    flows = tuple(short if each is before else each for each in level.flows)
    return _without(replace(level, flows=flows), node)


def _without_flow(level: Level, flow: Flow) -> Level:
    return _tidy(replace(level, flows=tuple(each for each in level.flows if each is not flow)))


def _tidy(level: Level) -> Level:
    """No default that is not there any more."""
    flows = {flow.id for flow in level.flows}
    nodes = tuple(
        replace(node, default=None) if node.default and node.default not in flows else node
        for node in level.nodes
    )
    return replace(level, nodes=nodes)


def _simpler_nodes(node: Node) -> Iterator[Node]:
    if node.kind == "subprocess":
        yield replace(node, kind="user", inside=None)
    if node.kind == "user" and node.repeat is None:
        yield replace(node, kind="task")
    if node.kind in ("complex", "inclusive"):
        yield replace(node, kind="parallel", default=None)
        yield replace(node, kind="exclusive")
    if node.kind in ("end", "throw", "start") and node.event is not None:
        yield replace(node, event=None)
    if node.repeat is not None:
        yield replace(node, repeat=None)
    if node.default is not None:
        yield replace(node, default=None)
    if (node.start_quantity, node.completion_quantity) != (1, 1):
        yield replace(node, start_quantity=1, completion_quantity=1)
    if node.inside is not None:
        for inside in simplifications(node.inside):
            yield replace(node, inside=inside)
