"""Processes, subprocesses, event subprocesses, ad-hoc subprocesses and call activities."""

from dataclasses import replace

from m2pem.mission import elements as e
from m2pem.verify.net.petri_net import Action, Exactness, Kind, Place, Role, Step, Trigger
from m2pem.verify.translate.catching import arm_handler
from m2pem.verify.translate.compensation import forget_completions, note_completion, on_inside_end
from m2pem.verify.translate.context import ActivityInstance, TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place, product
from m2pem.verify.translate.parallel_multiple import all_must_come, trigger_places
from m2pem.verify.translate.scopes import begin, handler_instance, when_empty
from m2pem.verify.translate.sequence_flows import some_of


def build(context: TranslationContext, container: e.Container, scope: ScopeDraft) -> None:
    """Translate all that is in a container."""
    if container.event_subprocesses:
        scope.open = context.net.place(scope.element, scope, Role.CONTROL, ":open")
    for node in container.nodes:
        context.build_node(context, node, scope)
    if scope.open is not None:
        context.later.append(lambda: _completing(context, container, scope))


def ends_with_its_inside(context: TranslationContext, instance: ActivityInstance) -> None:
    """An activity is done when no token is left inside."""
    over = instance.leave().and_then(when_empty(instance.inside))
    over = over.with_step(instance.node.id, Action.COMPLETED)
    context.transitions(on_inside_end(context, instance, instance.inside, [over]))


def event_subprocess(
    context: TranslationContext, container: e.SubProcess, scope: ScopeDraft
) -> None:
    """Translate the inside of an event subprocess, and how it begins."""
    instance = handler_instance(context, scope, container)
    instance.done = lambda: [note_completion(context, instance)]
    instance.cut = lambda: [Effect()]
    instance.inside.several = scope.several or any(not s.interrupting for s in container.starts)
    if instance.inside.several:
        context.net.places[instance.active] = _several(context.net.places[instance.active])
    build(context, container, instance.inside)
    ends_with_its_inside(context, instance)
    for start in container.starts:
        arm_handler(context, scope, start)


def _several(place: Place) -> Place:
    return replace(place, several=True)


def _completing(context: TranslationContext, container: e.Container, scope: ScopeDraft) -> None:
    """When only event subprocesses are left in a scope, no other one begins."""
    net = context.net
    assert scope.open is not None
    others: set[int] = {n for n in scope.places if net.places[n].role is not Role.CONTROL}
    activity_instances = []
    awaited: set[int] = set()
    for each in container.event_subprocesses:
        for start in each.starts:
            if all_must_come(start):
                awaited.update(trigger_places(context, start, scope).places)
        instance = handler_instance(context, scope, each)
        others.discard(instance.active)
        activity_instances.append(instance)
    for instance in activity_instances:
        net.transition(
            Effect(
                steps=(Step(scope.element.id, Action.COMPLETED, "its own work"),),
                consume=(scope.open,),
                read=frozenset({instance.active}),
                inhibit=frozenset(others),
                reset=frozenset(awaited),
            )
        )


# --- activities that hold others ----------------------------------------------------------------


def subprocess(context: TranslationContext, instance: ActivityInstance) -> list[Effect]:
    """Translate the start of a subprocess."""
    node = instance.node
    assert isinstance(node, e.SubProcess)
    build(context, node, instance.inside)
    ends_with_its_inside(context, instance)
    both = forget_completions(context, instance.inside, node).and_then(instance.begin())
    return product([both], [begin(context, node, instance.inside)])


def ad_hoc(context: TranslationContext, instance: ActivityInstance) -> list[Effect]:
    """Begin an ad-hoc subprocess: its activities are begun by choice."""
    node, net = instance.node, context.net
    assert isinstance(node, e.AdHocSubProcess)
    build(context, node, instance.inside)
    inside = instance.inside
    over = instance.leave().with_step(node.id, Action.COMPLETED)
    if node.active_elements is not None or not node.entries:
        net.approximate(node, Exactness.MORE, "any of its activities may be chosen")
        ends_with_its_inside(context, instance)
        begun = instance.begin().and_then(begin(context, node, inside))
        begun = replace(begun, reset=forget_completions(context, inside, node).reset)
        bare = replace(
            begun,
            produce=tuple(
                n
                for n in begun.produce
                if n not in {entry_place(net, x, inside) for x in node.entries}
            ),
        )
        chosen = [
            Effect(),
            *(
                Effect(produce=tuple(entry_place(net, x, inside) for x in some))
                for some in some_of(node.entries)
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
            read=frozenset({instance.active}),
            empty_scopes=frozenset({inside.index}) if alone else frozenset(),
            produce=(entry_place(net, entry, inside),),
        )
        context.choices.append((chosen_one, entry, inside))
    asked = net.place(node, inside, Role.ENTERING, ":asked")
    if node.completion is None:
        when = Effect() if node.cancel_remaining else when_empty(inside)
        for effect in product(product([when], [over]), instance.done()):
            net.transition(effect, Kind.EXTERNAL, Trigger.ANSWER, "complete")
        net.transition(Effect(steps=(Step(node.id, Action.ENTERED, "asks"),), consume=(asked,)))
    else:
        for guard, truth in context.data.cases([node.completion], inside, node, lambda t: t[0]):
            looked = Effect(guard=guard, consume=(asked,))
            going = [Effect(steps=(Step(node.id, Action.ENTERED, "asks"),))]
            if truth is True:
                going = product([over], instance.done())
                if not node.cancel_remaining:
                    net.approximate(node, Exactness.MORE, "it ends though some of it goes on")
            context.transitions(product([looked], going))
    begun = instance.begin().and_then(begin(context, node, inside))
    begun = replace(begun, reset=forget_completions(context, inside, node).reset)
    entries = {entry_place(net, x, inside) for x in node.entries}
    return [replace(begun, produce=tuple(n for n in begun.produce if n not in entries))]


def translate_choices(context: TranslationContext) -> None:
    """Add the choices of ad-hoc subprocesses, of activities that are not active already."""
    net = context.net
    for effect, entry, inside in context.choices:
        busy = {
            n
            for n in inside.places
            if net.places[n].element == entry.id and net.places[n].role is not Role.CONTROL
        }
        both = effect.and_then(Effect(inhibit=frozenset(busy)))
        net.transition(both, Kind.EXTERNAL, Trigger.ANSWER, entry.id)


def call(context: TranslationContext, instance: ActivityInstance) -> list[Effect]:
    """Begin an instance of the called process, with the inputs that the mappings pass in."""
    node = instance.node
    assert isinstance(node, e.CallActivity)
    calls = instance.outer.depth_of_calls
    if calls.count(node.called.id) >= context.options.calls:
        context.net.approximate(
            node, Exactness.BOUNDED, "a process calls itself: what the inner call does is not seen"
        )
        done = Effect(steps=(Step(node.id, Action.COMPLETED),), consume=(instance.active,))
        for effect in product([done], instance.done()):
            context.net.transition(effect, Kind.INTERNAL)
        return [instance.begin()]
    inside = context.net.scope(node, instance.inside, step=node.called.id)
    inside.depth_of_calls = (*calls, node.called.id)
    inside.frame = inside.path
    inside.instance = instance
    inside.several = instance.inside.several
    build(context, node.called, inside)
    ways = product(
        [forget_completions(context, inside, node.called)], [begin(context, node.called, inside)]
    )
    data = context.data
    ways = product(ways, [Effect(assign=data.initial(node.called, inside.frame))])
    for mapping in node.mappings.inputs:
        ways = data.write(
            ways, mapping.target, mapping.source, instance.outer, node, into=inside.frame
        )
    over = instance.leave().and_then(when_empty(instance.inside))
    overs = [over.with_step(node.id, Action.COMPLETED)]
    for mapping in node.mappings.outputs:
        overs = data.write_out(overs, mapping.target, mapping.source, inside, instance.outer, node)
    context.transitions(on_inside_end(context, instance, inside, overs))
    return product([instance.begin()], ways)
