"""The context of a translation: what the modules of all element families share.

`ActivityInstance` is an activity with a token on it. `register_catcher` registers what waits for
signals and messages, so that those who throw them know their catchers. `held_by` says which
vehicles and payloads an activity's behavior holds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from m2pem.engine.elements.behaviors import BRINGS_DOWN
from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.events import EventDefinition, MessageEventDefinition, SignalEventDefinition
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following, reach
from m2pem.verify.net.petri_net import Kind, Role
from m2pem.verify.net.size_limit import SizeLimit
from m2pem.verify.translate.data import Data, Truth
from m2pem.verify.translate.net_builder import Effect, NetBuilder, ScopeDraft
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.order import forks
from m2pem.verify.translate.pools import Pool, candidates_of, pools_of, stored_values
from m2pem.verify.translate.space import space_plan


@dataclass(slots=True, eq=False)
class ActivityInstance:
    """An activity in a scope, or one instance of it, while a token is on it.

    `outer`: the scope that the token is in. `inside`: the scope of what belongs to the activity
    alone. `active`: the token's place. `done`: what happens when its work has completed; its token
    is removed already. `cut`: the same, of work that was ended early. `armed`: places that get a
    token when it begins. `boundary`: whether its boundary events catch errors (not those of an
    instance: they belong to the whole).
    """

    node: e.Activity
    outer: ScopeDraft
    inside: ScopeDraft
    active: int
    done: Callable[[], list[Effect]]
    boundary: bool = True
    armed: list[int] = field(default_factory=list)
    armed_before: bool = False
    """Whether its boundary events are armed before its work begins."""
    cut: Callable[[], list[Effect]] | None = None

    def begin(self) -> Effect:
        """The token begins to work."""
        return Effect(produce=(self.active, *(() if self.armed_before else self.armed)))

    def leave(self) -> Effect:
        """Remove the token, with all that belongs to the activity."""
        return Effect(consume=(self.active,), reset_scopes=frozenset({self.inside.index}))


@dataclass(frozen=True, slots=True)
class Catcher:
    """A place that a signal or message reaches. The token of `waiting` moves to `caught`, or, if
    the catcher `keeps` it, a token is added there.
    """

    waiting: int
    caught: int
    keeps: bool
    element: str


class CompensatedBy(StrEnum):
    """The compensation of an activity."""

    ACTIVITY = "its compensation activity"
    INSIDE = "what is in it"


@dataclass(frozen=True, slots=True)
class CompensationEffects:
    """The compensation of a scope's activities: the effects at its start and at its end."""

    thrown: Effect
    over: Effect


@dataclass(frozen=True, slots=True)
class Contender:
    """A behavior that begins if all its resources are free, and fails at once if one is not.

    `asks`: the effect that removes its token from where it asks for them. `begins`: returns the
    effects of its begin, when all tasks are known. `kind`: JOIN, if it waits for space.
    """

    instance: ActivityInstance
    resources: tuple[str, ...]
    asks: Effect
    begins: Callable[[], list[Effect]]
    kind: Kind = Kind.INTERNAL


@dataclass(frozen=True, slots=True)
class Asking:
    """A place that has a token while a task asks for resources of `pools`. `urgent`: it gets one of
    them as soon as one is free, as far as its priority allows.

    `least`: how many it needs. `totals`: of a task that waits for several, and keeps those that are
    free, how many of each pool it may get at least. `any_will_do`: any so many of its pools.
    """

    place: int
    instance: ActivityInstance
    priority: int
    pools: frozenset[Pool]
    urgent: bool
    waits: bool
    least: int
    totals: tuple[Mapping[Pool, int], ...] = ()
    any_will_do: bool = False

    @property
    def scope(self) -> ScopeDraft:
        """The scope that its token is in."""
        return self.instance.outer


@dataclass(frozen=True, slots=True)
class PassedOver:
    """A place that has a token while a task gets nothing that others may keep. `keepers`: these, by
    the place of a token while one asks that comes before."""

    place: int
    keepers: dict[int, Asking] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Source:
    """A place that tasks in `until` take resources from. `until` None: a pool, for all tasks.

    `keeper`: the task and role that keep it until they are executed again, if any do.
    """

    place: int
    until: ScopeDraft | None = None
    keeper: tuple[ActivityInstance, str] | None = None


class TranslationContext:
    """A translation in progress.

    Compensation: `compensated_by` says what compensates each activity. By index of a scope,
    `notes_scopes` has the scope with the notes of what completed in it, `claims` the notes that are
    claimed and by which places, and `compensating` how all in it is compensated.
    """

    def __init__(
        self,
        mission: Mission,
        process: e.Process,
        fleet: Fleet,
        options: Options,
        size_limit: SizeLimit,
    ) -> None:
        self.mission = mission
        self.process = process
        self.fleet = fleet
        self.options = options
        self.net = NetBuilder(size_limit)
        self.candidates = candidates_of(mission, fleet, options.catalogue)
        self.data = Data(mission, options, size_limit, stored_values(self.candidates))
        self.space = space_plan(mission, process, fleet, self.candidates, options.ways)
        self.moving: dict[tuple[object, int, str], int] = {}
        """Places of vehicles on their way or just stopped, each with its transitions."""
        self.pool_of = pools_of(
            mission,
            fleet,
            self.candidates,
            self.data.domains.of,
            options.distinguished,
            self.space.likeness if self.space is not None else lambda _: None,
        )
        self.world = self.net.scope(process, None)
        self.world.path = ()
        self.world.frame = ()
        self.running = self.net.place(process, self.world, Role.CONTROL, ":running")
        self.completed = self.net.place(process, self.world, Role.END, ":completed")
        self.terminated = self.net.place(process, self.world, Role.END, ":terminated")
        self.failed = self.net.place(process, self.world, Role.END, ":failed")
        self.everything = self.net.scope(process, self.world, "everything")
        self.everything.path = ()
        self.build_node: Callable[[TranslationContext, e.FlowNode, ScopeDraft], None] = _nothing
        self.signals: dict[str, list[Catcher]] = {}
        self.messages: dict[str, list[Catcher]] = {}
        self.begins: dict[tuple[str, str], list[list[Effect]]] = {}
        self.later: list[Callable[[], None]] = []
        self.contended: list[Contender] = []
        self.asking: list[Asking] = []
        self.before: dict[tuple[int, int], int] = {}
        """By two places of tasks that ask, the place of the first one asking before the other."""
        self.passed_over: dict[int, PassedOver] = {}
        """By the place of a task that asks, while it gets nothing that others may keep."""
        self.keeps = any(each.role.keep for roles in self.candidates.values() for each in roles)
        self.kept: dict[Pool, list[Source]] = {}
        """By pool, the places of what is kept between tasks."""
        self.choices: list[tuple[Effect, e.FlowNode, ScopeDraft]] = []
        self.compensated_by: dict[e.Activity, CompensatedBy | None] = {}
        self.notes_scopes: dict[int, ScopeDraft] = {}
        self.claims: dict[int, list[tuple[int, int]]] = {}
        self.compensating: dict[int, CompensationEffects] = {}
        self.root = self.everything
        self.repeated = self.net.repeated = _repeated_nodes(mission)
        self.again = _ends_reached_again(mission, self.repeated)

    def pool_place(self, pool: Pool) -> int:
        """Return the place with a token for each resource of a pool that is free."""
        number = self.net.place(
            self.process,
            self.everything,
            Role.CONTROL,
            f":free {'|'.join(pool)}",
            several=len(pool) > 1,
        )
        self.net.places[number] = replace(self.net.places[number], free=pool)
        return number

    def free_resources(self) -> tuple[int, ...]:
        """Return the pools, each as often as it has resources: all are free at first."""
        pools = dict.fromkeys(self.pool_of.values())
        return tuple(self.pool_place(pool) for pool in pools for _ in pool)

    def end_run(self, place: int) -> Effect:
        """End the run, and all in it."""
        return Effect(
            consume=(self.running,),
            reset_scopes=frozenset({self.everything.index}),
            produce=(place,),
        )

    def reached(self, node: e.EndEvent, scope: ScopeDraft) -> Effect:
        """Note that an end event is reached: twice in one instance of its scope is a finding."""
        if node not in self.again:
            return Effect()
        seen = self.net.place(node, scope, Role.CONTROL, ":reached")
        self.net.places[seen] = replace(self.net.places[seen], once=True)
        return Effect(produce=(seen,))

    def transitions(self, effects: list[Effect], kind: Kind = Kind.INTERNAL) -> None:
        """Add a transition for each effect."""
        for effect in effects:
            self.net.transition(effect, kind)


def _nothing(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """The default until the translation of nodes is registered."""


def _repeated_nodes(mission: Mission) -> frozenset[e.FlowNode]:
    """Nodes that are reached only from non-interrupting events that can happen again."""
    found = reach(
        node
        for node in mission.nodes
        if isinstance(node, e.BoundaryEvent) and not node.interrupting
    )
    begun: set[e.FlowNode] = set()
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


def _ends_reached_again(mission: Mission, repeated: frozenset[e.FlowNode]) -> frozenset[e.FlowNode]:
    """End events that two tokens of one scope may reach, other than by an event that happens again:
    what is `repeated` has to be forked itself."""
    waiting = [node for node in mission.nodes if forks(node)]
    reached: set[e.FlowNode] = set()
    while waiting:
        node = waiting.pop()
        for each in following(node):
            if each not in reached and (node in repeated or each not in repeated):
                reached.add(each)
                waiting.append(each)
    return frozenset(each for each in reached if isinstance(each, e.EndEvent))


def register_catcher(
    context: TranslationContext,
    what: str,
    ref: str,
    waiting: int,
    caught: int,
    keeps: bool,
    node: e.FlowNode,
) -> None:
    """Register that a signal or message with that id reaches a token on `waiting`."""
    register = context.signals if what == "signal" else context.messages
    register.setdefault(ref, []).append(Catcher(waiting, caught, keeps, node.id))
    if keeps or context.net.places[waiting].several:
        context.net.places[caught] = replace(context.net.places[caught], several=True)


def what_and_ref(definition: EventDefinition) -> tuple[str, str]:
    """Return ("signal" or "message", its id)."""
    if isinstance(definition, SignalEventDefinition):
        return "signal", definition.signal.id
    assert isinstance(definition, MessageEventDefinition)
    return "message", definition.message.id


def first(truths: Sequence[Truth]) -> Truth:
    """The truth of a single condition."""
    return truths[0]


def held_by(context: TranslationContext, node: e.Activity) -> tuple[tuple[str, ...], str]:
    """Return (resources that a token on an activity holds, the behavior's name). The whole of a
    loop holds nothing.
    """
    return ((), "") if node.loop is not None else held_by_instance(context, node)


def held_by_instance(context: TranslationContext, node: e.Activity) -> tuple[tuple[str, ...], str]:
    """The same, of an instance of a loop too. What comes from pools is held by places beside it."""
    behavior = behavior_of(node)
    if behavior is None or takes_from_pools(context, node, behavior):
        return (), ""
    held = resources(context, behavior)
    return held or (), behavior.name if held else ""


def takes_from_pools(context: TranslationContext, node: e.Activity, behavior: Behavior) -> bool:
    """Whether a task chooses its resources, or needs one that another task may choose."""
    if node in context.candidates or (context.space is not None and context.space.asks(node)):
        return True
    return any(each in context.pool_of for each in resources(context, behavior) or ())


def may_be_preempted(fleet: Fleet, behavior: Behavior | None) -> bool:
    """Whether a task of another run may take what a behavior has, if its priority is greater."""
    if not fleet.preemption or behavior is None or not behavior.roles:
        return False
    return behavior.name not in BRINGS_DOWN


def behavior_of(node: e.FlowNode) -> Behavior | None:
    """The behavior that an activity commands."""
    if isinstance(node, e.ScriptTask | e.ServiceTask | e.SendTask):
        return node.behavior
    return None


def resources(context: TranslationContext, behavior: Behavior) -> tuple[str, ...] | None:
    """The resources that a behavior holds; None: the fleet lacks them."""
    try:
        return tuple(allocate(behavior, context.fleet).resources)
    except AllocationError:
        return None
