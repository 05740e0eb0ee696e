"""Standard loops and multi-instance activities."""

from collections.abc import Callable
from dataclasses import replace

from m2pem.errors import ExpressionError
from m2pem.mission import elements as e
from m2pem.mission.loops import InstanceBehavior, MultiInstance, StandardLoop
from m2pem.verify.net.petri_net import Action, Exactness, Flag, Role, Step
from m2pem.verify.translate.compensation import (
    forget_instance_completions,
    note_instance_completion,
)
from m2pem.verify.translate.context import (
    ActivityInstance,
    TranslationContext,
    behavior_of,
    first,
    held_by_instance,
)
from m2pem.verify.translate.data import ERROR, Truth
from m2pem.verify.translate.net_builder import Effect, product
from m2pem.verify.translate.throwing import throw_error

_ONE_STEP = (e.Task, e.SendTask, e.ReceiveTask, e.ScriptTask)
"""Activities that add few states, however often they are repeated."""

Work = Callable[[TranslationContext, ActivityInstance], list[Effect]]


def looped(context: TranslationContext, whole: ActivityInstance, work: Work) -> list[Effect]:
    """Translate the entry of a token into an activity with a loop."""
    loop = whole.node.loop
    if isinstance(loop, StandardLoop):
        return _standard_loop(context, whole, loop, work)
    assert isinstance(loop, MultiInstance)
    if loop.behavior is not InstanceBehavior.ALL:
        context.net.approximate(
            whole.node, Exactness.BOUNDED, "what its instances throw when they end is not thrown"
        )
    count = _count(loop)
    if count == 0:
        return whole.done()
    if loop.sequential:
        return _sequential(context, whole, loop, work, count)
    return _parallel(context, whole, loop, work, count)


def _count(loop: MultiInstance) -> int | None:
    """The number of instances, if the mission states it."""
    expression = loop.collection if loop.collection is not None else loop.cardinality
    if expression is None or not expression.constant:
        return None
    try:
        value = expression.evaluate(lambda _: None)
    except ExpressionError:
        return None
    if isinstance(value, list):
        return len(value)
    return value if isinstance(value, int) and value >= 0 else None


def _instance(
    context: TranslationContext, whole: ActivityInstance, number: int
) -> ActivityInstance:
    """Translate one instance: its token is in the scope of the whole activity."""
    node, net = whole.node, context.net
    held, behavior = held_by_instance(context, node)
    suffix = f"[{number}]"
    active = net.place(node, whole.inside, Role.ACTIVE, suffix, resources=held, behavior=behavior)
    inside = net.scope(node, whole.inside, step=f"{node.id}{suffix}")
    instance = ActivityInstance(node, whole.inside, inside, active, lambda: [], boundary=False)
    inside.instance = instance
    return instance


def _over(whole: ActivityInstance) -> list[Effect]:
    """The whole is done: remove its token and all that is inside."""
    over = whole.leave().with_step(whole.node.id, Action.COMPLETED)
    return product([over], whole.done())


def _begin_instance(
    work: Work, context: TranslationContext, instance: ActivityInstance
) -> list[Effect]:
    entered = Effect(steps=(Step(instance.node.id, Action.ENTERED, "an instance"),))
    return product([entered], work(context, instance))


class _Sequence:
    """Instances one after the other. A token on `begins` starts one; a token on `ended` says that
    it is over.
    """

    def __init__(self, context: TranslationContext, whole: ActivityInstance, work: Work) -> None:
        self.instance = _instance(context, whole, 0)
        self.begins = context.net.place(whole.node, whole.inside, Role.ENTERING, ":round")
        self.ended = context.net.place(whole.node, whole.inside, Role.ENTERING, ":rounded")
        self.instance.cut = self.ends
        self.instance.done = lambda: product(
            [note_instance_completion(context, self.instance, 0)], self.ends()
        )
        begun_work = _begin_instance(work, context, self.instance)
        context.transitions(product([Effect(consume=(self.begins,))], begun_work))

    def ends(self) -> list[Effect]:
        """Translate the end of an instance."""
        return [Effect(produce=(self.ended,))]


def _standard_loop(
    context: TranslationContext, whole: ActivityInstance, loop: StandardLoop, work: Work
) -> list[Effect]:
    sequence = _Sequence(context, whole, work)
    node = whole.node
    most = loop.maximum
    counted = most is not None and most <= context.options.most_instances
    if most is not None and not counted:
        context.net.approximate(
            node, Exactness.MORE, f"the maximum of {most} rounds is not counted"
        )
    rounds = [
        context.net.place(node, whole.inside, Role.CONTROL, f":{n + 1}")
        for n in range(most if counted and most is not None else 0)
    ]
    again = Effect(consume=(sequence.ended,), produce=(sequence.begins,))
    stop = Effect(consume=(sequence.ended,))
    for guard, goes_on in _condition_cases(context, whole, loop):
        when = Effect(guard=guard)
        if goes_on == ERROR:
            ways = throw_error(context, whole.outer, node, whole, "EXPRESSION", Flag.UNCAUGHT)
            ways = product([stop], product([Effect(consume=(whole.active,))], ways))
        elif not goes_on:
            ways = product([stop], _over(whole))
        elif not rounds:
            ways = [again]
        else:
            ways = [
                Effect(
                    consume=(sequence.ended, rounds[n]), produce=(sequence.begins, rounds[n + 1])
                )
                for n in range(len(rounds) - 1)
            ]
        context.transitions(product([when.with_step(node.id, Action.COMPLETED, "a round")], ways))
    if rounds:
        last = Effect(consume=(sequence.ended, rounds[-1]))
        context.transitions(
            product([last.with_step(node.id, Action.COMPLETED, "a round")], _over(whole))
        )
    begun = Effect(produce=(sequence.begins, *rounds[:1])).and_then(whole.begin())
    begun = replace(begun, reset=forget_instance_completions(context, whole, 1).reset)
    if most == 0:
        return whole.done()
    if not loop.test_before or loop.condition is None:
        return [begun]
    found: list[Effect] = []
    for guard, goes_on in _condition_cases(context, whole, loop):
        ways = [begun] if goes_on is True else whole.done()
        if goes_on == ERROR:
            ways = throw_error(context, whole.outer, node, whole, "EXPRESSION", Flag.UNCAUGHT)
        found += product([Effect(guard=guard)], ways)
    return found


def _condition_cases(
    context: TranslationContext, whole: ActivityInstance, loop: StandardLoop
) -> list[tuple[dict[int, frozenset[int]], Truth]]:
    if loop.condition is None:
        return [({}, True)]
    if not context.data.is_followed([loop.condition], whole.node):
        context.net.approximate(whole.node, Exactness.MORE, "how often it goes round is not known")
    return context.data.cases([loop.condition], whole.outer, whole.node, first)


def _sequential(
    context: TranslationContext,
    whole: ActivityInstance,
    loop: MultiInstance,
    work: Work,
    count: int | None,
) -> list[Effect]:
    sequence = _Sequence(context, whole, work)
    node = whole.node
    again = Effect(consume=(sequence.ended,), produce=(sequence.begins,))
    stop = Effect(consume=(sequence.ended,))
    most = context.options.most_instances
    if type(node) in _ONE_STEP and behavior_of(node) is None:
        most = context.options.most_in_turn
    counted = count is not None and count <= most
    rounds: list[int] = []
    if counted:
        assert count is not None
        rounds = [
            context.net.place(node, whole.inside, Role.CONTROL, f":{n + 1}") for n in range(count)
        ]
        for n in range(count - 1):
            goes_on = Effect(consume=(rounds[n],), produce=(rounds[n + 1],)).and_then(again)
            context.transitions([goes_on.with_step(node.id, Action.COMPLETED, "an instance")])
        last = Effect(consume=(rounds[-1],)).and_then(stop)
        context.transitions(product([last], _over(whole)))
    else:
        context.net.approximate(node, Exactness.MORE, "how many instances there are is not known")
        context.transitions([again.with_step(node.id, Action.COMPLETED, "an instance")])
    if loop.completion is not None or not counted:
        context.transitions(
            product([stop.with_step(node.id, Action.COMPLETED, "an instance")], _over(whole))
        )
        if loop.completion is not None:
            context.net.approximate(
                node, Exactness.MORE, "its completion condition may be true at any instance's end"
            )
    begun = Effect(produce=(sequence.begins, *rounds[:1])).and_then(whole.begin())
    begun = replace(begun, reset=forget_instance_completions(context, whole, 1).reset)
    return [begun] if counted else [begun, *whole.done()]


def _note_and_end(
    context: TranslationContext, instance: ActivityInstance, number: int, ends: list[Effect]
) -> Callable[[], list[Effect]]:
    """Translate the end of an instance that can be compensated."""
    return lambda: product([note_instance_completion(context, instance, number)], ends)


def _parallel(
    context: TranslationContext,
    whole: ActivityInstance,
    loop: MultiInstance,
    work: Work,
    count: int | None,
) -> list[Effect]:
    node = whole.node
    known = count is not None and count <= context.options.most_instances
    total = count if known and count is not None else context.options.instances
    if not known:
        context.net.approximate(
            node,
            Exactness.BOUNDED,
            f"checked with up to {total} instances" + ("" if count is None else f", of {count}"),
        )
    activity_instances = [_instance(context, whole, number) for number in range(total)]
    begins = [context.net.place(node, whole.inside, Role.ENTERING, f"[{n}]") for n in range(total)]
    ends = [Effect()]
    if loop.completion is not None:
        context.net.approximate(
            node, Exactness.MORE, "its completion condition may be true at any instance's end"
        )
        enough = context.net.place(node, whole.inside, Role.TRIGGERED, ":enough")
        ends.append(Effect(produce=(enough,)))
        context.transitions(product([Effect(consume=(enough,))], _over(whole)))
    for number, (instance, begin) in enumerate(zip(activity_instances, begins, strict=True)):
        instance.cut = lambda: ends
        instance.done = _note_and_end(context, instance, number, ends)
        begun_work = _begin_instance(work, context, instance)
        context.transitions(product([Effect(consume=(begin,))], begun_work))
    when_empty = Effect(empty_scopes=frozenset({whole.inside.index}))
    context.transitions(product([when_empty], _over(whole)))
    sizes = [total] if known else range(total + 1)
    found: list[Effect] = []
    for size in sizes:
        if size == 0:
            found += whole.done()
            continue
        begun = whole.begin().and_then(Effect(produce=tuple(begins[:size])))
        begun = replace(begun, reset=forget_instance_completions(context, whole, total).reset)
        found.append(begun)
    return found
