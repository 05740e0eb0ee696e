"""Moving tokens: the operations that the handlers of elements are made of.

An `Execution` lives as long as its run. Between inputs it keeps only tables of the mission. The
steps still to do are a queue of tokens to activate and scopes to check; nothing recurses. Every
change is a record that is applied at once, so that the next decision sees it.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import ClassVar, TypeAlias

from m2pem.engine import records as r
from m2pem.engine.apply import apply
from m2pem.engine.data import Store, flatten, store_for
from m2pem.engine.records import Record, TokenOutcome
from m2pem.engine.state import RunState, Scope, Token
from m2pem.errors import InternalError
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    CallActivity,
    Event,
    EventBasedGateway,
    FlowNode,
    IntermediateCatchEvent,
    Process,
    ReceiveTask,
    SequenceFlow,
    StartEvent,
    SubProcess,
    Transaction,
    caught_by,
)
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    Message,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import upstream
from m2pem.mission.values import Value

NO_FLEET = Fleet("", "no fleet", {})
"""The fleet of a mission that commands no resource."""


class Waits(Enum):
    """What a node waits for as soon as a token enters it."""

    NOTHING = "nothing"
    AT_ITSELF = "at itself"
    """It only waits, or opens a scope that waits: there is no later step."""
    AT_ITS_BOUNDARY = "at its boundary"
    """Its boundary events are armed at once; its work begins in its turn."""


Hook: TypeAlias = Callable[["Execution", Token], None]


def _no_hook(x: "Execution", token: Token) -> None:
    raise InternalError(f"{token.node.id}: {type(token.node).__name__} has no such hook")


@dataclass(frozen=True, slots=True)
class ElementHandler:
    """The hooks of one kind of BPMN element. Each is called with the token on the element.

    `activate`: its turn in the queue has come. `enter`: a token has entered it, before any other
    step; only of elements that wait for events. `execute`: an activity does its own work, after
    `activate` has armed its boundary events, begun its loop and filled its data inputs. `trigger`:
    the event that the token waited for at the element has occurred. `complete`: its work is done.
    `answer`: an operator has made a decision.

    Interruption is the same for all elements: `m2pem.engine.scopes.withdraw`.
    """

    activate: Hook
    enter: Hook = _no_hook
    execute: Hook = _no_hook
    trigger: Hook = _no_hook
    complete: Hook = _no_hook
    answer: Callable[["Execution", Token, str], None] | None = None


class Execution:
    """The records of the input being decided, and the steps it still causes."""

    handlers: ClassVar[Mapping[type[FlowNode], ElementHandler]]
    """The handler of each kind of element: `m2pem.engine.elements.HANDLERS`."""

    __slots__ = (
        "_reach",
        "_triggered_starts",
        "at_breakpoints",
        "breakpoints",
        "data_changed",
        "ended_instances",
        "entered",
        "fleet",
        "joins_to_check",
        "mission",
        "now_us",
        "process_ids",
        "queue",
        "records",
        "state",
        "steps_left",
        "waits",
    )

    def __init__(self, state: RunState, fleet: Fleet | None) -> None:
        self.state = state
        self.fleet = fleet if fleet is not None else NO_FLEET
        self.now_us = 0
        self.records: list[Record] = []
        self.queue: deque[Token | Scope] = deque()
        self.entered: deque[Token] = deque()  # at elements that wait: they come before the queue
        self.ended_instances: deque[tuple[Token, TokenOutcome]] | None = None
        self.joins_to_check: set[int] = set()  # scopes whose inclusive joins must be checked
        self.breakpoints: frozenset[str] = frozenset()
        self.at_breakpoints: list[Token] = []  # they have entered elements with breakpoints
        self.steps_left = 0  # steps that the batch still allows
        self.data_changed = False  # whether conditions must be evaluated before the next step
        self.read_mission()

    def read_mission(self) -> None:
        """Make the tables of the mission, for the version that the run has now."""
        self.mission: Mission = self.state.mission
        self.process_ids = [node.container.process.id for node in self.mission.nodes]
        self.waits = {
            node: waits
            for node in self.mission.nodes
            if (type(node) in _MAY_WAIT or (isinstance(node, Activity) and node.boundary))
            and (waits := waits_when_entered(node)) is not Waits.NOTHING
        }
        self._reach: dict[FlowNode, dict[FlowNode, int]] = {}
        self._triggered_starts: tuple[FlowNode, ...] | None = None

    def emit(self, record: Record) -> None:
        """Add a record and apply it."""
        self.records.append(record)
        apply(self.state, record)

    def ignore(self, reason: str) -> None:
        """Record why an input changes nothing."""
        self.emit(r.InputIgnored(reason))

    def open_prompt(
        self, token: Token, text: str, decisions: Iterable[dict[str, str]], role: str = ""
    ) -> None:
        """Ask operators what a token waits for."""
        node, number = token.node, self.state.last_prompt + 1
        place = self.process_of(node), node.id, token.scope.id
        self.emit(r.PromptOpened(token.id, *place, f"p{number}", text, tuple(decisions), role))

    def process_of(self, node: FlowNode) -> str:
        """Return the id of the process that contains a node."""
        return self.process_ids[node.index]

    def upstream(self, join: FlowNode) -> dict[FlowNode, int]:
        """Return `m2pem.mission.reachability.upstream` of a join, computed once."""
        reach = self._reach.get(join)
        if reach is None:
            reach = self._reach[join] = upstream(join)
        return reach

    @property
    def triggered_starts(self) -> tuple[FlowNode, ...]:
        """Elements that begin other processes: `triggered_starts` of the run's mission."""
        if self._triggered_starts is None:
            assert self.state.root is not None
            self._triggered_starts = triggered_starts(
                self.mission, self.state.root.container.process
            )
        return self._triggered_starts

    # --- tokens ---------------------------------------------------------------------------------

    def enter(
        self,
        token: int,
        node: FlowNode,
        scope: Scope,
        flow: SequenceFlow | None = None,
        instance: int | None = None,
    ) -> Token:
        """Put a token on a node and queue it."""
        self.emit(
            r.TokenEntered(
                token,
                self.process_ids[node.index],
                node.id,
                scope.id,
                flow.id if flow is not None else "",
                instance,
            )
        )
        entered = self.state.tokens[token]
        if node.id in self.breakpoints:
            self.at_breakpoints.append(entered)
        if instance is None and node not in self.waits:
            self.queue.append(entered)
        else:
            self.execute_later(entered)
        self.joins_to_check.add(scope.id)
        return entered

    def execute_later(self, token: Token) -> None:
        """Queue a token, or have it armed at once if its node waits."""
        node = token.node
        waits = self.waits.get(node, Waits.NOTHING)
        if token.instance is not None:
            waits = waits_when_entered(node, instance=True)
        elif type(node) is StartEvent and self.has_been_triggered(token):
            waits = Waits.NOTHING
        if waits is not Waits.NOTHING:
            self.entered.append(token)
        if waits is not Waits.AT_ITSELF:
            self.queue.append(token)

    def has_been_triggered(self, token: Token) -> bool:
        """Whether the scope of a token on a start event was opened by the event's trigger."""
        container = token.node.container
        if isinstance(container, SubProcess) and container.triggered_by_event:
            return True
        return token.scope.parent is None and token.scope is not self.state.root

    def spawn(self, node: FlowNode, scope: Scope) -> Token:
        """Put a new token on a node."""
        return self.enter(self.state.last_token + 1, node, scope)

    def is_active(self, token: Token) -> bool:
        """Whether a token is still there, and no incident stops it."""
        return self.state.tokens.get(token.id) is token and not token.incident

    def leave(self, token: Token, outcome: TokenOutcome) -> None:
        """Remove a token from its node. It is consumed unless it enters another node next."""
        node = token.node
        if token.incident:
            resources = self.state.incidents[token.incident].resources
            self.emit(r.IncidentClosed(token.incident, resources))
        self.emit(
            r.TokenLeft(
                token.id,
                self.process_ids[node.index],
                node.id,
                token.scope.id,
                outcome,
                token.instance,
            )
        )
        self.joins_to_check.add(token.scope.id)

    def consume(self, token: Token) -> None:
        """Consume a token; its scope may be complete now."""
        self.leave(token, TokenOutcome.COMPLETED)
        self.check_scope_later(token.scope)

    def proceed(self, token: Token, flows: Iterable[SequenceFlow], reason: str = "") -> None:
        """Leave along `flows`: the token takes the first, a new token each of the others (4.1).
        `reason`: why conditions of other flows were null."""
        node, scope = token.node, token.scope
        process = self.process_ids[node.index]
        self.leave(token, TokenOutcome.COMPLETED)
        number = token.id
        for flow in flows:
            self.emit(r.FlowTaken(number, process, node.id, scope.id, flow.id, reason))
            self.enter(number, flow.target, scope, flow)
            number, reason = self.state.last_token + 1, ""
        self.check_scope_later(scope)

    def check_scope_later(self, scope: Scope) -> None:
        """Queue a check of a scope in which a token was consumed: it may be complete."""
        container = scope.container
        if not scope.tokens:
            self.queue.append(scope)
        elif container.event_subprocesses and not isinstance(container, AdHocSubProcess):
            self.queue.append(scope)  # maybe only these are left

    # --- data -----------------------------------------------------------------------------------

    def write(self, token: Token, key: str, value: Value) -> None:
        """Write a value as seen from the element that a token is on."""
        for name, item in flatten(key, value):
            self.write_into(store_for(token, name), token, name, item)

    def write_into(self, place: Store, token: Token, key: str, value: Value) -> None:
        """Write one value into the given store."""
        self.data_changed = True
        node = token.node
        own = 0
        if type(place) is Token:
            store, own = place.scope.id, place.id
        else:
            store = place.id if isinstance(place, Scope) else 0
        self.emit(
            r.DataWritten(
                token.id,
                self.process_ids[node.index],
                node.id,
                token.scope.id,
                key,
                value,
                store,
                own,
            )
        )

    def write_in(self, scope: Scope, node: FlowNode, data: dict[str, Value]) -> None:
        """Write values for a node without a token, as seen from a scope."""
        self.write_at(scope, self.process_ids[node.index], node.id, data)

    def write_at(self, scope: Scope, process: str, element: str, data: dict[str, Value]) -> None:
        """The same for an element by its id, which may be the scope's own process."""
        self.data_changed = True
        for key, value in data.items():
            for name, item in flatten(key, value):
                place = store_for(scope, name)
                own, store = 0, 0
                if isinstance(place, Token):
                    own, store = place.id, place.scope.id
                elif isinstance(place, Scope):
                    store = place.id
                self.emit(r.DataWritten(0, process, element, scope.id, name, item, store, own))

    def write_all(self, token: Token, data: dict[str, Value]) -> None:
        """Write several values."""
        for key, value in data.items():
            self.write(token, key, value)


_MAY_WAIT: frozenset[type[FlowNode]] = frozenset(
    {
        AdHocSubProcess,
        CallActivity,
        EventBasedGateway,
        IntermediateCatchEvent,
        ReceiveTask,
        StartEvent,
        SubProcess,
        Transaction,
    }
)
"""Kinds of elements that may wait without a boundary event."""


def waits_when_entered(node: FlowNode, *, instance: bool = False) -> Waits:
    """Return what a node waits for as soon as a token enters it.

    `instance`: the token is an instance of a loop or multi-instance activity. Boundary events
    belong to the outer instance, which itself only begins its instances.
    """
    if not isinstance(node, Activity):
        if isinstance(node, StartEvent):
            container = node.container
            begun = isinstance(container, SubProcess) and container.triggered_by_event
            waits = bool(node.definitions) and not begun
        elif isinstance(node, IntermediateCatchEvent):
            waits = bool(node.definitions) and not node.linked_from
        else:
            waits = isinstance(node, EventBasedGateway)
        return Waits.AT_ITSELF if waits else Waits.NOTHING
    at_boundary = not instance and any(map(is_awaited, node.boundary))
    if instance or node.loop is None:
        if isinstance(node, ReceiveTask) and node.message is not None:
            return Waits.AT_ITSELF
        if isinstance(node, CallActivity | SubProcess):
            container = node.called if isinstance(node, CallActivity) else node
            starts = [start for inner in container.event_subprocesses for start in inner.starts]
            at_boundary = at_boundary or any(map(is_awaited, starts))
            return Waits.AT_ITSELF if at_boundary else Waits.NOTHING
    return Waits.AT_ITS_BOUNDARY if at_boundary else Waits.NOTHING


def is_awaited(event: Event) -> bool:
    """Whether an event is armed; the triggers of others look for their catcher when thrown."""
    return any(isinstance(definition, _AWAITED) for definition in event.definitions)


_AWAITED = (
    ConditionalEventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)


def definitions_of(node: FlowNode) -> Sequence[EventDefinition]:
    """Return the event definitions of a catch event or receive task."""
    if isinstance(node, ReceiveTask):
        return (MessageEventDefinition(node.line, node.message),) if node.message else ()
    return node.definitions if isinstance(node, Event) else ()


def triggered_starts(mission: Mission, root: Process) -> tuple[FlowNode, ...]:
    """Return the elements that begin the processes that neither a run begins with, which is `root`,
    nor a call activity calls.

    These are typed start events, instantiating receive tasks, and the events after instantiating
    event-based gateways. Each trigger makes an instance (docs/missions.md).
    """
    elsewhere = {node.called for node in mission.nodes if isinstance(node, CallActivity)}
    elsewhere.add(root)
    return tuple(
        start
        for process in mission.processes
        if process not in elsewhere
        for entry in process.entries
        for start in _triggered(entry)
    )


def _triggered(entry: FlowNode) -> Sequence[FlowNode]:
    if isinstance(entry, EventBasedGateway):
        return [flow.target for flow in entry.outgoing]
    if isinstance(entry, StartEvent):
        return [entry] if entry.definitions else []
    return [entry] if isinstance(entry, ReceiveTask) and entry.instantiate else []


def armed_triggers(start: FlowNode) -> Sequence[EventDefinition]:
    """Return the triggers of an element that begins another process which are armed: conditions,
    and timers of start events. The others find it when they are thrown."""
    return [
        each
        for each in definitions_of(start)
        if isinstance(each, ConditionalEventDefinition)
        or (isinstance(each, TimerEventDefinition) and isinstance(start, StartEvent))
    ]


@lru_cache(maxsize=16)
def received_messages(mission: Mission) -> frozenset[str]:
    """Return the ids of the messages that an element of a mission catches."""
    caught = (each for node in mission.nodes for each in caught_by(node))
    return frozenset(each.id for each in caught if isinstance(each, Message))
