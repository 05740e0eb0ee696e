"""One run as an operator sees it, folded from its records: what is active, and what has just been.

Times of finishing are of the operator's own clock (seconds), as fading is for eyes; all else is
mission time.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from m2pem.api import records as r
from m2pem.api.control import RunId, RunStatus, StampedRecord

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission

REMEMBERED = 20
"""Finished elements kept for fading."""

SHOWN_WHEN_DONE = frozenset(
    {
        "Task",
        "ManualTask",
        "UserTask",
        "ScriptTask",
        "ServiceTask",
        "SendTask",
        "ReceiveTask",
        "CallActivity",
        "SubProcess",
        "IntermediateCatchEvent",
        "BoundaryEvent",
    }
)
"""Kinds of elements in which something happens; gateways and start events only pass tokens on."""


@dataclass(slots=True)
class Doing:
    """A behavior or service of an active element."""

    what: str
    who: tuple[str, ...] = ()
    state: str = ""


@dataclass(frozen=True, slots=True)
class Wait:
    """A trigger that is awaited; `element` is its catcher. `due_s`: mission time of a duration."""

    element: str
    trigger: r.Trigger
    ref: str
    due_s: float | None


@dataclass(slots=True)
class Active:
    """A token on an element."""

    token: int
    element: str
    scope: int
    order: int
    since_s: float
    doing: dict[str, Doing] = field(default_factory=dict)
    prompts: set[str] = field(default_factory=set)
    waits: dict[int, Wait] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Done:
    """An element that a token has left, and when by the operator's clock."""

    element: str
    scope: int
    order: int
    outcome: r.TokenOutcome
    at: float


@dataclass(frozen=True, slots=True)
class Scope:
    """An instance of a process or subprocess; `token` sits on its activity in `parent`."""

    element: str
    parent: int | None
    token: int | None


class Board:
    """Apply a run's records in order; those seen already change nothing."""

    def __init__(self, run: RunId, mission: "Mission") -> None:
        self.run = run
        self.mission = mission
        self.seq = 0
        self.status = RunStatus.RUNNING
        self.outcome_detail = ""
        self.by = ""
        self.time_s = 0.0
        self.active: dict[int, Active] = {}
        self.scopes: dict[int, Scope] = {}
        self.done: deque[Done] = deque(maxlen=REMEMBERED)
        self.prompts: dict[str, str] = {}
        self.completed: set[str] = set()
        self._order = 0
        self._of_behavior: dict[str, int] = {}
        self._of_service: dict[str, int] = {}
        self._of_prompt: dict[str, int] = {}
        self._of_wait: dict[int, int] = {}
        self._of_scopes: dict[int, tuple[int, str]] = {}
        """What scopes wait for, to begin an event subprocess: the scope and the signal, by wait."""

    @property
    def name(self) -> str:
        """What to call the mission: its file's name without folders and ending."""
        return self.mission.file.replace("\\", "/").rpartition("/")[2].removesuffix(".bpmn")

    def label(self, element: str) -> str:
        """What the diagram calls an element."""
        found = self.mission.elements.get(element)
        return found.label if found is not None else element

    def behavior_name(self, behavior: str) -> str | None:
        """What a behavior that has not ended is called, by its id."""
        active = self.active.get(self._of_behavior.get(behavior, 0))
        doing = active.doing.get(behavior) if active is not None else None
        return doing.what if doing is not None else None

    def task(self, behavior: str) -> str | None:
        """The label of the task of a behavior that has not ended, by its id."""
        active = self.active.get(self._of_behavior.get(behavior, 0))
        return self.label(active.element) if active is not None else None

    def signals(self) -> Mapping[str, tuple[str, bool]]:
        """Signals of the mission by id: name, and whether one is awaited now."""
        awaited = {wait.ref for active in self.active.values() for wait in active.waits.values()}
        awaited.update(ref for _, ref in self._of_scopes.values())
        return {
            signal.id: (signal.name or signal.id, signal.id in awaited)
            for signal in self.mission.signals.values()
        }

    def progress(self) -> tuple[int, int]:
        """Activities that were completed at least once, and all that the diagram has."""
        activities = {each.id for each in self.mission.activities()}
        return len(self.completed & activities), len(activities)

    # --- records --------------------------------------------------------------------------------

    def apply(self, stamped: StampedRecord, now: float) -> bool:
        """Take a record in; `now` is the operator's clock. False: it was known already."""
        if stamped.seq <= self.seq:
            return False
        self.seq = stamped.seq
        self.time_s = stamped.t_s
        self._of_run(stamped.record)
        self._of_tokens(stamped.record, stamped.t_s, now)
        self._of_work(stamped.record)
        return True

    def _of_run(self, record: r.Record) -> None:
        match record:
            case r.RunPaused(by=by):
                self.status, self.by = RunStatus.PAUSED, by
            case r.RunResumed():
                self.status, self.by = RunStatus.RUNNING, ""
            case r.RunEnded(outcome=outcome, detail=detail):
                self.status = RunStatus(outcome.value)
                self.outcome_detail = detail

    def _of_tokens(self, record: r.Record, t_s: float, now: float) -> None:
        match record:
            case r.ScopeOpened():
                self.scopes[record.scope] = Scope(record.element, record.parent, record.token)
            case r.ScopeClosed(scope=scope):
                self.scopes.pop(scope, None)
                self._forget_waits_of(scope)
            case r.ScopeInterrupted(scope=scope):
                self._forget_waits_of(scope)
            case r.TokenEntered():
                self._order += 1
                self.active[record.token] = Active(
                    record.token, record.element, record.scope, self._order, t_s
                )
            case r.TokenLeft():
                left = self.active.pop(record.token, None)
                if left is None or record.outcome is r.TokenOutcome.CONSUMED:
                    return
                if record.outcome is r.TokenOutcome.COMPLETED:
                    self.completed.add(left.element)
                if type(self.mission.elements.get(left.element)).__name__ in SHOWN_WHEN_DONE:
                    self.done.append(
                        Done(left.element, left.scope, left.order, record.outcome, now)
                    )

    def _of_work(self, record: r.Record) -> None:
        match record:
            case r.BehaviorRequested():
                self._of_behavior[record.behavior] = record.token
                self._begin(record.token, record.behavior, record.name, record.resources)
            case r.BehaviorProgressed(behavior=behavior, state=state):
                self._turn(behavior, state.value.lower())
            case r.BehaviorUnsettled(behavior=behavior):
                self._turn(behavior, "unsettled")
            case r.BehaviorRestarted(behavior=behavior) | r.BehaviorContinued(behavior=behavior):
                self._turn(behavior, "")
            case r.BehaviorEnded(behavior=behavior):
                self._end(self._of_behavior.pop(behavior, 0), behavior)
            case r.ServiceRequested():
                self._of_service[record.service] = record.token
                self._begin(record.token, record.service, record.name, ())
            case r.ServiceEnded(service=service) | r.ServiceWithdrawn(service=service):
                self._end(self._of_service.pop(service, 0), service)
            case r.PromptOpened():
                self._of_prompt[record.prompt] = record.token
                self.prompts[record.prompt] = record.element
                if active := self.active.get(record.token):
                    active.prompts.add(record.prompt)
            case r.PromptAnswered(prompt=prompt) | r.PromptWithdrawn(prompt=prompt):
                self.prompts.pop(prompt, None)
                if active := self.active.get(self._of_prompt.pop(prompt, 0)):
                    active.prompts.discard(prompt)
            case r.EventAwaited():
                timer = record.trigger is r.Trigger.TIMER and not record.calendar
                due_s = record.due_us / 1_000_000 if timer else None
                self._of_wait[record.wait] = record.token
                if not record.token:
                    self._of_scopes[record.wait] = (record.scope, record.ref)
                if active := self.active.get(record.token):
                    wait = Wait(record.element, record.trigger, record.ref, due_s)
                    active.waits[record.wait] = wait
            case r.EventTriggered(wait=over):
                self._of_scopes.pop(over, None)
                if active := self.active.get(self._of_wait.pop(over, 0)):
                    active.waits.pop(over, None)

    def _forget_waits_of(self, scope: int) -> None:
        ended = [wait for wait, (holder, _) in self._of_scopes.items() if holder == scope]
        for wait in ended:
            del self._of_scopes[wait]

    def _begin(self, token: int, key: str, what: str, who: tuple[str, ...]) -> None:
        if active := self.active.get(token):
            active.doing[key] = Doing(what, who)

    def _turn(self, behavior: str, state: str) -> None:
        active = self.active.get(self._of_behavior.get(behavior, 0))
        if active and (doing := active.doing.get(behavior)):
            doing.state = state

    def _end(self, token: int, key: str) -> None:
        if active := self.active.get(token):
            active.doing.pop(key, None)
