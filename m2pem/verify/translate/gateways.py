"""Gateways: where tokens fork and join."""

import itertools

from m2pem.errors import ExpressionError
from m2pem.mission import elements as e
from m2pem.mission.reachability import upstream
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Role, Step, Trigger
from m2pem.verify.translate.context import TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, arrival, entry_place, product
from m2pem.verify.translate.sequence_flows import any_of, is_free_choice, leave, some_of
from m2pem.verify.translate.throwing import throw_error

MOST_INCOMING = 8
"""Most incoming flows of an inclusive or complex join for which every combination is translated."""


def _come(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> Effect:
    return Effect(
        steps=(Step(node.id, Action.COMPLETED),), consume=(entry_place(context.net, node, scope),)
    )


def exclusive(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """Take the first true flow, else the default one; every token passes."""
    assert isinstance(node, e.ExclusiveGateway)
    ways = _ways(context, node, scope, one=True)
    context.transitions(product([_come(context, node, scope)], ways))


def _ways(
    context: TranslationContext,
    node: e.ExclusiveGateway | e.InclusiveGateway,
    scope: ScopeDraft,
    *,
    one: bool,
) -> list[Effect]:
    """How a token goes on: by `one` flow, or by every true one."""
    if is_free_choice(node):
        return any_of(context, scope, node, one=one)
    return leave(
        context,
        scope,
        node,
        node.default,
        lambda code: throw_error(context, scope, node, None, code),
        first_only=one,
    )


def parallel(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """When every incoming flow has a token, put one on every outgoing flow."""
    if len(node.incoming) > 1:
        come = Effect(
            steps=(Step(node.id, Action.COMPLETED),),
            consume=tuple(arrival(context.net, flow, scope) for flow in node.incoming),
        )
    else:
        come = _come(context, node, scope)
    out = Effect(
        steps=tuple(Step(flow.id, Action.TAKEN) for flow in node.outgoing),
        produce=tuple(arrival(context.net, flow, scope) for flow in node.outgoing),
    )
    context.transitions(product([come], [out]))


def inclusive(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """Take every true flow. A join waits for all tokens that can still come."""
    assert isinstance(node, e.InclusiveGateway)
    ways = _ways(context, node, scope, one=False)
    if len(node.incoming) <= 1:
        context.transitions(product([_come(context, node, scope)], ways))
        return

    def translate_later() -> None:
        for come in joined(context, node, scope):
            context.transitions(product([come], ways), Kind.JOIN)

    context.later.append(translate_later)


def joined(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> list[Effect]:
    """An inclusive join with the tokens of some flows, when nothing can come by another."""
    flows = node.incoming
    places = [arrival(context.net, flow, scope) for flow in flows]
    if len(flows) > MOST_INCOMING:
        context.net.approximate(
            node, Exactness.MORE, "whether more can come is not looked at: too many flows come in"
        )
        return [
            Effect(steps=(Step(node.id, Action.COMPLETED),), consume=each)
            for each in some_of(places, MOST_INCOMING)
        ]
    reach = upstream(node)
    tokens = _tokens_by_node(context, scope)
    found: list[Effect] = []
    for chosen in some_of(range(len(flows)), MOST_INCOMING):
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


def _tokens_by_node(context: TranslationContext, scope: ScopeDraft) -> dict[e.FlowNode, set[int]]:
    """The places in a scope where a token on each node can be."""
    elements = context.mission.elements
    found: dict[e.FlowNode, set[int]] = {}
    for number in scope.places:
        place = context.net.places[number]
        if place.role in (Role.CONTROL, Role.END):
            continue
        element = elements.get(place.element)
        if isinstance(element, e.SequenceFlow):
            element = element.target
        if isinstance(element, e.FlowNode):
            found.setdefault(element, set()).add(number)
    return found


def complex_gateway(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """Join when the activation condition is true, then wait for the reset."""
    assert isinstance(node, e.ComplexGateway)
    own = frozenset({"activationCount", "waitingForStart", *(f.local_id for f in node.incoming)})
    context.net.approximate(
        node, Exactness.MORE, "flows that depend on its phase may be taken or not"
    )
    ways = leave(
        context,
        scope,
        node,
        node.default,
        lambda code: throw_error(context, scope, node, None, code),
        own=own,
    )
    places = [arrival(context.net, flow, scope) for flow in node.incoming]
    resetting = context.net.place(node, scope, Role.CONTROL, ":resets")

    def translate_later() -> None:
        for chosen in some_of(range(len(places)), MOST_INCOMING):
            active = _activates(node, chosen)
            if active is False:
                continue
            if active is None:
                context.net.approximate(
                    node, Exactness.MORE, "its activation condition may become true at any time"
                )
            whole = len(chosen) == len(places)
            used = [context.net.place(node, scope, Role.CONTROL, f":used{n}") for n in chosen]
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
                    context.net.transition(effect, Kind.EXTERNAL, Trigger.CONDITION)
                else:
                    context.net.transition(effect)
        if len(places) > 1:
            _reset(context, node, scope, places, resetting)

    context.later.append(translate_later)


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
    context: TranslationContext,
    node: e.ComplexGateway,
    scope: ScopeDraft,
    places: list[int],
    resetting: int,
) -> None:
    """The second phase: tokens that came meanwhile are consumed, and some flows are taken again."""
    net = context.net
    used = [net.place(node, scope, Role.CONTROL, f":used{n}") for n in range(len(places))]
    second: list[Effect] = [Effect()]
    for flow in node.outgoing:
        if flow.condition is not None or flow is node.default:
            more = Effect(
                steps=(Step(flow.id, Action.TAKEN),), produce=(arrival(net, flow, scope),)
            )
            second = [*second, *product(second, [more])]
    reach = upstream(node)
    tokens = _tokens_by_node(context, scope)
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
            context.transitions(product([come], second), Kind.JOIN)
