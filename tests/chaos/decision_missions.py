"""Missions that are revised, and what operators decide in them: drawn by chance, and played by the
engine alone first, which says what comes of each decision when no executive dies."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from random import Random
from typing import Any

from m2pem.engine import records as r
from m2pem.engine.inputs import IncidentChoice
from m2pem.engine.state import BehaviorPhase
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from tests.engine.kit import Play
from tests.engine.notation import mission, xml

FAR, NEAR = "[38.2000,-77.3192]", "[38.1078,-77.3192]"
"""A place that no vehicle reaches while a mission is played, and one that it reaches soon."""

_MAIN = """
<process id="MAIN" isExecutable="true" m2pem:onError="incident">
    <startEvent id="start"/> <endEvent id="end"/> <userTask id="last"/>
    <scriptTask id="init">x = 1; n = 0; items = [1, 2, 3]</scriptTask>
    <parallelGateway id="fork"/> <parallelGateway id="join"/> <exclusiveGateway id="meet"/>
    {kept}
    start -> init -> {tells}{part}fork
    {job}
    meet -> join
    {branches}
    join -> {undo}last -> end
    {events}
    {undone}
</process>
{others}
"""
_JOBS = {
    "task": '<userTask id="job"/>\nfork -> job -> meet\n',
    "box": """<subProcess id="job"> <startEvent id="in"/> <userTask id="inner"/>
        <endEvent id="out"/>
        in -> inner -> out
        {inside}</subProcess>
        fork -> job -> meet
    """,
    "call": '<callActivity id="job" calledElement="CALLED"></callActivity>\nfork -> job -> meet\n',
    "catch": """<intermediateCatchEvent id="job">message {waits}</intermediateCatchEvent>
        fork -> job -> meet
    """,
    "receive": '<receiveTask id="job" messageRef="{waits}"/>\nfork -> job -> meet\n',
    "choice": """<eventBasedGateway id="job"/>
        <intermediateCatchEvent id="first">message {waits}</intermediateCatchEvent>
        <intermediateCatchEvent id="second">signal s</intermediateCatchEvent>
        fork -> job -> first -> meet
        job -> second -> meet
    """,
    "moved": '<userTask id="job"/>\n<userTask id="next"/>\nfork -> job -> next -> meet\n',
}
_CALLED = """<process id="CALLED"> <startEvent id="c_in"/> <userTask id="inner"/>
    <endEvent id="c_out"/>
    c_in -> inner -> c_out
    {inside}</process>"""
_BRANCHES = {
    "bad": '<scriptTask id="bad">{bad}</scriptTask> <task id="bad_other"/>\n'
    "fork -> bad -> bad_other -> join\n",
    "gate": '<exclusiveGateway id="gate"{default}/> <task id="yes"/> <task id="no"/>\n'
    '<exclusiveGateway id="after_gate"/>\n'
    "fork -> gate\ngate -> yes if x > 5\nyes -> after_gate -> join\nno -> after_gate\n"
    "other_way: gate -> no{no}\n",
    "ask": '<userTask id="ask">ask good bad <each in="items" item="one" out="seen" result="user">'
    '</each></userTask>\n<intermediateThrowEvent id="asked">message m</intermediateThrowEvent>\n'
    "fork -> ask -> asked -> join\n",
    "drive": '<scriptTask id="drive">do goto ugv1 target={target}</scriptTask>\n'
    "fork -> drive -> join\n",
    "fails": f'<scriptTask id="fails">do goto ugv2 target={FAR}</scriptTask>\n'
    '<task id="fails_other"/>\nfork -> fails -> fails_other -> join\n',
}
_TRIGGERS = {
    "message": "message m",
    "signal": "signal s",
    "condition": "conditional x > 0",
    "date": "date 2025-12-31T00:00:00Z",
}


@dataclass(frozen=True)
class Version:
    """A version of a mission, in parts. `new`: the events that it has."""

    job: str = "task"
    branches: tuple[str, ...] = ()
    tells: int = 0
    undone: bool = False
    waits: str = "other"
    new: tuple[tuple[str, str, bool], ...] = ()
    bad: str = "throw error BAD"
    default: bool = False
    target: str = FAR

    def text(self) -> str:
        """The mission in the words of `tests.engine.notation`."""
        texts = {"main": "", "inside": "", "process": ""}
        for number, (place, trigger, interrupting) in enumerate(self.new, 1):
            where, new = _event(number, place, _TRIGGERS[trigger], interrupting=interrupting)
            texts[where] += new
        inside, others = texts["inside"], texts["process"]
        if self.job == "call":
            others += _CALLED.format(inside=inside)
        branches = "".join(_BRANCHES[each] for each in self.branches).format(
            bad=self.bad,
            default=' default="other_way"' if self.default else "",
            no="" if self.default else " if x > 7",
            target=self.target,
        )
        tells = [f"tell{each}" for each in range(self.tells)]
        text = _MAIN.format(
            kept="".join(map(_TELL.format, tells)),
            tells="".join(f"{each} -> " for each in tells),
            part="part -> " if self.undone else "",
            undo="undo -> " if self.undone else "",
            job=_JOBS[self.job].format(inside=inside, waits=self.waits),
            branches=branches,
            events=texts["main"],
            others=others,
            undone=_UNDONE if self.undone else "",
        )
        return "\n".join(map(_named, text.splitlines()))


_TELL = '<intermediateThrowEvent id="{}">message m</intermediateThrowEvent>\n'
_UNDONE = """<task id="part"/> <userTask id="unpart" isForCompensation="true"/>
    <intermediateThrowEvent id="undo">compensate</intermediateThrowEvent>
    part undo unpart
"""


def _event(number: int, place: str, trigger: str, *, interrupting: bool) -> tuple[str, str]:
    """An event that a version has, with what counts how often it has occurred: where its text is,
    and the text."""
    ev, got = f"ev{number}", f"got{number}"
    count = f'<scriptTask id="{got}">n = n + 1</scriptTask>'
    cancels = str(interrupting).lower()
    if place == "process":
        return place, (
            f'<process id="OTHER{number}" isExecutable="true"><startEvent id="{ev}">{trigger}'
            f'</startEvent> {count} <userTask id="look{number}"/>\n'
            f"{ev} -> {got} -> look{number}\n</process>"
        )
    if place in ("main", "inside"):
        return place, (
            f'<subProcess id="sub{number}" triggeredByEvent="true"><startEvent id="{ev}" '
            f'isInterrupting="{cancels}">{trigger}</startEvent> {count}\n{ev} -> {got}\n'
            "</subProcess>"
        )
    ways = {"bad": "bad_other", "ask": "asked", "fails": "fails_other"}
    way = f" -> {ways.get(place, 'meet')}" if interrupting else ""
    return "main", (
        f'<boundaryEvent id="{ev}" attachedToRef="{place}" cancelActivity="{cancels}">{trigger}'
        f"</boundaryEvent> {count}\n{ev} -> {got}{way}\n"
    )


def _named(line: str) -> str:
    """Give each flow of a chain the same name in all versions."""
    chain, _, condition = line.partition(" if ")
    if "->" not in chain or ":" in chain:
        return line
    pairs = pairwise(each.strip() for each in chain.split("->"))
    flows = [f"{source}_to_{target}: {source} -> {target}" for source, target in pairs]
    return "\n".join(flows) + (f" if {condition}" if condition else "")


def draw_versions(chance: Random) -> list[Version]:
    """Draw a mission and the versions with which it goes on."""
    job = chance.choice(list(_JOBS))
    some = chance.sample(list(_BRANCHES), chance.randint(1, 3))
    first = Version(job, tuple(some), chance.randint(0, 3), chance.random() < 0.4)
    versions = [first]
    for _ in range(chance.choice((1, 1, 2))):
        versions.append(_next(chance, versions[-1]))
    if chance.random() < 0.15:
        versions.append(replace(first, target=NEAR))
    return versions


def _next(chance: Random, old: Version) -> Version:
    places = ["main", "process"]
    if old.job in ("box", "call"):
        places += ["inside", "inside"]
    if old.job in ("task", "box", "call", "receive", "moved"):
        places += ["next" if old.job == "moved" else "job"] * 2
    places += [each for each in ("bad", "ask", "fails") if each in old.branches]
    place = chance.choice(places)
    trigger = chance.choice(("message", "message", "message", "signal", "condition", "date"))
    if place == "process":
        trigger = chance.choice(("message", "message", "signal"))
    # What interrupts all of the process ends what else there is to decide.
    interrupting = chance.random() < 0.5 and place != "main"
    new = replace(old, new=(*old.new, (place, trigger, interrupting)))
    if old.job in ("catch", "receive", "choice") and chance.random() < 0.7:
        new = replace(new if chance.random() < 0.3 else old, waits="m")
    if "bad" in old.branches and chance.random() < 0.3:
        new = replace(new, bad="y = 1")
    if "gate" in old.branches and chance.random() < 0.3:
        new = replace(new, default=True)
    if "drive" in old.branches:
        new = replace(new, target=NEAR)
    return new


@dataclass(frozen=True)
class Seen:
    """What a run has, by its records alone: where its tokens are, what it asks, keeps and does."""

    tokens: Counter[str]
    prompts: Counter[str]
    incidents: Counter[str]
    behaviors: Counter[str]
    waits: Counter[str]
    kept: Counter[str]
    ended: str


class Reader:
    """Reads the records of a run as docs/records.md describes them, without the engine."""

    def __init__(self, records: Iterable[r.Record] = ()) -> None:
        self.tokens: dict[int, str] = {}
        self.prompts: dict[str, r.PromptOpened] = {}
        self.incidents: dict[str, r.IncidentOpened] = {}
        self.behaviors: dict[str, str] = {}
        self.waits: dict[int, r.EventAwaited] = {}
        self.kept: Counter[str] = Counter()
        self.ended = ""
        self.faults: list[str] = []
        self._awaited: dict[int, r.EventAwaited] = {}
        for each in records:
            self.read(each)

    def read(self, record: r.Record) -> None:
        """Read the next record."""
        match record:
            case r.TokenEntered(token=token, element=element):
                if token in self.tokens:
                    self.faults.append(f"token {token} entered {element}, and was on {self.tokens}")
                self.tokens[token] = element
            case r.TokenLeft(token=token, element=element):
                if self.tokens.pop(token, None) != element:
                    self.faults.append(f"token {token} left {element}, and was not there")
                self._over(token=token)
            case r.ScopeClosed(scope=scope):
                self._over(scope=scope)
            case r.PromptOpened(prompt=prompt):
                if prompt in self.prompts:
                    self.faults.append(f"{prompt} was opened twice")
                self.prompts[prompt] = record
            case r.PromptAnswered(prompt=prompt) | r.PromptWithdrawn(prompt=prompt):
                if self.prompts.pop(prompt, None) is None:
                    self.faults.append(f"{prompt} was closed, and was not open")
            case r.IncidentOpened(incident=incident):
                self.incidents[incident] = record
            case r.IncidentResolved(incident=incident) | r.IncidentClosed(incident=incident):
                if self.incidents.pop(incident, None) is None:
                    self.faults.append(f"{incident} was over twice")
            case r.BehaviorRequested(behavior=behavior, element=element):
                if behavior in self.behaviors:
                    self.faults.append(f"{behavior} was requested twice")
                self.behaviors[behavior] = element
            case r.BehaviorEnded(behavior=behavior):
                self.behaviors.pop(behavior, None)
            case r.EventAwaited(wait=wait):
                self.waits[wait] = self._awaited[wait] = record
            case r.EventTriggered(wait=wait, kept=kept):
                if self.waits.pop(wait, None) is None:
                    self.faults.append(f"wait {wait} was over, and occurred")
                if kept:
                    self._take(self._awaited[wait].ref)
            case r.ScopeOpened(message=message):
                if message:
                    self._take(message)
            case r.MessageThrown(message=message, kept=kept):
                self.kept[message] += bool(kept)
            case r.MissionRevised(disarmed=disarmed):
                for wait in disarmed:
                    self.waits.pop(wait, None)
            case r.RunEnded(outcome=outcome):
                self.ended = outcome.value
            case _:
                pass

    def _take(self, message: str) -> None:
        self.kept[message] -= 1
        if self.kept[message] < 0:
            self.faults.append(f"message {message} was delivered more often than it was kept")

    def _over(self, **of: int) -> None:
        ((name, value),) = of.items()
        gone = [
            wait
            for wait, each in self.waits.items()
            if getattr(each, name) == value and (name == "token" or not each.token)
        ]
        for wait in gone:
            del self.waits[wait]

    @property
    def seen(self) -> Seen:
        """What there is now."""
        return Seen(
            Counter(self.tokens.values()),
            Counter(each.element for each in self.prompts.values() if not each.behavior),
            Counter(each.element for each in self.incidents.values()),
            Counter(self.behaviors.values()),
            Counter(each.element for each in self.waits.values()),
            +self.kept,
            self.ended,
        )


@dataclass(frozen=True)
class Decision:
    """What an operator decides. `about`: the element whose prompt or incident it is, the number of
    the version, or the signal or message; "arrive": it is not decided, the vehicle arrives."""

    kind: str
    about: str
    value: str = ""
    more: Mapping[str, Any] = field(default_factory=dict)
    before: Seen | None = None

    def __str__(self) -> str:
        return f"{self.kind} {self.about} {self.value} {dict(self.more) or ''}".strip()


@dataclass
class Script:
    """A mission, its versions, what is decided in turn, and how the run ends without any kill."""

    versions: list[str]
    decisions: list[Decision]
    records: list[r.Record]


MOST_DECISIONS = 20


def draw_script(seed: int, fleet: Fleet) -> Script:
    """Draw a mission and decisions with which it ends."""
    chance = Random(seed)
    versions = [each.text() for each in draw_versions(chance)]
    play = Play(mission(versions[0]), fleet=fleet).start(process="MAIN")
    now, decisions = 0, list[Decision]()
    while not play.ended:
        _settle(play)
        choices = list(_choices(play, versions, now, decisions))
        assert choices, f"seed {seed}: nothing can be decided at {play.at}"
        found = chance.choice(choices)
        if len(decisions) > MOST_DECISIONS:
            found = choices[0]
        decisions.append(replace(found, before=Reader(play.records()).seen))
        _decide(play, found, versions)
        now += found.kind == "revise"
    _settle(play)
    return Script([xml(each) for each in versions], decisions, list(play.records()))


def _settle(play: Play) -> None:
    """Dates that have passed are due; vehicles end what is cancelled, and `fails` fails."""
    play.advance(0)
    for each in list(play.run.state.behaviors.values()):
        if each.phase is BehaviorPhase.CANCELLING:
            play.report(each.id.rpartition(".")[2], BehaviorState.CANCELLED)
        elif each.element == "fails":
            play.report("fails", BehaviorState.FAILED, "FAILED")


def _choices(
    play: Play, versions: list[str], now: int, decided: list[Decision]
) -> Iterator[Decision]:
    """What can be decided now; first what brings the mission to its end."""
    state = play.run.state
    prompts = list(dict.fromkeys(each.token.node.id for each in state.prompts.values()))
    for element in prompts:
        if element != "last":
            yield Decision("answer", element, "good" if element == "ask" else "done")
    if now and any(each.element == "drive" for each in state.behaviors.values()):
        yield Decision("arrive", "drive")  # when it does, no operator decides
        return
    for incident in state.incidents.values():
        element = incident.token.node.id
        about = [each for each in decided if each.about == element]
        if IncidentChoice.SKIP in incident.choices:
            yield Decision("resolve", element, "skip")
        if IncidentChoice.MOVE in incident.choices:
            to = {"gate": "yes"}.get(element, f"{element}_other")
            yield Decision("resolve", element, "move", {"to": to})
        if element != "fails" and not any(each.value == "retry" for each in about):
            yield Decision("resolve", element, "retry")
        if not any(each.value == "set_data" for each in about):
            yield Decision("resolve", element, "set_data", {"data": {"x": 9}})
    if now + 1 < len(versions):
        for moves in ({}, {"job": "next"}, {"bad": "bad_other"}):
            plan = play.plan(versions[now + 1], **moves)
            if not plan.refusals:
                yield from [Decision("revise", str(now + 1), more=moves)] * 3
    if prompts == ["last"] and not (state.incidents or state.behaviors):
        yield Decision("answer", "last", "done")
    for wait in state.waits.values():
        if wait.trigger.value in ("signal", "message"):
            yield Decision(wait.trigger.value, wait.ref)


def _decide(play: Play, decision: Decision, versions: list[str]) -> None:
    match decision.kind:
        case "answer":
            play.answer(decision.value, prompt=decision.about)
        case "resolve":
            play.resolve(decision.value, decision.about, **decision.more)
        case "revise":
            play.revise(versions[int(decision.about)], **decision.more)
        case "signal":
            play.signal(decision.about)
        case "message":
            play.message(decision.about)
        case "arrive":
            play.report("drive")
    assert not isinstance(play.steps[-1].records[0], r.InputIgnored), decision
