"""Whether a run completes from its present state: explored with the engine itself.

A state of a run has more in it than the marking of its net: instances, data, timers that run
already. So the engine is the transition relation here: each state is a copy of the run, and each
step an input that may come. What is explored is what would happen, and nothing has to be
translated. States that differ only in ids and in the time of day are one.

Behaviors succeed, or fail with an error that some event catches; prompts get any answer; timers
come in any order with the ends of behaviors; what is awaited of signals and messages may come, and
operators may begin other processes by theirs. Incidents that were open before are skipped, or tried
again if that helps; what else operators decide about them is not known. A new one ends its path.

What is true on the way is read by a `MomentReader`, for requirements.
"""

import copy
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

from m2pem.bpmn.data_names import unwritten
from m2pem.engine import inputs as i
from m2pem.engine.execution import triggered_starts
from m2pem.engine.records import IncidentOpened, Record, RunOutcome, Trigger
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase, Incident, RunState, RunStatus, Token
from m2pem.engine.throwing import catcher_of_error
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import Activity, Event, exchanged
from m2pem.mission.events import Signal
from m2pem.mission.mission import Mission, version_of
from m2pem.verify.state_key import NotKnownError, state_key

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
    except (NotKnownError, RecursionError) as error:
        deep = isinstance(error, RecursionError)
        reason = "its subprocesses are too deep in each other" if deep else str(error)
        explorer.found.why_incomplete = reason
        return Outlook(Verdict.UNKNOWN, reason, explorer.found)


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
        self._read_mission(run)
        found, letter = self.found, self._reader.reading(run.state).letter
        found.add(letter)
        numbers = {(self._key(run, now_us), letter): 0}
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
            decided = {item.incident for item, _ in steps if isinstance(item, i.ResolveIncident)}
            if left := [each for each in incidents if each.id in self._open_before - decided]:
                found.undecided.add(number)
                found.why_incomplete = (
                    f"operators must decide about {left[0].token.node.label}, too: {left[0].code}"
                )
            if not steps and (opened or not left):
                found.final.add(number)
                bad[number] = _where_it_stops(run.state, opened)
            for item, at_us in steps:  # grows
                text = self._said(run.state, item)
                following = copy.deepcopy(run) if len(steps) > 1 else run
                reading = self._reader.reading(following.state)
                self._receive(following, item, at_us, reading.read)
                if at_us == now_us:
                    steps += [(item, later_us) for later_us in _later(run, following, now_us)]
                key = (self._key(following, at_us), reading.letter)
                known = numbers.setdefault(key, len(found.letters))
                if known == len(found.letters):
                    if known >= self._limits.states:
                        raise NotKnownError(f"there are more than {self._limits.states} states")
                    found.add(reading.letter)
                    waiting.append((known, following, at_us))
                step = Transition(known, tuple(reading.letters), text)
                found.transitions[number].append(step)
        found.expanded = len(found.letters)
        return _judge(found, good, bad)

    def _read_mission(self, run: MissionRun) -> None:
        """Read the version of the mission that holds now."""
        mission = run.state.mission
        known = {name for each in run.state.scopes.values() for name in each.data}
        self._reads_more = any(unwritten(mission, known, {}, {}))
        self._bringing = _bringing(mission)
        root = run.state.root.container.process if run.state.root else mission.process()
        self._begun = [
            (Trigger.SIGNAL if isinstance(each, Signal) else Trigger.MESSAGE, each.id, start)
            for start in triggered_starts(mission, root)
            for each in exchanged(start)
            if each.from_operator
        ]
        self._labels = {node.id: node.label for node in mission.nodes}
        self._alike = Counter(self._labels.values())
        self._codes = list(dict.fromkeys(["FAILED", *(e.code for e in mission.errors.values())]))

    def _choose(self, choice: i.ResolveIncident | i.Revise, now_us: int) -> None:
        """Carry out the choice, and let the run go on if it is paused."""
        run, observe = self._first, self._reader.observe
        if isinstance(choice, i.Revise):  # its plan is that of the run as it is
            self._receive(run, choice, now_us, observe)
            if version_of(run.state.mission) != choice.version:
                raise NotKnownError("the run has gone on since the plan of the revision was made")
        self._receive(run, i.SetBreakpoints(), now_us, observe)  # an author lets it go on
        if run.state.status is RunStatus.PAUSED:
            self._receive(run, i.ResumeRun(), now_us, observe)
        if isinstance(choice, i.ResolveIncident):
            self._receive(run, choice, now_us, observe)

    def _steps(self, run: MissionRun, now_us: int) -> list[tuple[i.Input, int]]:
        """Return the inputs that may come next, each with its time."""
        state = run.state
        if state.allocations:
            raise NotKnownError("a task chooses its vehicles or payloads when it starts")
        for behavior in state.behaviors.values():
            if behavior.phase is BehaviorPhase.CANCELLING:  # whatever else comes, this does
                ended = BehaviorState.CANCELLED
                return [(i.BehaviorReported(behavior.id, behavior.number + 1, ended), now_us)]
        items: list[i.Input] = []
        for behavior in state.behaviors.values():
            if behavior.phase is BehaviorPhase.UNSETTLED:
                continue  # its prompt is answered
            if behavior.name in self._writers:
                raise NotKnownError(f"what {behavior.name} writes is not known")
            number = behavior.number + 1
            items.append(i.BehaviorReported(behavior.id, number, BehaviorState.SUCCEEDED))
            items += [
                i.BehaviorReported(behavior.id, number, BehaviorState.FAILED, code)
                for code in self._caught_at(state.tokens[behavior.token])
            ]
        for prompt in state.prompts.values():
            items += [i.PromptAnswer(prompt.id, each["value"]) for each in prompt.decisions]
        for service in state.services.values():
            raise NotKnownError(f"what {service.name} writes is not known")
        active = {scope.container for scope in state.scopes.values()}
        begun = [(what, ref) for what, ref, start in self._begun if start.container not in active]
        for trigger, ref in dict.fromkeys((*state.catchers, *begun)):
            if self._reads_more or ref in self._bringing:
                raise NotKnownError(f"what {trigger.value}s from outside bring is not known")
            came = i.SignalReceived if trigger is Trigger.SIGNAL else i.MessageReceived
            items.append(came(ref))
        for incident in state.incidents.values():
            if incident.id not in self._open_before:
                continue
            if i.IncidentChoice.SKIP in incident.choices:
                items.append(i.ResolveIncident(incident.id, i.IncidentChoice.SKIP))
            if self._can_retry(run, incident, now_us):
                items.append(i.ResolveIncident(incident.id, i.IncidentChoice.RETRY))
        found = [(item, now_us) for item in items]
        due_us = run.next_due_us
        if due_us is not None:
            found.append((i.Tick(), max(now_us, due_us)))
        return found

    def _can_retry(self, run: MissionRun, incident: Incident, now_us: int) -> bool:
        """Whether the element of an incident succeeds with the data as it is now."""
        tried = copy.deepcopy(run)
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
            case i.SignalReceived(ref) | i.MessageReceived(ref):
                signal = isinstance(item, i.SignalReceived)
                root = (state.mission.signals if signal else state.mission.messages).get(ref)
                return f"{'signal' if signal else 'message'} {root.name if root else ref} comes"
            case i.ResolveIncident(incident, choice):
                how = "skipped" if choice is i.IncidentChoice.SKIP else "tried again"
                return f"{self._label(state.incidents[incident].token.node.id)} is {how}"
            case _:
                return "a timer ends"

    def _key(self, run: MissionRun, now_us: int) -> tuple[Any, ...]:
        return state_key(run.state, now_us, self._open_before)

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
        raise NotKnownError("a loop of the mission does not wait")

    def _check_time(self) -> None:
        if time.monotonic() > self._until:
            raise NotKnownError(f"more than {self._limits.seconds:g} s are needed")


def _bringing(mission: Mission) -> frozenset[str]:
    """Return the ids of what brings data, or is for those receivers whose keys it matches."""
    keyed = [ref for ref, each in mission.messages.items() if each.correlation_key is not None]
    keyed += [ref for each in mission.correlation_properties for ref in each.retrieve]
    return frozenset(keyed) | {
        root.id
        for node in mission.nodes
        if isinstance(node, Activity | Event) and (node.data_flow.inputs or node.data_flow.outputs)
        for root in exchanged(node)
    }


def _later(run: MissionRun, following: MissionRun, now_us: int) -> set[int]:
    """Return later times at which an input would come before the next timer, too, and the timers
    that it begins are due after others that run already: those would be due first."""
    old = [each for each in run.state.waits.values() if each.trigger is Trigger.TIMER]
    new = [
        each
        for each in following.state.waits.values()
        if each.trigger is Trigger.TIMER and each.id not in run.state.waits and not each.calendar
    ]
    due_us = run.next_due_us or 0
    times = {now_us + o.due_us - n.due_us + 1 for o in old for n in new if not o.calendar}
    return {each for each in times if now_us < each < due_us}


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
