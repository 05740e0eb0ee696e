"""Start, end, intermediate catch and throw events, and the event-based gateway."""

from dataclasses import replace

from m2pem.engine.execution import definitions_of
from m2pem.mission import elements as e
from m2pem.mission.events import (
    CancelEventDefinition,
    CompensateEventDefinition,
    ConditionalEventDefinition,
    ErrorEventDefinition,
    EscalationEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TerminateEventDefinition,
    TimerEventDefinition,
)
from m2pem.verify.net.petri_net import Action, Exactness, Flag, Kind, Role, Step, Trigger
from m2pem.verify.translate.compensation import cancel, compensate
from m2pem.verify.translate.context import (
    ActivityInstance,
    TranslationContext,
    first,
    register_catcher,
    what_and_ref,
)
from m2pem.verify.translate.net_builder import (
    Effect,
    ScopeDraft,
    TransitionDraft,
    entry_place,
    product,
)
from m2pem.verify.translate.parallel_multiple import TriggerPlaces, all_must_come, await_all
from m2pem.verify.translate.sequence_flows import along, leave
from m2pem.verify.translate.throwing import (
    interrupting_places,
    message_effects,
    signal_effects,
    split_by_places,
    throw_error,
    throw_escalation,
)
from m2pem.verify.translate.timers import fixed, runs, timer_us


def _leave(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> list[Effect]:
    return leave(
        context, scope, node, None, lambda code: throw_error(context, scope, node, None, code)
    )


def _come(
    context: TranslationContext, node: e.FlowNode, scope: ScopeDraft, action: Action
) -> Effect:
    return Effect(steps=(Step(node.id, action),), consume=(entry_place(context.net, node, scope),))


# --- catching -----------------------------------------------------------------------------------


def start(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """A none start event goes on at once; so does one whose trigger has created its instance."""
    assert isinstance(node, e.StartEvent)
    container = node.container
    begun = isinstance(container, e.SubProcess) and container.triggered_by_event
    begun = begun or (scope.parent is context.everything and container is not context.process)
    if node.definitions and not begun:
        _wait(context, node, scope)
    elif scope.parent is context.everything and all_must_come(node):
        waiting = context.net.place(node, scope, Role.ACTIVE)  # for the others of its triggers
        _all_have_come(context, node, scope, waiting, await_all(context, node, scope, scope))
    else:
        come = _come(context, node, scope, Action.COMPLETED)
        context.transitions(product([come], _leave(context, node, scope)))


def catch(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """A catch event waits for its trigger; the target of a link has none."""
    assert isinstance(node, e.IntermediateCatchEvent)
    if not node.definitions or node.linked_from:
        come = _come(context, node, scope, Action.COMPLETED)
        context.transitions(product([come], _leave(context, node, scope)))
        return
    _wait(context, node, scope)


def _wait(context: TranslationContext, node: e.Event, scope: ScopeDraft) -> None:
    net = context.net
    waiting = net.place(node, scope, Role.ACTIVE, several=node in context.repeated)
    if all_must_come(node):
        trigger_places = await_all(context, node, scope, scope)
        _enter(context, node, scope, (waiting, *trigger_places.awaited))
        _all_have_come(context, node, scope, waiting, trigger_places)
        return
    _enter(context, node, scope, (waiting,))
    for number, definition in enumerate(node.definitions):
        _trigger(context, node, scope, definition, waiting, _leave(context, node, scope), number)


def _enter(
    context: TranslationContext, node: e.FlowNode, scope: ScopeDraft, places: tuple[int, ...]
) -> None:
    """A token that enters the event waits at once."""
    come = _come(context, node, scope, Action.ENTERED)
    context.net.transition(come.and_then(Effect(produce=places)))
    context.net.at_once.add(entry_place(context.net, node, scope))


def _all_have_come(
    context: TranslationContext,
    node: e.Event,
    scope: ScopeDraft,
    waiting: int,
    trigger_places: TriggerPlaces,
) -> None:
    done = Effect(steps=(Step(node.id, Action.COMPLETED),), consume=(waiting, *trigger_places.came))
    ways = context.data.receive([done], scope, node)
    context.transitions(product(ways, _leave(context, node, scope)))


def _trigger(
    context: TranslationContext,
    node: e.FlowNode,
    scope: ScopeDraft,
    definition: EventDefinition,
    waiting: int,
    ways: list[Effect],
    number: int,
) -> list[TransitionDraft]:
    """The token of `waiting` goes on when the trigger comes. Returns the transitions of a timer."""
    net = context.net
    came = Effect(steps=(Step(node.id, Action.TRIGGERED),), consume=(waiting,))
    match definition:
        case TimerEventDefinition():
            return [
                net.transition(effect, Kind.EXTERNAL, Trigger.TIMER, due_us=timer_us(definition))
                for effect in product([came], ways)
            ]
        case SignalEventDefinition() | MessageEventDefinition():
            caught = net.place(node, scope, Role.TRIGGERED, f":{number}:{waiting}")
            what, ref = what_and_ref(definition)
            register_catcher(context, what, ref, waiting, caught, False, node)
            came = Effect(steps=came.steps, consume=(caught,))
            context.transitions(product(context.data.receive([came], scope, node), ways))
        case ConditionalEventDefinition(condition=condition):
            if not context.data.is_followed([condition], node):
                net.approximate(node, Exactness.MORE, "its condition may become true at any time")
                for effect in product([came], ways):
                    net.transition(effect, Kind.EXTERNAL, Trigger.CONDITION)
                return []
            for guard, truth in context.data.cases([condition], scope, node, first):
                if truth is True:
                    context.transitions(product(product([came], [Effect(guard=guard)]), ways))
        case _:
            context.transitions(product([came], ways))
    return []


def event_based(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """An event-based gateway waits for the first of the events behind it."""
    assert isinstance(node, e.EventBasedGateway)
    net = context.net
    waiting = net.place(node, scope, Role.ACTIVE, several=node in context.repeated)
    _enter(context, node, scope, (waiting,))
    number = 0
    for flow in node.outgoing:
        target = flow.target
        taken = Effect(steps=(Step(flow.id, Action.TAKEN),))
        ways = product([taken], after(context, target, scope))
        for definition in definitions_of(target):
            made = _trigger(context, target, scope, definition, waiting, ways, number)
            number += 1
            together = isinstance(target, e.Event) and all_must_come(target)
            if together:
                net.approximate(
                    target, Exactness.MORE, "one of its triggers is enough, not all of them"
                )
            if isinstance(definition, TimerEventDefinition) and not (node.parallel or together):
                runs(context, waiting, fixed(definition), (waiting,), made)


def after(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> list[Effect]:
    """Translate the flow after a catch event or receive task whose trigger has already come."""
    if isinstance(node, e.Activity):
        done = [Effect(steps=(Step(node.id, Action.COMPLETED),))]
        for mapping in node.data_flow.outputs:
            done = context.data.write(done, mapping.target, None, scope, node)
        out = leave(
            context,
            scope,
            node,
            node.default,
            lambda code: throw_error(context, scope, node, None, code),
            times=node.completion_quantity,
        )
        return product(done, out)
    return _leave(context, node, scope)


# --- throwing -----------------------------------------------------------------------------------


def throw(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """A throw event throws, and goes on."""
    assert isinstance(node, e.IntermediateThrowEvent)
    if node.links_to is not None:
        link = Effect(produce=(entry_place(context.net, node.links_to, scope),))
        come = _come(context, node, scope, Action.COMPLETED)
        context.transitions(product([come], [link]))
        return
    context.later.append(
        lambda: context.transitions(
            _throw_all(context, node, scope, node.definitions, _leave(context, node, scope))
        )
    )


def _throw_all(
    context: TranslationContext,
    node: e.Event,
    scope: ScopeDraft,
    definitions: tuple[EventDefinition, ...],
    ways: list[Effect],
) -> list[Effect]:
    """Translate the throws of several event definitions, one after the other, and then `ways`."""
    begun = [_come(context, node, scope, Action.COMPLETED)]
    ended: list[Effect] = []
    for definition in definitions:
        match definition:
            case SignalEventDefinition(signal=signal):
                thrown = Effect(steps=(Step(node.id, Action.THROWN, signal.id),))
                begun = product(product(begun, [thrown]), signal_effects(context, signal.id))
                around = interrupting_places(context, "signal", signal.id, scope)
                caught = [Effect(read=frozenset({place})) for place in sorted(around)]
                ended += _interrupted(node, product(begun, caught))
                begun = product(begun, [Effect(inhibit=around)])
            case MessageEventDefinition(message=message):
                thrown = Effect(steps=(Step(node.id, Action.THROWN, message.id),))
                sent = product(product(begun, [thrown]), message_effects(context, message.id))
                around = interrupting_places(context, "message", message.id, scope)
                cut, begun = split_by_places(sent, around)
                ended += _interrupted(node, cut)
            case EscalationEventDefinition(escalation=escalation):
                assert escalation is not None
                going: list[Effect] = []
                for effect, goes_on in throw_escalation(context, scope, node, escalation.code):
                    (going if goes_on else ended).extend(product(begun, [effect]))
                begun = going
            case CompensateEventDefinition():
                waited, begun = compensate(context, node, scope, definition, begun, ways)
                ended += waited
            case _:
                pass
    return [*product(begun, ways), *ended]


def _interrupted(node: e.Event, thrown: list[Effect]) -> list[Effect]:
    """Translate an event whose throw interrupts a scope around it: the event does not complete."""
    done, cut = Step(node.id, Action.COMPLETED), Step(node.id, Action.INTERRUPTED)
    return [
        replace(each, steps=tuple(cut if step == done else step for step in each.steps))
        for each in thrown
    ]


def end(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """An end event consumes the token, and may throw something."""
    assert isinstance(node, e.EndEvent)
    context.later.append(lambda: context.transitions(_end(context, node, scope)))


def _end(context: TranslationContext, node: e.EndEvent, scope: ScopeDraft) -> list[Effect]:
    last: list[Effect] = [context.reached(node, scope)]
    thrown = []
    for definition in node.definitions:
        match definition:
            case TerminateEventDefinition():
                last = _terminate(context, scope)
            case CancelEventDefinition():
                last = cancel(context, node, scope)
            case ErrorEventDefinition(error=error):
                assert error is not None
                last = throw_error(context, scope, node, None, error.code, Flag.UNCAUGHT)
            case _:
                thrown.append(definition)
    return _throw_all(context, node, scope, tuple(thrown), last)


def _terminate(context: TranslationContext, scope: ScopeDraft) -> list[Effect]:
    """End the scope at once. For the process that the run began with, that ends the run."""
    if scope is context.root:
        return [context.end_run(context.terminated)]
    stop = Effect(reset_scopes=frozenset({scope.index}))
    instance = scope.instance
    if not isinstance(instance, ActivityInstance):
        return [stop]
    left = instance.leave().and_then(stop)
    return product([left], instance.cut() if instance.cut is not None else instance.done())


__all__ = ["along", "catch", "end", "event_based", "start", "throw"]
