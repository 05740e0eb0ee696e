"""Translate a mission into a net: its processes, outside triggers, and the end of the run."""

from collections.abc import Callable
from dataclasses import replace

from m2pem.engine.execution import definitions_of
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    Message,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Action, Exactness, Kind, PetriNet, Role, Step, Trigger
from m2pem.verify.net.size_limit import SizeLimit
from m2pem.verify.translate import activities, events, gateways, subprocesses
from m2pem.verify.translate.activities import translate_contention
from m2pem.verify.translate.assumed import restrict
from m2pem.verify.translate.compensation import release_claims
from m2pem.verify.translate.context import Catcher, TranslationContext, what_and_ref
from m2pem.verify.translate.events import after
from m2pem.verify.translate.keeping import release_at_the_end
from m2pem.verify.translate.moving import initial_places
from m2pem.verify.translate.net_builder import (
    Effect,
    ScopeDraft,
    enter_at_once,
    entry_place,
    product,
)
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.parallel_multiple import AWAITED, all_must_come, trigger_places
from m2pem.verify.translate.participants import (
    alive,
    begin_together,
    instance_is_token,
    participants,
    triggers_of,
    without_entries,
)
from m2pem.verify.translate.scopes import begin
from m2pem.verify.translate.subprocesses import build, translate_choices
from m2pem.verify.translate.throwing import (
    deliver_stored,
    message_effects,
    signal_effects,
)
from m2pem.verify.translate.timers import put_in_order, timer_us
from m2pem.verify.translate.waiting_order import follow_order


def translate(
    mission: Mission,
    fleet: Fleet | None = None,
    *,
    process: str | None = None,
    options: Options | None = None,
    size_limit: SizeLimit | None = None,
) -> PetriNet:
    """Return the net of a mission that begins with a process (else its main one), on a fleet.

    Without a fleet, one is made from the mission's roles.

    Raises:
        KeyError: the mission has no such process.
        TooLargeError: its net is larger than `size_limit` allows.
    """
    root = mission.process(process)
    size_limit = size_limit or SizeLimit()
    fleet, options = fleet or fleet_for(mission), options or Options()
    reliable = options.assumed.resources(fleet)
    options = replace(options, distinguished=reliable.union(options.distinguished))
    context = TranslationContext(mission, root, fleet, options, size_limit)
    context.build_node = build_node
    context.root = context.net.scope(root, context.everything, step=root.id, frame=(root.id,))
    context.data.follow(context.root.frame)
    build(context, root, context.root)
    others = _triggered_processes(context)
    for other in others:
        _instances(context, other)
    together = participants(mission, root) if options.all_pools else ()
    begun = [place for each in together for place in begin_together(context, each)]
    first = begin(context, root, context.root)
    standing = initial_places(context)
    initial = (context.running, *context.free_resources(), *standing, *first.produce, *begun)
    for late in context.later:
        late()
    translate_contention(context)
    translate_choices(context)
    if others:
        release_at_the_end(context)
    _outside(context)
    release_claims(context)
    if context.options.timers_in_order:
        put_in_order(context)
    _completes(context)
    initial = follow_order(context, enter_at_once(context.net, initial))
    net = context.net.finish(
        mission.file,
        root.id,
        tuple(context.data.variables),
        initial,
        (context.completed, context.terminated, context.failed),
    )
    return restrict(net, mission, fleet, options.assumed)


def _completes(context: TranslationContext) -> None:
    """The run completes when no token is left anywhere."""
    over = Effect(
        steps=(Step(context.process.id, Action.COMPLETED),),
        empty_scopes=frozenset({context.everything.index}),
    ).and_then(context.end_run(context.completed))
    context.net.transition(over)


# --- processes that triggers begin --------------------------------------------------------------


def _triggered_processes(context: TranslationContext) -> list[e.Process]:
    """Processes that neither the run begins with nor a call activity calls."""
    called = {n.called for n in context.mission.nodes if isinstance(n, e.CallActivity)}
    return [p for p in context.mission.processes if p is not context.process and p not in called]


def _instances(context: TranslationContext, process: e.Process) -> None:
    """Translate a process once for each instance that may be active at a time."""
    starts = [start for entry in process.entries for start in triggers_of(entry)]
    if not starts:
        return
    if instance_is_token(process):
        _counted_instances(context, process, starts)
        return
    context.net.approximate(
        process,
        Exactness.BOUNDED,
        f"checked with up to {context.options.instances} instances at a time",
        process.id,
    )
    scopes = []
    for number in range(context.options.instances):
        step = f"{process.id}#{number + 1}"
        scope = context.net.scope(process, context.everything, step=step, frame=(process.id, step))
        build(context, process, scope)
        scopes.append((scope, alive(context, process, scope)))
    for start in starts:
        for definition in definitions_of(start):
            _begun_by(context, process, start, definition, scopes)


def _counted_instances(
    context: TranslationContext, process: e.Process, starts: list[e.FlowNode]
) -> None:
    """Translate a process whose instances are one token each: once, with any number of tokens."""
    scope = context.net.scope(
        process, context.everything, step=f"{process.id}#1", frame=(process.id,)
    )
    scope.several = scope.counted = True
    context.net.approximate(
        process, Exactness.BOUNDED, "not all its instances are counted", process.id
    )
    build(context, process, scope)
    for start in starts:
        for definition in definitions_of(start):
            begun = Effect(
                steps=(Step(start.id, Action.TRIGGERED),),
                produce=(entry_place(context.net, start, scope),),
            )
            ways = context.data.receive([begun], scope, start)
            context.begins.setdefault(what_and_ref(definition), []).append(ways)


def _begun_by(
    context: TranslationContext,
    process: e.Process,
    start: e.FlowNode,
    definition: EventDefinition,
    scopes: list[tuple[ScopeDraft, int]],
) -> None:
    brings = isinstance(definition, SignalEventDefinition | MessageEventDefinition)
    ways: list[Effect] = []
    for number, (scope, on) in enumerate(scopes):
        free = Effect(
            steps=(Step(start.id, Action.TRIGGERED),),
            read=frozenset(other for _, other in scopes[:number]),
            inhibit=frozenset({on}),
            produce=(on,),
        )
        inside = [Effect(produce=tuple(without_entries(context, process, scope)))]
        if isinstance(start, e.StartEvent) and all_must_come(start):
            more = [_first_of_several(context, start, definition, scope)]
        elif isinstance(start, e.StartEvent):
            more = [Effect(produce=(entry_place(context.net, start, scope),))]
        else:
            more = after(context, start, scope)
        come = context.data.receive([free], scope, start) if brings else [free]
        ways += product(product(come, inside), more)
    beyond = (Step(process.id, Action.NOT_FOLLOWED),)
    full = Effect(beyond, read=frozenset(on for _, on in scopes))
    match definition:
        case SignalEventDefinition() | MessageEventDefinition():
            what, ref = what_and_ref(definition)
            context.begins.setdefault((what, ref), []).append([*ways, full])
        case TimerEventDefinition() | ConditionalEventDefinition():
            timer = isinstance(definition, TimerEventDefinition)
            due = timer_us(definition) if isinstance(definition, TimerEventDefinition) else None
            for effect in product([Effect(read=frozenset({context.running}))], ways):
                context.net.transition(
                    effect,
                    Kind.EXTERNAL,
                    Trigger.TIMER if timer else Trigger.CONDITION,
                    due_us=due,
                )
        case _:
            pass


def _first_of_several(
    context: TranslationContext, start: e.StartEvent, definition: EventDefinition, scope: ScopeDraft
) -> Effect:
    """Translate the first of several triggers of a start event; the instance awaits the others."""
    places = trigger_places(context, start, scope)
    waiting = context.net.place(start, scope, Role.ACTIVE)
    triggers = [each for each in definitions_of(start) if isinstance(each, AWAITED)]
    came = [
        there if each is definition else yet
        for each, there, yet in zip(triggers, places.came, places.awaited, strict=True)
    ]
    return Effect(produce=(waiting, *came))


# --- signals and messages from outside ----------------------------------------------------------


def _outside(context: TranslationContext) -> None:
    mission = context.mission
    thrown_messages = {each.id for node in mission.nodes for each in e.thrown_by(node)}
    for message in sorted(thrown_messages & set(context.messages)):
        deliver_stored(context, message)
    for signal in mission.signals.values():
        if context.options.open_world or signal.from_operator or signal.returned:
            _from_outside(context, "signal", signal.id)
    black_box_messages = messages_from_black_box_pools(mission)
    for message_id, message_element in mission.messages.items():
        if (
            context.options.open_world
            or message_element.from_operator
            or (message_id in black_box_messages and message_id not in thrown_messages)
        ):
            _from_outside(context, "message", message_id)


def messages_from_black_box_pools(mission: Mission) -> frozenset[str]:
    """Ids of messages that pools without a process of their own send."""
    found: set[str] = set()
    for flow in mission.message_flows:
        if flow.source_id not in mission.elements:
            target = mission.elements.get(flow.target_id)
            if isinstance(target, e.Event | e.ReceiveTask):
                found.update(each.id for each in e.exchanged(target) if isinstance(each, Message))
    return frozenset(found)


def _from_outside(context: TranslationContext, what: str, ref: str) -> None:
    """A signal or message comes from outside when something waits for it, or when it begins a
    process.
    """
    trigger = Trigger.SIGNAL if what == "signal" else Trigger.MESSAGE
    register = context.signals if what == "signal" else context.messages
    catchers: list[Catcher] = register.get(ref, [])
    if what == "message":
        effects = [
            effect
            for effect in message_effects(context, ref, kept=False)
            if effect.consume or effect.produce
        ]
        on = Effect(read=frozenset({context.running}))  # what it begins, it begins in the run
        for effect in product([on], effects):
            named = effect.with_step(_receiver(context, catchers, effect), Action.TRIGGERED, ref)
            context.net.transition(named, Kind.EXTERNAL, trigger, ref)
        return
    effects = signal_effects(context, ref)
    begins = bool(context.begins.get((what, ref)))
    seen: list[int] = []
    for catcher in catchers:
        place = context.net.places[catcher.caught]
        when = Effect(
            steps=(Step(catcher.element, Action.TRIGGERED, ref),),
            read=frozenset({catcher.waiting}),
            inhibit=frozenset(seen) - {catcher.waiting}
            | ({place.index} if catcher.keeps else set()),
        )
        if catcher.waiting not in seen:
            for effect in product([when], effects):
                context.net.transition(effect, Kind.EXTERNAL, trigger, ref)
        seen.append(catcher.waiting)
    if begins:
        unawaited = Effect(inhibit=frozenset(seen), read=frozenset({context.running}))
        for effect in product([unawaited], effects):
            if effect.produce:
                context.net.transition(effect, Kind.EXTERNAL, trigger, ref)


def _receiver(context: TranslationContext, catchers: list[Catcher], effect: Effect) -> str:
    for catcher in catchers:
        if catcher.caught in effect.produce:
            return catcher.element
    return effect.steps[0].element if effect.steps else context.process.id


_BUILD: tuple[
    tuple[type[e.FlowNode], Callable[[TranslationContext, e.FlowNode, ScopeDraft], None]], ...
] = (
    (e.Activity, activities.activity),
    (e.ExclusiveGateway, gateways.exclusive),
    (e.ParallelGateway, gateways.parallel),
    (e.InclusiveGateway, gateways.inclusive),
    (e.ComplexGateway, gateways.complex_gateway),
    (e.EventBasedGateway, events.event_based),
    (e.StartEvent, events.start),
    (e.EndEvent, events.end),
    (e.IntermediateCatchEvent, events.catch),
    (e.IntermediateThrowEvent, events.throw),
)


def build_node(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """Translate one element in one scope."""
    context.net.add_element(node)
    if isinstance(node, e.SubProcess) and node.triggered_by_event:
        subprocesses.event_subprocess(context, node, scope)
        return
    for kind, translate_node in _BUILD:
        if isinstance(node, kind):
            translate_node(context, node, scope)
            return
