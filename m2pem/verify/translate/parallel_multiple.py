"""Events that wait for all of their triggers (parallel multiple)."""

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
from m2pem.verify.translate.context import Making, catching, first, what_and_ref
from m2pem.verify.translate.net_builder import Area, Effect, product
from m2pem.verify.translate.timers import timer_us

AWAITED = (
    TimerEventDefinition,
    SignalEventDefinition,
    MessageEventDefinition,
    ConditionalEventDefinition,
)
"""Triggers that come to an event which waits for them."""


@dataclass(frozen=True, slots=True)
class Gathering:
    """Places of an event, one for each trigger: it is awaited, or it has come.

    `again`: those that get a token when the event has come, and does not interrupt. A condition
    must then be seen false before it is awaited.
    """

    awaited: tuple[int, ...]
    came: tuple[int, ...]
    again: tuple[int, ...]

    @property
    def places(self) -> tuple[int, ...]:
        """All of them."""
        return tuple(dict.fromkeys((*self.awaited, *self.came, *self.again)))


def all_must_come(event: e.Event) -> bool:
    """Whether an event waits for all of its triggers.

    Errors and escalations are none of those: they look for their catcher when they are thrown, and
    one is enough, as in the engine.
    """
    several = event.parallel_multiple and len(event.definitions) > 1
    return several and bool(_awaited(event))


def _awaited(event: e.Event) -> list[EventDefinition]:
    return [each for each in event.definitions if isinstance(each, AWAITED)]


def gathering(making: Making, event: e.Event, inside: Area) -> Gathering:
    """The places of an event that waits for all of its triggers; they are in `inside`."""
    awaited: list[int] = []
    came: list[int] = []
    again: list[int] = []
    for number, definition in enumerate(_awaited(event)):
        awaited.append(making.net.place(event, inside, Role.CONTROL, f":awaits{number}"))
        came.append(making.net.place(event, inside, Role.CONTROL, f":came{number}"))
        spent = isinstance(definition, ConditionalEventDefinition) and making.data.is_followed(
            [definition.condition], event
        )
        again.append(
            making.net.place(event, inside, Role.CONTROL, f":spent{number}")
            if spent and _comes_again(event)
            else awaited[-1]
        )
    return Gathering(tuple(awaited), tuple(came), tuple(again))


def _comes_again(event: e.Event) -> bool:
    return isinstance(event, e.BoundaryEvent | e.StartEvent) and not event.interrupting


def gather(making: Making, event: e.Event, area: Area, inside: Area) -> Gathering:
    """What each trigger does: one that is awaited has come. `area` is where data is read, and the
    places are in `inside`."""
    net = making.net
    found = gathering(making, event, inside)
    if making.data.receives(event):
        net.approximate(
            event, Exactness.BOUNDED, "what its triggers bring is written when all have come"
        )
    for number, definition in enumerate(_awaited(event)):
        waiting, told, spent = found.awaited[number], found.came[number], found.again[number]
        seen = Effect(
            steps=(Step(event.id, Action.TRIGGERED, "one of several"),),
            consume=(waiting,),
            produce=(told,),
        )
        match definition:
            case TimerEventDefinition():
                net.rule(seen, Kind.OUTSIDE, Trigger.TIMER, due_us=timer_us(definition))
            case SignalEventDefinition() | MessageEventDefinition():
                what, ref = what_and_ref(definition)
                catching(making, what, ref, waiting, told, False, event)
            case ConditionalEventDefinition(condition=condition):
                if not making.data.is_followed([condition], event):
                    said = "its condition may become true at any time"
                    net.approximate(event, Exactness.MORE, said)
                    net.rule(seen, Kind.OUTSIDE, Trigger.CONDITION)
                    continue
                false = Effect(
                    steps=(Step(event.id, Action.ENTERED, "its condition is false"),),
                    consume=(spent,),
                    produce=(waiting,),
                )
                for guard, truth in making.data.cases([condition], area, event, first):
                    if truth is True:
                        making.rules(product([seen], [Effect(guard=guard)]))
                    elif spent != waiting:
                        making.rules(product([false], [Effect(guard=guard)]))
    return found
