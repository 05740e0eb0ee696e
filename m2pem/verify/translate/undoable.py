"""Which activities can be undone when they have completed, and how the rules note that one has.

As in the engine: an activity that completes well leaves a note in its scope. What undoes it is its
compensation activity; without one, what is in it: its compensation event subprocess, else what
undoes the activities that completed in it. What was terminated, or interrupted by an event
subprocess of its own, has not completed.
"""

from enum import StrEnum

from m2pem.engine.scopes import compensates_around, compensator
from m2pem.mission import elements as e
from m2pem.mission.loops import MultiInstance
from m2pem.mission.reach import following
from m2pem.verify.system import Exactness, Role
from m2pem.verify.translate.effect import Effect, product
from m2pem.verify.translate.making import Host, Making
from m2pem.verify.translate.net import Area


class Way(StrEnum):
    """By what an activity is undone."""

    ACTIVITY = "its compensation activity"
    INSIDE = "what is in it"


def way_back(making: Making, node: e.Activity) -> Way | None:
    """By what an activity can be undone; None: by nothing."""
    if node not in making.ways:
        making.ways[node] = None  # while it is looked at: a process may call itself
        making.ways[node] = _way_back(making, node)
    return making.ways[node]


def _way_back(making: Making, node: e.Activity) -> Way | None:
    if node.for_compensation or compensates_around(node):
        return None
    if node.compensation is not None:
        return Way.ACTIVITY
    inside = container_in(node)
    if inside is None:
        return None
    activities = [each for each in inside.nodes if isinstance(each, e.Activity)]
    if compensator(inside) is not None or any(way_back(making, each) for each in activities):
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
        if not compensates_around(each)
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
