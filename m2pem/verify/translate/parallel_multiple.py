"""Parallel multiple events: they wait for all of their triggers."""

from dataclasses import dataclass

from m2pem.mission import elements as e
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Role, Step, Trigger
from m2pem.verify.translate.context import TranslationContext, first, register_catcher, what_and_ref
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, product
from m2pem.verify.translate.timers import timer_us

AWAITED = (
    TimerEventDefinition,
    SignalEventDefinition,
    MessageEventDefinition,
    ConditionalEventDefinition,
)
"""Event definitions that a parallel multiple event waits for."""


@dataclass(frozen=True, slots=True)
class TriggerPlaces:
    """The places of an event, for each trigger: it is awaited, or it has come.

    `again`: those that get a token when a non-interrupting event has happened. A condition must
    then become false before it is awaited again.
    """

    awaited: tuple[int, ...]
    came: tuple[int, ...]
    again: tuple[int, ...]

    @property
    def places(self) -> tuple[int, ...]:
        return tuple(dict.fromkeys((*self.awaited, *self.came, *self.again)))


def all_must_come(event: e.Event) -> bool:
    """Whether an event waits for all of its triggers.

    Errors and escalations are excluded: a throw looks for its catcher, and one of them is enough,
    as in the engine.
    """
    several = event.parallel_multiple and len(event.definitions) > 1
    return several and bool(_awaited(event))


def _awaited(event: e.Event) -> list[EventDefinition]:
    return [each for each in event.definitions if isinstance(each, AWAITED)]


def trigger_places(
    context: TranslationContext, event: e.Event, inside: ScopeDraft
) -> TriggerPlaces:
    """The places of an event that waits for all of its triggers; they are in `inside`."""
    awaited: list[int] = []
    came: list[int] = []
    again: list[int] = []
    for number, definition in enumerate(_awaited(event)):
        awaited.append(context.net.place(event, inside, Role.CONTROL, f":awaits{number}"))
        came.append(context.net.place(event, inside, Role.CONTROL, f":came{number}"))
        spent = isinstance(definition, ConditionalEventDefinition) and context.data.is_followed(
            [definition.condition], event
        )
        again.append(
            context.net.place(event, inside, Role.CONTROL, f":spent{number}")
            if spent and _comes_again(event)
            else awaited[-1]
        )
    return TriggerPlaces(tuple(awaited), tuple(came), tuple(again))


def _comes_again(event: e.Event) -> bool:
    return isinstance(event, e.BoundaryEvent | e.StartEvent) and not event.interrupting


def await_all(
    context: TranslationContext, event: e.Event, scope: ScopeDraft, inside: ScopeDraft
) -> TriggerPlaces:
    """Translate each trigger: one that is awaited comes.

    `scope` is where data is read, and the places are in `inside`.
    """
    net = context.net
    found = trigger_places(context, event, inside)
    if context.data.receives(event):
        net.approximate(
            event, Exactness.BOUNDED, "what its triggers bring is written when all have come"
        )
    for number, definition in enumerate(_awaited(event)):
        waiting, caught, spent = found.awaited[number], found.came[number], found.again[number]
        seen = Effect(
            steps=(Step(event.id, Action.TRIGGERED, "one of several"),),
            consume=(waiting,),
            produce=(caught,),
        )
        match definition:
            case TimerEventDefinition():
                net.transition(seen, Kind.EXTERNAL, Trigger.TIMER, due_us=timer_us(definition))
            case SignalEventDefinition() | MessageEventDefinition():
                what, ref = what_and_ref(definition)
                register_catcher(context, what, ref, waiting, caught, False, event)
            case ConditionalEventDefinition(condition=condition):
                if not context.data.is_followed([condition], event):
                    said = "its condition may become true at any time"
                    net.approximate(event, Exactness.MORE, said)
                    net.transition(seen, Kind.EXTERNAL, Trigger.CONDITION)
                    continue
                false = Effect(
                    steps=(Step(event.id, Action.ENTERED, "its condition is false"),),
                    consume=(spent,),
                    produce=(waiting,),
                )
                for guard, truth in context.data.cases([condition], scope, event, first):
                    if truth is True:
                        context.transitions(product([seen], [Effect(guard=guard)]))
                    elif spent != waiting:
                        context.transitions(product([false], [Effect(guard=guard)]))
    return found
