"""The context of a translation: what the modules of all element families share.

`Host` is an activity with a token on it. `catching` registers what waits for signals and messages,
so that those who throw them know their catchers. `held_by` says which vehicles and payloads an
activity's behavior holds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.events import EventDefinition, MessageEventDefinition, SignalEventDefinition
from m2pem.mission.mission import Mission
from m2pem.mission.reach import following
from m2pem.verify.net.petri_net import Kind, Role
from m2pem.verify.net.size_limit import Bound
from m2pem.verify.translate.data import Data, Truth
from m2pem.verify.translate.net_builder import Area, Effect, Net
from m2pem.verify.translate.options import Options


@dataclass(slots=True, eq=False)
class Host:
    """An activity in an area, or one instance of it, while a token is on it.

    `outer`: the area that the token is in. `inside`: that of what belongs to the activity alone.
    `active`: the token's place. `done`: what happens when its work has ended, its token being
    taken off already. `cut`: the same, of work that was ended early. `armed`: places that get a
    token when it begins. `boundary`: whether its boundary events are asked for errors (not those of
    an instance: they are the whole's).
    """

    node: e.Activity
    outer: Area
    inside: Area
    active: int
    done: Callable[[], list[Effect]]
    boundary: bool = True
    armed: list[int] = field(default_factory=list)
    armed_before: bool = False
    """Whether its boundary events are armed before its work begins."""
    cut: Callable[[], list[Effect]] | None = None

    def begin(self) -> Effect:
        """The token comes to work."""
        return Effect(produce=(self.active, *(() if self.armed_before else self.armed)))

    def leave(self) -> Effect:
        """The token is taken off, with all that belongs to the activity."""
        return Effect(consume=(self.active,), kill_scopes=frozenset({self.inside.index}))


@dataclass(frozen=True, slots=True)
class Catcher:
    """Something that a signal or message reaches: the token of `waiting` goes to, or puts another
    on, `told`."""

    waiting: int
    told: int
    keeps: bool
    element: str


class Way(StrEnum):
    """By what an activity is undone."""

    ACTIVITY = "its compensation activity"
    INSIDE = "what is in it"


@dataclass(frozen=True, slots=True)
class Undoing:
    """What undoes the points of an area: how it begins, and when it is over."""

    thrown: Effect
    over: Effect


class Making:
    """A derivation under way.

    Of compensation: `ways` has by what each activity is undone; by index of an area, `kept` where
    is noted what was done in it, `claims` which notes are claimed and as what, and `undoing` how
    all in it is undone.
    """

    def __init__(
        self, mission: Mission, process: e.Process, fleet: Fleet, options: Options, bound: Bound
    ) -> None:
        self.mission = mission
        self.process = process
        self.fleet = fleet
        self.options = options
        self.net = Net(bound)
        self.data = Data(mission, options, bound)
        self.world = self.net.area(process, None)
        self.world.path = ()
        self.world.frame = ()
        self.running = self.net.place(process, self.world, Role.CONTROL, ":running")
        self.completed = self.net.place(process, self.world, Role.END, ":completed")
        self.terminated = self.net.place(process, self.world, Role.END, ":terminated")
        self.failed = self.net.place(process, self.world, Role.END, ":failed")
        self.everything = self.net.area(process, self.world, "everything")
        self.everything.path = ()
        self.build_node: Callable[[Making, e.FlowNode, Area], None] = _nothing
        self.signals: dict[str, list[Catcher]] = {}
        self.messages: dict[str, list[Catcher]] = {}
        self.begins: dict[tuple[str, str], list[list[Effect]]] = {}
        self.later: list[Callable[[], None]] = []
        self.contended: list[tuple[Host, int, tuple[str, ...]]] = []
        self.choices: list[tuple[Effect, e.FlowNode, Area]] = []
        self.ways: dict[e.Activity, Way | None] = {}
        self.kept: dict[int, Area] = {}
        self.claims: dict[int, list[tuple[int, int]]] = {}
        self.undoing: dict[int, Undoing] = {}
        self.root = self.everything
        self.repeated = _repeated_nodes(mission)
        self.again = _ends_reached_again(mission)

    def end_run(self, place: int) -> Effect:
        """The run ends, and all in it."""
        return Effect(
            consume=(self.running,),
            kill_scopes=frozenset({self.everything.index}),
            produce=(place,),
        )

    def reached(self, node: e.EndEvent, area: Area) -> Effect:
        """An end event is reached: twice in one instance of its scope is a finding."""
        if node not in self.again:
            return Effect()
        seen = self.net.place(node, area, Role.CONTROL, ":reached")
        self.net.places[seen] = replace(self.net.places[seen], once=True)
        return Effect(produce=(seen,))

    def rules(self, effects: list[Effect], kind: Kind = Kind.INTERNAL) -> None:
        """A rule for each effect."""
        for effect in effects:
            self.net.rule(effect, kind)


def _nothing(making: Making, node: e.FlowNode, area: Area) -> None:
    """Until it is said how nodes are built."""


def _repeated_nodes(mission: Mission) -> frozenset[e.FlowNode]:
    """Nodes that only what does not interrupt, and can come again, leads to."""
    begun: set[e.FlowNode] = set()
    waiting: list[e.FlowNode] = []
    for node in mission.nodes:
        if isinstance(node, e.BoundaryEvent) and not node.interrupting:
            waiting.append(node)
    found: set[e.FlowNode] = set()
    while waiting:
        each = waiting.pop()
        if each not in found:
            found.add(each)
            waiting += following(each)
    for process in mission.processes:
        begun |= set(process.entries)
    for node in mission.nodes:
        if isinstance(node, e.SubProcess):
            begun |= set(node.entries)
            if node.triggered_by_event:
                begun |= set(node.starts)
        if (
            isinstance(node, e.BoundaryEvent)
            and node.interrupting
            and node.attached_to not in found
        ):
            begun.add(node)
    waiting = list(begun)
    reached: set[e.FlowNode] = set()
    while waiting:
        each = waiting.pop()
        if each not in reached:
            reached.add(each)
            waiting += [n for n in following(each) if not (isinstance(n, e.BoundaryEvent))]
    return frozenset(found - reached)


def _ends_reached_again(mission: Mission) -> frozenset[e.FlowNode]:
    """End events that two tokens of one scope might come to."""
    waiting = [node for node in mission.nodes if forks(node)]
    reached: set[e.FlowNode] = set()
    while waiting:
        for each in following(waiting.pop()):
            if each not in reached:
                reached.add(each)
                waiting.append(each)
    return frozenset(each for each in reached if isinstance(each, e.EndEvent))


def forks(node: e.FlowNode) -> bool:
    """Whether one token can become several there."""
    if isinstance(node, e.ExclusiveGateway | e.EventBasedGateway):
        return False
    if isinstance(node, e.Activity) and (
        node.completion_quantity > 1 or any(not b.interrupting for b in node.boundary)
    ):
        return True
    if isinstance(node, e.StartEvent) and len(node.container.entries) > 1:
        return True
    return len(node.outgoing) > 1


def catching(
    making: Making,
    what: str,
    ref: str,
    waiting: int,
    told: int,
    keeps: bool,
    node: e.FlowNode,
) -> None:
    """A signal or message of that id reaches a token on `waiting`."""
    register = making.signals if what == "signal" else making.messages
    register.setdefault(ref, []).append(Catcher(waiting, told, keeps, node.id))


def what_and_ref(definition: EventDefinition) -> tuple[str, str]:
    """("signal" or "message", its id)."""
    if isinstance(definition, SignalEventDefinition):
        return "signal", definition.signal.id
    assert isinstance(definition, MessageEventDefinition)
    return "message", definition.message.id


def first(truths: Sequence[Truth]) -> Truth:
    """Of one condition, whether it is true."""
    return truths[0]


def held_by(making: Making, node: e.Activity) -> tuple[tuple[str, ...], str]:
    """What a token on an activity holds, and by which behavior; nothing, of a loop's whole."""
    behavior = behavior_of(node)
    if behavior is None or node.loop is not None:
        return (), ""
    held = resources(making, behavior)
    return held or (), behavior.name if held else ""


def behavior_of(node: e.Activity) -> Behavior | None:
    """The behavior that an activity commands."""
    if isinstance(node, e.ScriptTask | e.ServiceTask | e.SendTask):
        return node.behavior
    return None


def resources(making: Making, behavior: Behavior) -> tuple[str, ...] | None:
    """What a behavior holds; None: the fleet lacks it."""
    try:
        return tuple(allocate(behavior, making.fleet).resources)
    except AllocationError:
        return None
