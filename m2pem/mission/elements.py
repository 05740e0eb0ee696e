"""The elements of a mission: a hierarchical graph, linked both ways, that never changes.

A `Mission` holds processes; a process or subprocess (`Container`) holds flow nodes and sequence
flows; a node knows its incoming and outgoing flows and its container. Elements are compared and
hashed by identity. Links are set once, by `m2pem.bpmn`, before the mission is used.

Names are those of BPMN 2.0.2, chapter 10.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Self, TypeAlias, TypeVar, Union

from m2pem.mission.behavior import Behavior, Mappings, Prompt, Script, ServiceCall
from m2pem.mission.events import (
    CompensateEventDefinition,
    EventDefinition,
    Message,
    Signal,
    signals_and_messages,
)
from m2pem.mission.expression import Expression
from m2pem.mission.loops import MultiInstance, StandardLoop

_CAPITAL = re.compile(r"(?<!^)(?=[A-Z])")


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """Anything with an id in a mission. `line` is the line of its start tag, from 1.

    In files that the mission calls into, ids begin with the file's name: `survey:Start`.
    """

    id: str
    name: str
    line: int
    qualifier: str = field(init=False, repr=False, default="")
    """What the id begins with, before a colon; "" in the mission's own file."""

    def __deepcopy__(self, memo: object) -> Self:
        return self  # it never changes

    @property
    def local_id(self) -> str:
        """The id as it is in its file: what expressions there know it by."""
        return self.id[len(self.qualifier) + 1 :] if self.qualifier else self.id

    @property
    def label(self) -> str:
        """What to call the element in front of a person: its name, else its id.

        A name of nothing but white space says nothing: then it is called by its kind and id.
        """
        if not self.name or self.name.strip():
            return self.name or self.id
        return f"{self.kind} {self.id}"

    @property
    def kind(self) -> str:
        """The element's name in BPMN, in lower case: "exclusive gateway", "subprocess"."""
        words = _CAPITAL.sub(" ", type(self).__name__).lower().replace("sub process", "subprocess")
        return words.replace("event based", "event-based").replace("ad hoc", "ad-hoc")


@dataclass(frozen=True, slots=True, eq=False)
class SequenceFlow(Element):
    """A sequence flow (clause 8.4.13). `condition` None is true."""

    condition: Expression | None = None
    source: "FlowNode" = field(init=False, repr=False)
    target: "FlowNode" = field(init=False, repr=False)
    index: int = field(init=False, repr=False)
    """Place in `Mission.flows`."""


@dataclass(frozen=True, slots=True, eq=False)
class FlowNode(Element):
    """A node that tokens visit. Flows are in the order of the XML."""

    incoming: "tuple[SequenceFlow, ...]" = field(init=False, repr=False)
    outgoing: "tuple[SequenceFlow, ...]" = field(init=False, repr=False)
    container: "Container" = field(init=False, repr=False)
    index: int = field(init=False, repr=False)
    """Place in `Mission.nodes`."""


# --- containers ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class DataObject(Element):
    """A data object or property: declares the key `name or id` in its container's scope.

    `kind`: of its values besides null, as `operators.kind` calls them; "": any.
    """

    kind: str = ""

    @property
    def key(self) -> str:
        """The key in the data store (docs/missions.md): its name, else its id."""
        return self.name or self.id


class ErrorPolicy(StrEnum):
    """What an error does that no event catches: it ends the run, or opens an incident."""

    END = "end"
    INCIDENT = "incident"


@dataclass(frozen=True, slots=True, eq=False)
class Process(Element):
    """A process (clause 10.2). `executable` is the file's `isExecutable`.

    `global_task`: it has a global task of its id in it, and nothing else; it can only be called.
    `on_error`: what an error in it does that no event catches; None: what its caller, else the
    fleet, says. `incident_role`: which operators may decide about its incidents; "": as its caller,
    else the fleet, says.
    """

    executable: bool = False
    global_task: bool = False
    on_error: ErrorPolicy | None = None
    incident_role: str = ""
    file: str = field(init=False, repr=False, default="")
    """The file that it is in; "" in the mission's own."""
    nodes: tuple[FlowNode, ...] = field(init=False, repr=False, default=())
    flows: tuple[SequenceFlow, ...] = field(init=False, repr=False, default=())
    data: tuple[DataObject, ...] = field(init=False, repr=False, default=())
    entries: tuple[FlowNode, ...] = field(init=False, repr=False, default=())
    """What gets a token when the container begins (clause 13.2): the start events; without any,
    every node without an incoming flow, boundary events excepted. Empty: nothing to do."""
    subscription: Mapping[str, Expression] = field(init=False, repr=False, default_factory=dict)
    """By correlation property, what its instances take messages for (clause 8.4.2)."""
    event_subprocesses: "tuple[SubProcess, ...]" = field(init=False, repr=False, default=())
    """Those directly in it, in the order of the XML (clause 13.5.4); they have no token of their
    own until their start event is triggered."""

    @property
    def process(self) -> "Process":
        """The process itself; for a subprocess, the process that contains it."""
        return self

    @property
    def starts(self) -> "tuple[StartEvent, ...]":
        """Start events directly in this container, in the order of the XML."""
        return tuple(node for node in self.nodes if isinstance(node, StartEvent))


# --- activities ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Activity(FlowNode):
    """Work (clause 10.3, tables 10.3 and 10.5).

    `boundary`: events attached to it, in the order of the XML. `data_flow`: what passes between
    the data around it and its own data inputs and outputs (clause 10.4.2). `start_quantity`
    tokens begin it, `completion_quantity` leave by each flow. `for_compensation`: it runs only
    to undo the activity whose `compensation` it is.
    """

    default: SequenceFlow | None = field(init=False, repr=False, default=None)
    boundary: "tuple[BoundaryEvent, ...]" = field(init=False, repr=False, default=())
    loop: StandardLoop | MultiInstance | None = field(init=False, repr=False, default=None)
    data_flow: Mappings = field(init=False, repr=False, default=Mappings())
    own_data: frozenset[str] = field(init=False, repr=False, default=frozenset())
    """Keys of its data inputs, data outputs and properties: what only it sees."""
    start_quantity: int = field(init=False, repr=False, default=1)
    completion_quantity: int = field(init=False, repr=False, default=1)
    for_compensation: bool = field(init=False, repr=False, default=False)
    compensation: "Activity | None" = field(init=False, repr=False, default=None)


@dataclass(frozen=True, slots=True, eq=False)
class Task(Activity):
    """A task without a type: done as soon as it is entered (clause 10.3.3)."""


@dataclass(frozen=True, slots=True, eq=False)
class ManualTask(Activity):
    """Work outside any system's control: done as soon as it is entered."""


@dataclass(frozen=True, slots=True, eq=False)
class UserTask(Activity):
    """Asks an operator. `prompt`: None only until the file is read; see `CONFIRMATION`."""

    prompt: Prompt | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ScriptTask(Activity):
    """Commands a behavior, or runs assignments; an empty script does neither."""

    behavior: Behavior | None = None
    script: Script | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ServiceTask(Activity):
    """Runs a registered service, or commands a behavior (`m2pem:behavior`)."""

    call: ServiceCall | None = None
    behavior: Behavior | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SendTask(Activity):
    """Sends a message, or commands a behavior (`m2pem:behavior`)."""

    message: Message | None = None
    behavior: Behavior | None = None


@dataclass(frozen=True, slots=True, eq=False)
class BusinessRuleTask(ServiceTask):
    """A service task whose service decides by business rules (clause 10.3.3)."""


@dataclass(frozen=True, slots=True, eq=False)
class ReceiveTask(Activity):
    """Waits for a message; with `instantiate`, the message begins a process (clause 10.3.3)."""

    message: Message | None = None
    instantiate: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class CallActivity(Activity):
    """Calls a process or global task (clause 10.3.6). `called` is linked after all are read."""

    called_id: str = ""
    mappings: Mappings = field(default_factory=Mappings)
    called: Process = field(init=False, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class SubProcess(Activity):
    """An embedded subprocess (clause 10.3.5); sees its parent's data.

    `triggered_by_event`: an event subprocess; it has no flows and one typed start event.
    """

    triggered_by_event: bool = False
    nodes: tuple[FlowNode, ...] = field(init=False, repr=False, default=())
    flows: tuple[SequenceFlow, ...] = field(init=False, repr=False, default=())
    data: tuple[DataObject, ...] = field(init=False, repr=False, default=())
    entries: tuple[FlowNode, ...] = field(init=False, repr=False, default=())
    """What gets a token when the container begins (clause 13.2): the start events; without any,
    every node without an incoming flow, boundary events excepted. Empty: nothing to do."""
    event_subprocesses: "tuple[SubProcess, ...]" = field(init=False, repr=False, default=())
    """As for a process."""

    @property
    def process(self) -> Process:
        """The process that contains it, at whatever depth."""
        container: Container = self.container
        while isinstance(container, SubProcess):
            container = container.container
        return container

    @property
    def starts(self) -> "tuple[StartEvent, ...]":
        """Start events directly in this container, in the order of the XML."""
        return tuple(node for node in self.nodes if isinstance(node, StartEvent))


@dataclass(frozen=True, slots=True, eq=False)
class Transaction(SubProcess):
    """A subprocess that a cancel end event in it undoes (clauses 10.3.5 and 13.3.4)."""


class AdHocOrdering(StrEnum):
    """Whether several activities of an ad-hoc subprocess may run at a time (table 10.22)."""

    PARALLEL = "Parallel"
    SEQUENTIAL = "Sequential"


@dataclass(frozen=True, slots=True, eq=False)
class AdHocSubProcess(SubProcess):
    """A subprocess whose activities are begun by choice (clauses 10.3.5 and 13.3.5).

    `completion` is asked after each activity; None: it ends when nothing more is chosen.
    `active_elements` gives the ids to begin instead of an operator's choice; None: operators
    choose.
    """

    ordering: AdHocOrdering = AdHocOrdering.PARALLEL
    completion: Expression | None = None
    cancel_remaining: bool = True
    active_elements: Expression | None = None


Container: TypeAlias = Union[Process, SubProcess]
"""What holds flow nodes."""


# --- gateways -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Gateway(FlowNode):
    """Controls flow (clause 10.6)."""


@dataclass(frozen=True, slots=True, eq=False)
class ExclusiveGateway(Gateway):
    """Takes the first true flow, else the default (clause 10.6.2)."""

    default: SequenceFlow | None = field(init=False, repr=False, default=None)


@dataclass(frozen=True, slots=True, eq=False)
class InclusiveGateway(Gateway):
    """Takes every true flow, else the default; joins what can still arrive (clause 10.6.3)."""

    default: SequenceFlow | None = field(init=False, repr=False, default=None)


@dataclass(frozen=True, slots=True, eq=False)
class ParallelGateway(Gateway):
    """Waits for every incoming flow, takes every outgoing one (clause 10.6.4)."""


@dataclass(frozen=True, slots=True, eq=False)
class ComplexGateway(Gateway):
    """Joins when `activation` says so, then waits to reset (clause 10.6.5, table 13.5).

    `activation` reads the data, `activationCount` (incoming flows that have a token) and the
    number of tokens on each incoming flow by the flow's id; None: any token activates it.
    Conditions of its outgoing flows may also read `waitingForStart`.
    """

    default: SequenceFlow | None = field(init=False, repr=False, default=None)
    activation: Expression | None = None


@dataclass(frozen=True, slots=True, eq=False)
class EventBasedGateway(Gateway):
    """Waits for the first of the events behind it (clause 10.6.6).

    `instantiate`: those events begin the process. `parallel` (only then): all of them must come.
    """

    instantiate: bool = False
    parallel: bool = False


# --- events -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Event(FlowNode):
    """An event (clause 10.5). No definition: a none event; several: a multiple event.

    `parallel_multiple`: all definitions of a catch event must be triggered, not one of them.
    `data_flow`: what passes into what it throws, or out of what it catches (clause 10.4.2).
    """

    definitions: tuple[EventDefinition, ...] = ()
    parallel_multiple: bool = False
    data_flow: Mappings = field(init=False, repr=False, default=Mappings())


@dataclass(frozen=True, slots=True, eq=False)
class StartEvent(Event):
    """An event at which tokens begin. `interrupting`: of an event subprocess only."""

    interrupting: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class EndEvent(Event):
    """An event at which a token ends; it may throw."""


@dataclass(frozen=True, slots=True, eq=False)
class IntermediateCatchEvent(Event):
    """Waits for its trigger. `linked_from`: a link target, and the link sources that lead to it."""

    linked_from: "tuple[IntermediateThrowEvent, ...]" = field(init=False, repr=False, default=())


@dataclass(frozen=True, slots=True, eq=False)
class IntermediateThrowEvent(Event):
    """Throws, and goes on. `links_to`: a link source, and where it leads (table 10.98)."""

    links_to: "IntermediateCatchEvent | None" = field(init=False, repr=False, default=None)


@dataclass(frozen=True, slots=True, eq=False)
class BoundaryEvent(Event):
    """Catches while its activity is active; `interrupting` is BPMN's cancelActivity."""

    interrupting: bool = True
    attached_to: Activity = field(init=False, repr=False)


def exchanged(node: FlowNode) -> list[Signal | Message]:
    """Return the signals and messages that an element throws or catches, in their order."""
    if isinstance(node, SendTask | ReceiveTask):
        return [node.message] if node.message is not None else []
    return signals_and_messages(node.definitions) if isinstance(node, Event) else []


def thrown_by(node: FlowNode) -> list[Signal | Message]:
    """Return the signals and messages that an element throws."""
    return exchanged(node) if isinstance(node, _THROWING) else []


def caught_by(node: FlowNode) -> list[Signal | Message]:
    """Return the signals and messages that an element catches."""
    return [] if isinstance(node, _THROWING) else exchanged(node)


def undoes(element: Element | None) -> bool:
    """Whether an element is the boundary event of a compensation: no token ever comes to it, it
    only says what undoes its activity (clause 10.7.1)."""
    return isinstance(element, BoundaryEvent) and any(
        isinstance(each, CompensateEventDefinition) for each in element.definitions
    )


Catching = TypeVar("Catching", bound=Event)


def catches(
    events: Sequence[Catching], code: str, code_of: Callable[[EventDefinition], str | None]
) -> Catching | None:
    """Return the event that names an error's or escalation's code, else one that catches all."""
    for_all = None
    for event in events:
        for definition in event.definitions:
            caught = code_of(definition)
            if caught == "":
                for_all = for_all or event
            elif caught == code:
                return event
    return for_all


_THROWING = (SendTask, EndEvent, IntermediateThrowEvent)
