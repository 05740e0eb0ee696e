"""Random missions for the verdicts of verification, in the tests' notation.

Operators' answers and data decide gateways, event-based gateways wait for what comes first, several
instances work at once with and without outputs, processes answer each other's messages, work is
undone, and most missions have something wrong in them: a message that is never sent, a decision
that no flow is for, a branch that is not joined.
"""

from dataclasses import dataclass, field
from random import Random

MESSAGES = ("m1", "m1", "m2")
DATA = {"a": 1, "b": 1, "items": [1, 2]}
"""What each run begins with."""


@dataclass
class _Draft:
    dice: Random
    lines: list[str] = field(default_factory=list)
    processes: list[str] = field(default_factory=list)
    number: int = 0

    def name(self, kind: str = "n") -> str:
        self.number += 1
        return f"{kind}{self.number}"

    def chance(self, percent: int) -> bool:
        return self.dice.randrange(100) < percent

    def message(self) -> str:
        return self.dice.choice(MESSAGES)

    def add(self, tag: str, text: str = "", attributes: str = "", kind: str = "n") -> str:
        name = self.name(kind)
        self.lines.append(f'<{tag} id="{name}"{attributes}>{text}</{tag}>')
        return name

    def row(self, before: str, depth: int) -> str:
        """Some pieces after an element; returns the last one."""
        for _ in range(self.dice.randint(1, 3 if depth < 2 else 1)):
            before = self.dice.choice(_PIECES if depth < 3 else _PIECES[:6])(self, before, depth)
        return before

    def then(self, before: str, tag: str, text: str = "", attributes: str = "") -> str:
        name = self.add(tag, text, attributes)
        self.lines.append(f"{before} -> {name}")
        return name

    # --- pieces: each is put after an element, and returns its last one -------------------------

    def task(self, before: str, depth: int) -> str:
        kinds = ("scriptTask", "userTask", "task")
        kind = self.dice.choice(kinds)
        text = {"userTask": "ask x y", "task": ""}.get(kind) or self.dice.choice(
            ("a = a + 1", "b = a", "a = 0", "b = 2")
        )
        each = "" if self.chance(70) else self.dice.choice(("<each>2</each>", _IN_TURN))
        name = self.then(before, kind, "" if kind == "task" else f"{text}{each}")
        if kind == "userTask" and self.chance(30):
            self.boundary(name, depth)
        return name

    def throws(self, before: str, depth: int) -> str:
        return self.then(before, "intermediateThrowEvent", self.dice.choice(_THROWN))

    def catches(self, before: str, depth: int) -> str:
        what = self.dice.choice(("timer PT5S", "timer PT7S", f"message {self.message()}"))
        return self.then(before, "intermediateCatchEvent", what)

    def decides(self, before: str, depth: int) -> str:
        asked = self.then(before, "userTask", "ask x y")
        split, merge = self.then(asked, "exclusiveGateway"), self.add("exclusiveGateway")
        wrong = 15
        for value in ("x", "z" if self.chance(wrong) else "y"):
            task = self.add("task")
            self.lines.append(f"{split} -> {task} if user.decision == '{value}'")
            self.lines.append(f"{self.row(task, depth + 1)} -> {merge}")
        return merge

    def waits(self, before: str, depth: int) -> str:
        gate, merge = self.then(before, "eventBasedGateway"), self.add("exclusiveGateway")
        for what in self.dice.sample(("timer PT6S", "message m1", "message m2", "signal g"), 2):
            caught = self.then(gate, "intermediateCatchEvent", what)
            self.lines.append(f"{self.row(caught, depth + 1)} -> {merge}")
        return merge

    def tests(self, before: str, depth: int) -> str:
        split, merge, default = self.name(), self.add("exclusiveGateway"), self.name("d")
        safe = f' default="{default}"' if self.chance(85) else ""
        self.lines.append(f'<exclusiveGateway id="{split}"{safe}/>')
        self.lines.append(f"{before} -> {split}")
        one, other = self.add("task"), self.add("task")
        self.lines.append(f"{split} -> {one} if {self.dice.choice(('a > 1', 'b == 2', 'a == b'))}")
        condition = "" if safe else f" if {self.dice.choice(('a < 2', 'b == 1', 'a != b'))}"
        self.lines.append(f"{default}: {split} -> {other}{condition}")
        for each in (one, other):
            self.lines.append(f"{self.row(each, depth + 1)} -> {merge}")
        return merge

    def forks(self, before: str, depth: int) -> str:
        fork = self.then(before, "parallelGateway")
        joins = self.chance(85)
        merge = self.add("parallelGateway" if joins else "exclusiveGateway")
        for _ in range(2):
            first = self.add("task")
            self.lines.append(f"{fork} -> {first}")
            self.lines.append(f"{self.row(first, depth + 1)} -> {merge}")
        return merge

    def nested(self, before: str, depth: int) -> str:
        outer, self.lines = self.lines, []
        each = "" if self.chance(60) else self.dice.choice(_EACH)
        last = self.row(self.add("startEvent"), depth + 1)
        if "result" in each:
            last = self.then(last, "scriptTask", self.dice.choice(("r = a", "r = r1", "q = 1")))
        self.then(last, "endEvent", self.dice.choice(_ENDS))
        if self.chance(40):
            self.handler(depth)
        inside, self.lines = "\n".join(self.lines), outer
        name = self.then(before, "subProcess", f"{each}\n{inside}\n")
        if self.chance(50):
            self.boundary(name, depth)
        return name

    def calls(self, before: str, depth: int) -> str:
        outer, self.lines = self.lines, []
        self.then(self.row(self.add("startEvent"), depth + 1), "endEvent", self.dice.choice(_ENDS))
        called = self.name("P")
        inside, self.lines = "\n".join(self.lines), outer
        self.processes.append(f'<process id="{called}">\n{inside}\n</process>')
        text = "in a as a, in b as b, out a as b"
        name = self.then(before, "callActivity", text, f' calledElement="{called}"')
        if self.chance(40):
            self.boundary(name, depth)
        return name

    def undoes(self, before: str, depth: int) -> str:
        done = self.then(before, "userTask", "ask x")
        handler = self.add("task", attributes=' isForCompensation="true"')
        event = self.add("boundaryEvent", "compensate", f' attachedToRef="{done}"')
        self.lines.append(f"{event} ~> {handler}")
        return self.then(done, "intermediateThrowEvent", "compensate")

    # --- beside ---------------------------------------------------------------------------------

    def boundary(self, host: str, depth: int) -> None:
        what = self.dice.choice((*_CAUGHT, "error"))
        cuts = what == "error" or self.chance(50)
        attributes = f' attachedToRef="{host}"{"" if cuts else _BESIDE}'
        last = self.row(self.add("boundaryEvent", what, attributes), depth + 2)
        self.then(last, "endEvent")

    def handler(self, depth: int) -> None:
        outer, self.lines = self.lines, []
        attributes = ' isInterrupting="false"' if self.chance(60) else ""
        start = self.add("startEvent", self.dice.choice(_CAUGHT), attributes)
        self.then(self.row(start, depth + 2), "endEvent")
        inside, self.lines = "\n".join(self.lines), outer
        self.add("subProcess", f"\n{inside}\n", ' triggeredByEvent="true"')


_BESIDE = ' cancelActivity="false"'
_IN_TURN = '<each isSequential="true">2</each>'
_EACH = (
    "<each>2</each>",
    _IN_TURN,
    '<each in="items" item="r1" out="results" result="r"> </each>',
    '<each isSequential="true" in="items" item="r1" out="results" result="r"> </each>',
)
_THROWN = ("message m1", "message m1", "message m2", "signal g", "escalation X1")
_CAUGHT = ("message m1", "signal g", "timer PT4S", "escalation X1")
_ENDS = ("", "", "", "message m2", "error E1", "terminate", "escalation X1")
_PIECES = (
    _Draft.task,
    _Draft.task,
    _Draft.throws,
    _Draft.throws,
    _Draft.catches,
    _Draft.undoes,
    _Draft.decides,
    _Draft.waits,
    _Draft.tests,
    _Draft.forks,
    _Draft.nested,
    _Draft.nested,
    _Draft.calls,
)


def verified(dice: Random) -> str:
    """A random mission."""
    draft = _Draft(dice)
    draft.lines += ['<dataObject id="items"/>', '<dataObject id="results"/>']
    draft.then(draft.row(draft.add("startEvent"), 0), "endEvent", dice.choice(_ENDS[:4]))
    main, other = "\n".join(draft.lines), ""
    if draft.chance(50):
        draft.lines = []
        start = draft.add("startEvent", dice.choice(("message m1", "message m2", "signal g")))
        draft.then(draft.row(start, 1), "endEvent", dice.choice(_ENDS[:4]))
        inside = "\n".join(draft.lines)
        other = f'<process id="OTHER" isExecutable="true">\n{inside}\n</process>'
    called = "\n".join(draft.processes)
    return f'<process id="MAIN" isExecutable="true">\n{main}\n</process>\n{other}\n{called}'
