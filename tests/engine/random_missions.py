"""Random missions in the tests' notation.

`structured`: blocks within blocks (sequence, choice, fork, loop, link, subprocess, call), each
entered and left by one token, so that no token can get stuck, with event subprocesses beside them.
`graph`: anything that the reader takes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

CONDITIONS = ("a < 2", "b == 1", "a > b", "c == null", "not (a == 1)", "a + b > c", "1 / b > 0")
ASSIGNMENTS = ("a = 0", "a = a + 1", "b = 1", "b = a", "c = a * b", "b = 0", "c.d = b")
ROLES = ("evsg1", "evsg2", "uav1", "uav2", "evsg1/ptz", "team:alpha", "alpha_2", "evsg1 evsg2")
EVENTS = ("signal s1", "signal s2", "message m1", "timer PT3S", "cycle R3/PT2S", "cycle R/PT4S")
TRUE = ("conditional b == 1", "conditional a > b", "conditional c == null", "conditional 1 / b > 0")
CAUGHT = (*EVENTS, *TRUE, "error", "error E1", "escalation", "escalation X1")
THROWN = ("signal s1", "signal s2", "message m1", "message m2", "escalation X1", "escalation X2")
CODES = ("E1", "E2")
LOOPS = (
    '<loop loopMaximum="2"> </loop>',
    '<loop loopMaximum="3">a < 2</loop>',
    '<loop testBefore="true" loopMaximum="2">1 / b > 0</loop>',
    "<each>2</each>",
    '<each isSequential="true">2</each>',
    "<each>a - 1</each>",
    "<each>3 until loopCounter == 1 or b == 0</each>",
    '<each isSequential="true" behavior="None">3 until 1 / b > 0</each>',
    '<each behavior="One" m2pem:collection="[a, b]" m2pem:elementVariable="b"> </each>',
)


@dataclass
class _Block:
    """Lines of notation, and the elements that its token comes to first and leaves last."""

    lines: list[str]
    entry: str
    exit: str


@dataclass
class _Draft:
    dice: Random
    budget: int
    processes: list[str] = field(default_factory=list)
    number: int = 100
    roles: Sequence[str] = ROLES

    def name(self, prefix: str) -> str:
        self.number += 1
        return f"{prefix}{self.number}"

    def one_of(self, items: Sequence[str]) -> str:
        return self.dice.choice(items)

    def chance(self, percent: int) -> bool:
        return self.dice.randrange(100) < percent

    def loop(self) -> str:
        """Perhaps a loop marker."""
        return self.one_of(LOOPS) if self.chance(20) else ""

    # --- leaves ---------------------------------------------------------------------------------

    def leaf(self, *, inside: bool) -> _Block:
        tag, text = self.one_of(_LEAVES if inside else _LEAVES[:-1]).split(" ", 1)
        text = text.format(
            set=self.one_of(ASSIGNMENTS),
            roles=self.one_of(self.roles),
            event=self.one_of(EVENTS[:4]),
            thrown=self.one_of(THROWN),
            code=self.one_of(CODES),
        )
        name = self.name(tag[0])
        if tag in ("sendTask", "receiveTask"):
            line = f'<{tag} id="{name}" messageRef="{text}">{self.loop()}</{tag}>'
        elif text == "-":
            line = f'<{tag} id="{name}">{self.loop()}</{tag}>'
        else:
            marker = self.loop() if tag.endswith("Task") else ""
            line = f'<{tag} id="{name}">{text}{marker}</{tag}>'
        block = _Block([line], name, name)
        if tag.endswith("Task") and self.chance(60):
            return self.guarded(block, ("error", *CAUGHT), depth=9)
        return block

    def guarded(self, block: _Block, caught: tuple[str, ...], depth: int) -> _Block:
        """Boundary events on an activity; what interrupts merges with what it interrupted."""
        merge = self.name("x")
        lines = [*block.lines, f'<exclusiveGateway id="{merge}"/>', f"{block.exit} -> {merge}"]
        for kind in dict.fromkeys((self.one_of(caught), self.one_of(caught))):
            boundary = self.name("b")
            interrupting = kind.startswith("error") or self.chance(50)
            attribute = "" if interrupting else ' cancelActivity="false"'
            lines.append(
                f'<boundaryEvent id="{boundary}" attachedToRef="{block.exit}"{attribute}>{kind}'
                "</boundaryEvent>"
            )
            handler = self.block(depth + 1) if self.chance(50) else None
            if handler:
                lines += [*handler.lines, f"{boundary} -> {handler.entry}"]
            if interrupting:
                lines.append(f"{handler.exit if handler else boundary} -> {merge}")
        return _Block(lines, block.entry, merge)

    # --- blocks ---------------------------------------------------------------------------------

    def block(self, depth: int, *, inside: bool = False) -> _Block:
        self.budget -= 1
        if depth > 5 or self.budget <= 0:
            return self.leaf(inside=inside)
        kind = self.one_of(("leaf", "seq", "xor", "and", "or", "loop", "link", "sub", "call"))
        if kind == "leaf":
            return self.leaf(inside=inside)
        if kind in ("seq", "loop", "link"):
            return getattr(self, f"_{kind}")(depth, inside)  # type: ignore[no-any-return]
        if kind in ("sub", "call"):
            return self._nested(kind, depth)
        return self._branches(kind, depth, inside)

    def _seq(self, depth: int, inside: bool) -> _Block:
        first, second = self.block(depth + 1, inside=inside), self.block(depth + 1, inside=inside)
        lines = [*first.lines, *second.lines, f"{first.exit} -> {second.entry}"]
        return _Block(lines, first.entry, second.exit)

    def _link(self, depth: int, inside: bool) -> _Block:
        first, second = self.block(depth + 1, inside=inside), self.block(depth + 1, inside=inside)
        source, target = self.name("l"), self.name("l")
        lines = [
            *first.lines,
            *second.lines,
            f'<intermediateThrowEvent id="{source}">link {target}</intermediateThrowEvent>',
            f'<intermediateCatchEvent id="{target}">link {target}</intermediateCatchEvent>',
            f"{first.exit} -> {source}",
            f"{target} -> {second.entry}",
        ]
        return _Block(lines, first.entry, second.exit)

    def _branches(self, kind: str, depth: int, inside: bool) -> _Block:
        tag = {"xor": "exclusive", "and": "parallel", "or": "inclusive"}[kind] + "Gateway"
        split, join, default = self.name("g"), self.name("g"), self.name("d")
        attribute = "" if kind == "and" else f' default="{default}"'
        lines = [f'<{tag} id="{split}"{attribute}/>', f'<{tag} id="{join}"/>']
        for number in range(self.dice.randint(2, 3)):
            branch = self.block(depth + 1, inside=inside)
            flow = f"{split} -> {branch.entry}"
            if kind != "and":
                flow = f"{flow} if {self.one_of(CONDITIONS)}" if number else f"{default}: {flow}"
            lines += [*branch.lines, flow, f"{branch.exit} -> {join}"]
        return _Block(lines, split, join)

    def _loop(self, depth: int, inside: bool) -> _Block:
        body = self.block(depth + 1, inside=inside)
        merge, split, default = self.name("x"), self.name("x"), self.name("d")
        count, key = self.name("s"), self.name("n")
        lines = [
            *body.lines,
            f'<exclusiveGateway id="{merge}"/>',
            f'<exclusiveGateway id="{split}" default="{default}"/>',
            f'<scriptTask id="{count}">{key} = max([0, {key}]) + 1</scriptTask> <task id="{key}"/>',
            f"{merge} -> {body.entry}",
            f"{body.exit} -> {count} -> {split}",
            f"{split} -> {merge} if {key} < {self.dice.randint(1, 3)}",
            f"{default}: {split} -> {key}",
        ]
        return _Block(lines, merge, key)

    def _nested(self, kind: str, depth: int) -> _Block:
        name = self.name("c" if kind == "call" else "p")
        inner = "\n".join(self.container(depth + 1, inside=True))
        if kind == "call":
            process = self.name("P")
            self.processes.append(f'<process id="{process}">\n{inner}\n</process>')
            line = f'<callActivity id="{name}" calledElement="{process}">in a as a, out b as b'
            block = _Block([f"{line}{self.loop()}</callActivity>"], name, name)
        else:
            declared = '<property id="{}" name="b"/>'.format(self.name("v"))
            own = declared if self.chance(30) else ""
            head = f'<subProcess id="{name}">{self.loop()}{own}'
            block = _Block([f"{head}\n{inner}\n</subProcess>"], name, name)
        return self.guarded(block, CAUGHT, depth) if self.chance(70) else block

    def container(self, depth: int, *, inside: bool, trigger: str = "") -> list[str]:
        """The inside of a process or subprocess."""
        block = self.block(depth, inside=inside)
        start, end = self.name("start"), self.name("end")
        ends = ("", "", "", "terminate", *THROWN, *(("error E1", "error E2") if inside else ()))
        last = self.one_of(ends)
        lines = [
            f'<startEvent id="{start}">{trigger}</startEvent>',
            *block.lines,
            f'<endEvent id="{end}">{last}</endEvent>',
            f"{start} -> {block.entry}",
            f"{block.exit} -> {end}",
        ]
        while self.budget > 0 and self.chance(25):
            lines += self.handler(depth)
        return lines

    def handler(self, depth: int) -> list[str]:
        """An event subprocess."""
        kind = self.one_of(CAUGHT)
        inside = self.container(depth + 1, inside=True, trigger=kind)
        if not kind.startswith("error") and self.chance(60):
            inside[0] = inside[0].replace("<startEvent", '<startEvent isInterrupting="false"')
        inner = "\n".join(inside)
        return [
            f'<subProcess id="{self.name("h")}" triggeredByEvent="true">\n{inner}\n</subProcess>'
        ]


_LEAVES = (
    "task -",
    "scriptTask {set}; {set}",
    "scriptTask {set}",
    "userTask ask a b",
    "userTask ask a b",
    "scriptTask do drive_stop {roles}",
    "scriptTask do drive_stop {roles}",
    "serviceTask call Look",
    "scriptTask do drive_stop {roles}",
    "userTask ask a b",
    "scriptTask do hold duration=2",
    "intermediateCatchEvent {event}",
    "intermediateThrowEvent {thrown}",
    "sendTask m1",
    "receiveTask m2",
    "scriptTask throw error {code}",
)


def structured(dice: Random, roles: Sequence[str] = ROLES) -> str:
    """A mission of nested blocks, with perhaps a second process that a signal or message starts.

    `roles`: of its behaviors; each takes one of these texts.
    """
    draft = _Draft(dice, dice.randint(1, 30), roles=roles)
    main = "\n".join(draft.container(0, inside=False))
    other = ""
    if draft.chance(30):
        trigger = draft.one_of(("signal s1", "message m1"))
        inner = "\n".join(draft.container(2, inside=False, trigger=trigger))
        other = f'<process id="OTHER">\n{inner}\n</process>'
    return f'<process id="MAIN" isExecutable="true">\n{main}\n</process>\n{other}\n' + "\n".join(
        draft.processes
    )


# --- graphs -------------------------------------------------------------------------------------

_NODES = (
    "exclusiveGateway",
    "parallelGateway",
    "inclusiveGateway",
    "exclusiveGateway",
    "inclusiveGateway",
    "task",
    *(leaf for leaf in _LEAVES if not leaf.startswith("task")),
    "intermediateCatchEvent {condition}",
    "endEvent",
    "endEvent {thrown}",
    "endEvent terminate",
    "endEvent error {code}",
    "subProcess",
    "callActivity",
)


def graph(dice: Random, roles: Sequence[str] = ROLES) -> str:
    """Nodes joined at random, all of which some start event can reach. `roles`: as above."""
    draft = _Draft(dice, 0, roles=roles)
    inside = _graph(draft, dice.randint(1, 12), 0)
    return f'<process id="MAIN" isExecutable="true">\n{inside}\n</process>'


def _graph(draft: _Draft, size: int, depth: int) -> str:
    lines = []
    start = draft.name("start")
    sources, targets, activities = [start], list[str](), list[str]()
    conditional: set[str] = set()
    lines.append(f'<startEvent id="{start}"/>')
    for _ in range(size):
        tag, _, text = draft.one_of(_NODES if depth < 2 else _NODES[:-2]).partition(" ")
        name = draft.name("n")
        came = draft.one_of(sources)
        lines.append(_flow(draft, came, name, conditional))
        lines.append(_element(draft, tag, text, name, depth))
        targets.append(name)
        if tag != "endEvent":
            sources.append(name)
        if tag.endswith(("Task", "task", "subProcess", "callActivity")):
            activities.append(name)
        if tag.endswith(("Task", "task", "exclusiveGateway", "inclusiveGateway")):
            conditional.add(name)
        if depth < 3 and draft.chance(5):
            lines += draft.handler(4)
        if activities and draft.chance(20):
            boundary = draft.name("b")
            kind = draft.one_of(CAUGHT)
            cancel = "" if kind.startswith("error") or draft.chance(50) else "false"
            host = draft.one_of(activities)
            lines.append(_boundary(boundary, host, kind, cancel))
            sources.append(boundary)
    for _ in range(draft.dice.randint(0, size + 1) if targets else 0):
        source, target = draft.one_of(sources), draft.one_of(targets)
        lines.append(_flow(draft, source, target, conditional))
    return "\n".join(lines)


def _boundary(name: str, host: str, kind: str, cancel: str) -> str:
    attribute = f' cancelActivity="{cancel}"' if cancel else ""
    return f'<boundaryEvent id="{name}" attachedToRef="{host}"{attribute}>{kind}</boundaryEvent>'


def _flow(draft: _Draft, source: str, target: str, conditional: set[str]) -> str:
    flow = f"{source} -> {target}"
    if source in conditional and draft.chance(60):
        flow += f" if {draft.one_of(CONDITIONS)}"
    return flow


def _element(draft: _Draft, tag: str, text: str, name: str, depth: int) -> str:
    if tag == "subProcess":
        inside = _graph(draft, draft.dice.randint(0, 4), depth + 1)
        return f'<subProcess id="{name}">{draft.loop()}\n{inside}\n</subProcess>'
    if tag == "callActivity":
        return f'<callActivity id="{name}" calledElement="MAIN"/>'
    if tag in ("sendTask", "receiveTask"):
        return f'<{tag} id="{name}" messageRef="{text}">{draft.loop()}</{tag}>'
    text = text.format(
        set=draft.one_of(ASSIGNMENTS),
        roles=draft.one_of(draft.roles),
        event=draft.one_of(EVENTS[:4]),
        thrown=draft.one_of(THROWN),
        code=draft.one_of(CODES),
        condition=draft.one_of(TRUE),
    )
    marker = draft.loop() if tag.endswith(("Task", "task")) else ""
    return f'<{tag} id="{name}">{"" if text == "-" else text}{marker}</{tag}>'
