"""Translate a mission into a net: its processes, outside triggers, and the end of the run."""

from collections.abc import Callable

from m2pem.fleet.fleet import Fleet
from m2pem.fleet.madeup import fleet_for
from m2pem.mission import elements as e
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Role, Step, System, Trigger
from m2pem.verify.net.size_limit import Bound
from m2pem.verify.translate import activities, events, gateways, subprocesses
from m2pem.verify.translate.activities import contend
from m2pem.verify.translate.compensation import give_back
from m2pem.verify.translate.context import Catcher, Making, what_and_ref
from m2pem.verify.translate.events import after, awaited
from m2pem.verify.translate.net_builder import Area, Effect, at, enter_at_once, product
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.parallel_multiple import AWAITED, all_must_come, gathering
from m2pem.verify.translate.scopes import begin
from m2pem.verify.translate.subprocesses import build, choose
from m2pem.verify.translate.throwing import (
    deliver_kept,
    message_effects,
    signal_effects,
    thrown_by,
)
from m2pem.verify.translate.timers import put_in_order, timer_us


def translate(
    mission: Mission,
    fleet: Fleet | None = None,
    *,
    process: str | None = None,
    options: Options | None = None,
    bound: Bound | None = None,
) -> System:
    """The rules of a mission that begins with a process (else its main one), on a fleet.

    Without a fleet, one is made up from the mission's roles.

    Raises:
        KeyError: the mission has no such process.
        TooLargeError: it stands for more than `bound` allows.
    """
    root = mission.process(process)
    bound = bound or Bound()
    making = Making(mission, root, fleet or fleet_for(mission), options or Options(), bound)
    making.build_node = build_node
    making.root = making.net.area(root, making.everything, step=root.id, frame=(root.id,))
    making.data.follow(making.root.frame)
    build(making, root, making.root)
    others = _others(making)
    for other in others:
        _instances(making, other)
    first = begin(making, root, making.root)
    initial = (making.running, *first.produce)
    for late in making.later:
        late()
    contend(making)
    choose(making)
    _outside(making)
    give_back(making)
    if making.options.timers_in_order:
        put_in_order(making)
    _completes(making)
    initial = enter_at_once(making.net, initial)
    return making.net.finish(
        mission.file,
        root.id,
        tuple(making.data.variables),
        initial,
        (making.completed, making.terminated, making.failed),
    )


def _completes(making: Making) -> None:
    """The run is over when no token is left anywhere."""
    over = Effect(
        steps=(Step(making.process.id, Action.COMPLETED),),
        quiet_scopes=frozenset({making.everything.index}),
    ).then(making.end_run(making.completed))
    assert over is not None
    making.net.rule(over)


# --- processes that triggers begin --------------------------------------------------------------


def _others(making: Making) -> list[e.Process]:
    """Processes that neither the run begins with nor a call activity calls."""
    called = {n.called for n in making.mission.nodes if isinstance(n, e.CallActivity)}
    return [p for p in making.mission.processes if p is not making.process and p not in called]


def _instances(making: Making, process: e.Process) -> None:
    """One area for each instance that may be active at a time."""
    starts = [start for entry in process.entries for start in _triggered(entry)]
    if not starts:
        return
    making.net.approximate(
        process,
        Exactness.BOUNDED,
        f"checked with up to {making.options.instances} instances at a time",
    )
    areas = []
    for number in range(making.options.instances):
        step = f"{process.id}#{number + 1}"
        area = making.net.area(process, making.everything, step=step, frame=(process.id, step))
        build(making, process, area)
        alive = making.net.place(process, area, Role.CONTROL, ":alive")
        notes = making.kept.get(area.index, area)
        over = Effect(
            steps=(Step(process.id, Action.COMPLETED),),
            consume=(alive,),
            kill_scopes=frozenset({area.index, notes.index}),
            quiet_scopes=frozenset({area.index}),
        )
        making.net.rule(over)
        areas.append((area, alive))
    for start in starts:
        for definition in awaited(start):
            _begun_by(making, process, start, definition, areas)


def _triggered(entry: e.FlowNode) -> list[e.FlowNode]:
    if isinstance(entry, e.EventBasedGateway):
        return [flow.target for flow in entry.outgoing]
    if isinstance(entry, e.StartEvent):
        return [entry] if entry.definitions else []
    return [entry] if isinstance(entry, e.ReceiveTask) and entry.instantiate else []


def _begun_by(
    making: Making,
    process: e.Process,
    start: e.FlowNode,
    definition: EventDefinition,
    areas: list[tuple[Area, int]],
) -> None:
    brings = isinstance(definition, SignalEventDefinition | MessageEventDefinition)
    ways: list[Effect] = []
    for number, (area, alive) in enumerate(areas):
        free = Effect(
            steps=(Step(start.id, Action.TRIGGERED),),
            read=frozenset(other for _, other in areas[:number]),
            inhibit=frozenset({alive}),
            produce=(alive,),
        )
        inside = [Effect(produce=tuple(begin_without_entries(making, process, area)))]
        if isinstance(start, e.StartEvent) and all_must_come(start):
            more = [_first_of_several(making, start, definition, area)]
        elif isinstance(start, e.StartEvent):
            more = [Effect(produce=(at(making.net, start, area),))]
        else:
            more = after(making, start, area)
        come = making.data.receive([free], area, start) if brings else [free]
        ways += product(product(come, inside), more)
    full = Effect(read=frozenset(alive for _, alive in areas))
    match definition:
        case SignalEventDefinition() | MessageEventDefinition():
            what, ref = what_and_ref(definition)
            making.begins.setdefault((what, ref), []).append([*ways, full])
        case TimerEventDefinition() | ConditionalEventDefinition():
            timer = isinstance(definition, TimerEventDefinition)
            due = timer_us(definition) if isinstance(definition, TimerEventDefinition) else None
            for effect in product([Effect(read=frozenset({making.running}))], ways):
                making.net.rule(
                    effect,
                    Kind.OUTSIDE,
                    Trigger.TIMER if timer else Trigger.CONDITION,
                    due_us=due,
                )
        case _:
            pass


def _first_of_several(
    making: Making, start: e.StartEvent, definition: EventDefinition, area: Area
) -> Effect:
    """One of the triggers that must all come has come: the others are awaited in the instance."""
    places = gathering(making, start, area)
    waiting = making.net.place(start, area, Role.ACTIVE)
    triggers = [each for each in awaited(start) if isinstance(each, AWAITED)]
    came = [
        there if each is definition else yet
        for each, there, yet in zip(triggers, places.came, places.awaited, strict=True)
    ]
    return Effect(produce=(waiting, *came))


def begin_without_entries(making: Making, process: e.Process, area: Area) -> list[int]:
    """What an instance begins with beside the token of its start event."""
    entries = {at(making.net, entry, area) for entry in process.entries}
    return [n for n in begin(making, process, area).produce if n not in entries]


# --- signals and messages from outside ----------------------------------------------------------


def _outside(making: Making) -> None:
    mission = making.mission
    thrown_signals: set[str] = set()
    thrown_messages: set[str] = set()
    for node in mission.nodes:
        signals, messages = thrown_by(node)
        thrown_signals |= signals
        thrown_messages |= messages
    for message in sorted(thrown_messages & set(making.messages)):
        deliver_kept(making, message)
    for signal in mission.signals.values():
        if making.options.open_world or signal.from_operator or signal.returned:
            _from_outside(making, "signal", signal.id)
    strangers = messages_from_strangers(mission)
    for message_id, message_element in mission.messages.items():
        if (
            making.options.open_world
            or message_element.from_operator
            or (message_id in strangers and message_id not in thrown_messages)
        ):
            _from_outside(making, "message", message_id)


def messages_from_strangers(mission: Mission) -> frozenset[str]:
    """Messages that pools without a process of their own send."""
    found: set[str] = set()
    for flow in mission.message_flows:
        if flow.source_id not in mission.elements:
            target = mission.elements.get(flow.target_id)
            if isinstance(target, e.Event | e.ReceiveTask):
                for definition in awaited(target):
                    if isinstance(definition, MessageEventDefinition):
                        found.add(definition.message.id)
    return frozenset(found)


def _from_outside(making: Making, what: str, ref: str) -> None:
    """It comes when somebody waits for it, or when it begins a process."""
    trigger = Trigger.SIGNAL if what == "signal" else Trigger.MESSAGE
    register = making.signals if what == "signal" else making.messages
    catchers: list[Catcher] = register.get(ref, [])
    if what == "message":
        effects = [
            effect
            for effect in message_effects(making, ref, kept=False)
            if effect.consume or effect.produce
        ]
        on = Effect(read=frozenset({making.running}))  # what it begins, it begins in the run
        for effect in product([on], effects):
            named = effect.saying(_receiver(making, catchers, effect), Action.TRIGGERED, ref)
            making.net.rule(named, Kind.OUTSIDE, trigger, ref)
        return
    effects = signal_effects(making, ref)
    begins = bool(making.begins.get((what, ref)))
    seen: list[int] = []
    for catcher in catchers:
        host = making.net.places[catcher.told]
        when = Effect(
            steps=(Step(catcher.element, Action.TRIGGERED, ref),),
            read=frozenset({catcher.waiting}),
            inhibit=frozenset(seen) - {catcher.waiting}
            | ({host.index} if catcher.keeps else set()),
        )
        if catcher.waiting not in seen:
            for effect in product([when], effects):
                making.net.rule(effect, Kind.OUTSIDE, trigger, ref)
        seen.append(catcher.waiting)
    if begins:
        nobody = Effect(inhibit=frozenset(seen), read=frozenset({making.running}))
        for effect in product([nobody], effects):
            if effect.produce:
                making.net.rule(effect, Kind.OUTSIDE, trigger, ref)


def _receiver(making: Making, catchers: list[Catcher], effect: Effect) -> str:
    for catcher in catchers:
        if catcher.told in effect.produce:
            return catcher.element
    return effect.steps[0].element if effect.steps else making.process.id


_BUILD: tuple[tuple[type[e.FlowNode], Callable[[Making, e.FlowNode, Area], None]], ...] = (
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


def build_node(making: Making, node: e.FlowNode, area: Area) -> None:
    """Make the rules of one element in one area."""
    making.net.knows(node)
    if isinstance(node, e.SubProcess) and node.triggered_by_event:
        subprocesses.event_subprocess(making, node, area)
        return
    for kind, translate_node in _BUILD:
        if isinstance(node, kind):
            translate_node(making, node, area)
            return
