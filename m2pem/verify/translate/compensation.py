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
from functools import partial

from m2pem.engine.scopes import compensation_handler, is_compensation_handler
from m2pem.mission import elements as e
from m2pem.mission.events import CancelEventDefinition, CompensateEventDefinition
from m2pem.mission.loops import MultiInstance
from m2pem.mission.reachability import following, reach
from m2pem.verify.net.petri_net import (
    COMPENSATION_BEGINS,
    COMPENSATION_ENDS,
    Action,
    Exactness,
    Role,
    Step,
)
from m2pem.verify.translate.context import (
    ActivityInstance,
    CompensatedBy,
    CompensationEffects,
    TranslationContext,
)
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place, product
from m2pem.verify.translate.scopes import begin_event_subprocess, handler_instance, when_empty


def compensated_by(context: TranslationContext, node: e.Activity) -> CompensatedBy | None:
    """Return the compensation of an activity; None: it has none."""
    if node not in context.compensated_by:
        context.compensated_by[node] = None  # while it is looked at: a process may call itself
        context.compensated_by[node] = _find_compensation(context, node)
    return context.compensated_by[node]


def _find_compensation(context: TranslationContext, node: e.Activity) -> CompensatedBy | None:
    if node.for_compensation or is_compensation_handler(node):
        return None
    if node.compensation is not None:
        return CompensatedBy.ACTIVITY
    inside = container_in(node)
    if inside is None:
        return None
    activities = [each for each in inside.nodes if isinstance(each, e.Activity)]
    if compensation_handler(inside) is not None or any(
        compensated_by(context, each) for each in activities
    ):
        return CompensatedBy.INSIDE
    return None


def container_in(node: e.FlowNode) -> e.Container | None:
    """The container that an activity holds: itself, or the process that it calls."""
    if isinstance(node, e.CallActivity):
        return node.called
    return node if isinstance(node, e.SubProcess) else None


# --- notes --------------------------------------------------------------------------------------


def notes_scope(context: TranslationContext, scope: ScopeDraft) -> ScopeDraft:
    """The scope with the notes of what completed in a scope: it outlives that scope."""
    home = scope
    while home.parent is not None and home.parent is not context.everything:
        home = home.parent
    if home.index not in context.notes_scopes:
        made = context.net.scope(home.element, context.everything, step=f"{home.path[-1]}~done")
        context.notes_scopes[home.index] = made
    return context.notes_scopes[home.index]


def completion_note(
    context: TranslationContext, scope: ScopeDraft, node: e.Activity, number: int | None = None
) -> int:
    """The place that says that an activity of a scope (or an instance of it) can be compensated."""
    which = "" if number is None else f"[{number}]"
    home, suffix = notes_scope(context, scope), f":done{scope.index}{which}"
    if number is None and _is_counted(context, scope, node):
        return context.net.counted(node, home, suffix)
    return context.net.place(node, home, Role.CONTROL, suffix)


def _is_counted(context: TranslationContext, scope: ScopeDraft, node: e.Activity) -> bool:
    """Whether each time that an activity has completed is undone for itself."""
    by_activity = compensated_by(context, node) is CompensatedBy.ACTIVITY
    return by_activity and _comes_again(context, scope, node)


def note_completion(context: TranslationContext, instance: ActivityInstance) -> Effect:
    """Note that an activity has completed."""
    if compensated_by(context, instance.node) is None:
        return Effect()
    place = completion_note(context, instance.outer, instance.node)
    counted = _is_counted(context, instance.outer, instance.node)
    _note_approximations(
        context,
        instance.outer,
        instance.node,
        again=_comes_again(context, instance.outer, instance.node),
        counted=context.net.places[place].name if counted else "",
    )
    return Effect(produce=(place,)) if counted else _note(place)


def note_instance_completion(
    context: TranslationContext, instance: ActivityInstance, number: int
) -> Effect:
    """Note that an instance has completed. A compensation activity compensates only the whole."""
    if compensated_by(context, instance.node) is not CompensatedBy.INSIDE:
        return Effect()
    loop = instance.node.loop
    in_turn = not isinstance(loop, MultiInstance) or loop.sequential
    _note_approximations(context, instance.outer, instance.node, again=in_turn)
    return _note(completion_note(context, instance.outer, instance.node, number))


def _note(place: int) -> Effect:
    return Effect(reset=frozenset({place}), produce=(place,))


def _note_approximations(
    context: TranslationContext,
    scope: ScopeDraft,
    node: e.Activity,
    *,
    again: bool,
    counted: str = "",
) -> None:
    around = container_of(scope)
    others = [
        each
        for each in (around.nodes if around is not None else ())
        if isinstance(each, e.Activity) and each is not node and compensated_by(context, each)
    ]
    if others or is_loop(scope):
        context.net.approximate(
            node, Exactness.MORE, "it and what else was done is undone in any order"
        )
    if again:
        how = (
            "more often than is counted, it is undone less often"
            if counted
            else ("several times, it is undone once")
        )
        context.net.approximate(node, Exactness.BOUNDED, f"done {how}", counted)


def _comes_again(context: TranslationContext, scope: ScopeDraft, node: e.Activity) -> bool:
    """Whether it can complete more than once in one instance of its scope."""
    if scope.several or node in context.repeated or isinstance(node.container, e.AdHocSubProcess):
        return True
    if isinstance(node, e.SubProcess) and node.triggered_by_event:
        return any(not start.interrupting for start in node.starts)
    return node in reach(following(node))


def forget_completions(
    context: TranslationContext, scope: ScopeDraft, container: e.Container
) -> Effect:
    """Remove the notes of a scope before it begins again."""
    return Effect(
        reset=frozenset(
            completion_note(context, scope, node)
            for node in container.nodes
            if isinstance(node, e.Activity) and compensated_by(context, node)
        )
    )


def forget_instance_completions(
    context: TranslationContext, whole: ActivityInstance, count: int
) -> Effect:
    """Remove the notes of an activity's instances."""
    if compensated_by(context, whole.node) is not CompensatedBy.INSIDE:
        return Effect()
    places = [completion_note(context, whole.inside, whole.node, number) for number in range(count)]
    return Effect(reset=frozenset(places))


# --- what has not completed ---------------------------------------------------------------------


def cut_short(context: TranslationContext, scope: ScopeDraft) -> tuple[int, ...]:
    """The place that says that an event subprocess has interrupted a scope, if that matters."""
    instance = scope.instance
    if (
        not isinstance(instance, ActivityInstance)
        or instance.cut is None
        or compensated_by(context, instance.node) is None
    ):
        return ()
    return (context.net.place(scope.element, scope, Role.CONTROL, ":cut"),)


def on_inside_end(
    context: TranslationContext, instance: ActivityInstance, scope: ScopeDraft, over: list[Effect]
) -> list[Effect]:
    """How an activity goes on when its inside `scope` is over. If it was interrupted, it cannot be
    compensated.
    """
    container = container_of(scope)
    interrupts = container is not None and any(
        start.interrupting
        for each in container.event_subprocesses
        if not is_compensation_handler(each)
        for start in each.starts
    )
    cut = cut_short(context, scope) if interrupts else ()
    if not cut or instance.cut is None:
        return product(over, instance.done())
    well = product(over, [Effect(inhibit=frozenset(cut))])
    early = product(over, [Effect(read=frozenset(cut))])
    return [*product(well, instance.done()), *product(early, instance.cut())]


# --- scopes --------------------------------------------------------------------------------------


def is_loop(scope: ScopeDraft) -> bool:
    """Whether a scope holds the instances of an activity, and is not the inside of one."""
    instance = scope.instance
    return (
        isinstance(instance, ActivityInstance)
        and instance.inside is scope
        and instance.boundary
        and instance.node.loop is not None
    )


def container_of(scope: ScopeDraft) -> e.Container | None:
    """The container that a scope is an instance of."""
    element = scope.element
    if isinstance(element, e.CallActivity):
        return element.called if scope.frame == scope.path else None
    if isinstance(element, e.Process | e.SubProcess) and not is_loop(scope):
        return element
    return None


@dataclass(frozen=True, slots=True)
class _Point:
    """An activity, or an instance of one, that can be compensated while there is a
    token on `note`.
    """

    instance: ActivityInstance
    note: int


# --- throwing -----------------------------------------------------------------------------------


def compensate(
    context: TranslationContext,
    node: e.FlowNode,
    scope: ScopeDraft,
    definition: CompensateEventDefinition,
    begun: list[Effect],
    ways: list[Effect],
) -> tuple[list[Effect], list[Effect]]:
    """Return (effects after which the throw event waits, effects after which it goes on
    at once).
    """
    name = definition.activity
    if name and node.qualifier:
        name = f"{node.qualifier}:{name}"
    named = context.mission.elements.get(name) if name else None
    target = _target(scope, named)
    found = _points(context, target)
    if named is not None and named is not container_of(target):
        found = [point for point in found if point.instance.node is named]
    compensating = _compensate_points(context, node, f"{scope.index}{name or ''}", target, found)
    thrown = compensating.thrown.with_step(node.id, Action.THROWN, "compensation")
    over = compensating.over.with_step(node.id, Action.TRIGGERED, COMPENSATION_ENDS)
    if not definition.wait:
        context.net.transition(over)
        return [], product(begun, [thrown])
    waiting = context.net.place(node, scope, Role.ACTIVE, ":undoes")
    last = Step(node.id, Action.COMPLETED, "all is undone")
    goes_on = replace(
        compensating.over, steps=(last,), consume=(*compensating.over.consume, waiting)
    )
    context.transitions(product([goes_on], ways))
    if target is not scope:  # the event subprocess that threw may be over before
        context.transitions(product([over], [Effect(inhibit=frozenset({waiting}))]))
    return product(begun, product([thrown], [Effect(produce=(waiting,))])), []


def _target(scope: ScopeDraft, named: e.Element | None) -> ScopeDraft:
    """The scope in which a throw event compensates, as in the engine."""
    here = scope
    if named is None:
        if isinstance(scope.element, e.SubProcess) and scope.element.triggered_by_event:
            assert isinstance(scope.instance, ActivityInstance)
            here = scope.instance.outer
        return here
    homes: tuple[e.Element, ...] = (named,)
    if isinstance(named, e.Activity):
        homes = (named, named.container)
    while container_of(here) not in homes:
        if not isinstance(here.instance, ActivityInstance):
            return scope
        here = here.instance.outer
    return here


def cancel(context: TranslationContext, node: e.EndEvent, scope: ScopeDraft) -> list[Effect]:
    """Cancel a transaction: all in it ends, what completed is compensated, and a token
    leaves it.
    """
    instance = scope.instance
    assert isinstance(instance, ActivityInstance)
    while not instance.boundary:  # an instance: the whole is left
        assert isinstance(instance.outer.instance, ActivityInstance)
        instance = instance.outer.instance
    left = instance.leave()
    for boundary in instance.node.boundary:
        if any(isinstance(d, CancelEventDefinition) for d in boundary.definitions):
            out = Effect(
                steps=(Step(boundary.id, Action.TRIGGERED),),
                produce=(entry_place(context.net, boundary, instance.outer),),
            )
            left = left.and_then(out)
            break
    compensating = _compensate_points(context, node, "", scope, _points(context, scope))
    over = compensating.over.with_step(node.id, Action.COMPLETED, "all is undone")
    context.transitions(product([over], [left]))
    ended = context.net.place(node, scope, Role.TRIGGERED, ":cancelled")
    begins = Effect(steps=(Step(node.id, Action.TRIGGERED, COMPENSATION_BEGINS),), consume=(ended,))
    context.transitions(product([begins], [compensating.thrown]))
    return [Effect(interrupt_scopes=frozenset({scope.index}), produce=(ended,))]


# --- undoing ------------------------------------------------------------------------------------


def _points(context: TranslationContext, scope: ScopeDraft) -> list[_Point]:
    """Return the activities of a scope that can be compensated, if they have completed."""
    if is_loop(scope):
        assert isinstance(scope.instance, ActivityInstance)
        node = scope.instance.node
        if compensated_by(context, node) is not CompensatedBy.INSIDE:
            return []
        instances = [each for each in _activity_instances(scope) if not each.boundary]
        return [
            _Point(each, completion_note(context, scope, node, n))
            for n, each in enumerate(instances)
        ]
    around = container_of(scope)
    nodes = around.nodes if around is not None else ()
    activity_instances = {instance.node: instance for instance in _activity_instances(scope)}
    return [
        _Point(activity_instances[node], completion_note(context, scope, node))
        for node in nodes
        if isinstance(node, e.Activity)
        and node in activity_instances
        and compensated_by(context, node)
    ]


def _activity_instances(scope: ScopeDraft) -> list[ActivityInstance]:
    return [
        child.instance
        for child in scope.children
        if isinstance(child.instance, ActivityInstance) and child.instance.inside is child
    ]


def _compensate_points(
    context: TranslationContext,
    thrower: e.FlowNode,
    mark: str,
    scope: ScopeDraft,
    points: Sequence[_Point],
) -> CompensationEffects:
    """Compensate points of a scope one after the other, while a token says that the throw is
    active.

    That token is in the scope: when the scope ends, or is interrupted, nothing more is compensated.
    """
    net = context.net
    compensating = net.place(thrower, scope, Role.TRIGGERED, f":undoes{mark}")
    what = f"{thrower.id}:{mark}"
    claimed: list[tuple[int, int]] = []
    busy: list[int] = []
    for number, point in enumerate(points):
        node = point.instance.node
        several = net.places[point.note].several
        make = net.counted if several else partial(net.place, role=Role.CONTROL)
        claimed.append((point.note, make(node, scope, suffix=f":for{what}.{number}")))
        busy.append(net.place(node, scope, Role.CONTROL, f":by{what}.{number}"))
    for point, (_, claim), mine in zip(points, claimed, busy, strict=True):
        node = point.instance.node
        begins = Effect(
            steps=(Step(node.id, Action.TRIGGERED, COMPENSATION_BEGINS),),
            read=frozenset({compensating}),
            inhibit=frozenset(busy),
            consume=(claim,),
            produce=(mine,),
        )
        starts, over = _compensation_of(context, scope, point)
        context.transitions(product([begins], starts))
        is_over = Effect(
            steps=(Step(node.id, Action.TRIGGERED, COMPENSATION_ENDS),), consume=(mine,)
        )
        context.transitions(product([is_over], [over]))
    context.claims.setdefault(scope.index, []).extend(
        (claim, note_completion) for note_completion, claim in claimed
    )
    return CompensationEffects(
        Effect(reset=frozenset({compensating}), produce=(compensating,), moves=tuple(claimed)),
        Effect(
            consume=(compensating,), inhibit=frozenset({*busy, *(claim for _, claim in claimed)})
        ),
    )


def _compensation_of(
    context: TranslationContext, scope: ScopeDraft, point: _Point
) -> tuple[list[Effect], Effect]:
    """What compensates a point: (how it begins, when it is over)."""
    instance = point.instance
    handler = instance.node.compensation
    if handler is not None:
        (compensates,) = [each for each in _activity_instances(scope) if each.node is handler]
        tokens = [
            place
            for place in scope.places
            if context.net.places[place].element == handler.id
            and context.net.places[place].role is not Role.CONTROL
        ]
        over = when_empty(compensates.inside).and_then(Effect(inhibit=frozenset(tokens)))
        return [Effect(produce=(entry_place(context.net, handler, scope),))], over
    inner = _inside(instance)
    if inner is None:  # a process that calls itself: the inner call is not seen
        return [Effect()], Effect()
    container = container_of(inner)
    by_itself = compensation_handler(container) if container is not None else None
    if by_itself is not None:
        begun = begin_event_subprocess(context, inner, by_itself, by_itself.starts)
        forgotten = forget_completions(
            context, handler_instance(context, inner, by_itself).inside, by_itself
        )
        return product([forgotten], [begun]), when_empty(instance.inside)
    return [_compensate_inside(context, instance.node, inner).thrown], when_empty(instance.inside)


def _compensate_inside(
    context: TranslationContext, node: e.Activity, inner: ScopeDraft
) -> CompensationEffects:
    """Compensate an activity by compensating all that completed in it."""
    known = context.compensating.get(inner.index)
    if known is None:
        known = _compensate_points(context, node, "all", inner, _points(context, inner))
        context.compensating[inner.index] = known
        context.net.transition(known.over.with_step(node.id, Action.TRIGGERED, COMPENSATION_ENDS))
    return known


def _inside(instance: ActivityInstance) -> ScopeDraft | None:
    """The scope in which the contents of an activity completed."""
    if is_loop(instance.inside) or container_in(instance.node) is instance.node:
        return instance.inside
    return next((a for a in instance.inside.children if container_of(a) is not None), None)


# --- the end ------------------------------------------------------------------------------------


def release_claims(context: TranslationContext) -> None:
    """When a scope is interrupted or its transaction cancelled, claimed notes can be claimed anew.

    That concerns claims whose compensation has not begun.
    """
    for index, claims in context.claims.items():
        container = container_of(context.net.scopes[index])
        if container is None:
            continue
        ends = {start.id for each in container.event_subprocesses for start in each.starts}
        ends |= {node.id for node in container.nodes if isinstance(node, e.EndEvent)}
        for draft in context.net.drafts:
            effect = draft.effect
            ended = effect.reset_scopes | effect.interrupt_scopes
            if index in ended and any(step.element in ends for step in effect.steps):
                draft.effect = replace(effect, moves=(*claims, *effect.moves))
