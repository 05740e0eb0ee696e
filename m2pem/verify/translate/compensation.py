"""Compensation: which activities can be compensated, and how a compensation throw event does it.

As in the engine, an activity that completes well leaves a note in its scope: a token. What
compensates it is its compensation activity; without one, its inside: the compensation event
subprocess, else what compensates the activities that completed in it. An activity that was
terminated, or interrupted by an event subprocess of its own, has not completed.

A throw event claims the notes of its scope, so that nothing else compensates those activities too.
Then it compensates them one after the other, in any order: the engine's order, the latest first, is
among them. An activity that is compensated by its inside has that inside again, without itself: its
boundary events and other event subprocesses catch nothing then.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from m2pem.engine.scopes import compensation_handler, is_compensation_handler
from m2pem.mission import elements as e
from m2pem.mission.events import CancelEventDefinition, CompensateEventDefinition
from m2pem.mission.loops import MultiInstance
from m2pem.mission.reach import following
from m2pem.verify.net.petri_net import UNDOES, UNDONE, Action, Exactness, Role, Step
from m2pem.verify.translate.context import Host, Making, Undoing, Way
from m2pem.verify.translate.net_builder import Area, Effect, at, product
from m2pem.verify.translate.scopes import begin_event_subprocess, handler_host, quiet


def way_back(making: Making, node: e.Activity) -> Way | None:
    """By what an activity can be undone; None: by nothing."""
    if node not in making.ways:
        making.ways[node] = None  # while it is looked at: a process may call itself
        making.ways[node] = _way_back(making, node)
    return making.ways[node]


def _way_back(making: Making, node: e.Activity) -> Way | None:
    if node.for_compensation or is_compensation_handler(node):
        return None
    if node.compensation is not None:
        return Way.ACTIVITY
    inside = container_in(node)
    if inside is None:
        return None
    activities = [each for each in inside.nodes if isinstance(each, e.Activity)]
    if compensation_handler(inside) is not None or any(
        way_back(making, each) for each in activities
    ):
        return Way.INSIDE
    return None


def container_in(node: e.FlowNode) -> e.Container | None:
    """What an activity holds: itself, or the process that it calls."""
    if isinstance(node, e.CallActivity):
        return node.called
    return node if isinstance(node, e.SubProcess) else None


# --- notes --------------------------------------------------------------------------------------


def kept(making: Making, area: Area) -> Area:
    """Where it is noted what was done in an area: outside of all that may be over by then."""
    home = area
    while home.parent is not None and home.parent is not making.everything:
        home = home.parent
    if home.index not in making.kept:
        made = making.net.area(home.element, making.everything, step=f"{home.path[-1]}~done")
        making.kept[home.index] = made
    return making.kept[home.index]


def done(making: Making, area: Area, node: e.Activity, number: int | None = None) -> int:
    """The place that says that an activity of an area (or an instance of it) can be undone."""
    which = "" if number is None else f"[{number}]"
    return making.net.place(node, kept(making, area), Role.CONTROL, f":done{area.index}{which}")


def noted(making: Making, host: Host) -> Effect:
    """What the completion of an activity notes."""
    if way_back(making, host.node) is None:
        return Effect()
    _tell(making, host.outer, host.node, again=_comes_again(making, host.outer, host.node))
    return _note(done(making, host.outer, host.node))


def noted_instance(making: Making, host: Host, number: int) -> Effect:
    """What the completion of an instance notes: a compensation activity undoes the whole alone."""
    if way_back(making, host.node) is not Way.INSIDE:
        return Effect()
    loop = host.node.loop
    in_turn = not isinstance(loop, MultiInstance) or loop.sequential
    _tell(making, host.outer, host.node, again=in_turn)
    return _note(done(making, host.outer, host.node, number))


def _note(place: int) -> Effect:
    return Effect(kill=frozenset({place}), produce=(place,))


def _tell(making: Making, area: Area, node: e.Activity, *, again: bool) -> None:
    around = container_of(area)
    others = [
        each
        for each in (around.nodes if around is not None else ())
        if isinstance(each, e.Activity) and each is not node and way_back(making, each)
    ]
    if others or is_loop(area):
        making.net.approximate(
            node, Exactness.MORE, "it and what else was done is undone in any order"
        )
    if again:
        making.net.approximate(node, Exactness.BOUNDED, "done several times, it is undone once")


def _comes_again(making: Making, area: Area, node: e.Activity) -> bool:
    """Whether it can complete more than once in an instance of its scope."""
    if area.several or node in making.repeated or isinstance(node.container, e.AdHocSubProcess):
        return True
    if isinstance(node, e.SubProcess) and node.triggered_by_event:
        return any(not start.interrupting for start in node.starts)
    waiting, seen = following(node), set[e.FlowNode]()
    while waiting:
        each = waiting.pop()
        if each is node:
            return True
        if each not in seen:
            seen.add(each)
            waiting += following(each)
    return False


def forget(making: Making, area: Area, container: e.Container) -> Effect:
    """What was done in a scope before it begins again is not done in it."""
    return Effect(
        kill=frozenset(
            done(making, area, node)
            for node in container.nodes
            if isinstance(node, e.Activity) and way_back(making, node)
        )
    )


def forget_instances(making: Making, whole: Host, count: int) -> Effect:
    """The same, of the instances of an activity."""
    if way_back(making, whole.node) is not Way.INSIDE:
        return Effect()
    places = [done(making, whole.inside, whole.node, number) for number in range(count)]
    return Effect(kill=frozenset(places))


# --- what has not completed ---------------------------------------------------------------------


def cut_short(making: Making, area: Area) -> tuple[int, ...]:
    """The place that says that an event subprocess has interrupted an area, if that matters."""
    host = area.host
    if not isinstance(host, Host) or host.cut is None or way_back(making, host.node) is None:
        return ()
    return (making.net.place(area.element, area, Role.CONTROL, ":cut"),)


def ended(making: Making, host: Host, area: Area, over: list[Effect]) -> list[Effect]:
    """How an activity goes on when its inside `area` is over: cut short, it cannot be undone."""
    container = container_of(area)
    interrupts = container is not None and any(
        start.interrupting
        for each in container.event_subprocesses
        if not is_compensation_handler(each)
        for start in each.starts
    )
    cut = cut_short(making, area) if interrupts else ()
    if not cut or host.cut is None:
        return product(over, host.done())
    well = product(over, [Effect(inhibit=frozenset(cut))])
    early = product(over, [Effect(read=frozenset(cut))])
    return [*product(well, host.done()), *product(early, host.cut())]


# --- areas --------------------------------------------------------------------------------------


def is_loop(area: Area) -> bool:
    """Whether it is where the instances of an activity are, and not the inside of one."""
    host = area.host
    return (
        isinstance(host, Host)
        and host.inside is area
        and host.boundary
        and host.node.loop is not None
    )


def container_of(area: Area) -> e.Container | None:
    """What an area is an instance of."""
    element = area.element
    if isinstance(element, e.CallActivity):
        return element.called if area.frame == area.path else None
    if isinstance(element, e.Process | e.SubProcess) and not is_loop(area):
        return element
    return None


@dataclass(frozen=True, slots=True)
class _Point:
    """An activity, or an instance of one, that can be undone while there is a token on `done`."""

    host: Host
    done: int


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
    by_itself = compensation_handler(container) if container is not None else None
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
