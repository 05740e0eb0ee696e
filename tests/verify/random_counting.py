"""Random missions that count: messages kept, work undone, instances begun, tokens at a signal.

Nothing but timers comes from outside, so the engine does one thing: it completes, or it never does.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from random import Random

from m2pem.mission.mission import Mission
from tests.bpmn.bpmn_text import definitions, flow, load

TIMES = (1, 1, 2, 2, 3, 4, 5, 9)
MESSAGES = ("m1", "m2", "m3")
ROOTS = (
    "".join(f'<message id="{each}" name="{each}"/>' for each in MESSAGES)
    + '<signal id="g" name="g"/>'
)


def event(kind: str, name: str, definition: str, attributes: str = "") -> str:
    what, _, ref = definition.partition(" ")
    said = f' {what}Ref="{ref}"' if ref else ""
    inside = "<timeDuration>PT1S</timeDuration>" if what == "timer" else ""
    defined = f"<{what}EventDefinition{said}>{inside}</{what}EventDefinition>"
    return f'<{kind} id="{name}"{attributes}>{defined}</{kind}>'


@dataclass
class Draft:
    """A mission under construction. `beside`: what belongs to the process of the run, and is not in
    the row of its elements."""

    dice: Random
    beside: list[str] = field(default_factory=list)
    processes: list[str] = field(default_factory=list)
    number: int = 0

    def name(self) -> str:
        self.number += 1
        return f"n{self.number}"

    def message(self) -> str:
        return f"message {self.dice.choice(MESSAGES[:2])}"

    def row(self, pieces: list[str], begin: str = "", end: str = "") -> str:
        """Pieces one after the other, between a start and an end event."""
        start, last = self.name(), self.name()
        starts = begin.format(start) if begin else f'<startEvent id="{start}"/>'
        ids = [start, *(each.split('id="')[1].split('"')[0] for each in pieces), last]
        flows = "".join(flow(*pair) for pair in pairwise(ids))
        return f'{starts}{"".join(pieces)}<endEvent id="{last}">{end}</endEvent>{flows}'

    def some(self, make: str) -> list[str]:
        """A few alike pieces."""
        kind = "intermediateThrowEvent" if make == "throws" else "intermediateCatchEvent"
        what, count = self.message(), self.dice.choice(TIMES)
        return [event(kind, self.name(), what) for _ in range(count)]

    def pieces(self, depth: int = 0) -> list[str]:
        kinds = ["throws", "catches", "throws", "catches", "in_turn", "wait", "signal"]
        if depth < 2:
            kinds += ["sub", "call", "undone"]
        found: list[str] = []
        for _ in range(self.dice.randint(1, 5 - 2 * depth)):
            kind = self.dice.choice(kinds)
            found += (
                self.some(kind) if kind in ("throws", "catches") else getattr(self, kind)(depth)
            )
        return found

    def in_turn(self, depth: int) -> list[str]:
        kind = self.dice.choice(("sendTask", "receiveTask"))
        count = self.dice.choice((*TIMES, 20))
        parallel = count < 4 and self.dice.random() < 0.4
        turn = "false" if parallel else "true"
        return [
            f'<{kind} id="{self.name()}" messageRef="{self.message()[8:]}">'
            f'<multiInstanceLoopCharacteristics isSequential="{turn}"><loopCardinality>{count}'
            f"</loopCardinality></multiInstanceLoopCharacteristics></{kind}>"
        ]

    def wait(self, depth: int) -> list[str]:
        return [event("intermediateCatchEvent", self.name(), "timer")]

    def signal(self, depth: int) -> list[str]:
        return [event("intermediateThrowEvent", self.name(), "signal g")]

    def call(self, depth: int) -> list[str]:
        called = f"P{self.name()}"
        inside = self.row(self.pieces(depth + 1))
        self.processes.append(f'<process id="{called}">{inside}</process>')
        return [f'<callActivity id="{self.name()}" calledElement="{called}"/>']

    def sub(self, depth: int) -> list[str]:
        """A subprocess, perhaps with an event subprocess; at the top, with a boundary event."""
        name, inside = self.name(), self.row(self.pieces(depth + 1))
        if self.dice.random() < 0.4:
            handler = self.row(
                self.handling(),
                event("startEvent", "{}", self.message(), ' isInterrupting="false"'),
            )
            inside += (
                f'<subProcess id="{self.name()}" triggeredByEvent="true">{handler}</subProcess>'
            )
        if depth == 0 and self.dice.random() < 0.7:
            cut = self.dice.choice(("true", "false", "false"))
            attributes = f' attachedToRef="{name}" cancelActivity="{cut}"'
            boundary = event("boundaryEvent", "{}", self.message(), attributes)
            self.beside.append(self.row(self.handling(), boundary))
        return [f'<subProcess id="{name}">{inside}</subProcess>']

    def handling(self) -> list[str]:
        waits = [event("intermediateCatchEvent", self.name(), "signal g")]
        says = [event("intermediateThrowEvent", self.name(), self.message())]
        return self.dice.choice(([], says, waits, [*waits, *says]))

    def undone(self, depth: int, twice: str = "", message: str = "") -> list[str]:
        """A subprocess in which a task is done once or twice, and then undone, which sends."""
        twice, message = twice or self.dice.choice(("true", "false")), message or self.message()
        merge, task, split, off, undo, sends = (self.name() for _ in range(6))
        again, throw, start, end = (self.name() for _ in range(4))
        flag, host = f"f{self.number}", f' attachedToRef="{task}"'
        inside = (
            f'<startEvent id="{start}"/><scriptTask id="{again}"><script>{flag} = {twice}</script>'
            f'</scriptTask><exclusiveGateway id="{merge}"/><task id="{task}"/>'
            f'<exclusiveGateway id="{split}" default="{split}_{throw}"/>'
            f'<scriptTask id="{off}"><script>{flag} = false</script></scriptTask>'
            f'{event("intermediateThrowEvent", throw, "compensate")}<endEvent id="{end}"/>'
            f"{event('boundaryEvent', undo, 'compensate', host)}"
            f'<sendTask id="{sends}" isForCompensation="true" messageRef="{message[8:]}"/>'
            f'<sequenceFlow id="{split}_{off}" sourceRef="{split}" targetRef="{off}">'
            f"<conditionExpression>{flag}</conditionExpression></sequenceFlow>"
            f'<sequenceFlow id="{split}_{throw}" sourceRef="{split}" targetRef="{throw}"/>'
            f'<association id="{undo}_" sourceRef="{undo}" targetRef="{sends}"'
            ' associationDirection="One"/>'
        )
        pairs = ((start, again), (again, merge), (merge, task), (task, split), (off, merge))
        flows = "".join(flow(*pair) for pair in (*pairs, (throw, end)))
        return [f'<subProcess id="{self.name()}">{inside}{flows}</subProcess>']


def counting(dice: Random) -> Mission:
    """A random mission."""
    draft = Draft(dice)
    main = draft.row(draft.pieces())
    if dice.random() < 0.5:  # several tokens wait for one signal
        fork, waits = draft.name(), draft.name()
        count = dice.choice((2, 3))
        merged = "".join(
            f'<sequenceFlow id="{fork}_{n}" sourceRef="{fork}" targetRef="{waits}"/>'
            for n in range(count)
        )
        start, end = draft.name(), draft.name()
        draft.beside.append(
            f'<startEvent id="{start}"/><parallelGateway id="{fork}"/><endEvent id="{end}"/>'
            f"{event('intermediateCatchEvent', waits, 'signal g')}{merged}"
            f"{flow(start, fork)}{flow(waits, end)}"
        )
    other = ""
    if dice.random() < 0.6:
        begins = event("startEvent", "{}", dice.choice(("message m1", "message m3", "signal g")))
        rest = draft.handling() if dice.random() < 0.7 else draft.pieces(1)
        other = f'<process id="OTHER" isExecutable="true">{draft.row(rest, begins)}</process>'
    processes = f'<process id="MAIN" isExecutable="true">{main}{"".join(draft.beside)}</process>'
    return load(definitions(f"{ROOTS}{processes}{other}{''.join(draft.processes)}"))
