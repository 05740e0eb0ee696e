"""Scopes: how they begin, when they are empty, and their event subprocesses."""

from collections.abc import Sequence

from m2pem.mission import elements as e
from m2pem.mission.events import ConditionalEventDefinition, TimerEventDefinition, TimerKind
from m2pem.verify.net.petri_net import Action, Role, Step
from m2pem.verify.translate.context import ActivityInstance, TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place
from m2pem.verify.translate.parallel_multiple import all_must_come, trigger_places


def begin(context: TranslationContext, container: e.Container, scope: ScopeDraft) -> Effect:
    """Put a token on each start event of a container."""
    produce = [entry_place(context.net, entry, scope) for entry in container.entries]
    if container.event_subprocesses:
        produce.append(context.net.place(scope.element, scope, Role.CONTROL, ":open"))
        produce += armed_handlers(context, container, scope)
    return Effect(produce=tuple(produce))


def when_empty(scope: ScopeDraft) -> Effect:
    """Only when no token is left in a scope."""
    return Effect(empty_scopes=frozenset({scope.index}))


def handler_instance(
    context: TranslationContext, scope: ScopeDraft, container: e.SubProcess
) -> ActivityInstance:
    """The event subprocess of a scope, as an activity in it; created at the first call."""
    place = context.net.place(container, scope, Role.ACTIVE)
    for child in scope.children:
        if child.element is container and isinstance(child.instance, ActivityInstance):
            return child.instance
    inside = context.net.scope(container, scope)
    instance = ActivityInstance(container, scope, inside, place, lambda: [Effect()])
    inside.instance = instance
    return instance


def begin_event_subprocess(
    context: TranslationContext,
    scope: ScopeDraft,
    container: e.SubProcess,
    starts: Sequence[e.StartEvent],
) -> Effect:
    """An event subprocess of a scope begins with a token on some of its start events."""
    instance = handler_instance(context, scope, container)
    inside = begin(context, container, instance.inside)
    entries = {entry_place(context.net, entry, instance.inside) for entry in container.entries}
    begun = Effect(
        steps=tuple(Step(start.id, Action.TRIGGERED) for start in starts),
        produce=(
            *(entry_place(context.net, start, instance.inside) for start in starts),
            *(place for place in inside.produce if place not in entries),
        ),
    )
    return begun.and_then(instance.begin())


def armed_handlers(
    context: TranslationContext, container: e.Container, scope: ScopeDraft
) -> list[int]:
    """The places that get a token when a scope begins, for its event subprocesses."""
    armed: list[int] = []
    for each in container.event_subprocesses:
        for start in each.starts:
            if all_must_come(start):
                armed += trigger_places(context, start, scope).awaited
                continue
            if start.interrupting:
                continue
            for number, definition in enumerate(start.definitions):
                once = (
                    isinstance(definition, TimerEventDefinition)
                    and definition.kind is not TimerKind.CYCLE
                )
                if once or isinstance(definition, ConditionalEventDefinition):
                    armed.append(context.net.place(start, scope, Role.CONTROL, f":armed{number}"))
    return armed
