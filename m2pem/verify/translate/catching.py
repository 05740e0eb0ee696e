"""What waits for something: boundary events, the starts of event subprocesses, catch events."""

from dataclasses import replace

from m2pem.mission import elements as e
from m2pem.mission.events import (
    CancelEventDefinition,
    CompensateEventDefinition,
    ConditionalEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.mission.expression import Expression
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Role, Step, Trigger
from m2pem.verify.translate.context import Host, Making, catching, first, what_and_ref
from m2pem.verify.translate.data import ERROR
from m2pem.verify.translate.net_builder import Area, Effect, at, is_join, product
from m2pem.verify.translate.parallel_multiple import Gathering, all_must_come, gather, gathering
from m2pem.verify.translate.scopes import handler_host
from m2pem.verify.translate.sequence_flows import leave
from m2pem.verify.translate.throwing import begin_handler, throw_error
from m2pem.verify.translate.timers import fixed, holder_of, runs, timer_us

# --- boundary events ----------------------------------------------------------------------------


def boundaries(making: Making, host: Host) -> None:
    """Everything that can come to the boundary of an activity from outside of it."""
    for event in host.node.boundary:
        making.net.knows(event)
        out = at(making.net, event, host.outer)
        _leave_boundary(making, host, event, out)
        if all_must_come(event):
            _gathered(making, host, event, out)
            continue
        for number, definition in enumerate(event.definitions):
            _boundary(making, host, event, definition, out, number)


def caught_before_work(making: Making, host: Host) -> None:
    """What can come to the boundary of an activity whose work has not begun: nothing from outside,
    for that begins before."""
    for event in host.node.boundary:
        out = at(making.net, event, host.outer)
        if all_must_come(event):
            _all_came(making, host, event, out, gathering(making, event, host.inside))
            continue
        for number, definition in enumerate(event.definitions):
            match definition:
                case SignalEventDefinition() | MessageEventDefinition():
                    told = making.net.place(event, host.outer, Role.TRIGGERED, f":{number}")
                    what, ref = what_and_ref(definition)
                    catching(making, what, ref, host.active, told, not event.interrupting, event)
                case ConditionalEventDefinition(condition=condition):
                    if making.data.is_followed([condition], event):
                        comes, _ = _comes(host, event, out)
                        _boundary_condition(making, host, event, condition, comes, number)
                case _:
                    pass


def _leave_boundary(making: Making, host: Host, event: e.BoundaryEvent, out: int) -> None:
    if any(isinstance(d, CompensateEventDefinition) for d in event.definitions):
        return
    come = Effect(steps=(Step(event.id, Action.COMPLETED),), consume=(out,))
    ways = leave(
        making,
        host.outer,
        event,
        None,
        lambda code: throw_error(making, host.outer, event, None, code),
    )
    making.rules(product([come], ways))


def _boundary(
    making: Making,
    host: Host,
    event: e.BoundaryEvent,
    definition: EventDefinition,
    out: int,
    number: int,
) -> None:
    net = making.net
    comes, told_comes = _comes(host, event, out)
    match definition:
        case TimerEventDefinition():
            running = host.active
            if not event.interrupting and definition.kind is TimerKind.CYCLE:
                comes = _again(making, host, event, comes)
            elif not event.interrupting:
                running = net.place(event, host.inside, Role.CONTROL, f":armed{number}")
                comes = _once(host, comes, running)
            made = net.rule(comes, Kind.OUTSIDE, Trigger.TIMER, due_us=timer_us(definition))
            runs(making, host.active, fixed(definition), (running,), [made])
        case SignalEventDefinition() | MessageEventDefinition():
            told = net.place(event, host.outer, Role.TRIGGERED, f":{number}")
            what, ref = what_and_ref(definition)
            catching(making, what, ref, host.active, told, not event.interrupting, event)
            both = told_comes.then(Effect(consume=(told,)))
            assert both is not None
            making.rules(making.data.receive([both], host.outer, event))
        case ConditionalEventDefinition(condition=condition):
            _boundary_condition(making, host, event, condition, comes, number)
        case CancelEventDefinition():
            pass  # its transaction comes here by itself
        case _:
            pass  # errors and escalations look for their catcher


def _comes(host: Host, event: e.BoundaryEvent, out: int) -> tuple[Effect, Effect]:
    """What follows when the trigger comes; and when it has taken the activity's token already."""
    caught = Step(event.id, Action.TRIGGERED)
    if not event.interrupting:
        comes = Effect(steps=(caught,), read=frozenset({host.active}), produce=(out,))
        return comes, Effect(steps=(caught,), produce=(out,))
    stop = host.leave().saying(host.node.id, Action.INTERRUPTED)
    told_comes = Effect(steps=(caught, *stop.steps), kill_scopes=stop.kill_scopes, produce=(out,))
    return replace(told_comes, consume=stop.consume), told_comes


def _gathered(making: Making, host: Host, event: e.BoundaryEvent, out: int) -> None:
    """All of its triggers must come; what does not interrupt then awaits them all anew."""
    places = gather(making, event, host.outer, host.inside)
    host.armed += places.awaited
    _all_came(making, host, event, out, places)


def _all_came(
    making: Making, host: Host, event: e.BoundaryEvent, out: int, places: Gathering
) -> None:
    caught = Effect(steps=(Step(event.id, Action.TRIGGERED),), consume=places.came, produce=(out,))
    if event.interrupting:
        stop = host.leave().saying(host.node.id, Action.INTERRUPTED)
    else:
        stop = Effect(read=frozenset({host.active}), produce=places.again)
    making.rules(product(making.data.receive([caught], host.outer, event), [stop]))


def _once(host: Host, comes: Effect, armed: int) -> Effect:
    """What does not interrupt comes once for each token on the activity."""
    host.armed.append(armed)
    both = comes.then(Effect(consume=(armed,)))
    assert both is not None
    return both


def _again(making: Making, host: Host, event: e.BoundaryEvent, comes: Effect) -> Effect:
    """What does not interrupt, and comes again and again: one handling at a time."""
    making.net.approximate(
        event, Exactness.BOUNDED, "it comes again only when what it began has ended"
    )
    region = handled(event)
    found: set[int] = set()
    both = comes.then(Effect(inhibit=_Late(making, host.outer, region, found)))
    assert both is not None
    return both


class _Late(frozenset[int]):
    """Places of some nodes, known when all are made."""

    __slots__ = ()

    def __new__(
        cls, making: Making, area: Area, nodes: frozenset[e.FlowNode], found: set[int]
    ) -> "_Late":
        del found
        return super().__new__(cls, {at(making.net, node, area) for node in nodes})


def handled(event: e.BoundaryEvent) -> frozenset[e.FlowNode]:
    """The event's own first steps: what follows it until something else joins."""
    found: set[e.FlowNode] = {event}
    waiting: list[e.FlowNode] = [event]
    while waiting:
        for flow in waiting.pop().outgoing:
            node = flow.target
            if node not in found and all(f.source in found for f in node.incoming):
                found.add(node)
                waiting.append(node)
    return frozenset(node for node in found if not is_join(node))


def _boundary_condition(
    making: Making,
    host: Host,
    event: e.BoundaryEvent,
    condition: Expression,
    comes: Effect,
    number: int,
) -> None:
    net = making.net
    if not making.data.is_followed([condition], event):
        net.approximate(event, Exactness.MORE, "its condition may become true at any time")
        if not event.interrupting:
            comes = _again(making, host, event, comes)
        net.rule(comes, Kind.OUTSIDE, Trigger.CONDITION)
        return
    for guard, truth in making.data.cases([condition], host.outer, event, first):
        if event.interrupting:
            if truth is True:
                making.rules(product([comes], [Effect(guard=guard)]))
            continue
        ready = net.place(event, host.inside, Role.CONTROL, f":ready{number}")
        if ready not in host.armed:
            host.armed.append(ready)
        if truth is True:
            making.rules(product([comes], [Effect(guard=guard, consume=(ready,))]))
        else:
            reset = Effect(
                steps=(Step(event.id, Action.ENTERED, "its condition is false"),),
                guard=guard,
                read=frozenset({host.active}),
                inhibit=frozenset({ready}),
                produce=(ready,),
            )
            net.rule(reset)


# --- event subprocesses -------------------------------------------------------------------------


def arm_handler(making: Making, area: Area, start: e.StartEvent) -> None:
    """What begins an event subprocess from outside of its area."""
    net = making.net
    assert area.open is not None
    if all_must_come(start):
        _gathered_start(making, area, start)
        return
    for number, definition in enumerate(start.definitions):
        begun = begin_handler(making, area, start)
        when = Effect(read=frozenset({area.open}))
        match definition:
            case TimerEventDefinition():
                running: tuple[int, ...] = ()
                if not start.interrupting:
                    if definition.kind is TimerKind.CYCLE:
                        when = when.then(_once_at_a_time(making, area, start)) or when
                    else:
                        armed = net.place(start, area, Role.CONTROL, f":armed{number}")
                        when = when.then(Effect(consume=(armed,))) or when
                        running = (armed,)
                made = [
                    net.rule(effect, Kind.OUTSIDE, Trigger.TIMER, due_us=timer_us(definition))
                    for effect in product([when], begun)
                ]
                holder = holder_of(making, area)
                runs(making, holder, fixed(definition), (area.open, *running), made)
            case SignalEventDefinition() | MessageEventDefinition():
                told = net.place(start, area, Role.TRIGGERED, f":told{number}")
                what, ref = what_and_ref(definition)
                catching(making, what, ref, area.open, told, not start.interrupting, start)
                come = Effect(steps=(Step(start.id, Action.TRIGGERED),), consume=(told,))
                if not start.interrupting:
                    come = come.then(_once_at_a_time(making, area, start)) or come
                    host = _host_of(making, area, start)
                    net.rule(
                        Effect(steps=come.steps, consume=(told,), read=frozenset({host.active}))
                    )
                making.rules(product(making.data.receive([come], area, start), begun))
            case ConditionalEventDefinition(condition=condition):
                _handler_condition(making, area, start, condition, when, begun, number)
            case _:
                pass


def _gathered_start(making: Making, area: Area, start: e.StartEvent) -> None:
    """All of its triggers must come; what does not interrupt then awaits them all anew."""
    assert area.open is not None
    places = gather(making, start, area, area)
    come = Effect(read=frozenset({area.open}), consume=places.came)
    if not start.interrupting:
        missed = Effect(
            steps=(Step(start.id, Action.TRIGGERED),),
            consume=places.came,
            read=frozenset({_host_of(making, area, start).active}),
            produce=places.again,
        )
        making.net.rule(missed)
        again = replace(come, produce=places.again)
        alone = again.then(_once_at_a_time(making, area, start))
        assert alone is not None
        come = alone
    ways = making.data.receive([come], area, start)
    making.rules(product(ways, begin_handler(making, area, start)))


def _once_at_a_time(making: Making, area: Area, start: e.StartEvent) -> Effect:
    making.net.approximate(start, Exactness.BOUNDED, "it begins again only when it has ended")
    return Effect(inhibit=frozenset({_host_of(making, area, start).active}))


def _host_of(making: Making, area: Area, start: e.StartEvent) -> Host:
    assert isinstance(start.container, e.SubProcess)
    return handler_host(making, area, start.container)


def _handler_condition(
    making: Making,
    area: Area,
    start: e.StartEvent,
    condition: Expression,
    when: Effect,
    begun: list[Effect],
    number: int,
) -> None:
    net = making.net
    armed = net.place(start, area, Role.CONTROL, f":armed{number}")
    if not making.data.is_followed([condition], start):
        net.approximate(start, Exactness.MORE, "its condition may become true at any time")
        if not start.interrupting:
            when = when.then(_once_at_a_time(making, area, start)) or when
        for effect in product([when], begun):
            net.rule(effect, Kind.OUTSIDE, Trigger.CONDITION)
        return
    for guard, truth in making.data.cases([condition], area, start, first):
        asked = when.then(Effect(guard=guard))
        assert asked is not None
        if truth is True:
            if not start.interrupting:
                asked = asked.then(Effect(consume=(armed,)))
                assert asked is not None
                asked = asked.then(_once_at_a_time(making, area, start))
                assert asked is not None
            making.rules(product([asked], begun))
        elif not start.interrupting and truth != ERROR:
            reset = asked.then(
                Effect(
                    steps=(Step(start.id, Action.ENTERED, "its condition is false"),),
                    inhibit=frozenset({armed}),
                    produce=(armed,),
                )
            )
            assert reset is not None
            net.rule(reset)
