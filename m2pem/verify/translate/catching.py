"""Catching: boundary events, start events of event subprocesses, and event-based catching."""

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
from m2pem.verify.translate.context import (
    ActivityInstance,
    TranslationContext,
    first,
    register_catcher,
    what_and_ref,
)
from m2pem.verify.translate.data import ERROR
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place, is_join, product
from m2pem.verify.translate.parallel_multiple import (
    TriggerPlaces,
    all_must_come,
    await_all,
    trigger_places,
)
from m2pem.verify.translate.scopes import handler_instance
from m2pem.verify.translate.sequence_flows import leave
from m2pem.verify.translate.throwing import begin_handler, throw_error
from m2pem.verify.translate.timers import fixed, holder_of, runs, timer_us

# --- boundary events ----------------------------------------------------------------------------


def boundaries(context: TranslationContext, instance: ActivityInstance) -> None:
    """Translate the triggers that come from outside to the boundary events of an activity."""
    for event in instance.node.boundary:
        context.net.add_element(event)
        out = entry_place(context.net, event, instance.outer)
        _leave_boundary(context, instance, event, out)
        if all_must_come(event):
            _all_triggers(context, instance, event, out)
            continue
        for number, definition in enumerate(event.definitions):
            _boundary(context, instance, event, definition, out, number)


def caught_before_work(context: TranslationContext, instance: ActivityInstance) -> None:
    """Translate what an armed boundary event catches before the activity's work begins.

    Nothing comes from outside then, because the work begins before.
    """
    for event in instance.node.boundary:
        out = entry_place(context.net, event, instance.outer)
        if all_must_come(event):
            _all_came(
                context, instance, event, out, trigger_places(context, event, instance.inside)
            )
            continue
        for number, definition in enumerate(event.definitions):
            match definition:
                case SignalEventDefinition() | MessageEventDefinition():
                    caught = context.net.place(event, instance.outer, Role.TRIGGERED, f":{number}")
                    what, ref = what_and_ref(definition)
                    register_catcher(
                        context, what, ref, instance.active, caught, not event.interrupting, event
                    )
                case ConditionalEventDefinition(condition=condition):
                    if context.data.is_followed([condition], event):
                        comes, _ = _comes(instance, event, out)
                        _boundary_condition(context, instance, event, condition, comes, number)
                case _:
                    pass


def _leave_boundary(
    context: TranslationContext, instance: ActivityInstance, event: e.BoundaryEvent, out: int
) -> None:
    if any(isinstance(d, CompensateEventDefinition) for d in event.definitions):
        return
    come = Effect(steps=(Step(event.id, Action.COMPLETED),), consume=(out,))
    ways = leave(
        context,
        instance.outer,
        event,
        None,
        lambda code: throw_error(context, instance.outer, event, None, code),
    )
    context.transitions(product([come], ways))


def _boundary(
    context: TranslationContext,
    instance: ActivityInstance,
    event: e.BoundaryEvent,
    definition: EventDefinition,
    out: int,
    number: int,
) -> None:
    net = context.net
    comes, caught_comes = _comes(instance, event, out)
    match definition:
        case TimerEventDefinition():
            running = instance.active
            if not event.interrupting and definition.kind is TimerKind.CYCLE:
                comes = _again(context, instance, event, comes)
            elif not event.interrupting:
                running = net.place(event, instance.inside, Role.CONTROL, f":armed{number}")
                comes = _once(instance, comes, running)
            made = net.transition(comes, Kind.EXTERNAL, Trigger.TIMER, due_us=timer_us(definition))
            runs(context, instance.active, fixed(definition), (running,), [made])
        case SignalEventDefinition() | MessageEventDefinition():
            caught = net.place(event, instance.outer, Role.TRIGGERED, f":{number}")
            what, ref = what_and_ref(definition)
            register_catcher(
                context, what, ref, instance.active, caught, not event.interrupting, event
            )
            both = caught_comes.and_then(Effect(consume=(caught,)))
            context.transitions(context.data.receive([both], instance.outer, event))
        case ConditionalEventDefinition(condition=condition):
            _boundary_condition(context, instance, event, condition, comes, number)
        case CancelEventDefinition():
            pass  # its transaction comes here by itself
        case _:
            pass  # errors and escalations look for their catcher


def _comes(instance: ActivityInstance, event: e.BoundaryEvent, out: int) -> tuple[Effect, Effect]:
    """(effect when the trigger comes, effect when the trigger has taken the activity's token
    already).
    """
    caught = Step(event.id, Action.TRIGGERED)
    if not event.interrupting:
        comes = Effect(steps=(caught,), read=frozenset({instance.active}), produce=(out,))
        return comes, Effect(steps=(caught,), produce=(out,))
    stop = instance.leave().with_step(instance.node.id, Action.INTERRUPTED)
    caught_comes = Effect(
        steps=(caught, *stop.steps), reset_scopes=stop.reset_scopes, produce=(out,)
    )
    return replace(caught_comes, consume=stop.consume), caught_comes


def _all_triggers(
    context: TranslationContext, instance: ActivityInstance, event: e.BoundaryEvent, out: int
) -> None:
    """All triggers of a parallel multiple event must come. A non-interrupting one then awaits them
    all again.
    """
    places = await_all(context, event, instance.outer, instance.inside)
    instance.armed += places.awaited
    _all_came(context, instance, event, out, places)


def _all_came(
    context: TranslationContext,
    instance: ActivityInstance,
    event: e.BoundaryEvent,
    out: int,
    places: TriggerPlaces,
) -> None:
    caught = Effect(steps=(Step(event.id, Action.TRIGGERED),), consume=places.came, produce=(out,))
    if event.interrupting:
        stop = instance.leave().with_step(instance.node.id, Action.INTERRUPTED)
    else:
        stop = Effect(read=frozenset({instance.active}), produce=places.again)
    context.transitions(product(context.data.receive([caught], instance.outer, event), [stop]))


def _once(instance: ActivityInstance, comes: Effect, armed: int) -> Effect:
    """A non-interrupting event happens once for each token on the activity."""
    instance.armed.append(armed)
    return comes.and_then(Effect(consume=(armed,)))


def _again(
    context: TranslationContext, instance: ActivityInstance, event: e.BoundaryEvent, comes: Effect
) -> Effect:
    """A non-interrupting event that happens again and again: one handling at a time."""
    context.net.approximate(
        event, Exactness.BOUNDED, "it comes again only when what it began has ended"
    )
    places = (entry_place(context.net, node, instance.outer) for node in handled(event))
    return comes.and_then(Effect(inhibit=frozenset(places)))


def handled(event: e.BoundaryEvent) -> frozenset[e.FlowNode]:
    """The event's own first steps: what follows it until another path joins."""
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
    context: TranslationContext,
    instance: ActivityInstance,
    event: e.BoundaryEvent,
    condition: Expression,
    comes: Effect,
    number: int,
) -> None:
    net = context.net
    if not context.data.is_followed([condition], event):
        net.approximate(event, Exactness.MORE, "its condition may become true at any time")
        if not event.interrupting:
            comes = _again(context, instance, event, comes)
        net.transition(comes, Kind.EXTERNAL, Trigger.CONDITION)
        return
    for guard, truth in context.data.cases([condition], instance.outer, event, first):
        if event.interrupting:
            if truth is True:
                context.transitions(product([comes], [Effect(guard=guard)]))
            continue
        ready = net.place(event, instance.inside, Role.CONTROL, f":ready{number}")
        if ready not in instance.armed:
            instance.armed.append(ready)
        if truth is True:
            context.transitions(product([comes], [Effect(guard=guard, consume=(ready,))]))
        else:
            reset = Effect(
                steps=(Step(event.id, Action.ENTERED, "its condition is false"),),
                guard=guard,
                read=frozenset({instance.active}),
                inhibit=frozenset({ready}),
                produce=(ready,),
            )
            net.transition(reset)


# --- event subprocesses -------------------------------------------------------------------------


def arm_handler(context: TranslationContext, scope: ScopeDraft, start: e.StartEvent) -> None:
    """Translate the triggers of an event subprocess that come from outside of its scope."""
    net = context.net
    assert scope.open is not None
    if all_must_come(start):
        _start_by_all_triggers(context, scope, start)
        return
    for number, definition in enumerate(start.definitions):
        begun = begin_handler(context, scope, start)
        when = Effect(read=frozenset({scope.open}))
        match definition:
            case TimerEventDefinition():
                running: tuple[int, ...] = ()
                if not start.interrupting:
                    if definition.kind is TimerKind.CYCLE:
                        when = when.then(_once_at_a_time(context, scope, start)) or when
                    else:
                        armed = net.place(start, scope, Role.CONTROL, f":armed{number}")
                        when = when.then(Effect(consume=(armed,))) or when
                        running = (armed,)
                made = [
                    net.transition(
                        effect, Kind.EXTERNAL, Trigger.TIMER, due_us=timer_us(definition)
                    )
                    for effect in product([when], begun)
                ]
                holder = holder_of(scope)
                runs(context, holder, fixed(definition), (scope.open, *running), made)
            case SignalEventDefinition() | MessageEventDefinition():
                caught = net.place(start, scope, Role.TRIGGERED, f":reached{number}")
                what, ref = what_and_ref(definition)
                register_catcher(
                    context, what, ref, scope.open, caught, not start.interrupting, start
                )
                come = Effect(steps=(Step(start.id, Action.TRIGGERED),), consume=(caught,))
                if not start.interrupting:
                    come = come.then(_once_at_a_time(context, scope, start)) or come
                    instance = _instance_of(context, scope, start)
                    net.transition(
                        Effect(
                            steps=come.steps, consume=(caught,), read=frozenset({instance.active})
                        )
                    )
                context.transitions(product(context.data.receive([come], scope, start), begun))
            case ConditionalEventDefinition(condition=condition):
                _handler_condition(context, scope, start, condition, when, begun, number)
            case _:
                pass


def _start_by_all_triggers(
    context: TranslationContext, scope: ScopeDraft, start: e.StartEvent
) -> None:
    """All triggers of a parallel multiple start event must come. A non-interrupting one then awaits
    them all again.
    """
    assert scope.open is not None
    places = await_all(context, start, scope, scope)
    come = Effect(read=frozenset({scope.open}), consume=places.came)
    if not start.interrupting:
        missed = Effect(
            steps=(Step(start.id, Action.TRIGGERED),),
            consume=places.came,
            read=frozenset({_instance_of(context, scope, start).active}),
            produce=places.again,
        )
        context.net.transition(missed)
        again = replace(come, produce=places.again)
        come = again.and_then(_once_at_a_time(context, scope, start))
    ways = context.data.receive([come], scope, start)
    context.transitions(product(ways, begin_handler(context, scope, start)))


def _once_at_a_time(context: TranslationContext, scope: ScopeDraft, start: e.StartEvent) -> Effect:
    context.net.approximate(start, Exactness.BOUNDED, "it begins again only when it has ended")
    return Effect(inhibit=frozenset({_instance_of(context, scope, start).active}))


def _instance_of(
    context: TranslationContext, scope: ScopeDraft, start: e.StartEvent
) -> ActivityInstance:
    assert isinstance(start.container, e.SubProcess)
    return handler_instance(context, scope, start.container)


def _handler_condition(
    context: TranslationContext,
    scope: ScopeDraft,
    start: e.StartEvent,
    condition: Expression,
    when: Effect,
    begun: list[Effect],
    number: int,
) -> None:
    net = context.net
    armed = net.place(start, scope, Role.CONTROL, f":armed{number}")
    if not context.data.is_followed([condition], start):
        net.approximate(start, Exactness.MORE, "its condition may become true at any time")
        if not start.interrupting:
            when = when.then(_once_at_a_time(context, scope, start)) or when
        for effect in product([when], begun):
            net.transition(effect, Kind.EXTERNAL, Trigger.CONDITION)
        return
    for guard, truth in context.data.cases([condition], scope, start, first):
        asked = when.and_then(Effect(guard=guard))
        if truth is True:
            if not start.interrupting:
                asked = asked.and_then(Effect(consume=(armed,)))
                asked = asked.and_then(_once_at_a_time(context, scope, start))
            context.transitions(product([asked], begun))
        elif not start.interrupting and truth != ERROR:
            reset = asked.and_then(
                Effect(
                    steps=(Step(start.id, Action.ENTERED, "its condition is false"),),
                    inhibit=frozenset({armed}),
                    produce=(armed,),
                )
            )
            net.transition(reset)
