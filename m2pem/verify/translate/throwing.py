"""Errors, escalations, signals and messages: who catches them, and what follows."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from m2pem.mission import elements as e
from m2pem.mission.events import (
    ErrorEventDefinition,
    EscalationEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
)
from m2pem.verify.net.petri_net import Action, Exactness, Flag, Kind, Role, Step
from m2pem.verify.translate.compensation import cut_short, forget, way_back
from m2pem.verify.translate.context import Host, Making, Way
from m2pem.verify.translate.net_builder import Area, Effect, at
from m2pem.verify.translate.scopes import begin_event_subprocess, handler_host

Catching = TypeVar("Catching", bound=e.Event)


def catchable(making: Making, area: Area, host: Host | None) -> list[str]:
    """Codes of errors that something around a place names, and one that nothing names."""
    codes: dict[str, None] = {}
    for event in _around(area, host):
        for definition in event.definitions:
            if isinstance(definition, ErrorEventDefinition) and definition.error is not None:
                codes[definition.error.code] = None
    return list(codes)


def _around(area: Area, host: Host | None) -> list[e.Event]:
    found: list[e.Event] = []
    here: Area | None = area
    while here is not None:
        if host is not None and host.boundary:
            found += host.node.boundary
        found += [s for each in handlers(here) for s in each.starts]
        host = here.host if isinstance(here.host, Host) else None
        here = host.outer if host is not None else None
    return found


def handlers(area: Area) -> Sequence[e.SubProcess]:
    """The event subprocesses that can begin in an area."""
    element = area.element
    if area.open is None or not isinstance(element, e.Process | e.SubProcess | e.CallActivity):
        return ()
    container = element.called if isinstance(element, e.CallActivity) else element
    return container.event_subprocesses


def throw_error(
    making: Making,
    area: Area,
    thrower: e.FlowNode,
    host: Host | None,
    code: str,
    uncaught: Flag = Flag.UNCAUGHT,
) -> list[Effect]:
    """What an error leads to. The thrower's own token is taken off already; `host`: the activity
    that it was on, which may catch it itself."""
    thrown = Step(thrower.id, Action.THROWN, code)
    return _go_up(making, area, thrower, host, code, thrown, uncaught, _error_code, first=True)


def throw_escalation(
    making: Making, area: Area, thrower: e.FlowNode, code: str
) -> list[tuple[Effect, bool]]:
    """What an escalation leads to, and whether its scope goes on."""
    thrown = Step(thrower.id, Action.THROWN, code)
    found: list[tuple[Effect, bool]] = []
    condition = Effect(steps=(thrown,))
    here: Area | None = area
    host: Host | None = None
    node: e.FlowNode = thrower
    while here is not None:
        if host is not None and host.boundary:
            event = best(host.node.boundary, code, _escalation_code)
            if event is not None:
                there, without = _there(making, condition, host)
                found.append(_at_boundary(making, there, host, event, taken_off=False))
                if without is None:
                    return found
                condition = without
        if here.open is not None:
            start = best(_starts(here, node), code, _escalation_code)
            if start is not None:
                begun = condition.then(Effect(read=frozenset({here.open})))
                assert begun is not None
                for effect in begin_handler(making, here, start):
                    both = begun.then(effect)
                    if both is not None:
                        found.append((both, not start.interrupting))
                without = condition.then(Effect(inhibit=frozenset({here.open})))
                assert without is not None
                condition = without
        host = here.host if isinstance(here.host, Host) else None
        if host is None:
            break
        node, here = host.node, host.outer
    ignored = condition.then(Effect(flag=Flag.UNHEARD, flagged=code))
    assert ignored is not None
    found.append((ignored, True))
    return found


def _there(
    making: Making, condition: Effect, host: Host, *, taken_off: bool = False
) -> tuple[Effect, Effect | None]:
    """When an activity's boundary events can catch what is thrown in it, and when not, if ever.

    They cannot while it is undone: it has completed (as in the engine).
    """
    if taken_off or way_back(making, host.node) is not Way.INSIDE:
        return condition, None
    there = condition.then(Effect(read=frozenset({host.active})))
    assert there is not None
    return there, condition.then(Effect(inhibit=frozenset({host.active})))


def _at_boundary(
    making: Making, condition: Effect, host: Host, event: e.BoundaryEvent, *, taken_off: bool
) -> tuple[Effect, bool]:
    caught = Effect(
        steps=(Step(event.id, Action.TRIGGERED),), produce=(at(making.net, event, host.outer),)
    )
    if event.interrupting:
        inside = frozenset({host.inside.index})
        left = Effect(kill_scopes=inside) if taken_off else host.leave()
        stopped = left.saying(host.node.id, Action.INTERRUPTED)
        both = condition.then(stopped)
        assert both is not None
        condition = both
    done = condition.then(caught)
    assert done is not None
    return done, not event.interrupting


def _go_up(
    making: Making,
    area: Area,
    thrower: e.FlowNode,
    host: Host | None,
    code: str,
    thrown: Step,
    uncaught: Flag,
    code_of: "object",
    *,
    first: bool,
) -> list[Effect]:
    found: list[Effect] = []
    condition = Effect(steps=(thrown,))
    here: Area | None = area
    node = thrower
    taken_off = True
    while here is not None:
        if host is not None and host.boundary:
            event = best(host.node.boundary, code, _error_code)
            if event is not None:
                there, without = _there(making, condition, host, taken_off=taken_off)
                found.append(_at_boundary(making, there, host, event, taken_off=taken_off)[0])
                if without is None:
                    return found
                condition = without
        if here.open is not None:
            start = best(_starts(here, node), code, _error_code)
            if start is not None:
                begun = condition.then(Effect(read=frozenset({here.open})))
                assert begun is not None
                found += [
                    both
                    for effect in begin_handler(making, here, start)
                    if (both := begun.then(effect)) is not None
                ]
                without = condition.then(Effect(inhibit=frozenset({here.open})))
                assert without is not None
                condition = without
        host = here.host if isinstance(here.host, Host) else None
        if host is None:
            break
        node, here, taken_off = host.node, host.outer, False
    failed = condition.then(making.end_run(making.failed))
    assert failed is not None
    flagged = failed.then(Effect(flag=uncaught, flagged=code))
    assert flagged is not None
    found.append(flagged)
    return found


def begin_handler(making: Making, area: Area, start: e.StartEvent) -> list[Effect]:
    """An event subprocess begins in an area; an interrupting one ends all else there first."""
    container = start.container
    assert isinstance(container, e.SubProcess)
    begun = begin_event_subprocess(making, area, container, (start,))
    anew = forget(making, handler_host(making, area, container).inside, container).then(begun)
    assert anew is not None
    begun = anew
    if start.interrupting:
        stop = Effect(kill_scopes=frozenset({area.index}), produce=cut_short(making, area))
        both = stop.then(begun)
        assert both is not None
        return [both]
    return [begun]


def _starts(area: Area, but: e.FlowNode) -> list[e.StartEvent]:
    return [start for each in handlers(area) if each is not but for start in each.starts]


def _error_code(definition: EventDefinition) -> str | None:
    """The code that it catches, "" for every one; None: it catches no error."""
    if not isinstance(definition, ErrorEventDefinition):
        return None
    return definition.error.code if definition.error is not None else ""


def _escalation_code(definition: EventDefinition) -> str | None:
    if not isinstance(definition, EscalationEventDefinition):
        return None
    return definition.escalation.code if definition.escalation is not None else ""


def best(events: Sequence[Catching], code: str, code_of: "object") -> Catching | None:
    """The event that names a code, else one that takes all."""
    assert callable(code_of)
    for_all = None
    for event in events:
        for definition in event.definitions:
            caught = code_of(definition)
            if caught == "":
                for_all = for_all or event
            elif caught == code:
                return event
    return for_all


# --- signals and messages -----------------------------------------------------------------------


def throw_signal(making: Making, signal: str) -> Effect:
    """Every catcher that waits has it. Complete only when all catchers are known."""
    moves = [(c.waiting, c.told) for c in making.signals.get(signal, ()) if not c.keeps]
    copies = [(c.waiting, c.told) for c in making.signals.get(signal, ()) if c.keeps]
    return Effect(moves=tuple(moves), copies=tuple(copies))


def signal_effects(making: Making, signal: str) -> list[Effect]:
    """The same, with the processes that it begins."""
    found = [throw_signal(making, signal)]
    for begun in making.begins.get(("signal", signal), ()):
        found = [both for one in found for way in begun if (both := one.then(way)) is not None]
    return found


def message_effects(making: Making, message: str, *, kept: bool = True) -> list[Effect]:
    """One of those that wait for a message gets it, else a process begins, else it is kept."""
    catchers = making.messages.get(message, [])
    found: list[Effect] = []
    for catcher in catchers:
        if catcher.keeps:
            found.append(Effect(read=frozenset({catcher.waiting}), produce=(catcher.told,)))
        else:
            found.append(Effect(consume=(catcher.waiting,), produce=(catcher.told,)))
    nobody = Effect(inhibit=frozenset(c.waiting for c in catchers))
    begins = making.begins.get(("message", message), ())
    if begins:
        return found + [both for way in begins[0] if (both := nobody.then(way)) is not None]
    if not catchers:
        return [Effect()]
    if kept:
        nobody = nobody.then(Effect(produce=(_letters(making, message),))) or nobody
    return [*found, nobody]


def interrupting_places(making: Making, what: str, ref: str, area: Area) -> frozenset[int]:
    """The places on which an activity or event subprocess around an element of `area` waits, with
    an interrupting event, for a signal or message that the element throws.

    It goes out before its thrower completes: one that is interrupted by it never does.
    """
    around: set[int] = set()
    here: Area | None = area
    while here is not None:
        if here.open is not None:
            around.add(here.open)
        host = here.host if isinstance(here.host, Host) else None
        if host is not None:
            around.add(host.active)
        here = host.outer if host is not None else None
    register = making.signals if what == "signal" else making.messages
    return frozenset(
        each.waiting for each in register.get(ref, ()) if each.waiting in around and not each.keeps
    )


def parted(ways: Iterable[Effect], places: frozenset[int]) -> tuple[list[Effect], list[Effect]]:
    """The effects that take a token from one of some places, and the others."""
    all_of = list(ways)
    taking = [each for each in all_of if not places.isdisjoint(each.consume)]
    return taking, [each for each in all_of if places.isdisjoint(each.consume)]


def _letters(making: Making, message: str) -> int:
    """Where copies of a message are kept until somebody waits: nothing limits how many come."""
    making.net.approximate(
        making.process, Exactness.BOUNDED, f"up to three copies of message {message} are kept"
    )
    place = making.net.place(
        making.process, making.everything, Role.CONTROL, f":{message}", several=True
    )
    making.net.places[place] = replace(making.net.places[place], once=True)
    return place


def deliver_kept(making: Making, message: str) -> None:
    """Who waits for a message gets one that was kept."""
    letter = _letters(making, message)
    for catcher in making.messages.get(message, ()):
        taken = Effect(
            steps=(Step(catcher.element, Action.TRIGGERED, message),),
            consume=(letter,) if catcher.keeps else (letter, catcher.waiting),
            read=frozenset({catcher.waiting}) if catcher.keeps else frozenset(),
            produce=(catcher.told,),
        )
        making.net.rule(taken, Kind.INTERNAL)


def thrown_by(node: e.FlowNode) -> tuple[set[str], set[str]]:
    """Ids of the signals and messages that an element throws."""
    signals: set[str] = set()
    messages: set[str] = set()
    if isinstance(node, e.SendTask) and node.message is not None:
        messages.add(node.message.id)
    if isinstance(node, e.EndEvent | e.IntermediateThrowEvent):
        for definition in node.definitions:
            if isinstance(definition, SignalEventDefinition):
                signals.add(definition.signal.id)
            elif isinstance(definition, MessageEventDefinition):
                messages.add(definition.message.id)
    return signals, messages
