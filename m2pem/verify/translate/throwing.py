"""Throwing errors, escalations, signals and messages: what catches them, and what follows."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from m2pem.mission import elements as e
from m2pem.mission.events import (
    ErrorEventDefinition,
    EventDefinition,
    error_code,
    escalation_code,
)
from m2pem.verify.net.petri_net import Action, Exactness, Flag, Kind, Step
from m2pem.verify.translate.compensation import compensated_by, cut_short, forget_completions
from m2pem.verify.translate.context import ActivityInstance, CompensatedBy, TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place, product
from m2pem.verify.translate.scopes import begin_event_subprocess, handler_instance


def catchable(scope: ScopeDraft, instance: ActivityInstance | None) -> list[str]:
    """The error codes that events around a place name."""
    codes: dict[str, None] = {}
    for event in _around(scope, instance):
        for definition in event.definitions:
            if isinstance(definition, ErrorEventDefinition) and definition.error is not None:
                codes[definition.error.code] = None
    return list(codes)


def _outward(
    scope: ScopeDraft, instance: ActivityInstance | None
) -> Iterator[tuple[ScopeDraft, ActivityInstance | None]]:
    """Yield a scope and those around it, each with the activity that is left on the way to it."""
    here: ScopeDraft | None = scope
    while here is not None:
        yield here, instance
        instance = here.instance if isinstance(here.instance, ActivityInstance) else None
        here = instance.outer if instance is not None else None


def _around(scope: ScopeDraft, instance: ActivityInstance | None) -> list[e.Event]:
    found: list[e.Event] = []
    for here, left in _outward(scope, instance):
        if left is not None and left.boundary:
            found += left.node.boundary
        found += [s for each in handlers(here) for s in each.starts]
    return found


def handlers(scope: ScopeDraft) -> Sequence[e.SubProcess]:
    """The event subprocesses that can begin in a scope."""
    element = scope.element
    if scope.open is None or not isinstance(element, e.Process | e.SubProcess | e.CallActivity):
        return ()
    container = element.called if isinstance(element, e.CallActivity) else element
    return container.event_subprocesses


def throw_error(
    context: TranslationContext,
    scope: ScopeDraft,
    thrower: e.FlowNode,
    instance: ActivityInstance | None,
    code: str,
    uncaught: Flag = Flag.UNCAUGHT,
) -> list[Effect]:
    """Return what an error leads to.

    The thrower's own token is removed already. `instance`: the activity that it was on, which may
    catch the error itself.
    """
    caught, uncaught_by_all = _catch(context, scope, thrower, instance, code, error_code)
    found = [effect for effect, _ in caught]
    if uncaught_by_all is not None:
        failed = uncaught_by_all.and_then(context.end_run(context.failed))
        found.append(failed.and_then(Effect(flag=uncaught, flagged=code)))
    return found


def failing(
    context: TranslationContext, instance: ActivityInstance, code: str, flag: Flag
) -> list[Effect]:
    """An activity fails. Its token is removed already."""
    return throw_error(context, instance.outer, instance.node, instance, code, flag)


def throw_escalation(
    context: TranslationContext, scope: ScopeDraft, thrower: e.FlowNode, code: str
) -> list[tuple[Effect, bool]]:
    """Return what an escalation leads to, and whether its scope goes on."""
    found, unheard = _catch(context, scope, thrower, None, code, escalation_code)
    if unheard is not None:
        found.append((unheard.and_then(Effect(flag=Flag.UNHEARD, flagged=code)), True))
    return found


def _catch(
    context: TranslationContext,
    scope: ScopeDraft,
    thrower: e.FlowNode,
    instance: ActivityInstance | None,
    code: str,
    code_of: Callable[[EventDefinition], str | None],
) -> tuple[list[tuple[Effect, bool]], Effect | None]:
    """Return what an error or escalation leads to where an event catches it, each with whether its
    scope goes on; and the effect of throwing it where none does, None: one does in any case."""
    found: list[tuple[Effect, bool]] = []
    condition = Effect(steps=(Step(thrower.id, Action.THROWN, code),))
    node = thrower
    taken_off = True  # the token of an activity that throws itself
    for here, left in _outward(scope, instance):
        if here is not scope:
            assert left is not None
            node, taken_off = left.node, False
        if left is not None and left.boundary:
            event = e.catches(left.node.boundary, code, code_of)
            if event is not None:
                there, without = _there(context, condition, left, taken_off=taken_off)
                found.append(_at_boundary(context, there, left, event, taken_off=taken_off))
                if without is None:
                    return found, None
                condition = without
        if here.open is not None:
            start = e.catches(_starts(here, node), code, code_of)
            if start is not None:
                begun = condition.and_then(Effect(read=frozenset({here.open})))
                ways = product([begun], begin_handler(context, here, start))
                found += [(way, not start.interrupting) for way in ways]
                condition = condition.and_then(Effect(inhibit=frozenset({here.open})))
    return found, condition


def _there(
    context: TranslationContext,
    condition: Effect,
    instance: ActivityInstance,
    *,
    taken_off: bool,
) -> tuple[Effect, Effect | None]:
    """When an activity's boundary events can catch what is thrown in it, and when not, if ever.

    They cannot while it is compensated: it has completed (as in the engine).
    """
    if taken_off or compensated_by(context, instance.node) is not CompensatedBy.INSIDE:
        return condition, None
    there = condition.and_then(Effect(read=frozenset({instance.active})))
    return there, condition.then(Effect(inhibit=frozenset({instance.active})))


def _at_boundary(
    context: TranslationContext,
    condition: Effect,
    instance: ActivityInstance,
    event: e.BoundaryEvent,
    *,
    taken_off: bool,
) -> tuple[Effect, bool]:
    caught = Effect(
        steps=(Step(event.id, Action.TRIGGERED),),
        produce=(entry_place(context.net, event, instance.outer),),
    )
    if event.interrupting:
        inside = frozenset({instance.inside.index})
        left = Effect(reset_scopes=inside) if taken_off else instance.leave()
        condition = condition.and_then(left.with_step(instance.node.id, Action.INTERRUPTED))
    return condition.and_then(caught), not event.interrupting


def begin_handler(
    context: TranslationContext, scope: ScopeDraft, start: e.StartEvent
) -> list[Effect]:
    """An event subprocess begins in a scope; an interrupting one ends all else there first."""
    container = start.container
    assert isinstance(container, e.SubProcess)
    begun = begin_event_subprocess(context, scope, container, (start,))
    inside = handler_instance(context, scope, container).inside
    begun = forget_completions(context, inside, container).and_then(begun)
    if start.interrupting:
        stop = Effect(interrupt_scopes=frozenset({scope.index}), produce=cut_short(context, scope))
        return [stop.and_then(begun)]
    return [begun]


def _starts(scope: ScopeDraft, but: e.FlowNode) -> list[e.StartEvent]:
    return [start for each in handlers(scope) if each is not but for start in each.starts]


# --- signals and messages -----------------------------------------------------------------------


def throw_signal(context: TranslationContext, signal: str) -> Effect:
    """Every catcher that waits receives it. Complete only when all catchers are registered."""
    moves = [(c.waiting, c.caught) for c in context.signals.get(signal, ()) if not c.keeps]
    copies = [(c.waiting, c.caught) for c in context.signals.get(signal, ()) if c.keeps]
    return Effect(moves=tuple(moves), copies=tuple(copies))


def signal_effects(context: TranslationContext, signal: str) -> list[Effect]:
    """The effects of a signal on catchers, and the processes that it begins."""
    found = [throw_signal(context, signal)]
    for begun in context.begins.get(("signal", signal), ()):
        found = product(found, begun)
    return found


def message_effects(
    context: TranslationContext, message: str, *, kept: bool = True
) -> list[Effect]:
    """One of the catchers that wait receives a message; else it begins a process, else it is
    stored.
    """
    catchers = context.messages.get(message, [])
    found: list[Effect] = []
    for catcher in catchers:
        if catcher.keeps:
            found.append(Effect(read=frozenset({catcher.waiting}), produce=(catcher.caught,)))
        else:
            found.append(Effect(consume=(catcher.waiting,), produce=(catcher.caught,)))
    unawaited = Effect(inhibit=frozenset(c.waiting for c in catchers))
    begins = context.begins.get(("message", message), ())
    if begins:
        return found + product([unawaited], begins[0])
    if not catchers:
        return [Effect()]
    if kept:
        unawaited = unawaited.and_then(Effect(produce=(_stored_messages(context, message),)))
    return [*found, unawaited]


def interrupting_places(
    context: TranslationContext, what: str, ref: str, scope: ScopeDraft
) -> frozenset[int]:
    """The places on which activities and event subprocesses around an element wait for what it
    throws.

    They wait, in `scope` or around it, for a signal or message with an interrupting event. The
    message goes out before its thrower completes; a thrower that is interrupted by it never
    completes.
    """
    around: set[int] = set()
    for here, left in _outward(scope, None):
        if here.open is not None:
            around.add(here.open)
        if left is not None:
            around.add(left.active)
    register = context.signals if what == "signal" else context.messages
    return frozenset(
        each.waiting for each in register.get(ref, ()) if each.waiting in around and not each.keeps
    )


def split_by_places(
    ways: Iterable[Effect], places: frozenset[int]
) -> tuple[list[Effect], list[Effect]]:
    """Return (effects that take a token from one of some places, the others)."""
    all_of = list(ways)
    taking = [each for each in all_of if not places.isdisjoint(each.consume)]
    return taking, [each for each in all_of if places.isdisjoint(each.consume)]


def _stored_messages(context: TranslationContext, message: str) -> int:
    """The place with the copies of a message that wait for a catcher: their number is
    not limited.
    """
    place = context.net.counted(context.process, context.everything, f":{message}")
    context.net.approximate(
        context.process,
        Exactness.BOUNDED,
        f"not all copies of message {message} that are kept are counted",
        context.net.places[place].name,
    )
    return place


def deliver_stored(context: TranslationContext, message: str) -> None:
    """A catcher that waits for a message receives a stored copy."""
    letter = _stored_messages(context, message)
    for catcher in context.messages.get(message, ()):
        taken = Effect(
            steps=(Step(catcher.element, Action.TRIGGERED, message),),
            consume=(letter,) if catcher.keeps else (letter, catcher.waiting),
            read=frozenset({catcher.waiting}) if catcher.keeps else frozenset(),
            produce=(catcher.caught,),
        )
        context.net.transition(taken, Kind.INTERNAL)
