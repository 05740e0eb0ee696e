"""How areas begin, are quiet, and hold their event subprocesses."""

from collections.abc import Sequence

from m2pem.mission import elements as e
from m2pem.mission.events import ConditionalEventDefinition, TimerEventDefinition, TimerKind
from m2pem.verify.net.petri_net import Action, Role, Step
from m2pem.verify.translate.context import Host, Making
from m2pem.verify.translate.net_builder import Area, Effect, at
from m2pem.verify.translate.parallel_multiple import all_must_come, gathering


def begin(making: Making, container: e.Container, area: Area) -> Effect:
    """A token for each of its start events."""
    produce = [at(making.net, entry, area) for entry in container.entries]
    if container.event_subprocesses:
        produce.append(making.net.place(area.element, area, Role.CONTROL, ":open"))
        produce += armed_handlers(making, container, area)
    return Effect(produce=tuple(produce))


def quiet(area: Area) -> Effect:
    """Only when no token is left in it."""
    return Effect(quiet_scopes=frozenset({area.index}))


def handler_host(making: Making, area: Area, container: e.SubProcess) -> Host:
    """The event subprocess of an area, as an activity in it; made when it is first asked for."""
    place = making.net.place(container, area, Role.ACTIVE)
    for child in area.children:
        if child.element is container and isinstance(child.host, Host):
            return child.host
    inside = making.net.area(container, area)
    host = Host(container, area, inside, place, lambda: [Effect()])
    inside.host = host
    return host


def begin_event_subprocess(
    making: Making, area: Area, container: e.SubProcess, starts: Sequence[e.StartEvent]
) -> Effect:
    """An event subprocess of an area begins with a token on some of its starts."""
    host = handler_host(making, area, container)
    inside = begin(making, container, host.inside)
    entries = {at(making.net, entry, host.inside) for entry in container.entries}
    begun = Effect(
        steps=tuple(Step(start.id, Action.TRIGGERED) for start in starts),
        produce=(
            *(at(making.net, start, host.inside) for start in starts),
            *(place for place in inside.produce if place not in entries),
        ),
    ).then(host.begin())
    assert begun is not None
    return begun


def armed_handlers(making: Making, container: e.Container, area: Area) -> list[int]:
    """Places that get a token when an area begins, for its event subprocesses."""
    armed: list[int] = []
    for each in container.event_subprocesses:
        for start in each.starts:
            if all_must_come(start):
                armed += gathering(making, start, area).awaited
                continue
            if start.interrupting:
                continue
            for number, definition in enumerate(start.definitions):
                once = (
                    isinstance(definition, TimerEventDefinition)
                    and definition.kind is not TimerKind.CYCLE
                )
                if once or isinstance(definition, ConditionalEventDefinition):
                    armed.append(making.net.place(start, area, Role.CONTROL, f":armed{number}"))
    return armed
