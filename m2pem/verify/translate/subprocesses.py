"""Processes, subprocesses, event subprocesses and calls: where tokens are together."""

from dataclasses import replace
from itertools import combinations

from m2pem.mission import elements as e
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Place, Role, Step, Trigger
from m2pem.verify.translate.catching import arm_handler
from m2pem.verify.translate.compensation import ended, forget, noted
from m2pem.verify.translate.context import Host, Making
from m2pem.verify.translate.net_builder import Area, Effect, at, product
from m2pem.verify.translate.parallel_multiple import all_must_come, gathering
from m2pem.verify.translate.scopes import begin, handler_host, quiet


def build(making: Making, container: e.Container, area: Area) -> None:
    """Make the rules of all that is in a container."""
    if container.event_subprocesses:
        area.open = making.net.place(area.element, area, Role.CONTROL, ":open")
    for node in container.nodes:
        making.build_node(making, node, area)
    if area.open is not None:
        making.later.append(lambda: _completing(making, container, area))


def ends_with_its_inside(making: Making, host: Host) -> None:
    """An activity is done when nothing is left inside."""
    over = host.leave().then(quiet(host.inside))
    assert over is not None
    over = over.saying(host.node.id, Action.COMPLETED)
    making.rules(ended(making, host, host.inside, [over]))


def event_subprocess(making: Making, container: e.SubProcess, area: Area) -> None:
    """Its inside, and how it begins."""
    host = handler_host(making, area, container)
    host.done = lambda: [noted(making, host)]
    host.cut = lambda: [Effect()]
    host.inside.several = area.several or any(not s.interrupting for s in container.starts)
    if host.inside.several:
        making.net.places[host.active] = _several(making.net.places[host.active])
    build(making, container, host.inside)
    ends_with_its_inside(making, host)
    for start in container.starts:
        arm_handler(making, area, start)


def _several(place: Place) -> Place:
    return replace(place, several=True)


def _completing(making: Making, container: e.Container, area: Area) -> None:
    """When only event subprocesses are left, no other one begins."""
    net = making.net
    assert area.open is not None
    others: set[int] = {n for n in area.places if net.places[n].role is not Role.CONTROL}
    hosts = []
    awaited: set[int] = set()
    for each in container.event_subprocesses:
        for start in each.starts:
            if all_must_come(start):
                awaited.update(gathering(making, start, area).places)
        host = handler_host(making, area, each)
        others.discard(host.active)
        hosts.append(host)
    for host in hosts:
        net.rule(
            Effect(
                steps=(Step(area.element.id, Action.COMPLETED, "its own work"),),
                consume=(area.open,),
                read=frozenset({host.active}),
                inhibit=frozenset(others),
                kill=frozenset(awaited),
            )
        )


# --- activities that hold others ----------------------------------------------------------------


def subprocess(making: Making, host: Host) -> list[Effect]:
    """Open it, and begin what is in it."""
    node = host.node
    assert isinstance(node, e.SubProcess)
    build(making, node, host.inside)
    ends_with_its_inside(making, host)
    both = forget(making, host.inside, node).then(host.begin())
    assert both is not None
    return product([both], [begin(making, node, host.inside)])


def ad_hoc(making: Making, host: Host) -> list[Effect]:
    """Its activities are begun by choice."""
    node, net = host.node, making.net
    assert isinstance(node, e.AdHocSubProcess)
    build(making, node, host.inside)
    inside = host.inside
    over = host.leave().saying(node.id, Action.COMPLETED)
    if node.active_elements is not None or not node.entries:
        net.approximate(node, Exactness.MORE, "any of its activities may be chosen")
        ends_with_its_inside(making, host)
        begun = host.begin().then(begin(making, node, inside))
        assert begun is not None
        begun = replace(begun, kill=forget(making, inside, node).kill)
        bare = replace(
            begun,
            produce=tuple(
                n for n in begun.produce if n not in {at(net, x, inside) for x in node.entries}
            ),
        )
        chosen = [
            Effect(),
            *(
                Effect(produce=tuple(at(net, x, inside) for x in some))
                for some in _some(node.entries)
            ),
        ]
        return product([bare], chosen)
    alone = node.ordering is e.AdHocOrdering.SEQUENTIAL
    if not alone:
        net.approximate(
            node, Exactness.BOUNDED, "an activity is chosen again only when it has ended"
        )
    for entry in node.entries:
        chosen_one = Effect(
            steps=(Step(node.id, Action.TRIGGERED, entry.id),),
            read=frozenset({host.active}),
            quiet_scopes=frozenset({inside.index}) if alone else frozenset(),
            produce=(at(net, entry, inside),),
        )
        making.choices.append((chosen_one, entry, inside))
    asked = net.place(node, inside, Role.ENTERING, ":asked")
    if node.completion is None:
        when = Effect() if node.cancel_remaining else quiet(inside)
        for effect in product(product([when], [over]), host.done()):
            net.rule(effect, Kind.OUTSIDE, Trigger.ANSWER, "complete")
        net.rule(Effect(steps=(Step(node.id, Action.ENTERED, "asks"),), consume=(asked,)))
    else:
        for guard, truth in making.data.cases([node.completion], inside, node, lambda t: t[0]):
            looked = Effect(guard=guard, consume=(asked,))
            going = [Effect(steps=(Step(node.id, Action.ENTERED, "asks"),))]
            if truth is True:
                going = product([over], host.done())
                if not node.cancel_remaining:
                    net.approximate(node, Exactness.MORE, "it ends though some of it goes on")
            making.rules(product([looked], going))
    begun = host.begin().then(begin(making, node, inside))
    assert begun is not None
    begun = replace(begun, kill=forget(making, inside, node).kill)
    entries = {at(net, x, inside) for x in node.entries}
    return [replace(begun, produce=tuple(n for n in begun.produce if n not in entries))]


def _some(nodes: tuple[e.FlowNode, ...]) -> list[tuple[e.FlowNode, ...]]:
    if len(nodes) > 6:
        return [*((n,) for n in nodes), nodes]
    return [c for size in range(1, len(nodes) + 1) for c in combinations(nodes, size)]


def choose(making: Making) -> None:
    """The choices of ad-hoc subprocesses: not what is being done already."""
    net = making.net
    for effect, entry, inside in making.choices:
        busy = {
            n
            for n in inside.places
            if net.places[n].element == entry.id and net.places[n].role is not Role.CONTROL
        }
        both = effect.then(Effect(inhibit=frozenset(busy)))
        assert both is not None
        net.rule(both, Kind.OUTSIDE, Trigger.ANSWER, entry.id)


def call(making: Making, host: Host) -> list[Effect]:
    """Open an instance of the called process, with what the mappings pass in."""
    node = host.node
    assert isinstance(node, e.CallActivity)
    calls = host.outer.depth_of_calls
    if calls.count(node.called.id) >= making.options.calls:
        making.net.approximate(
            node, Exactness.BOUNDED, "a process calls itself: what the inner call does is not seen"
        )
        done = Effect(steps=(Step(node.id, Action.COMPLETED),), consume=(host.active,))
        for effect in product([done], host.done()):
            making.net.rule(effect, Kind.INTERNAL)
        return [host.begin()]
    inside = making.net.area(node, host.inside, step=node.called.id)
    inside.depth_of_calls = (*calls, node.called.id)
    inside.frame = inside.path
    inside.host = host
    inside.several = host.inside.several
    build(making, node.called, inside)
    ways = product([forget(making, inside, node.called)], [begin(making, node.called, inside)])
    data = making.data
    for key in data.domains.of:
        if key not in making.mission.data_stores and data.is_read_in(key, node.called):
            variable = data.variable(key, inside.frame)
            ways = product(ways, [Effect(assign={variable: data.variables[variable].initial})])
    for mapping in node.mappings.inputs:
        ways = data.write(ways, mapping.target, mapping.source, host.outer, node, into=inside.frame)
    over = host.leave().then(quiet(host.inside))
    assert over is not None
    overs = [over.saying(node.id, Action.COMPLETED)]
    for mapping in node.mappings.outputs:
        overs = data.write_out(overs, mapping.target, mapping.source, inside, host.outer, node)
    making.rules(ended(making, host, inside, overs))
    return product([host.begin()], ways)
