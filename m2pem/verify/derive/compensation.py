"""Compensation: what undoes activities that have completed, when that is thrown.

What was done in the throwing event's own scope is undone before the event goes on; what was done
in subprocesses of it may be undone, or not. Nothing is undone twice, and one at a time, but in any
order: the engine's order is among them.
"""

from collections.abc import Callable

from m2pem.model import elements as e
from m2pem.model.events import CancelEventDefinition, CompensateEventDefinition
from m2pem.verify.derive.effect import Effect, product
from m2pem.verify.derive.making import Host, Making
from m2pem.verify.derive.net import Area, at
from m2pem.verify.system import Action, Exactness, Role, Step


def home(making: Making, area: Area) -> Area:
    """Where what was done in an area is noted: outside of all that may be over by then."""
    while area.parent is not None and area.parent is not making.everything:
        area = area.parent
    return area


def done(making: Making, area: Area, node: e.Activity) -> int:
    """The place that says that an activity of an area can be undone."""
    return making.net.place(node, home(making, area), Role.CONTROL, f":done{area.index}")


def undoable(making: Making, host: Host) -> Effect | None:
    """What the completion of an activity notes; None: nothing undoes it."""
    if host.node.compensation is None:
        return None
    place = done(making, host.outer, host.node)
    making.net.approximate(
        host.node, Exactness.MORE, "what is undone, is undone in any order, and once"
    )
    return Effect(kill=frozenset({place}), produce=(place,))


def forget(making: Making, area: Area, container: e.Container) -> Effect:
    """What was done in a scope before it begins again is not done in it."""
    places = [
        done(making, area, node)
        for node in container.nodes
        if isinstance(node, e.Activity) and node.compensation is not None
    ]
    return Effect(kill=frozenset(places))


def undone(making: Making, host: Host) -> Effect:
    """A compensation activity is done."""
    place = making.net.place(host.node, host.outer, Role.TRIGGERED, ":undone")
    return Effect(produce=(place,))


def compensate(
    making: Making,
    node: e.FlowNode,
    area: Area,
    definition: CompensateEventDefinition,
    begun: list[Effect],
    ways: list[Effect],
) -> tuple[list[Effect], list[Effect]]:
    """(effects that end with the throw waiting, effects that go on at once)."""
    scope = area
    if isinstance(area.element, e.SubProcess) and area.element.triggered_by_event:
        assert isinstance(area.host, Host)
        scope = area.host.outer
    name = definition.activity
    if name and node.qualifier:
        name = f"{node.qualifier}:{name}"
    role = Role.ACTIVE if definition.wait else Role.TRIGGERED
    waiting = making.net.place(node, area, role, ":undoes")
    _undo(making, node, scope, area, waiting, name, ways if definition.wait else [Effect()])
    thrown = Effect(steps=(Step(node.id, Action.THROWN, "compensation"),), produce=(waiting,))
    both = product(begun, [thrown])
    return (both, []) if definition.wait else ([], both)


def cancel(making: Making, node: e.EndEvent, area: Area) -> list[Effect]:
    """A transaction is cancelled: all in it ends, what was done is undone, and it is left."""
    host = area.host
    assert isinstance(host, Host)
    waiting = making.net.place(node, area, Role.TRIGGERED, ":undoes")
    left = host.leave()
    for boundary in host.node.boundary:
        if any(isinstance(d, CancelEventDefinition) for d in boundary.definitions):
            out = Effect(
                steps=(Step(boundary.id, Action.TRIGGERED),),
                produce=(at(making.net, boundary, host.outer),),
            )
            both = left.then(out)
            assert both is not None
            left = both
            break
    _undo(making, node, area, area, waiting, "", [left])
    return [Effect(kill_scopes=frozenset({area.index}), produce=(waiting,))]


def _undo(
    making: Making,
    thrower: e.FlowNode,
    scope: Area,
    area: Area,
    waiting: int,
    name: str,
    ways: list[Effect],
) -> None:
    """Undo one after the other while a token is on `waiting`, then go on by `ways`."""
    net = making.net

    def spell_out() -> None:
        direct, nested = _candidates(making, scope, name)
        busy = {
            (where.index, node): net.place(
                node, area, Role.CONTROL, f":for{thrower.id}{where.index}"
            )
            for where, node in (*direct, *nested)
        }
        for where, node in (*direct, *nested):
            assert node.compensation is not None
            handler = node.compensation
            mine = busy[where.index, node]
            net.rule(
                Effect(
                    steps=(Step(node.id, Action.TRIGGERED, "is undone"),),
                    read=frozenset({waiting}),
                    inhibit=frozenset(busy.values()),
                    consume=(done(making, where, node),),
                    produce=(mine, at(net, handler, where)),
                )
            )
            over = net.place(handler, where, Role.TRIGGERED, ":undone")
            net.rule(Effect(steps=(Step(handler.id, Action.COMPLETED),), consume=(over, mine)))
        left = Effect(
            steps=(Step(thrower.id, Action.COMPLETED, "all is undone"),),
            consume=(waiting,),
            inhibit=frozenset(
                {*busy.values(), *(done(making, where, node) for where, node in direct)}
            ),
        )
        making.rules(product([left], ways))

    making.at_last.append(spell_out)


def _candidates(
    making: Making, scope: Area, name: str
) -> tuple[list[tuple[Area, e.Activity]], list[tuple[Area, e.Activity]]]:
    """Activities that can be undone: of the scope itself, and of what is in it."""
    direct: list[tuple[Area, e.Activity]] = []
    nested: list[tuple[Area, e.Activity]] = []
    waiting = [scope]
    if name and not any(n.id == name for n in _nodes(scope)):
        while waiting[0].parent is not None and waiting[0].parent is not making.everything:
            waiting = [waiting[0].parent]
    while waiting:
        area = waiting.pop()
        waiting += area.children
        for node in _nodes(area):
            if not isinstance(node, e.Activity) or node.compensation is None:
                continue
            if not name or node.id == name or name in area.path:
                (direct if area is scope else nested).append((area, node))
    return direct, nested


def _nodes(area: Area) -> tuple[e.FlowNode, ...]:
    element = area.element
    if isinstance(element, e.CallActivity):
        return element.called.nodes if area.frame == area.path else ()
    if isinstance(element, e.Process | e.SubProcess):
        return element.nodes
    return ()


Spelling = Callable[[], None]
