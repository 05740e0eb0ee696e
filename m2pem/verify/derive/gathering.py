"""Events that wait for all of their triggers (parallel multiple)."""

from dataclasses import dataclass

from m2pem.model import elements as e
from m2pem.model.events import (
    ConditionalEventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.verify.derive.catching import catching, first, what_and_ref
from m2pem.verify.derive.effect import Effect, product
from m2pem.verify.derive.making import Making
from m2pem.verify.derive.net import Area
from m2pem.verify.derive.timers import timer_us
from m2pem.verify.system import Action, Exactness, Kind, Role, Step, Trigger

_AWAITED = (TimerEventDefinition, SignalEventDefinition, MessageEventDefinition)


@dataclass(frozen=True, slots=True)
class Gathering:
    """Places of an event, one for each trigger: it is awaited, or it has come."""

    awaited: tuple[int, ...]
    came: tuple[int, ...]


def all_must_come(event: e.Event) -> bool:
    """Whether an event waits for all of its triggers."""
    return event.parallel_multiple and len(event.definitions) > 1


def can_be_gathered(event: e.BoundaryEvent) -> bool:
    """Whether the triggers of a boundary event are followed one by one.

    Errors and escalations look for their catcher when they are thrown. What does not interrupt
    must see a condition false before it comes again, which is not followed.
    """
    kinds = (*_AWAITED, ConditionalEventDefinition) if event.interrupting else _AWAITED
    return all(isinstance(definition, kinds) for definition in event.definitions)


def gather(making: Making, event: e.Event, area: Area, inside: Area) -> Gathering:
    """What each trigger does: one that is awaited has come. `area` is where data is read, and the
    places are in `inside`."""
    net = making.net
    awaited: list[int] = []
    came: list[int] = []
    for number, definition in enumerate(event.definitions):
        waiting = net.place(event, inside, Role.CONTROL, f":awaits{number}")
        told = net.place(event, inside, Role.CONTROL, f":came{number}")
        awaited.append(waiting)
        came.append(told)
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
                if making.data.is_followed([condition], event):
                    for guard, truth in making.data.cases([condition], area, event, first):
                        if truth is True:
                            making.rules(product([seen], [Effect(guard=guard)]))
                else:
                    said = "its condition may become true at any time"
                    net.approximate(event, Exactness.MORE, said)
                    net.rule(seen, Kind.OUTSIDE, Trigger.CONDITION)
            case _:
                net.rule(seen)
    return Gathering(tuple(awaited), tuple(came))
