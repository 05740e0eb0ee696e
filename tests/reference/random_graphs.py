"""Random unstructured models: nodes, and flows between any of them that BPMN allows.

A flow comes to every node from one that was there before, so a start event leads to each; further
flows go anywhere, back too. Every way back passes something that waits, or the model would not end
by itself.
"""

from random import Random

from tests.reference.diagram import WAITING_FOR_START, Event, Is, Level, Node, is_link_target
from tests.reference.drafting import ELEMENTS, Draft, LevelDraft

_NODES = {
    "user": 10,
    "task": 2,
    "exclusive": 4,
    "parallel": 5,
    "inclusive": 5,
    "complex": 2,
    "event_gateway": 2,
    "catch_signal": 2,
    "throw_signal": 2,
    "subprocess": 3,
    "link": 1,
    "none": 2,
}
_CONDITIONAL = ("exclusive", "inclusive", "complex")
_NEEDS_A_WAY_OUT = (
    "start",
    "exclusive",
    "parallel",
    "inclusive",
    "complex",
    "catch",
    "throw",
    "boundary",
)


def random_graph(dice: Random, elements: frozenset[str] = ELEMENTS, largest: int = 9) -> Level:
    draft = Draft(dice, 0, elements)
    return _content(draft, dice.randint(2, largest), 0)


def _content(draft: Draft, size: int, depth: int, *, handler: bool = False) -> Level:
    level = LevelDraft(draft)
    level.add(Node(draft.name("s"), "start"))
    if draft.may("several_starts", 15) and not handler:
        waits = depth == 0 and draft.may("typed_start", 50)
        level.add(Node(draft.name("s"), "start", draft.signal() if waits else None))
    for _ in range(size):
        _add_node(level, depth)
    for _ in range(draft.dice.randint(0, size)):
        _add_flow(level)
    _add_ways_out(level, depth)
    if draft.may("event_subprocess", 20) and depth < 2 and not handler:
        inside = _content(draft, draft.dice.randint(1, 3), depth + 1, handler=True)
        level.add(draft.handler(inside, draft.handled()))
    return level.level()


def _add_node(level: LevelDraft, depth: int) -> None:
    draft = level.draft
    source = draft.dice.choice(_sources(level))
    kind = draft.pick(_NODES if depth < 2 else {**_NODES, "subprocess": 0})
    match kind:
        case "user":
            node = draft.user()
        case "catch_signal":
            node = draft.catcher()
        case "throw_signal":
            node = draft.thrower()
        case "none":
            node = draft.end(inside=depth > 0)
        case "subprocess":
            inside = _content(draft, draft.dice.randint(1, 4), depth + 1)
            node = draft.decorated(Node(draft.name("P"), "subprocess", inside=inside))
        case "link":
            link = Event("link", draft.name("link"))
            node = Node(draft.name("l"), "throw", link)
            level.add(Node(draft.name("l"), "catch", link))
        case "task":
            node = Node(draft.name("n"), "task")
        case _:
            node = Node(draft.name("g"), kind, needed=draft.dice.randint(1, 2))
    _connect(level, source, level.add(node))
    if kind == "event_gateway":
        for _ in range(2):
            level.connect(node.id, level.add(draft.catcher()).id)
    if node.kind in ("user", "subprocess") and draft.may("boundary", 30):
        boundary = draft.boundary(node, ())
        if boundary is not None:
            level.add(boundary)


def _sources(level: LevelDraft) -> list[Node]:
    return [
        node
        for node in level.nodes
        if node.kind not in ("end", "event_gateway", "event_subprocess") and not _throws_link(node)
    ]


def _throws_link(node: Node) -> bool:
    return node.kind == "throw" and node.event is not None and node.event.kind == "link"


def _connect(level: LevelDraft, source: Node, target: Node) -> None:
    draft = level.draft
    condition = None
    if source.kind in _CONDITIONAL and draft.chance(60):
        condition = draft.condition()
        if source.kind == "complex" and draft.chance(60):
            condition = Is(WAITING_FOR_START, draft.chance(70))
    elif source.kind in ("user", "subprocess") and draft.may("conditional", 15):
        condition = draft.condition()
    level.connect(source.id, target.id, condition)


def _add_flow(level: LevelDraft) -> None:
    draft = level.draft
    behind_gateways = {
        flow.target
        for flow in level.flows
        if any(n.id == flow.source and n.kind == "event_gateway" for n in level.nodes)
    }
    targets = [
        node
        for node in level.nodes
        if node.kind not in ("start", "boundary", "event_subprocess")
        and not is_link_target(node)
        and node.id not in behind_gateways
    ]
    source, target = draft.dice.choice(_sources(level)), draft.dice.choice(targets)
    known = any(f.source == source.id and f.target == target.id for f in level.flows)
    if not known and not _leads_at_once(level, target.id, source.id):
        _connect(level, source, target)


def _leads_at_once(level: LevelDraft, source: str, target: str) -> bool:
    """Whether a token could go from one node to another without waiting anywhere."""
    nodes = {node.id: node for node in level.nodes}
    seen: set[str] = set()
    todo = [source]
    while todo:
        name = todo.pop()
        node = nodes[name]
        if name in seen or (node.kind in ("user", "catch") and node.repeat is None):
            continue
        if name == target:
            return True
        seen.add(name)
        ways = {name} | {b.id for b in level.nodes if b.attached_to == name}
        todo += [flow.target for flow in level.flows if flow.source in ways]
        if _throws_link(node):
            todo += [n.id for n in level.nodes if is_link_target(n) and n.event == node.event]
    return False


def _add_ways_out(level: LevelDraft, depth: int) -> None:
    """What may not be the last on its way gets an end event; some of the flows become defaults."""
    draft = level.draft
    for node in list(level.nodes):
        out = [flow for flow in level.flows if flow.source == node.id]
        if not out and node.kind in _NEEDS_A_WAY_OUT and not _throws_link(node):
            level.connect(node.id, level.add(draft.end(inside=depth > 0)).id)
        conditional = [flow for flow in out if flow.condition is not None]
        if conditional and draft.chance(70):
            plain = [flow for flow in out if flow.condition is None]
            end = Node(draft.name("e"), "end")
            default = plain[0] if plain else level.connect(node.id, level.add(end).id)
            level.set_default(node.id, default)
