"""Whether a run completes from its present state: explored with the engine itself.

A state of a run has more in it than the marking of its net: instances, data, timers that run
already. So the engine is the transition relation here: each state is a copy of the run, and each
step an input that may come. What is explored is what would happen, and nothing has to be
translated. States that differ only in ids and in the time of day are one.

Behaviors succeed, or fail with an error that some event catches; prompts get any answer; timers
come in any order with the ends of behaviors; operators may send signals. Incidents that were open
before are skipped, or tried again if that helps; what else operators decide about them is not
known. A new one ends its path.

What is true on the way is read by a `MomentReader`, for requirements.
"""

import copy
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol, TypeAlias

import msgspec

from m2pem.engine import inputs as i
from m2pem.engine.execution import received_messages
from m2pem.engine.records import IncidentOpened, Record, RunOutcome, Trigger
from m2pem.engine.run import MissionRun
from m2pem.engine.state import (
    BehaviorPhase,
    Incident,
    KeptMessage,
    RunState,
    RunStatus,
    Scope,
    Token,
    Wait,
)
from m2pem.engine.throwing import catcher_of_error
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import version_of

Key: TypeAlias = tuple[Any, ...]

MAX_CONTINUES = 100
"""Batches of steps after which an input counts as one that never comes to an end."""


class Verdict(StrEnum):
    """What follows from a state. The values are those of `m2pem.api.IncidentVerdict`."""

    COMPLETES = "completes"
    MAY_NOT_COMPLETE = "may not complete"
    CANNOT_COMPLETE = "cannot complete"
    UNKNOWN = "not known"


@dataclass(frozen=True, slots=True)
class Transition:
    """From one state to another. `letters`: of the moments on the way, those that are as the one
    before left out; `text`: what comes, for people."""

    target: int
    letters: tuple[int, ...]
    text: str


@dataclass(slots=True)
class StateSpace:
    """What was explored, by the numbers of states; 0 is the state after the choice.

    `transitions`: from each state. `letters`: of the last moment of each. `final`: the states after
    which nothing comes. `undecided`: the states in which operators must first decide about an
    earlier incident. `expanded`: so many states, the first ones, have all their transitions.
    `why_incomplete`: why the others have not; "": there are none.
    """

    transitions: list[list[Transition]] = field(default_factory=list)
    letters: list[int] = field(default_factory=list)
    final: set[int] = field(default_factory=set)
    undecided: set[int] = field(default_factory=set)
    expanded: int = 0
    why_incomplete: str = ""

    def add(self, letter: int) -> None:
        """Add a state."""
        self.transitions.append([])
        self.letters.append(letter)


@dataclass(frozen=True, slots=True)
class Outlook:
    """The verdict, its reason for people, and the states that were explored to find it."""

    verdict: Verdict
    reason: str = ""
    explored: StateSpace = field(default_factory=StateSpace, compare=False, repr=False)


class Reading(Protocol):
    """Reads the records of what follows one state. `letters`: of the moments so far; `letter`: of
    the last one."""

    letters: list[int]

    @property
    def letter(self) -> int: ...

    def read(self, records: Sequence[Record]) -> None:
        """Read the records of one input."""


class MomentReader(Protocol):
    """Reads what is true as the run goes on: `m2pem.monitors.requirement_outlook`."""

    def observe(self, records: Sequence[Record]) -> None:
        """Read the records of the choice itself."""

    def reading(self, state: RunState) -> Reading:
        """Read what follows a state of the run, in which no input is half done."""


class _NoReading:
    """Nothing is of interest on the way."""

    def __init__(self) -> None:
        self.letters: list[int] = []
        self.letter = 0

    def read(self, records: Sequence[Record]) -> None:
        pass


class _NoReader:
    def observe(self, records: Sequence[Record]) -> None:
        pass

    def reading(self, state: RunState) -> Reading:
        return _NoReading()


@dataclass(frozen=True, slots=True)
class OutlookLimits:
    """Bounds of the exploration: states, and seconds of the wall clock."""

    states: int = 3000
    seconds: float = 4.0


class _NotKnownError(Exception):
    """The exploration cannot say what follows; the text says why."""


def outlook(
    run: MissionRun,
    now_us: int,
    choice: i.ResolveIncident | i.Revise,
    limits: OutlookLimits | None = None,
    writers: frozenset[str] = frozenset(),
    reader: MomentReader | None = None,
) -> Outlook:
    """Return whether a run completes after a choice about an incident, or a revision.

    `run` is changed. `now_us`: microseconds since the Unix epoch. `writers`: names of behaviors
    that write data when they end. `reader`: reads what is true as the run goes on.
    """
    explorer = _Explorer(run, limits or OutlookLimits(), writers, reader or _NoReader())
    try:
        return explorer.explore(now_us, choice)
    except _NotKnownError as error:
        explorer.found.why_incomplete = str(error)
        return Outlook(Verdict.UNKNOWN, str(error), explorer.found)


class _Explorer:
    def __init__(
        self,
        run: MissionRun,
        limits: OutlookLimits,
        writers: frozenset[str],
        reader: MomentReader,
    ) -> None:
        self.found = StateSpace()
        self._reader = reader
        self._first = run
        self._limits = limits
        self._until = time.monotonic() + limits.seconds
        self._writers = writers
        self._open_before = frozenset(run.state.incidents)

    def explore(self, now_us: int, choice: i.ResolveIncident | i.Revise) -> Outlook:
        """Explore all states, breadth first, and judge them."""
        self._choose(choice, now_us)
        run = self._first
        mission = run.state.mission
        shared = [mission, *mission.elements.values()]
        self._shared = {id(each): each for each in shared}
        self._labels = {node.id: node.label for node in mission.nodes}
        self._alike = Counter(self._labels.values())
        self._codes = list(dict.fromkeys(["FAILED", *(e.code for e in mission.errors.values())]))
        found, letter = self.found, self._reader.reading(run.state).letter
        found.add(letter)
        numbers = {(_key(run.state, now_us), letter): 0}
        good: list[int] = []
        bad: dict[int, str] = {}
        waiting = deque([(0, run, now_us)])
        while waiting:
            number, run, now_us = waiting.popleft()
            found.expanded = number
            self._check_time()
            if run.state.status is RunStatus.ENDED:
                found.final.add(number)
                if run.state.outcome in (RunOutcome.COMPLETED, RunOutcome.TERMINATED):
                    good.append(number)
                else:
                    bad[number] = run.state.detail
                continue
            steps = self._steps(run, now_us)
            incidents = list(run.state.incidents.values())
            opened = [each for each in incidents if each.id not in self._open_before]
            if not steps and incidents and not opened:
                found.undecided.add(number)
                stopped = incidents[0].token.node.label
                found.why_incomplete = (
                    f"operators must decide about {stopped}, too: {incidents[0].code}"
                )
            elif not steps:
                found.final.add(number)
                bad[number] = _where_it_stops(run.state, opened)
            texts = [self._said(run.state, item) for item, _ in steps]
            for (item, at_us), text in zip(steps, texts, strict=True):
                following = copy.deepcopy(run, dict(self._shared)) if len(steps) > 1 else run
                reading = self._reader.reading(following.state)
                self._receive(following, item, at_us, reading.read)
                key = (_key(following.state, at_us), reading.letter)
                known = numbers.setdefault(key, len(found.letters))
                if known == len(found.letters):
                    if known >= self._limits.states:
                        raise _NotKnownError(f"there are more than {self._limits.states} states")
                    found.add(reading.letter)
                    waiting.append((known, following, at_us))
                step = Transition(known, tuple(reading.letters), text)
                found.transitions[number].append(step)
        found.expanded = len(found.letters)
        return _judge(found, good, bad)

    def _choose(self, choice: i.ResolveIncident | i.Revise, now_us: int) -> None:
        """Carry out the choice, and let the run go on if it is paused."""
        run, observe = self._first, self._reader.observe
        if isinstance(choice, i.Revise):  # its plan is that of the run as it is
            self._receive(run, choice, now_us, observe)
            if version_of(run.state.mission) != choice.version:
                raise _NotKnownError("the run has gone on since the plan of the revision was made")
        self._receive(run, i.SetBreakpoints(), now_us, observe)  # an author lets it go on
        if run.state.status is RunStatus.PAUSED:
            self._receive(run, i.ResumeRun(), now_us, observe)
        if isinstance(choice, i.ResolveIncident):
            self._receive(run, choice, now_us, observe)

    def _steps(self, run: MissionRun, now_us: int) -> list[tuple[i.Input, int]]:
        """Return the inputs that may come next, each with its time."""
        state = run.state
        if state.allocations:
            raise _NotKnownError("a task chooses its vehicles or payloads when it starts")
        for behavior in state.behaviors.values():
            if behavior.phase is BehaviorPhase.CANCELLING:  # whatever else comes, this does
                ended = BehaviorState.CANCELLED
                return [(i.BehaviorReported(behavior.id, behavior.number + 1, ended), now_us)]
        items: list[i.Input] = []
        for behavior in state.behaviors.values():
            if behavior.phase is BehaviorPhase.UNSETTLED:
                continue  # its prompt is answered
            if behavior.name in self._writers:
                raise _NotKnownError(f"what {behavior.name} writes is not known")
            number = behavior.number + 1
            items.append(i.BehaviorReported(behavior.id, number, BehaviorState.SUCCEEDED))
            items += [
                i.BehaviorReported(behavior.id, number, BehaviorState.FAILED, code)
                for code in self._caught_at(state.tokens[behavior.token])
            ]
        for prompt in state.prompts.values():
            items += [i.PromptAnswer(prompt.id, each["value"]) for each in prompt.decisions]
        for service in state.services.values():
            raise _NotKnownError(f"what {service.name} writes is not known")
        for trigger, ref in list(state.catchers):
            if trigger is Trigger.MESSAGE:
                raise _NotKnownError("what messages from outside bring is not known")
            items.append(i.SignalReceived(ref))
        for incident in state.incidents.values():
            if incident.id not in self._open_before:
                continue
            if i.IncidentChoice.SKIP in incident.choices:
                items.append(i.ResolveIncident(incident.id, i.IncidentChoice.SKIP))
            elif self._can_retry(run, incident, now_us):
                items.append(i.ResolveIncident(incident.id, i.IncidentChoice.RETRY))
        found = [(item, now_us) for item in items]
        due_us = run.next_due_us
        if due_us is not None:
            found.append((i.Tick(), max(now_us, due_us)))
        return found

    def _can_retry(self, run: MissionRun, incident: Incident, now_us: int) -> bool:
        """Whether the element of an incident succeeds with the data as it is now."""
        tried = copy.deepcopy(run, dict(self._shared))
        records: list[Record] = []
        retry = i.ResolveIncident(incident.id, i.IncidentChoice.RETRY)
        self._receive(tried, retry, now_us, records.extend)
        element = incident.token.node.id
        return not any(isinstance(e, IncidentOpened) and e.element == element for e in records)

    def _said(self, state: RunState, item: i.Input) -> str:
        """Return what comes, for people."""
        match item:
            case i.BehaviorReported(behavior, _, now, code):
                label = self._label(state.behaviors[behavior].element)
                if now is BehaviorState.FAILED:
                    return f"{label} fails with {code}"
                done = now is BehaviorState.SUCCEEDED
                return f"{label} {'succeeds' if done else 'is cancelled'}"
            case i.PromptAnswer(prompt, value):
                return f"{self._label(state.prompts[prompt].token.node.id)} is answered {value}"
            case i.SignalReceived(ref):
                signal = state.mission.signals.get(ref)
                return f"signal {signal.name if signal else ref} comes"
            case i.ResolveIncident(incident, choice):
                how = "skipped" if choice is i.IncidentChoice.SKIP else "tried again"
                return f"{self._label(state.incidents[incident].token.node.id)} is {how}"
            case _:
                return "a timer ends"

    def _label(self, element: str) -> str:
        """Return what to call an element of the run; with its id where others are called so."""
        label = self._labels.get(element, element)  # a revision may have removed it
        return label if self._alike[label] <= 1 else f"{label} ({element})"

    def _caught_at(self, token: Token) -> list[str]:
        return [code for code in self._codes if catcher_of_error(token, code) is not None]

    def _receive(
        self,
        run: MissionRun,
        item: i.Input,
        at_us: int,
        read: Callable[[Sequence[Record]], None],
    ) -> None:
        """Give a run an input, and all steps that follow at once."""
        read(run.receive(item, at_us).records)
        for _ in range(MAX_CONTINUES):
            if not run.wants_continue:
                return
            self._check_time()
            read(run.receive(i.Continue(), at_us).records)
        raise _NotKnownError("a loop of the mission does not wait")

    def _check_time(self) -> None:
        if time.monotonic() > self._until:
            raise _NotKnownError(f"more than {self._limits.seconds:g} s are needed")


def _where_it_stops(state: RunState, opened: Sequence[Incident]) -> str:
    for incident in opened:
        return f"it stops at {incident.token.node.label}: {incident.code}"
    nodes = dict.fromkeys(t.node.label for t in state.tokens.values() if t.inner is None)
    return f"it waits at {', '.join(nodes)}"


ROUND_AND_ROUND = "it goes round in a loop that it does not leave"


def _judge(found: StateSpace, good: list[int], bad: dict[int, str]) -> Outlook:
    following = [[each.target for each in steps] for steps in found.transitions]
    reaches = leading_to([*good, *found.undecided], following)
    reason = next(iter(bad.values()), ROUND_AND_ROUND)
    if 0 not in reaches:
        return Outlook(Verdict.CANNOT_COMPLETE, reason, found)
    if bad or len(reaches) < len(found.letters):
        return Outlook(Verdict.MAY_NOT_COMPLETE, reason, found)
    if found.undecided:
        return Outlook(Verdict.UNKNOWN, found.why_incomplete, found)
    return Outlook(Verdict.COMPLETES, explored=found)


def leading_to(states: Iterable[int], following: Sequence[Sequence[int]]) -> set[int]:
    """Return the states from which one of `states` can be reached. `following`: by state, those
    that follow it."""
    before: list[list[int]] = [[] for _ in following]
    for state, targets in enumerate(following):
        for target in targets:
            before[target].append(state)
    reaches = set(states)
    waiting = list(reaches)
    while waiting:
        for earlier in before[waiting.pop()]:
            if earlier not in reaches:
                reaches.add(earlier)
                waiting.append(earlier)
    return reaches


# --- states ---------------------------------------------------------------------------------------


def _key(state: RunState, now_us: int) -> Key:
    """Return what distinguishes states: everything but ids and the time of day."""
    if state.status is RunStatus.ENDED:
        return ("ended", state.outcome, state.detail)
    roots = [scope for scope in state.scopes.values() if scope.parent is None]
    return (
        state.status,
        tuple(_scope(state, scope, now_us) for scope in roots),
        _encoded(state.shared.data),
        _encoded({ref: [(m.data, m.keys) for m in kept] for ref, kept in _receivable(state)}),
        tuple(state.taken),
        tuple(sorted((b.name, b.element, b.phase) for b in state.behaviors.values())),
    )


def _receivable(state: RunState) -> Iterable[tuple[str, list[KeptMessage]]]:
    """Return the kept messages that something can receive; others are for a later revision."""
    received = received_messages(state.mission)
    return [each for each in state.kept_messages.items() if each[0] in received]


def _encoded(data: object) -> bytes:
    return msgspec.json.encode(data, order="deterministic")


def _scope(state: RunState, scope: Scope, now_us: int) -> Key:
    if scope.compensations:
        raise _NotKnownError("something is being compensated")
    places = {token.id: place for place, token in enumerate(scope.tokens.values())}
    loop = scope.loop
    return (
        scope.container.id,
        _encoded(scope.data),
        tuple(_token(state, token, now_us) for token in scope.tokens.values()),
        tuple(
            (node.id, flow.id, tuple(places[token.id] for token in tokens))
            for node, join in scope.joins.items()
            for flow, tokens in join.by_flow.items()
        ),
        _waits(state, scope.waits, now_us),
        loop
        and (
            *(loop.total, loop.started, loop.completed, loop.terminated),
            _encoded(sorted(loop.outputs.items())),  # JSON has no numbers as keys
        ),
        tuple((node.id, tuple(places[t.id] for t in ts)) for node, ts in scope.gathered.items()),
        tuple((node.id, tuple(f.id for f in flows)) for node, flows in scope.activated.items()),
        tuple(node.id for node in scope.chosen),
        tuple(node.id for node in scope.begun),
        (scope.completing, scope.interrupted, scope.cancelled, scope.reopened),
        tuple((done.node.id, done.instance) for done in (scope.compensable or {}).values()),
    )


def _token(state: RunState, token: Token, now_us: int) -> Key:
    behavior = state.behaviors.get(token.behavior)
    return (
        token.node.id,
        token.flow.id if token.flow is not None else "",
        token.instance,
        _encoded(token.own),
        (behavior.name, behavior.phase, behavior.resources) if behavior is not None else (),
        bool(token.prompt),
        bool(token.service),
        state.incidents[token.incident].code if token.incident else "",
        (token.armed, token.ended_early),
        _waits(state, token.waits, now_us),
        _scope(state, token.inner, now_us) if token.inner is not None else (),
    )


def _waits(state: RunState, waits: dict[int, Wait] | None, now_us: int) -> Key:
    mission_time_us = state.mission_time_us(now_us)
    return tuple(
        (
            wait.node.id,
            wait.trigger,
            wait.ref,
            (wait.due_us - (now_us if wait.calendar else mission_time_us))
            if wait.trigger is Trigger.TIMER
            else 0,
            wait.left,
            state.conditions.get(wait.id, False),
        )
        for wait in (waits or {}).values()
    )
