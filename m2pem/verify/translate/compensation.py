"""Compensation: what undoes activities that have completed, when that is thrown.

A throw claims what was done in its scope, so that nothing else undoes it too, and undoes it, one
after the other, in any order: the engine's order, the latest first, is among them. What is undone
by what is in it has its inside again, without itself: its boundary events and other event
subprocesses catch nothing then.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from m2pem.engine.scopes import compensator
from m2pem.mission import elements as e
from m2pem.mission.events import CancelEventDefinition, CompensateEventDefinition
from m2pem.verify.system import UNDOES, UNDONE, Action, Role, Step
from m2pem.verify.translate.areas import begin_event_subprocess, handler_host, quiet
from m2pem.verify.translate.effect import Effect, product
from m2pem.verify.translate.making import Host, Making
from m2pem.verify.translate.net import Area, at
from m2pem.verify.translate.undoable import (
    Way,
    container_in,
    container_of,
    done,
    forget,
    is_loop,
    way_back,
)


@dataclass(frozen=True, slots=True)
class _Point:
    """An activity, or an instance of one, that can be undone while there is a token on `done`."""

    host: Host
    done: int


@dataclass(frozen=True, slots=True)
class Undoing:
    """What undoes the points of an area: how it begins, and when it is over."""

    thrown: Effect
    over: Effect


# --- throwing -----------------------------------------------------------------------------------


def compensate(
    making: Making,
    node: e.FlowNode,
    area: Area,
    definition: CompensateEventDefinition,
    begun: list[Effect],
    ways: list[Effect],
) -> tuple[list[Effect], list[Effect]]:
    """(effects that end with the throw waiting, effects that go on at once)."""
    name = definition.activity
    if name and node.qualifier:
        name = f"{node.qualifier}:{name}"
    named = making.mission.elements.get(name) if name else None
    target = _target(making, area, named)
    found = _points(making, target)
    if named is not None and named is not container_of(target):
        found = [point for point in found if point.host.node is named]
    undoing = _undo(making, node, f"{area.index}{name or ''}", target, found)
    thrown = undoing.thrown.saying(node.id, Action.THROWN, "compensation")
    over = undoing.over.saying(node.id, Action.TRIGGERED, UNDONE)
    if not definition.wait:
        making.net.rule(over)
        return [], product(begun, [thrown])
    waiting = making.net.place(node, area, Role.ACTIVE, ":undoes")
    last = Step(node.id, Action.COMPLETED, "all is undone")
    goes_on = replace(undoing.over, steps=(last,), consume=(*undoing.over.consume, waiting))
    making.rules(product([goes_on], ways))
    if target is not area:  # the event subprocess that threw may be over before
        making.rules(product([over], [Effect(inhibit=frozenset({waiting}))]))
    return product(begun, product([thrown], [Effect(produce=(waiting,))])), []


def _target(making: Making, area: Area, named: e.Element | None) -> Area:
    """The scope in which something is to be undone, as in the engine."""
    here = area
    if named is None:
        if isinstance(area.element, e.SubProcess) and area.element.triggered_by_event:
            assert isinstance(area.host, Host)
            here = area.host.outer
        return here
    homes: tuple[e.Element, ...] = (named,)
    if isinstance(named, e.Activity):
        homes = (named, named.container)
    while container_of(here) not in homes:
        if not isinstance(here.host, Host):
            return area
        here = here.host.outer
    return here


def cancel(making: Making, node: e.EndEvent, area: Area) -> list[Effect]:
    """A transaction is cancelled: all in it ends, what was done is undone, and it is left."""
    host = area.host
    assert isinstance(host, Host)
    while not host.boundary:  # an instance: the whole is left
        assert isinstance(host.outer.host, Host)
        host = host.outer.host
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
    undoing = _undo(making, node, "", area, _points(making, area))
    over = undoing.over.saying(node.id, Action.COMPLETED, "all is undone")
    making.rules(product([over], [left]))
    ended = making.net.place(node, area, Role.TRIGGERED, ":cancelled")
    begins = Effect(steps=(Step(node.id, Action.TRIGGERED, UNDOES),), consume=(ended,))
    making.rules(product([begins], [undoing.thrown]))
    return [Effect(kill_scopes=frozenset({area.index}), produce=(ended,))]


# --- undoing ------------------------------------------------------------------------------------


def _points(making: Making, area: Area) -> list[_Point]:
    """What can be undone in an area, if it was done."""
    if is_loop(area):
        assert isinstance(area.host, Host)
        node = area.host.node
        if way_back(making, node) is not Way.INSIDE:
            return []
        instances = [each for each in _hosts(area) if not each.boundary]
        return [_Point(each, done(making, area, node, n)) for n, each in enumerate(instances)]
    around = container_of(area)
    nodes = around.nodes if around is not None else ()
    hosts = {host.node: host for host in _hosts(area)}
    return [
        _Point(hosts[node], done(making, area, node))
        for node in nodes
        if isinstance(node, e.Activity) and node in hosts and way_back(making, node)
    ]


def _hosts(area: Area) -> list[Host]:
    return [
        child.host
        for child in area.children
        if isinstance(child.host, Host) and child.host.inside is child
    ]


def _undo(
    making: Making, thrower: e.FlowNode, mark: str, area: Area, points: Sequence[_Point]
) -> Undoing:
    """Undo some points of an area, one after the other, while a token says that it is done.

    It is the area's: when that ends, or is interrupted, it undoes nothing more.
    """
    net = making.net
    undoing = net.place(thrower, area, Role.TRIGGERED, f":undoes{mark}")
    what = f"{thrower.id}:{mark}"
    claimed: list[tuple[int, int]] = []
    busy: list[int] = []
    for number, point in enumerate(points):
        node = point.host.node
        claimed.append((point.done, net.place(node, area, Role.CONTROL, f":for{what}.{number}")))
        busy.append(net.place(node, area, Role.CONTROL, f":by{what}.{number}"))
    for point, (_, claim), mine in zip(points, claimed, busy, strict=True):
        node = point.host.node
        begins = Effect(
            steps=(Step(node.id, Action.TRIGGERED, UNDOES),),
            read=frozenset({undoing}),
            inhibit=frozenset(busy),
            consume=(claim,),
            produce=(mine,),
        )
        starts, over = _undone(making, area, point)
        making.rules(product([begins], starts))
        is_over = Effect(steps=(Step(node.id, Action.TRIGGERED, UNDONE),), consume=(mine,))
        making.rules(product([is_over], [over]))
    making.claims.setdefault(area.index, []).extend((claim, noted) for noted, claim in claimed)
    return Undoing(
        Effect(kill=frozenset({undoing}), produce=(undoing,), moves=tuple(claimed)),
        Effect(consume=(undoing,), inhibit=frozenset({*busy, *(claim for _, claim in claimed)})),
    )


def _undone(making: Making, area: Area, point: _Point) -> tuple[list[Effect], Effect]:
    """What undoes one of them: how it begins, and when it is over."""
    host = point.host
    handler = host.node.compensation
    if handler is not None:
        (undoes,) = [each for each in _hosts(area) if each.node is handler]
        tokens = [
            place
            for place in area.places
            if making.net.places[place].element == handler.id
            and making.net.places[place].role is not Role.CONTROL
        ]
        over = quiet(undoes.inside).then(Effect(inhibit=frozenset(tokens)))
        assert over is not None
        return [Effect(produce=(at(making.net, handler, area),))], over
    inner = _inside(host)
    if inner is None:  # a process that calls itself: the inner call is not seen
        return [Effect()], Effect()
    container = container_of(inner)
    by_itself = compensator(container) if container is not None else None
    if by_itself is not None:
        begun = begin_event_subprocess(making, inner, by_itself, by_itself.starts)
        forgotten = forget(making, handler_host(making, inner, by_itself).inside, by_itself)
        return product([forgotten], [begun]), quiet(host.inside)
    return [_undo_all(making, host.node, inner).thrown], quiet(host.inside)


def _undo_all(making: Making, node: e.Activity, inner: Area) -> Undoing:
    """Undo an activity by undoing all that was done in it."""
    known = making.undoing.get(inner.index)
    if known is None:
        known = _undo(making, node, "all", inner, _points(making, inner))
        making.undoing[inner.index] = known
        making.net.rule(known.over.saying(node.id, Action.TRIGGERED, UNDONE))
    return known


def _inside(host: Host) -> Area | None:
    """Where what was done in an activity was done."""
    if is_loop(host.inside) or container_in(host.node) is host.node:
        return host.inside
    return next((a for a in host.inside.children if container_of(a) is not None), None)


# --- the end ------------------------------------------------------------------------------------


def give_back(making: Making) -> None:
    """What was claimed in a scope and not begun can be undone again when the scope is interrupted
    or its transaction is cancelled."""
    for index, claims in making.claims.items():
        container = container_of(making.net.areas[index])
        if container is None:
            continue
        ends = {start.id for each in container.event_subprocesses for start in each.starts}
        ends |= {node.id for node in container.nodes if isinstance(node, e.EndEvent)}
        for draft in making.net.drafts:
            effect = draft.effect
            if index in effect.kill_scopes and any(step.element in ends for step in effect.steps):
                draft.effect = replace(effect, moves=(*claims, *effect.moves))
