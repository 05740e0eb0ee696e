"""Tasks whose resources come from pools: they are chosen, or waited for, when the task starts.

The token of such a task is on its activity as soon as it is entered, so that its boundary events
can end it while it waits. Until it has its resources, a token on its place *asks* prevents its work
from ending. A choice takes a token from the pools, and puts one on a place *holds*; whatever resets
that place gives it back (`NetBuilder.finish`). Both places are in the activity's own scope. What
the run keeps between tasks is taken as what is free is (`keeping`).

The allocator decides when the engine has nothing left to do; so choices, and refusals, wait until
nothing else can move, as joins do. Which of the resources that may fill a role the executive takes
depends on telemetry: each is a transition.
"""

import itertools
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.mission.behavior import Behavior, OnLoss
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.losses import REJECTED, UNAVAILABLE
from m2pem.mission.values import Value
from m2pem.units import US_PER_S
from m2pem.verify.net import choices
from m2pem.verify.net.petri_net import (
    REASSIGNED,
    Action,
    Exactness,
    Flag,
    Kind,
    Role,
    Step,
    Trigger,
)
from m2pem.verify.translate.context import (
    ActivityInstance,
    Asking,
    Contender,
    Source,
    TranslationContext,
)
from m2pem.verify.translate.data import constant
from m2pem.verify.translate.keeping import (
    goes_to,
    holds_place,
    lets_go,
    sources,
    translate_keeping,
)
from m2pem.verify.translate.moving import (
    asks_for_space,
    begin_moving,
    movers_of,
    refused_place,
    without_room,
)
from m2pem.verify.translate.net_builder import Effect, product
from m2pem.verify.translate.pools import Pool, RoleCandidates
from m2pem.verify.translate.role_choices import (
    RoleChoices,
    RoleFilling,
    least_of,
    pools_among,
    role_cases,
    role_choices,
)
from m2pem.verify.translate.throwing import failing
from m2pem.verify.translate.timers import due_us, runs, written
from m2pem.verify.translate.waiting_order import (
    may_take,
    not_kept,
    refusals_by_kept,
    served_before,
)


def asking_place(context: TranslationContext, instance: ActivityInstance) -> int:
    """Return the place of a token while a task asks for its resources."""
    return context.net.place(instance.node, instance.inside, Role.CONTROL, ":asks")


# --- tasks that name their resources --------------------------------------------------------------


def take_named_resources(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    resources: Sequence[str],
) -> list[Effect]:
    """Translate a task that names its resources, of which another task may choose some."""
    asks = asking_place(context, instance)
    named = tuple(map(ResourceId, resources))
    pools = pools_among(context, named)

    def begins() -> list[Effect]:
        ways = itertools.product(*(sources(context, instance.outer, pool) for pool in pools))
        return [
            Effect(
                consume=(asks, *(source.place for source in way)),
                produce=(
                    _holds_named(
                        context, instance, behavior, named, tuple(source.place for source in way)
                    ),
                ),
            )
            for way in ways
        ]

    refused = Effect(consume=(asks, instance.active))
    kind = Kind.INTERNAL
    if asks_for_space(context, instance.node):
        kind = Kind.JOIN
        wait_for_space(context, instance)
        _note_kept_while_it_waits_for_space(context, instance, named)
    context.contended.append(Contender(instance, named, refused, begins, kind))
    return [instance.begin().and_then(Effect(produce=(asks,)))]


def _holds_named(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    named: Sequence[ResourceId],
    returns: tuple[int, ...],
) -> int:
    """`returns`: by pool of what it names, where that goes when the task ends."""
    return holds_place(context, instance, behavior, "+".join(named), tuple(named), returns)


# --- tasks whose resources are chosen -------------------------------------------------------------


def choose_resources(
    context: TranslationContext, instance: ActivityInstance, behavior: Behavior
) -> list[Effect]:
    """Translate a task that asks for resources: what it may be given, and how it ends without."""
    roles = context.candidates[instance.node]
    asks = asking_place(context, instance)
    waits = any(each.role.need is not None and each.role.need.waits for each in roles)
    cases = list(role_cases(context, instance, roles))
    asking = _asking(context, instance, roles, cases, waits=waits)
    context.asking.append(asking)
    _note_approximations(context, asking, roles, waits=waits)
    translate_keeping(context, instance, roles)
    asks_space = asks_for_space(context, instance.node)
    if waits:
        _wait_limit(context, instance, roles)
    elif asks_space:
        wait_for_space(context, instance)

    def translate_later() -> None:
        for guard, offered in cases:
            when = Effect(guard=guard)
            for choice, taken in _takings(context, instance, behavior, roles, offered):
                given = product([when], _given(context, asking, behavior, choice, taken))
                movers = movers_of(context, instance.node, (), choice.total)
                moved = begin_moving(context, instance, behavior, movers)
                context.transitions(product(given, moved), Kind.JOIN)
                no_room = without_room(context, instance, behavior, movers, awaited=asks_space)
                if asks_space:
                    offered_to = product([when], [_not_taken(context, instance, taken)])
                    fails = failing(context, instance, REJECTED, Flag.UNCAUGHT)
                    refused = product(product(offered_to, no_room), fails)
                else:
                    rejected = Effect(produce=(refused_place(context, instance),))
                    refused = product(given, product(no_room, [rejected])) if no_room else []
                context.transitions(refused, Kind.JOIN)
            if not waits:
                fewest = role_choices(context, instance, roles, offered, fewest=True)
                for limits in _refusals([each.total for each in fewest]):
                    refused = product([when], _refused(context, asking, limits))
                    fails = failing(context, instance, UNAVAILABLE, Flag.UNCAUGHT)
                    context.transitions(product(refused, fails), Kind.JOIN)

    context.later.append(translate_later)
    return [instance.begin().and_then(Effect(produce=(asks,)))]


def lose_resources(context: TranslationContext, instance: ActivityInstance) -> None:
    """Translate the loss of a behavior whose rest another is to do: the task asks again.

    Once for each time that the task is executed: what was lost is free at once in the net, so that
    more would go on for ever. Errors of losses are translated as of all behaviors: that no other
    could do the rest.
    """
    if not any(each.role.on_loss is OnLoss.REASSIGN for each in context.candidates[instance.node]):
        return
    asks = asking_place(context, instance)
    once = context.net.place(instance.node, instance.inside, Role.CONTROL, ":reassigned")
    effect = Effect(
        steps=(Step(instance.node.id, Action.THROWN),),
        read=frozenset({instance.active}),
        inhibit=frozenset({asks, once}),
        reset_scopes=frozenset({instance.inside.index}),
        releases=frozenset({instance.inside.index}),
        produce=(asks, once),
    )
    context.net.transition(effect, Kind.EXTERNAL, Trigger.FAILS, REASSIGNED)
    context.net.approximate(
        instance.node,
        Exactness.BOUNDED,
        "that what it lost is reassigned is followed once, to any that fills the role",
    )


def _asking(
    context: TranslationContext,
    instance: ActivityInstance,
    roles: Sequence[RoleCandidates],
    cases: Sequence[tuple[object, Sequence[tuple[ResourceId, ...]]]],
    *,
    waits: bool,
) -> Asking:
    """Return who asks. Only of a task that needs one resource, whatever telemetry and data are, it
    is known that it gets one as soon as one is free.
    """
    pools = pools_among(context, (resource for each in roles for resource in each.resources))
    asks, least = asking_place(context, instance), sum(map(least_of, roles))
    asks_space, several = asks_for_space(context, instance.node), instance.inside.several
    urgent = len(cases) == 1 and not several and not asks_space  # what it needs may have no room
    urgent = urgent and len(roles) == 1 and least_of(roles[0]) == 1 and not roles[0].unknown
    totals: list[Counter[Pool]] = []
    if waits and least > 1 and not several and not asks_space:
        for _, offered in cases:
            fewest = role_choices(context, instance, roles, offered, fewest=True)
            totals += [each.total for each in fewest]
    needed = {pools_among(context, each.resources) for each in roles if least_of(each)}
    named = any(each.named for each in roles)
    return Asking(
        asks,
        instance,
        _priority(roles),
        frozenset(pools),
        urgent,
        waits,
        least,
        tuple(totals),
        any_will_do=len(cases) == 1 and len(needed) == 1 and not named,
    )


def _priority(roles: Sequence[RoleCandidates]) -> int:
    return max((each.role.need.priority for each in roles if each.role.need is not None), default=0)


def _note_approximations(
    context: TranslationContext,
    asking: Asking,
    roles: Sequence[RoleCandidates],
    *,
    waits: bool,
) -> None:
    instance = asking.instance

    def bounded(what: str) -> None:
        context.net.approximate(instance.node, Exactness.BOUNDED, what)

    for each in roles:
        if each.unknown:
            names = ", ".join(sorted(each.unknown))
            bounded(f"role '{each.role.name}': what depends on {names} is taken to hold")
        same = each.role.need.same if each.role.need is not None else ""
        if same and context.data.values_of(same, instance.outer, instance.node) is None:
            bounded(f"role '{each.role.name}': '{same}' is not followed, so it may be any resource")
    others = [other for other in context.candidates if other is not instance.node]
    if waits and asking.least > 1 and others and not asking.totals:
        bounded("that it keeps what is free, while it waits for the rest, is not followed")
    if asks_for_space(context, instance.node):
        able = [resource for each in roles for resource in each.resources]
        _note_kept_while_it_waits_for_space(context, instance, able)
    if instance.inside.several:
        bounded("of several tokens on it, one has resources at a time")


def _note_kept_while_it_waits_for_space(
    context: TranslationContext, instance: ActivityInstance, resources: Collection[ResourceId]
) -> None:
    """`resources`: that it may have. Tasks that name theirs and do not wait get them anyway."""
    others = (roles for node, roles in context.candidates.items() if node is not instance.node)
    wanted = (each.resources for roles in others for each in roles)
    if any(not set(resources).isdisjoint(each) for each in wanted):
        what = "that later tasks do not get its vehicle, while it waits for space, is not followed"
        context.net.approximate(instance.node, Exactness.BOUNDED, what)


# --- what a task is given -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Taken:
    """A resource of a pool that fills a role, and the place it is taken from. `returns`: where it
    goes when the task ends."""

    role: RoleCandidates
    pool: Pool
    source: Source
    returns: int


def _takings(
    context: TranslationContext,
    instance: ActivityInstance,
    behavior: Behavior,
    roles: Sequence[RoleCandidates],
    offered: Sequence[tuple[ResourceId, ...]],
) -> Iterator[tuple[RoleChoices, Sequence[_Taken]]]:
    """Yield all choices for the roles of a task, with where each resource is taken from."""
    for choice in role_choices(context, instance, roles, offered, fewest=False):
        ways = [
            itertools.combinations_with_replacement(
                [
                    _Taken(
                        each.role,
                        pool,
                        source,
                        goes_to(context, instance, behavior, each.role.role, pool, source),
                    )
                    for source in sources(context, instance.outer, pool)
                ],
                count,
            )
            for each in choice.filled
            for pool, count in each.amounts.items()
        ]
        for way in itertools.product(*ways):
            context.net.size_limit.count_case(instance.node.id)
            yield choice, [taken for some in way for taken in some]


def _given(
    context: TranslationContext,
    asking: Asking,
    behavior: Behavior,
    choice: RoleChoices,
    taken: Sequence[_Taken],
) -> list[Effect]:
    """A task is given resources, and begins its behavior."""
    instance = asking.instance
    chosen = Counter((each.pool, each.returns) for each in taken if not each.role.named)
    holds = [
        holds_place(
            context,
            instance,
            behavior,
            f"{number + 1} of {'|'.join(pool)}",
            pool if len(pool) == 1 else (),
            (returns,),
        )
        for (pool, returns), count in chosen.items()
        for number in range(count)
    ]
    named = [r for each in choice.filled if each.role.named for r in each.role.resources]
    if named:
        returns_of = {each.pool: each.returns for each in taken if each.role.named}
        returns = tuple(returns_of[pool] for pool in pools_among(context, named))
        holds.append(_holds_named(context, instance, behavior, named, returns))
    fillings: dict[str, list[choices.Filling]] = {}
    for each in taken:
        until = each.source.until.element.id if each.source.until is not None else ""
        filling = choices.Filling(each.pool, until)
        fillings.setdefault(each.role.role.name, []).append(filling)
    begins = Effect(
        steps=(Step(instance.node.id, Action.ALLOCATED, choices.written(fillings)),),
        consume=(asking.place, *(each.source.place for each in taken)),
        inhibit=served_before(context, asking, {each.source.place: each.pool for each in taken})
        | frozenset(holds if instance.inside.several else ()),
        lets_go=lets_go(context, instance),
        produce=tuple(holds),
    )
    counts = Counter(each.source.place for each in taken)
    effects = product([begins], _no_more(context, asking, choice, counts))
    effects = product(effects, not_kept(context, asking, counts))
    for filled in choice.filled:
        need = filled.role.role.need
        if need is not None and need.store and filled.count:
            value = _stored_value(filled, one=need.most == 1)
            source = None if value is None else constant(value)
            effects = context.data.write(effects, need.store, source, instance.outer, instance.node)
    return effects


def _no_more(
    context: TranslationContext,
    asking: Asking,
    choice: RoleChoices,
    counts: Mapping[int, int],
) -> list[Effect]:
    """Return when a choice may leave a role with fewer than it can have: no more are free, or
    another task asks for them at the same time. `counts`: how many it takes, by place.
    """
    wanting: dict[Pool, None] = {}
    for each in choice.filled:
        need = each.role.role.need
        if not each.role.named and need is not None and each.count < need.most:
            wanting.update(dict.fromkeys(each.offered))
    if not wanting:
        return [Effect()]
    places = may_take(context, asking, wanting)
    rest = Effect(at_most=tuple((place, counts.get(place, 0)) for place in sorted(places)))
    others = [
        each.place
        for each in context.asking
        if each.place != asking.place and not may_take(context, each, wanting).isdisjoint(places)
    ]
    return [rest, *(Effect(read=frozenset({place})) for place in others)]


def _stored_value(each: RoleFilling, *, one: bool) -> Value | None:
    """What a role stores; None: which of a pool is not known."""
    if any(len(pool) > 1 for pool in each.amounts):
        return None
    chosen = {pool[0] for pool in each.amounts}
    ordered: list[Value] = [r for r in each.role.resources if r in chosen]
    return ordered[0] if one else ordered


# --- without resources ----------------------------------------------------------------------------


def _refusals(fewest: Sequence[Counter[Pool]]) -> list[dict[Pool, int]]:
    """Return how many of which pools are free at most when no choice is possible, for each way.

    `fewest`: what those choices take that take no more than the task needs.
    """
    found: list[dict[Pool, int]] = [{}]
    for total in fewest:
        extended: list[tuple[dict[Pool, int], bool]] = []  # with whether they are new
        for limits in found:
            if any(limits.get(pool, count) < count for pool, count in total.items()):
                extended.append((limits, False))
                continue
            extended += [({**limits, pool: count - 1}, True) for pool, count in total.items()]
        # Those of before cover none another, and new ones, which are narrower, cover none of them.
        found = [
            each
            for number, (each, new) in enumerate(extended)
            if not new
            or not any(
                _covers(other, each) and (other != each or at < number)
                for at, (other, _) in enumerate(extended)
                if at != number
            )
        ]
    return found


def _covers(one: Mapping[Pool, int], other: Mapping[Pool, int]) -> bool:
    """Whether limits hold wherever others do."""
    return all(pool in other and other[pool] <= count for pool, count in one.items())


def _refused(
    context: TranslationContext, asking: Asking, limits: Mapping[Pool, int]
) -> list[Effect]:
    """A task gets nothing: no more than that is free which is not kept by tasks before it."""
    instance = asking.instance
    found: list[Effect] = []
    for when, kept in [(Effect(), {}), *refusals_by_kept(context, asking)]:
        ways: list[dict[int, int]] = [{}]
        for pool, most in limits.items():
            places = [
                source.place
                for source in sources(context, instance.outer, pool)
                if kept.get(source.place, 0) < len(pool)
            ]
            ways = [
                {**way, **{p: kept.get(p, 0) + shared.count(p) for p in places}}
                for way in ways
                for shared in itertools.combinations_with_replacement(places, most if places else 0)
            ]
        found += [
            replace(
                when,
                steps=(Step(instance.node.id, Action.ALLOCATED),),
                consume=(asking.place, instance.active),
                inhibit=frozenset(place for place, count in way.items() if not count),
                at_most=tuple((place, count) for place, count in way.items() if count),
            )
            for way in ways
        ]
    return found


def _not_taken(
    context: TranslationContext, instance: ActivityInstance, taken: Sequence[_Taken]
) -> Effect:
    """A task could be given what a choice says, and gets nothing."""
    free = tuple(each.source.place for each in taken)
    asks = asking_place(context, instance)
    return Effect(consume=(asks, instance.active, *free), produce=free)


def wait_for_space(context: TranslationContext, instance: ActivityInstance) -> None:
    """Translate the end of the wait of a task whose roles do not say how long it waits."""
    plan = context.space
    assert plan is not None
    if not plan.moves(instance.node):
        return
    asks = asking_place(context, instance)
    late = Effect(consume=(instance.active,), read=frozenset({asks}))
    due = round(plan.wait_s() * US_PER_S)
    for effect in product([late], failing(context, instance, UNAVAILABLE, Flag.UNCAUGHT_FAILURE)):
        context.net.transition(effect, Kind.EXTERNAL, Trigger.TIMER, due_us=due)


def _wait_limit(
    context: TranslationContext, instance: ActivityInstance, roles: Sequence[RoleCandidates]
) -> None:
    """A task has waited for its resources as long as it may."""
    limits = [
        each.role.need.wait_limit
        for each in roles
        if each.role.need is not None and each.role.need.wait_limit is not None
    ]
    if not limits:
        return
    asks = asking_place(context, instance)
    late = Effect(consume=(instance.active,), read=frozenset({asks}))
    due = [due_us(each) for each in limits]
    fixed = [written(each) for each in limits]
    made = [
        context.net.transition(effect, Kind.EXTERNAL, Trigger.TIMER, due_us=_first(due))
        for effect in product(
            [late], failing(context, instance, UNAVAILABLE, Flag.UNCAUGHT_FAILURE)
        )
    ]
    runs(context, instance.active, _first(fixed), (asks,), made)


def _first(times: Sequence[int | None]) -> int | None:
    known = [each for each in times if each is not None]
    return min(known) if len(known) == len(times) else None
