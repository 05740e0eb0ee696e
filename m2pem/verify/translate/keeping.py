"""What a run keeps between its tasks (`m2pem.engine.keeping`), and where tasks take resources from.

A scope has a place *kept* for each pool of which a role keeps something until the scope ends: a
token for each resource that is kept and that no task has. Tasks in the scope take from there as
well as from the pool, and give back what they took from there. When the scope ends, its tokens go
to the pool. So resources of a pool remain interchangeable: how many of them are kept by which scope
is all that the net distinguishes.

A task that the same token may execute again keeps what it has now in place of what it had before:
each of its roles has a place *keeps* of its own, beside those of its scope.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior, Keep
from m2pem.mission.behavior import Role as BehaviorRole
from m2pem.mission.reachability import following, reach
from m2pem.verify.net.petri_net import Action, Exactness, Role, Step
from m2pem.verify.translate.compensation import container_of
from m2pem.verify.translate.context import ActivityInstance, Source, TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, is_join
from m2pem.verify.translate.order import forks
from m2pem.verify.translate.pools import Pool, RoleCandidates


def keep_of(role: BehaviorRole) -> Keep | None:
    """Return until when a role keeps what fills it after its task; None: no longer."""
    return role.keep if role.keep in (Keep.PROCESS, Keep.SUBPROCESS) else None


def translate_keeping(
    context: TranslationContext, instance: ActivityInstance, roles: Sequence[RoleCandidates]
) -> None:
    """Make the places of what the roles of a task keep."""
    for each in roles:
        keep = keep_of(each.role)
        if keep is None:
            continue
        until = _until(instance.outer, keep)
        for pool in dict.fromkeys(context.pool_of[resource] for resource in each.resources):
            _kept_place(context, until, pool, instance.node)
            if _may_execute_again(instance.node):
                _own_place(context, instance, each.role.name, until, pool)
        _note_approximations(context, instance)


def _note_approximations(context: TranslationContext, instance: ActivityInstance) -> None:
    def bounded(what: str) -> None:
        context.net.approximate(instance.node, Exactness.BOUNDED, what)

    if _may_execute_again(instance.node) and _other_tokens_may_come(instance.node):
        bounded("what it keeps goes when it is executed again, also by another token")
    if instance.outer.several:
        bounded("several tokens on it keep what one of them has")
    if context.fleet.preemption:
        bounded("that another run takes what it keeps between tasks is not followed")
    if instance.node.for_compensation:
        bounded("what a compensation keeps is free only when what is around it has ended")
    if context.space is not None:
        what = "which of the vehicles that stand apart is the one that it keeps is not followed"
        context.net.approximate(instance.node, Exactness.MORE, what)


def _until(scope: ScopeDraft, keep: Keep) -> ScopeDraft:
    """Return the scope with whose end the keeping ends, as the engine does."""
    here = scope
    while here.parent is not None:
        container = container_of(here)
        if container is not None and (keep is Keep.SUBPROCESS or isinstance(container, e.Process)):
            return here
        here = here.parent
    return here


def _kept_place(
    context: TranslationContext, until: ScopeDraft, pool: Pool, keeper: e.FlowNode
) -> int:
    place = _place(context, until.element, until, pool, ":kept ", context.pool_place(pool))
    places = context.net.places
    places[place] = replace(
        places[place],
        keepers=tuple(dict.fromkeys((*places[place].keepers, keeper.id))),
        until=until.element.id,
    )
    sources = context.kept.setdefault(pool, [])
    if all(each.place != place for each in sources):
        sources.append(Source(place, until))
    return place


def _own_place(
    context: TranslationContext,
    instance: ActivityInstance,
    role: str,
    until: ScopeDraft,
    pool: Pool,
) -> int:
    """Return the place of what a role of a task keeps until it is executed again."""
    scope, node = instance.outer, instance.node
    kept = context.pool_place(pool)
    if scope is not until:  # then no token comes again for which it would be let go
        kept = _kept_place(context, until, pool, node)
    place = _place(context, node, scope, pool, f":keeps {role} ", kept)
    context.net.places[place] = replace(
        context.net.places[place], keepers=(node.id,), until=until.element.id
    )
    sources = context.kept.setdefault(pool, [])
    if all(each.place != place for each in sources):
        sources.append(Source(place, until, (instance, role)))
    return place


def _place(
    context: TranslationContext,
    element: e.Element,
    scope: ScopeDraft,
    pool: Pool,
    what: str,
    returns: int,
) -> int:
    place = context.net.place(
        element,
        scope,
        Role.CONTROL,
        f"{what}{'|'.join(pool)}",
        several=len(pool) > 1,
        returns=(returns,),
    )
    context.net.places[place] = replace(context.net.places[place], kept=pool)
    return place


# --- who executes a task again --------------------------------------------------------------------


def _may_execute_again(node: e.Activity) -> bool:
    """Whether the same token may execute a task again. Each instance of a loop has its own."""
    return node.loop is None and node in _after(node)


def _other_tokens_may_come(node: e.Activity) -> bool:
    """Whether the token may be another one then."""
    between = {each for each in _after(node) if node in _after(each)}
    return any(forks(each) or is_join(each) for each in between)


def _after(node: e.FlowNode) -> set[e.FlowNode]:
    return reach(following(node))


# --- what tasks take, and where it goes -----------------------------------------------------------


def sources(context: TranslationContext, scope: ScopeDraft, pool: Pool) -> list[Source]:
    """Return where a task in a scope takes resources of a pool from. All tasks are known then."""
    kept = context.kept.get(pool, ())
    around = _around(scope) if kept else []
    return [Source(context.pool_place(pool)), *(each for each in kept if each.until in around)]


def kept_for_others(
    context: TranslationContext, scope: ScopeDraft, pools: Sequence[Pool]
) -> list[int]:
    """Return the places of what tasks in a scope may not have."""
    return [
        each.place
        for pool in pools
        for each in context.kept.get(pool, ())
        if each.until not in _around(scope)
    ]


def _around(scope: ScopeDraft | None) -> list[ScopeDraft]:
    """The scope, and those around it."""
    found: list[ScopeDraft] = []
    while scope is not None:
        found.append(scope)
        scope = scope.parent
    return found


def goes_to(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    role: BehaviorRole,
    pool: Pool,
    source: Source,
) -> int:
    """Return where what fills a role goes when its task ends."""
    free, keep = context.pool_place(pool), keep_of(role)
    before = ""  # the role of the same task that had it when it was executed before
    if source.keeper is not None and source.keeper[0] is instance:
        before = source.keeper[1]
    if before not in ("", role.name):  # that role keeps something else now
        names = [each.name for each in behavior.roles]
        if keep is None or names.index(role.name) < names.index(before):
            return free
    elif role.keep is Keep.TASK:
        return free
    elif keep is None:
        return source.place
    until = _until(instance.outer, keep)
    if not before and source.until in _around(until):
        return source.place
    if _may_execute_again(instance.node):
        return _own_place(context, instance, role.name, until, pool)
    return _kept_place(context, until, pool, instance.node)


def lets_go(context: TranslationContext, instance: ActivityInstance) -> frozenset[int]:
    """Return the places of what a task keeps no longer when it is executed again."""
    return frozenset(
        each.place
        for kept in context.kept.values()
        for each in kept
        if each.keeper is not None and each.keeper[0] is instance
    )


def holds_place(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    what: str,
    resources: tuple[str, ...],
    returns: tuple[int, ...],
) -> int:
    """Return the place of resources that a task has. `returns`: where they go when it ends.

    What another task keeps for itself may be kept no longer meanwhile: then the token goes to a
    place of the same resources that gives them back elsewhere.
    """
    net = context.net
    places = [net.places[place] for place in returns]
    kept = [f"{place.name}" for place in places if place.kept]
    name = f":holds {what}" + (f", of {' and '.join(kept)}" if kept else "")
    place = net.place(
        instance.node,
        instance.inside,
        Role.CONTROL,
        name,
        resources=resources,
        behavior=behavior.name,
        returns=returns,
        holder=instance.active,
    )
    options = [list(_otherwise(context, each)) for each in returns]
    for other in product(*options):
        if other != returns and (place, other) not in net.same_holding:
            net.same_holding[place, other] = holds_place(
                context, instance, behavior, what, resources, other
            )
    return place


def _otherwise(context: TranslationContext, place: int) -> Iterator[int]:
    """Yield a place to which a resource goes that a task has, and those to which it may go if it is
    kept otherwise meanwhile."""
    yield place
    for pool, kept in context.kept.items():
        if any(each.place == place and each.keeper is not None for each in kept):
            around = context.net.places[place].returns[0]
            yield from dict.fromkeys((around, context.pool_place(pool)))


# --- the end of the process -----------------------------------------------------------------------


def release_at_the_end(context: TranslationContext) -> None:
    """Keep nothing more until the end of the process that the run began with, when nothing is left
    in it, though other processes go on."""
    kept = [n for n in context.root.places if context.net.places[n].kept]
    for place in kept:
        over = Effect(
            steps=(Step(context.process.id, Action.RELEASED),),
            read=frozenset({place}),
            empty_scopes=frozenset({context.root.index}),
            reset=frozenset(kept),
        )
        context.net.transition(over)
