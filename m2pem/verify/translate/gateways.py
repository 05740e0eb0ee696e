"""Gateways: where tokens part and join."""

import itertools

from m2pem.errors import ExpressionError
from m2pem.mission import elements as e
from m2pem.mission.upstream import upstream
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Role, Step, Trigger
from m2pem.verify.translate.context import Making
from m2pem.verify.translate.net_builder import Area, Effect, arrival, at, product
from m2pem.verify.translate.sequence_flows import any_of, is_free_choice, leave
from m2pem.verify.translate.throwing import throw_error

MOST_INCOMING = 8
"""Flows of an inclusive or complex join whose every combination is looked at."""


def _come(making: Making, node: e.FlowNode, area: Area) -> Effect:
    return Effect(steps=(Step(node.id, Action.COMPLETED),), consume=(at(making.net, node, area),))


def exclusive(making: Making, node: e.FlowNode, area: Area) -> None:
    """The first true flow, else the default one; every token passes."""
    assert isinstance(node, e.ExclusiveGateway)
    if is_free_choice(node):
        ways = any_of(making, area, node, one=True)
    else:
        ways = leave(
            making,
            area,
            node,
            node.default,
            lambda code: throw_error(making, area, node, None, code),
            first_only=True,
        )
    making.rules(product([_come(making, node, area)], ways))


def parallel(making: Making, node: e.FlowNode, area: Area) -> None:
    """Goes on when every incoming flow has a token, by every outgoing one."""
    if len(node.incoming) > 1:
        come = Effect(
            steps=(Step(node.id, Action.COMPLETED),),
            consume=tuple(arrival(making.net, flow, area) for flow in node.incoming),
        )
    else:
        come = _come(making, node, area)
    out = Effect(
        steps=tuple(Step(flow.id, Action.TAKEN) for flow in node.outgoing),
        produce=tuple(arrival(making.net, flow, area) for flow in node.outgoing),
    )
    making.rules(product([come], [out]))


def inclusive(making: Making, node: e.FlowNode, area: Area) -> None:
    """Every true flow; a join waits for what can still come."""
    assert isinstance(node, e.InclusiveGateway)
    if is_free_choice(node):
        ways = any_of(making, area, node, one=False)
    else:
        ways = leave(
            making,
            area,
            node,
            node.default,
            lambda code: throw_error(making, area, node, None, code),
        )
    if len(node.incoming) <= 1:
        making.rules(product([_come(making, node, area)], ways))
        return

    def spell_out() -> None:
        for come in joined(making, node, area):
            making.rules(product([come], ways), Kind.JOIN)

    making.later.append(spell_out)


def joined(making: Making, node: e.FlowNode, area: Area) -> list[Effect]:
    """An inclusive join with the tokens of some flows, when nothing can come by another."""
    flows = node.incoming
    places = [arrival(making.net, flow, area) for flow in flows]
    if len(flows) > MOST_INCOMING:
        making.net.approximate(
            node, Exactness.MORE, "whether more can come is not looked at: too many flows come in"
        )
        return [
            Effect(steps=(Step(node.id, Action.COMPLETED),), consume=tuple(each))
            for each in ([*((p,) for p in places), tuple(places)])
        ]
    reach = upstream(node)
    tokens = _tokens_by_node(making, area)
    found: list[Effect] = []
    for size in range(1, len(flows) + 1):
        for chosen in itertools.combinations(range(len(flows)), size):
            bits = sum(1 << number for number in chosen)
            blocking = {
                place
                for other, reachable in reach.items()
                if reachable & ~bits and not reachable & bits
                for place in tokens.get(other, ())
            }
            absent = {places[n] for n in range(len(flows)) if n not in chosen}
            found.append(
                Effect(
                    steps=(Step(node.id, Action.COMPLETED),),
                    consume=tuple(places[n] for n in chosen),
                    inhibit=frozenset(blocking | absent),
                )
            )
    return found


def _tokens_by_node(making: Making, area: Area) -> dict[e.FlowNode, set[int]]:
    """Where in an area a token on each node can be."""
    elements = making.mission.elements
    found: dict[e.FlowNode, set[int]] = {}
    for number in area.places:
        place = making.net.places[number]
        if place.role in (Role.CONTROL, Role.END):
            continue
        element = elements.get(place.element)
        if isinstance(element, e.SequenceFlow):
            element = element.target
        if isinstance(element, e.FlowNode):
            found.setdefault(element, set()).add(number)
    return found


def complex_gateway(making: Making, node: e.FlowNode, area: Area) -> None:
    """Joins when its condition says so, then waits to reset."""
    assert isinstance(node, e.ComplexGateway)
    own = frozenset({"activationCount", "waitingForStart", *(f.local_id for f in node.incoming)})
    making.net.approximate(
        node, Exactness.MORE, "flows that depend on its phase may be taken or not"
    )
    ways = leave(
        making,
        area,
        node,
        node.default,
        lambda code: throw_error(making, area, node, None, code),
        own=own,
    )
    places = [arrival(making.net, flow, area) for flow in node.incoming]
    resetting = making.net.place(node, area, Role.CONTROL, ":resets")

    def spell_out() -> None:
        subsets = [
            chosen
            for size in range(1, len(places) + 1)
            for chosen in itertools.combinations(range(len(places)), size)
        ]
        if len(places) > MOST_INCOMING:
            subsets = [*((n,) for n in range(len(places))), tuple(range(len(places)))]
        for chosen in subsets:
            active = _activates(node, chosen)
            if active is False:
                continue
            if active is None:
                making.net.approximate(
                    node, Exactness.MORE, "its activation condition may become true at any time"
                )
            whole = len(chosen) == len(places)
            used = [making.net.place(node, area, Role.CONTROL, f":used{n}") for n in chosen]
            come = Effect(
                steps=(Step(node.id, Action.COMPLETED),),
                consume=tuple(places[n] for n in chosen),
                inhibit=frozenset(
                    {places[n] for n in range(len(places)) if n not in chosen} | {resetting}
                ),
                produce=() if whole else (resetting, *used),
            )
            for effect in product([come], ways):
                if active is None:
                    making.net.rule(effect, Kind.OUTSIDE, Trigger.CONDITION)
                else:
                    making.net.rule(effect)
        if len(places) > 1:
            _reset(making, node, area, places, resetting)

    making.later.append(spell_out)


def _activates(node: e.ComplexGateway, chosen: tuple[int, ...]) -> bool | None:
    """Whether the tokens of some flows activate it; None: that depends on more than them."""
    if node.activation is None:
        return True
    counts = {flow.local_id: 0 for flow in node.incoming}
    for number in chosen:
        counts[node.incoming[number].local_id] = 1
    known: dict[str, object] = {"activationCount": len(chosen), "waitingForStart": True, **counts}
    if any(name not in known for name in node.activation.names):
        return None
    try:
        return node.activation.holds(known.get)  # type: ignore[arg-type]
    except ExpressionError:
        return None


def _reset(
    making: Making, node: e.ComplexGateway, area: Area, places: list[int], resetting: int
) -> None:
    """The second phase: what came meanwhile is used up, and some flows are taken again."""
    net = making.net
    used = [net.place(node, area, Role.CONTROL, f":used{n}") for n in range(len(places))]
    second: list[Effect] = [Effect()]
    for flow in node.outgoing:
        if flow.condition is not None or flow is node.default:
            more = Effect(steps=(Step(flow.id, Action.TAKEN),), produce=(arrival(net, flow, area),))
            second = [*second, *(both for s in second if (both := s.then(more)) is not None)]
    reach = upstream(node)
    tokens = _tokens_by_node(making, area)
    if len(places) > MOST_INCOMING:
        return
    for taken in itertools.product((0, 1), repeat=len(places)):
        if not any(taken) or all(taken):
            continue
        for waiting in itertools.product((0, 1), repeat=len(places)):
            if any(t and w for t, w in zip(taken, waiting, strict=True)):
                continue
            bits = sum(1 << n for n in range(len(places)) if taken[n] or waiting[n])
            blocking = {
                place
                for other, reachable in reach.items()
                if other is not node and reachable & ~bits and not reachable & bits
                for place in tokens.get(other, ())
            }
            now = [n for n in range(len(places)) if waiting[n]]
            come = Effect(
                steps=(Step(node.id, Action.COMPLETED, "resets"),),
                consume=(
                    resetting,
                    *(used[n] for n in range(len(places)) if taken[n]),
                    *(places[n] for n in now),
                ),
                inhibit=frozenset(
                    blocking
                    | {places[n] for n in range(len(places)) if not taken[n] and not waiting[n]}
                    | {used[n] for n in range(len(places)) if not taken[n]}
                ),
            )
            making.rules(product([come], second), Kind.JOIN)
