"""Random block-structured models: sequences, choices, forks, loops, subprocesses in one another."""

from random import Random

from tests.reference.diagram import WAITING_FOR_START, Event, Is, Level, Node
from tests.reference.drafting import ELEMENTS, Draft, LevelDraft

Block = tuple[str, str]  # where a token comes in, and where it goes out

_BLOCKS = {
    "leaf": 3,
    "sequence": 4,
    "exclusive": 3,
    "parallel": 4,
    "inclusive": 3,
    "loop": 2,
    "subprocess": 4,
    "complex": 2,
    "event_gateway": 2,
    "conditional": 2,
    "link": 1,
}
_LEAVES = {"user": 12, "task": 2, "catch_signal": 2, "throw_signal": 2, "escalation": 1}
_JOINS = {
    "exclusive": {"exclusive": 8, "inclusive": 2, "parallel": 1},
    "parallel": {"parallel": 8, "inclusive": 3, "exclusive": 3},
    "inclusive": {"inclusive": 8, "exclusive": 2, "parallel": 1},
    "complex": {"complex": 1},
}


def random_blocks(dice: Random, elements: frozenset[str] = ELEMENTS, largest: int = 10) -> Level:
    draft = Draft(dice, dice.randint(2, largest), elements)
    return _content(draft, depth=0)


def _content(draft: Draft, depth: int, *, handler: bool = False) -> Level:
    """The inside of the process (depth 0), of a subprocess or of an event subprocess."""
    level = LevelDraft(draft)
    without = depth > 0 and not handler and draft.may("no_start", 25)
    starts = 1 + (draft.may("several_starts", 12) and not handler)
    for number in range(starts):
        entry, leave = _block(level, depth)
        if not without:
            waits = number and depth == 0 and draft.may("typed_start", 50)
            start = Node(draft.name("s"), "start", draft.signal() if waits else None)
            level.connect(level.add(start).id, entry)
        elif any(flow.target == entry for flow in level.flows):
            level.connect(level.add(Node(draft.name("s"), "start")).id, entry)
            without = False
        if draft.chance(80):
            level.connect(leave, level.add(draft.end(inside=depth > 0)).id)
        elif any(node.id == leave and node.kind in ("exclusive",) for node in level.nodes):
            level.connect(leave, level.add(Node(draft.name("e"), "end")).id)
    if draft.may("event_subprocess", 25) and depth < 2 and not handler:
        level.add(draft.handler(_content(draft, depth + 1, handler=True), draft.handled()))
    return level.level()


def _block(level: LevelDraft, depth: int) -> Block:
    draft = level.draft
    draft.budget -= 1
    kind = draft.pick(_BLOCKS) if draft.budget > 0 and depth < 4 else "leaf"
    match kind:
        case "sequence":
            return _sequence(level, _block(level, depth), _block(level, depth))
        case "exclusive" | "parallel" | "inclusive" | "complex":
            return _branches(level, kind, depth)
        case "loop":
            return _loop(level, depth)
        case "subprocess":
            node = Node(draft.name("P"), "subprocess", inside=_content(draft, depth + 1))
            return _guarded(level, level.add(draft.decorated(node)), depth)
        case "event_gateway":
            return _race(level, depth)
        case "conditional":
            return _conditional(level, depth)
        case "link":
            link = Event("link", draft.name("link"))
            there = level.add(Node(draft.name("l"), "catch", link)).id
            here = level.add(Node(draft.name("l"), "throw", link)).id
            first, last = _block(level, depth), _block(level, depth)
            level.connect(first[1], here)
            level.connect(there, last[0])
            return first[0], last[1]
        case _:
            return _leaf(level, depth)


def _sequence(level: LevelDraft, first: Block, last: Block) -> Block:
    level.connect(first[1], last[0])
    return first[0], last[1]


def _leaf(level: LevelDraft, depth: int) -> Block:
    draft = level.draft
    match draft.pick(_LEAVES):
        case "task":
            node = level.add(Node(draft.name("n"), "task"))
        case "catch_signal":
            node = level.add(draft.catcher())
        case "throw_signal" | "escalation":
            node = level.add(draft.thrower())
        case _:
            return _guarded(level, level.add(draft.user()), depth)
    return node.id, node.id


def _guarded(level: LevelDraft, host: Node, depth: int) -> Block:
    """An activity with boundary events, whose ways end by themselves or join its own."""
    draft = level.draft
    leave = host.id
    caught: list[Event] = []
    while draft.may("boundary", 45 if host.kind == "subprocess" else 20) and len(caught) < 2:
        boundary = draft.boundary(host, caught)
        if boundary is None or boundary.event is None:
            break
        caught.append(boundary.event)
        level.add(boundary)
        last = boundary.id
        if draft.chance(60):
            entry, last = _block(level, depth + 1)
            level.connect(boundary.id, entry)
        if draft.chance(60):
            kind = draft.pick({"exclusive": 3, "inclusive": 2, "none": 0 if _joins(draft) else 1})
            if kind != "none":
                merge = level.add(Node(draft.name("g"), kind)).id
                level.connect(last, merge)
                level.connect(leave, merge)
                leave = merge
                continue
        level.connect(last, level.add(draft.end(inside=depth > 0)).id)
    return host.id, leave


def _joins(draft: Draft) -> bool:
    return bool({"exclusive", "inclusive"} & draft.elements)


def _branches(level: LevelDraft, kind: str, depth: int) -> Block:
    draft = level.draft
    splits = kind if kind != "complex" else draft.pick({"parallel": 2, "inclusive": 1, "none": 0})
    ways = draft.dice.randint(2, 3)
    joins = draft.pick({**_JOINS[kind], "none": 0})
    split = level.add(Node(draft.name("g"), splits if splits != "none" else "complex"))
    join = level.add(Node(draft.name("g"), joins, needed=draft.dice.randint(1, ways)))
    default = draft.dice.randrange(ways) if draft.chance(75) else None
    for way in range(ways):
        empty = way and draft.chance(15)
        entry, last = (join.id, split.id) if empty else _block(level, depth + 1)
        conditional = splits in ("exclusive", "inclusive") and way != default
        flow = level.connect(split.id, entry, draft.condition() if conditional else None)
        if splits in ("exclusive", "inclusive") and way == default:
            level.set_default(split.id, flow)
        if empty:
            continue
        if way and draft.chance(12):
            level.connect(last, level.add(draft.end(inside=depth > 0)).id)
        else:
            level.connect(last, join.id)
    if joins != "complex":
        return split.id, join.id
    after = _block(level, depth + 1)
    condition = Is(WAITING_FOR_START, draft.chance(75)) if draft.chance(70) else None
    flow = level.connect(join.id, after[0], condition)
    if condition is not None and not condition.value:
        level.set_default(join.id, level.connect(join.id, level.add(draft.end(inside=False)).id))
    return split.id, after[1]


def _loop(level: LevelDraft, depth: int) -> Block:
    """Back again while the answer to its own task says so."""
    draft = level.draft
    kind = draft.pick({"exclusive": 3, "inclusive": 1, "none": 0 if _joins(draft) else 1})
    if kind == "none":
        return _leaf(level, depth)
    merge = level.add(Node(draft.name("g"), kind)).id
    name = draft.name("U")
    draft.users.append(name)
    task = level.add(Node(name, "user")).id
    body = _sequence(level, (task, task), _block(level, depth + 1))
    split = level.add(Node(draft.name("g"), kind)).id
    level.connect(merge, body[0])
    level.connect(body[1], split)
    level.connect(split, merge, Is(name, "a"))
    after = level.add(Node(draft.name("n"), "task")).id
    level.set_default(split, level.connect(split, after))
    return merge, after


def _race(level: LevelDraft, depth: int) -> Block:
    """An event-based gateway; the ways after its events join, or end."""
    draft = level.draft
    gateway = level.add(Node(draft.name("g"), "event_gateway")).id
    merge = level.add(Node(draft.name("n"), "task")).id
    for _ in range(draft.dice.randint(2, 3)):
        event = level.add(draft.catcher()).id
        level.connect(gateway, event)
        after = _sequence(level, (event, event), _block(level, depth + 1))
        level.connect(after[1], merge)
    return gateway, merge


def _conditional(level: LevelDraft, depth: int) -> Block:
    """Several flows out of a user task, some with conditions; they merge where they like."""
    draft = level.draft
    task = level.add(draft.user()).id
    merge = level.add(Node(draft.name("n"), "task")).id
    for way in range(draft.dice.randint(2, 3)):
        entry, last = _block(level, depth + 1)
        asked = Is(task, draft.dice.choice("ab")) if draft.chance(70) else None
        flow = level.connect(task, entry, asked if way else None)
        if not way and draft.chance(70):
            level.set_default(task, flow)
        level.connect(last, merge)
    return task, merge
