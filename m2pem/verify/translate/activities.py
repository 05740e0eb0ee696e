"""Tasks and other activities: how they begin, work and end."""

from collections.abc import Collection
from dataclasses import replace

from m2pem.engine.execution import Waits, waits_when_entered
from m2pem.fleet.allocation import allocate
from m2pem.fleet.space import may_wait_for_space
from m2pem.mission import elements as e
from m2pem.mission.behavior import Assignment, Behavior, OnLoss
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression.expression import literal
from m2pem.mission.losses import (
    BATTERY_LOW,
    FAILED,
    LINK_LOST,
    PREEMPTED,
    REJECTED,
    TAKEN_OVER,
    UNAVAILABLE,
    is_loss,
)
from m2pem.units import Dimension, UnitError, quantity
from m2pem.verify.net import choices
from m2pem.verify.net.petri_net import (
    BEGINS,
    UNASKED,
    Action,
    Exactness,
    Flag,
    Kind,
    Role,
    Step,
    Trigger,
)
from m2pem.verify.translate import subprocesses
from m2pem.verify.translate.allocations import (
    asking_place,
    choose_resources,
    lose_resources,
    take_named_resources,
)
from m2pem.verify.translate.catching import boundaries, caught_before_work
from m2pem.verify.translate.compensation import note_completion
from m2pem.verify.translate.context import (
    ActivityInstance,
    Contender,
    TranslationContext,
    behavior_of,
    held_by,
    may_be_preempted,
    register_catcher,
    resources,
    takes_from_pools,
)
from m2pem.verify.translate.keeping import kept_for_others
from m2pem.verify.translate.loops import looped
from m2pem.verify.translate.moving import (
    begin_moving,
    may_be_refused,
    movers_of,
    refused_place,
    stop_moving,
    without_room,
)
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place, product
from m2pem.verify.translate.pools import goes_on
from m2pem.verify.translate.role_choices import pools_among
from m2pem.verify.translate.sequence_flows import leave
from m2pem.verify.translate.throwing import (
    catchable,
    failing,
    interrupting_places,
    message_effects,
    split_by_places,
    throw_error,
)
from m2pem.verify.translate.timers import due_us, runs, written


def activity(context: TranslationContext, node: e.FlowNode, scope: ScopeDraft) -> None:
    """Translate an activity: a token enters it, works, and leaves."""
    assert isinstance(node, e.Activity)
    net = context.net
    inside = net.scope(node, scope)
    inside.several = scope.several or node in context.repeated
    held, behavior = held_by(context, node)
    repeated = node in context.repeated
    active = net.place(
        node, scope, Role.ACTIVE, several=repeated, resources=held, behavior=behavior
    )
    instance = ActivityInstance(node, scope, inside, active, lambda: [])
    instance.done = lambda: pass_on(context, instance)
    instance.cut = lambda: pass_on(context, instance, well=False)
    inside.instance = instance
    boundaries(context, instance)
    come = Effect(
        steps=(Step(node.id, Action.ENTERED),),
        consume=(entry_place(net, node, scope),) * node.start_quantity,
    )
    waits = waits_when_entered(node)
    instance.armed_before = waits is Waits.AT_ITS_BOUNDARY and not isinstance(node, e.UserTask)
    begun = looped(context, instance, work) if node.loop is not None else work(context, instance)
    if instance.armed_before:
        _arm_before_work(context, instance, come, begun)
        return
    context.transitions(product([come], begun))
    if waits is not Waits.NOTHING:
        net.at_once.add(entry_place(net, node, scope))


def _arm_before_work(
    context: TranslationContext, instance: ActivityInstance, come: Effect, begun: list[Effect]
) -> None:
    """Arm the boundary events when the token enters; the work begins in a later step."""
    net, node = context.net, instance.node
    net.at_once.add(entry_place(net, node, instance.outer))
    later = begun[0].produce if len(begun) == 1 else ()
    only_brings = len(begun) == 1 and begun[0] == Effect(produce=later)
    if only_brings and instance.active in later:
        # Its instances begin each in its turn: what interrupts it finds it at work already.
        context.transitions(product([replace(come, produce=tuple(instance.armed))], begun))
        return
    if only_brings and len(later) == 1:
        due = later[0]  # a behavior or message: its work is to begin as it is
    else:
        due = net.place(node, instance.outer, Role.ENTERING, f":due{instance.inside.index}")
        for effect in begun:
            over = instance.active not in effect.produce
            ended = frozenset({instance.inside.index}) if over else frozenset()
            begins = () if effect.steps else (Step(node.id, Action.ENTERED, BEGINS),)
            context.transitions(product([Effect(begins, (due,), reset_scopes=ended)], [effect]))
    armed = come.and_then(Effect(produce=(due, *instance.armed)))
    net.transition(armed)
    caught_before_work(context, replace(instance, active=due, armed=[]))


def pass_on(
    context: TranslationContext, instance: ActivityInstance, *, well: bool = True
) -> list[Effect]:
    """An activity is done: it leaves by its sequence flows. Its token is removed already.

    `well`: it completed, and was not ended early, so it can be compensated.
    """
    node = instance.node
    ways = [note_completion(context, instance) if well else Effect()]
    for mapping in node.data_flow.outputs:
        ways = context.data.write(ways, mapping.target, None, instance.outer, node)
    if node.for_compensation:
        return ways
    out = leave(
        context,
        instance.outer,
        node,
        node.default,
        lambda code: throw_error(context, instance.outer, node, instance, code),
        times=node.completion_quantity,
    )
    if isinstance(node.container, e.AdHocSubProcess):
        asked = context.net.place(node.container, instance.outer, Role.ENTERING, ":asked")
        if node.container.active_elements is None and node.container.entries:
            ways = product(ways, [Effect(produce=(asked,))])
    return product(ways, out)


# --- work ---------------------------------------------------------------------------------------


def work(context: TranslationContext, instance: ActivityInstance) -> list[Effect]:
    """Translate the start of an activity, or of one of its instances."""
    node = instance.node
    behavior = behavior_of(node)
    if behavior is not None:
        return _behavior(context, instance, behavior)
    match node:
        case e.UserTask():
            return _user_task(context, instance, node)
        case e.ScriptTask():
            return _script(context, instance, node)
        case e.ServiceTask(call=call) if call is not None:
            return _outside_work(context, instance)
        case e.SendTask(message=message) if message is not None:
            return _send(context, instance, message.id)
        case e.ReceiveTask(message=message) if message is not None:
            return _receive(context, instance, node)
        case e.AdHocSubProcess():
            return subprocesses.ad_hoc(context, instance)
        case e.SubProcess():
            return subprocesses.subprocess(context, instance)
        case e.CallActivity():
            return subprocesses.call(context, instance)
        case _:
            return _at_once(instance)


def _at_once(instance: ActivityInstance) -> list[Effect]:
    stop = Effect(steps=(Step(instance.node.id, Action.COMPLETED),))
    return product([stop], instance.done())


def _behavior(
    context: TranslationContext, instance: ActivityInstance, behavior: Behavior
) -> list[Effect]:
    net = context.net
    if not behavior.roles and behavior.name == "hold":
        done = _ended(instance, instance.leave())
        after_us = _hold_us(behavior)
        made = [
            net.transition(effect, Kind.EXTERNAL, Trigger.TIMER, due_us=after_us)
            for effect in product([done], instance.done())
        ]
        runs(context, instance.active, after_us, (instance.active,), made)
        return [instance.begin()]
    roles = context.candidates.get(instance.node, ())
    able = [each for role in roles for each in role.resources] or resources(context, behavior)
    fleet = context.fleet
    if context.options.ways is not None:
        fleet = replace(fleet, shared_space={})
    if may_wait_for_space(fleet, behavior.type, behavior.name, able or ()):
        what = "that it may wait for space, and end without it, is not followed"
        net.approximate(instance.node, Exactness.BOUNDED, what)
    if context.options.failures and any(role.on_loss is OnLoss.ASK for role in behavior.roles):
        what = "that an operator is asked when it loses something is not followed"
        net.approximate(instance.node, Exactness.BOUNDED, what)
    if instance.node in context.candidates:
        _outside_work(context, instance, asking_place(context, instance))
        if context.options.failures:
            lose_resources(context, instance)
        return choose_resources(context, instance, behavior)
    held = resources(context, behavior)
    if not held:
        return failing(context, instance, "RESOURCE_UNAVAILABLE", Flag.UNCAUGHT)
    if takes_from_pools(context, instance.node, behavior):
        _outside_work(context, instance, asking_place(context, instance))
        return take_named_resources(context, instance, behavior, held)
    _outside_work(context, instance)
    wants = net.place(
        instance.node, instance.outer, Role.ENTERING, f":wants{instance.inside.index}"
    )
    asks = Effect(consume=(wants,))
    begins = instance.begin()
    begun = replace(begins, consume=asks.consume)
    context.contended.append(Contender(instance, held, asks, lambda: [begun]))
    return [Effect(produce=(wants,))]


def translate_contention(context: TranslationContext) -> None:
    """A behavior begins when no other behavior holds its resources; else it fails at once."""
    net = context.net
    all_begins = [contender.begins() for contender in context.contended]  # all holders are known
    for contender, begins in zip(context.contended, all_begins, strict=True):
        instance = contender.instance
        holders = {n: r for r in contender.resources for n in net.holders.get(r, ())}
        free = Effect(
            steps=(Step(instance.node.id, Action.ENTERED, "commands"),),
            inhibit=frozenset(holders),
        )
        asked = contender.kind is Kind.JOIN
        behavior = behavior_of(instance.node)
        assert behavior is not None
        movers = movers_of(context, instance.node, contender.resources)
        no_room = without_room(context, instance, behavior, movers, awaited=asked)
        if asked:
            free = replace(free, steps=(_given(context, instance.node, behavior),))
            unheard = replace(contender.asks, inhibit=frozenset(holders))
            fails = failing(context, instance, REJECTED, Flag.UNCAUGHT)
            context.transitions(product(product([unheard], no_room), fails), Kind.JOIN)
        begun = product([free], begins)
        moved = begin_moving(context, instance, behavior, movers)
        context.transitions(product(begun, moved), contender.kind)
        if not asked:
            refused = Effect(produce=(refused_place(context, instance),)) if no_room else Effect()
            context.transitions(product(product(begun, no_room), [refused]))
        for holder, resource in holders.items():
            refused = Effect(
                read=frozenset({holder}),
                flag=Flag.CONFLICT,
                flagged=resource,
            )
            fails = failing(context, instance, "RESOURCE_UNAVAILABLE", Flag.CONFLICT)
            effects = product(product([contender.asks], [refused]), fails)
            context.transitions(effects, contender.kind)
        pools = pools_among(context, map(ResourceId, contender.resources))
        for place in kept_for_others(context, instance.outer, pools):
            kept = product([contender.asks], [Effect(read=frozenset({place}))])
            fails = failing(context, instance, UNAVAILABLE, Flag.UNCAUGHT)
            context.transitions(product(kept, fails), contender.kind)


def _given(context: TranslationContext, node: e.FlowNode, behavior: Behavior) -> Step:
    """The step in which a task that names its resources is given them."""
    roles = allocate(behavior, context.fleet).roles
    given = {role: [choices.Filling((each,)) for each in ids] for role, ids in roles.items()}
    return Step(node.id, Action.ALLOCATED, choices.written(given))


def _hold_us(behavior: Behavior) -> int | None:
    for parameter in behavior.parameters:
        if parameter.name == "duration" and isinstance(parameter.value, str):
            try:
                return round(quantity(parameter.value, Dimension.DURATION) * 1_000_000)
            except UnitError:
                return None
    return 0 if not any(p.name == "duration" for p in behavior.parameters) else None


def _ended(instance: ActivityInstance, effect: Effect) -> Effect:
    return effect.with_step(instance.node.id, Action.COMPLETED)


def _outside_work(
    context: TranslationContext, instance: ActivityInstance, asks: int | None = None
) -> list[Effect]:
    """A behavior or service call: it succeeds or fails when its report comes.

    `asks`: a place that has a token while the behavior has not begun.
    """
    net = context.net
    begun = Effect(inhibit=frozenset() if asks is None else frozenset({asks}))
    rejected: Effect | None = None
    if may_be_refused(context, instance):
        refused = refused_place(context, instance)
        rejected = replace(begun, consume=(instance.active,), read=frozenset({refused}))
        begun = replace(begun, inhibit=begun.inhibit | {refused})
    well = product([_ended(instance, instance.leave())], [begun])
    badly = replace(begun, consume=(instance.active,))
    if context.space is not None:
        well = product(well, [stop_moving(context, instance)])
    if rejected is not None:
        for effect in product([rejected], failing(context, instance, REJECTED, Flag.UNCAUGHT)):
            net.transition(effect, Kind.EXTERNAL, Trigger.FAILS, REJECTED)
    for key in context.data.written_anyhow(instance.node):
        well = context.data.write(well, key, None, instance.outer, instance.node)
    unasked = UNASKED if asks is not None and _goes_on(context, instance) else ""
    for effect in product(well, instance.done()):
        net.transition(effect, Kind.EXTERNAL, Trigger.SUCCEEDS, unasked)
    if context.options.failures:
        named = catchable(instance.outer, instance)
        other = _other_error(named)
        codes = dict.fromkeys((*named, other))
        if may_be_preempted(context.fleet, behavior_of(instance.node)):
            codes[PREEMPTED] = None
        for code in codes:
            failed = failing(context, instance, code, Flag.UNCAUGHT_FAILURE)
            kept = _kept_after(context, instance, code, is_any=code == other)
            for effect in product(kept, product([badly], failed)):
                net.transition(effect, Kind.EXTERNAL, Trigger.FAILS, code)
    return [instance.begin()]


def _other_error(named: Collection[str]) -> str:
    """Return a code that no event names: it represents all errors that none catches by its name."""
    known = (FAILED, LINK_LOST, REJECTED, BATTERY_LOW, TAKEN_OVER, UNAVAILABLE)
    return next((code for code in known if code not in named), "ERROR")


def _kept_after(
    context: TranslationContext, instance: ActivityInstance, code: str, *, is_any: bool
) -> list[Effect]:
    """Return what becomes of what a task keeps when it fails: it is kept, but for a loss.

    `is_any`: the code represents all errors that nothing catches by its name, losses among them.
    """
    behavior = behavior_of(instance.node)
    if not context.keeps or behavior is None or not behavior.roles:
        return [Effect()]
    gone = Effect(releases=frozenset({instance.inside.index}))
    if code == PREEMPTED:
        return [gone]
    if not all(role.on_loss is OnLoss.REASSIGN for role in behavior.roles):
        return [Effect()]
    if is_any or code in (FAILED, REJECTED):
        return [Effect(), gone]
    return [gone] if is_loss(behavior.type, None, code) else [Effect()]


def _goes_on(context: TranslationContext, instance: ActivityInstance) -> bool:
    """Whether a behavior that takes resources from pools keeps them until it is interrupted."""
    behavior = behavior_of(instance.node)
    assert behavior is not None
    roles = context.candidates.get(instance.node, ())
    chosen = [each for role in roles for each in role.resources]
    named = map(ResourceId, resources(context, behavior) or ()) if not roles else ()
    return goes_on(behavior, [*chosen, *named], context.options.catalogue)


def _user_task(
    context: TranslationContext, instance: ActivityInstance, node: e.UserTask
) -> list[Effect]:
    net = context.net
    assert node.prompt is not None
    prompt = node.prompt
    for decision in prompt.decisions:
        answered = [_ended(instance, instance.leave())]
        answered = context.data.write(
            answered, prompt.store, literal(decision.value), instance.outer, node
        )
        for effect in product(answered, instance.done()):
            net.transition(effect, Kind.EXTERNAL, Trigger.ANSWER, decision.value)
    if prompt.timeout is not None:
        late = Effect(consume=(instance.active,))
        made = [
            net.transition(effect, Kind.EXTERNAL, Trigger.TIMER, due_us=due_us(prompt.timeout))
            for effect in product(
                [late], failing(context, instance, "PROMPT_TIMEOUT", Flag.UNCAUGHT_FAILURE)
            )
        ]
        runs(context, instance.active, written(prompt.timeout), (instance.active,), made)
    return [instance.begin()]


def _script(
    context: TranslationContext, instance: ActivityInstance, node: e.ScriptTask
) -> list[Effect]:
    ways = [Effect()]
    unable: list[Effect] = []
    thrown = ""
    for statement in node.script.statements if node.script is not None else ():
        if not isinstance(statement, Assignment):
            thrown = statement.code
            break
        if context.data.is_blurred(statement.key):
            context.net.approximate(
                node, Exactness.MORE, f"'{statement.key}' has more values than are distinguished"
            )
        ways = context.data.write(
            ways, statement.key, statement.expression, instance.outer, node, unable=unable
        )
    over = failing(context, instance, thrown, Flag.UNCAUGHT) if thrown else _at_once(instance)
    if not unable:
        return product(ways, over)
    wrong = failing(context, instance, "EXPRESSION", Flag.UNCAUGHT)
    return [*product(ways, over), *product(unable, wrong)]


def _send(context: TranslationContext, instance: ActivityInstance, message: str) -> list[Effect]:
    """A send task throws after it was entered and before it leaves: its catchers are
    known by then.
    """
    thrown = context.net.place(
        instance.node, instance.outer, Role.ENTERING, f":sends{instance.inside.index}"
    )

    def translate_later() -> None:
        sends = Effect(steps=(Step(instance.node.id, Action.THROWN, message),), consume=(thrown,))
        over = Effect(reset_scopes=frozenset({instance.inside.index}))
        around = interrupting_places(context, "message", message, instance.outer)
        ended, gone_on = split_by_places(
            product([sends], message_effects(context, message)), around
        )
        ended += [
            replace(sends, produce=(catcher.caught,))
            for catcher in context.messages.get(message, ())
            if catcher.waiting == thrown and not catcher.keeps
        ]
        context.transitions(ended)
        context.transitions(product(product(gone_on, [over]), _at_once(instance)))

    context.later.append(translate_later)
    return [Effect(produce=(thrown,))]


def _receive(
    context: TranslationContext, instance: ActivityInstance, node: e.ReceiveTask
) -> list[Effect]:
    caught = context.net.place(node, instance.outer, Role.TRIGGERED, f":{instance.inside.index}")
    assert node.message is not None
    register_catcher(context, "message", node.message.id, instance.active, caught, False, node)
    stop = Effect(consume=(caught,), reset_scopes=frozenset({instance.inside.index}))
    come = context.data.receive([_ended(instance, stop)], instance.outer, node)
    context.transitions(product(come, instance.done()))
    return [instance.begin()]
