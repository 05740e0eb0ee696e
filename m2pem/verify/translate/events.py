"""Events that are entered: starts, ends, catches, throws, and the event-based gateway."""

from dataclasses import replace

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
from m2pem.verify.translate.context import Host, Making, catching, first, what_and_ref
from m2pem.verify.translate.net_builder import Area, Draft, Effect, at, product
from m2pem.verify.translate.parallel_multiple import Gathering, all_must_come, gather
from m2pem.verify.translate.sequence_flows import along, leave
from m2pem.verify.translate.throwing import (
    interrupting_places,
    message_effects,
    parted,
    signal_effects,
    throw_error,
    throw_escalation,
)
from m2pem.verify.translate.timers import fixed, runs, timer_us


def _leave(making: Making, node: e.FlowNode, area: Area) -> list[Effect]:
    return leave(making, area, node, None, lambda code: throw_error(making, area, node, None, code))


def _come(making: Making, node: e.FlowNode, area: Area, action: Action) -> Effect:
    return Effect(steps=(Step(node.id, action),), consume=(at(making.net, node, area),))


# --- catching -----------------------------------------------------------------------------------


def start(making: Making, node: e.FlowNode, area: Area) -> None:
    """A plain start goes on at once; so does one whose trigger has made its instance."""
    assert isinstance(node, e.StartEvent)
    container = node.container
    begun = isinstance(container, e.SubProcess) and container.triggered_by_event
    begun = begun or (area.parent is making.everything and container is not making.process)
    if node.definitions and not begun:
        _wait(making, node, area)
    elif area.parent is making.everything and all_must_come(node):
        waiting = making.net.place(node, area, Role.ACTIVE)  # for the others of its triggers
        _all_have_come(making, node, area, waiting, gather(making, node, area, area))
    else:
        come = _come(making, node, area, Action.COMPLETED)
        making.rules(product([come], _leave(making, node, area)))


def catch(making: Making, node: e.FlowNode, area: Area) -> None:
    """Waits for its trigger; the target of a link has none."""
    assert isinstance(node, e.IntermediateCatchEvent)
    if not node.definitions or node.linked_from:
        come = _come(making, node, area, Action.COMPLETED)
        making.rules(product([come], _leave(making, node, area)))
        return
    _wait(making, node, area)


def _wait(making: Making, node: e.Event, area: Area) -> None:
    net = making.net
    waiting = net.place(node, area, Role.ACTIVE, several=node in making.repeated)
    if all_must_come(node):
        gathering = gather(making, node, area, area)
        _enter(making, node, area, (waiting, *gathering.awaited))
        _all_have_come(making, node, area, waiting, gathering)
        return
    _enter(making, node, area, (waiting,))
    for number, definition in enumerate(node.definitions):
        _trigger(making, node, area, definition, waiting, _leave(making, node, area), number)


def _enter(making: Making, node: e.FlowNode, area: Area, places: tuple[int, ...]) -> None:
    """A token that comes waits at once."""
    come = _come(making, node, area, Action.ENTERED).then(Effect(produce=places))
    assert come is not None
    making.net.rule(come)
    making.net.at_once.add(at(making.net, node, area))


def _all_have_come(
    making: Making, node: e.Event, area: Area, waiting: int, gathering: Gathering
) -> None:
    done = Effect(steps=(Step(node.id, Action.COMPLETED),), consume=(waiting, *gathering.came))
    ways = making.data.receive([done], area, node)
    making.rules(product(ways, _leave(making, node, area)))


def _trigger(
    making: Making,
    node: e.FlowNode,
    area: Area,
    definition: EventDefinition,
    waiting: int,
    ways: list[Effect],
    number: int,
) -> list[Draft]:
    """The token of `waiting` goes on when the trigger comes. Answers with a timer's rules."""
    net = making.net
    came = Effect(steps=(Step(node.id, Action.TRIGGERED),), consume=(waiting,))
    match definition:
        case TimerEventDefinition():
            return [
                net.rule(effect, Kind.OUTSIDE, Trigger.TIMER, due_us=timer_us(definition))
                for effect in product([came], ways)
            ]
        case SignalEventDefinition() | MessageEventDefinition():
            told = net.place(node, area, Role.TRIGGERED, f":{number}:{waiting}")
            what, ref = what_and_ref(definition)
            catching(making, what, ref, waiting, told, False, node)
            came = Effect(steps=came.steps, consume=(told,))
            making.rules(product(making.data.receive([came], area, node), ways))
        case ConditionalEventDefinition(condition=condition):
            if not making.data.is_followed([condition], node):
                net.approximate(node, Exactness.MORE, "its condition may become true at any time")
                for effect in product([came], ways):
                    net.rule(effect, Kind.OUTSIDE, Trigger.CONDITION)
                return []
            for guard, truth in making.data.cases([condition], area, node, first):
                if truth is True:
                    making.rules(product(product([came], [Effect(guard=guard)]), ways))
        case _:
            making.rules(product([came], ways))
    return []


def _true_or_never(making: Making, node: e.FlowNode, area: Area, ways: list[Effect]) -> None:
    """A condition on what nothing in the mission writes: it is true at once, or never."""
    come = _come(making, node, area, Action.TRIGGERED)
    making.rules(product([come], ways))


def event_based(making: Making, node: e.FlowNode, area: Area) -> None:
    """Waits for the first of the events behind it."""
    assert isinstance(node, e.EventBasedGateway)
    net = making.net
    waiting = net.place(node, area, Role.ACTIVE, several=node in making.repeated)
    _enter(making, node, area, (waiting,))
    number = 0
    for flow in node.outgoing:
        target = flow.target
        taken = Effect(steps=(Step(flow.id, Action.TAKEN),))
        ways = product([taken], after(making, target, area))
        for definition in awaited(target):
            made = _trigger(making, target, area, definition, waiting, ways, number)
            number += 1
            together = isinstance(target, e.Event) and all_must_come(target)
            if together:
                net.approximate(
                    target, Exactness.MORE, "one of its triggers is enough, not all of them"
                )
            if isinstance(definition, TimerEventDefinition) and not (node.parallel or together):
                runs(making, waiting, fixed(definition), (waiting,), made)


def awaited(node: e.FlowNode) -> tuple[EventDefinition, ...]:
    """What triggers a catch event or receive task."""
    if isinstance(node, e.ReceiveTask):
        return (MessageEventDefinition(node.line, node.message),) if node.message else ()
    return node.definitions if isinstance(node, e.Event) else ()


def after(making: Making, node: e.FlowNode, area: Area) -> list[Effect]:
    """What follows a catch event or receive task whose trigger has come already."""
    if isinstance(node, e.Activity):
        done = [Effect(steps=(Step(node.id, Action.COMPLETED),))]
        for mapping in node.data_flow.outputs:
            done = making.data.write(done, mapping.target, None, area, node)
        out = leave(
            making,
            area,
            node,
            node.default,
            lambda code: throw_error(making, area, node, None, code),
            times=node.completion_quantity,
        )
        return product(done, out)
    return _leave(making, node, area)


# --- throwing -----------------------------------------------------------------------------------


def throw(making: Making, node: e.FlowNode, area: Area) -> None:
    """Throws, and goes on."""
    assert isinstance(node, e.IntermediateThrowEvent)
    if node.links_to is not None:
        link = Effect(produce=(at(making.net, node.links_to, area),))
        come = _come(making, node, area, Action.COMPLETED)
        making.rules(product([come], [link]))
        return
    making.later.append(
        lambda: making.rules(
            _throw_all(making, node, area, node.definitions, _leave(making, node, area))
        )
    )


def _throw_all(
    making: Making,
    node: e.Event,
    area: Area,
    definitions: tuple[EventDefinition, ...],
    ways: list[Effect],
) -> list[Effect]:
    """What several definitions throw, one after the other, and then `ways`."""
    begun = [_come(making, node, area, Action.COMPLETED)]
    ended: list[Effect] = []
    for definition in definitions:
        match definition:
            case SignalEventDefinition(signal=signal):
                thrown = Effect(steps=(Step(node.id, Action.THROWN, signal.id),))
                begun = product(product(begun, [thrown]), signal_effects(making, signal.id))
                around = interrupting_places(making, "signal", signal.id, area)
                caught = [Effect(read=frozenset({place})) for place in sorted(around)]
                ended += _interrupted(node, product(begun, caught))
                begun = product(begun, [Effect(inhibit=around)])
            case MessageEventDefinition(message=message):
                thrown = Effect(steps=(Step(node.id, Action.THROWN, message.id),))
                sent = product(product(begun, [thrown]), message_effects(making, message.id))
                around = interrupting_places(making, "message", message.id, area)
                cut, begun = parted(sent, around)
                ended += _interrupted(node, cut)
            case EscalationEventDefinition(escalation=escalation):
                assert escalation is not None
                going: list[Effect] = []
                for effect, goes_on in throw_escalation(making, area, node, escalation.code):
                    (going if goes_on else ended).extend(product(begun, [effect]))
                begun = going
            case CompensateEventDefinition():
                waited, begun = compensate(making, node, area, definition, begun, ways)
                ended += waited
            case _:
                pass
    return [*product(begun, ways), *ended]


def _interrupted(node: e.Event, thrown: list[Effect]) -> list[Effect]:
    """What it throws interrupts what is around it: it does not complete."""
    done, cut = Step(node.id, Action.COMPLETED), Step(node.id, Action.INTERRUPTED)
    return [
        replace(each, steps=tuple(cut if step == done else step for step in each.steps))
        for each in thrown
    ]


def end(making: Making, node: e.FlowNode, area: Area) -> None:
    """The token ends here, perhaps throwing something."""
    assert isinstance(node, e.EndEvent)
    making.later.append(lambda: making.rules(_end(making, node, area)))


def _end(making: Making, node: e.EndEvent, area: Area) -> list[Effect]:
    last: list[Effect] = [making.reached(node, area)]
    thrown = []
    for definition in node.definitions:
        match definition:
            case TerminateEventDefinition():
                last = _terminate(making, area)
            case CancelEventDefinition():
                last = cancel(making, node, area)
            case ErrorEventDefinition(error=error):
                assert error is not None
                last = throw_error(making, area, node, None, error.code, Flag.UNCAUGHT)
            case _:
                thrown.append(definition)
    return _throw_all(making, node, area, tuple(thrown), last)


def _terminate(making: Making, area: Area) -> list[Effect]:
    """The scope ends at once; the process that the run began with, and the run with it."""
    if area is making.root:
        return [making.end_run(making.terminated)]
    stop = Effect(kill_scopes=frozenset({area.index}))
    host = area.host
    if not isinstance(host, Host):
        return [stop]
    left = host.leave().then(stop)
    assert left is not None
    return product([left], host.cut() if host.cut is not None else host.done())


__all__ = ["along", "catch", "end", "event_based", "start", "throw"]
