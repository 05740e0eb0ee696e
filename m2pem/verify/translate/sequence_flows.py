"""Sequence flows: by which of them a token can leave an element."""

import itertools
from collections.abc import Callable, Sequence
from typing import TypeVar

from m2pem.mission import elements as e
from m2pem.verify.net.petri_net import Action, Exactness, Step
from m2pem.verify.translate.context import TranslationContext
from m2pem.verify.translate.data import ERROR, Truth
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, arrival, product

MOST_SUBSETS = 6
"""Most flows, or activities of an ad-hoc subprocess, of which every combination is tried."""

T = TypeVar("T")

Fail = Callable[[str], list[Effect]]
"""What an error with a code leads to; the token is removed already."""


def along(
    context: TranslationContext, scope: ScopeDraft, flows: Sequence[e.SequenceFlow], times: int = 1
) -> Effect:
    """A token comes to the end of each flow."""
    return Effect(
        steps=tuple(Step(flow.id, Action.TAKEN) for flow in flows),
        produce=tuple(arrival(context.net, flow, scope) for flow in flows) * times,
    )


def leave(
    context: TranslationContext,
    scope: ScopeDraft,
    node: e.FlowNode,
    default: e.SequenceFlow | None,
    fail: Fail,
    *,
    first_only: bool = False,
    times: int = 1,
    own: frozenset[str] = frozenset(),
) -> list[Effect]:
    """Take every flow that is true, or the first of them, else the default flow, else throw
    NO_FLOW.

    The default flow of an activity goes with the flows that have no condition (clause 13.3.1).
    """
    beside = default is not None and isinstance(node, e.Activity)
    flows = [flow for flow in node.outgoing if flow is not default]
    if not any(flow.condition is not None for flow in flows):
        taken = flows[:1] if first_only else flows
        if default is not None and (beside or not taken):
            taken = [*taken, default]
        return [along(context, scope, taken, times)]
    asked = [flow.condition for flow in flows if flow.condition is not None]

    def choose(truths: Sequence[Truth]) -> tuple[int, ...] | str:
        answers = iter(truths)
        taken: list[int] = []
        for number, flow in enumerate(flows):
            truth = next(answers) if flow.condition is not None else True
            if truth == ERROR:
                return "EXPRESSION"
            if truth is True:
                taken.append(number)
                if first_only:
                    break
        if not taken and default is None:
            return "NO_FLOW"
        return tuple(taken)

    found: list[Effect] = []
    if not context.data.is_followed(asked, node):
        context.net.approximate(
            node, Exactness.MORE, "a condition reads what nothing in the mission writes"
        )
    for guard, outcome in context.data.cases(asked, scope, node, choose, own):
        when = Effect(guard=guard)
        if isinstance(outcome, str):
            ways = fail(outcome)
        else:
            taken = [flows[number] for number in outcome]
            asks = any(flow.condition is not None for flow in taken)
            if default is not None and not (asks if beside else taken):
                taken.append(default)
            ways = [along(context, scope, taken, times)]
        found += product([when], ways)
    return found


def is_free_choice(node: e.Gateway) -> bool:
    """Whether no outgoing flow of a diverging gateway has a condition."""
    return len(node.outgoing) > 1 and all(flow.condition is None for flow in node.outgoing)


def any_of(
    context: TranslationContext, scope: ScopeDraft, node: e.Gateway, *, one: bool
) -> list[Effect]:
    """A gateway whose flows have no conditions: it takes one of them, or some; which is unknown."""
    context.net.approximate(
        node, Exactness.MORE, "no flow has a condition, so any of them may be taken"
    )
    chosen = [(flow,) for flow in node.outgoing] if one else some_of(node.outgoing)
    return [along(context, scope, each) for each in chosen]


def some_of(these: Sequence[T], most: int = MOST_SUBSETS) -> list[tuple[T, ...]]:
    """The non-empty combinations of these; of more than `most`, each alone and all together."""
    if len(these) > most:
        return [*((each,) for each in these), tuple(these)]
    return [
        each for size in range(1, len(these) + 1) for each in itertools.combinations(these, size)
    ]
