"""Which resources may fill the roles of a task that asks for some.

A choice says how many resources of which pool fill each role. Resources of a pool are alike, so
which of them it is does not matter.
"""

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from m2pem.fleet.facts import vehicle_of
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value
from m2pem.verify.translate.context import ActivityInstance, TranslationContext
from m2pem.verify.translate.data import boxes
from m2pem.verify.translate.pools import Pool, RoleCandidates

Amounts = Mapping[Pool, int]
"""How many resources of each pool."""


def pools_among(context: TranslationContext, resources: Iterable[ResourceId]) -> tuple[Pool, ...]:
    """Return the pools of some resources."""
    pools = (context.pool_of.get(each) for each in resources)
    return tuple(dict.fromkeys(pool for pool in pools if pool is not None))


@dataclass(frozen=True, slots=True)
class RoleFilling:
    """A role, how many of which pool fill it, and what could."""

    role: RoleCandidates
    amounts: Amounts
    offered: Sequence[Pool]

    @property
    def count(self) -> int:
        return sum(self.amounts.values())


@dataclass(frozen=True, slots=True)
class RoleChoices:
    """A choice for all roles of a task."""

    filled: tuple[RoleFilling, ...]

    @property
    def total(self) -> Counter[Pool]:
        total: Counter[Pool] = Counter()
        for each in self.filled:
            total.update(each.amounts)
        return total

    @property
    def possible(self) -> bool:
        """Whether the pools have so many."""
        return all(count <= len(pool) for pool, count in self.total.items())


def role_cases(
    context: TranslationContext, instance: ActivityInstance, roles: Sequence[RoleCandidates]
) -> Iterator[tuple[dict[int, frozenset[int]], tuple[tuple[ResourceId, ...], ...]]]:
    """Yield, by the values of data that roles read with `same`, what may fill each role."""
    followed = {}
    for each in roles:
        name = each.role.need.same if each.role.need is not None else ""
        known = context.data.values_of(name, instance.outer, instance.node) if name else None
        if known is not None:
            followed[name] = known
    ranges = [range(len(values)) for _, values in followed.values()]
    alike: dict[tuple[tuple[ResourceId, ...], ...], list[tuple[int, ...]]] = {}
    for combination in itertools.product(*ranges):
        context.net.size_limit.count_case(instance.node.id)
        values = {
            name: known[number]
            for (name, (_, known)), number in zip(followed.items(), combination, strict=True)
        }
        offered = tuple(_same(context.fleet, each, values) for each in roles)
        alike.setdefault(offered, []).append(combination)
    variables = [variable for variable, _ in followed.values()]
    for offered, combinations in alike.items():
        for box in boxes(combinations, [len(each) for each in ranges]):
            yield dict(zip(variables, box, strict=True)), offered


def _same(
    fleet: Fleet, each: RoleCandidates, values: Mapping[str, tuple[Value, bool]]
) -> tuple[ResourceId, ...]:
    """What may fill a role beside the values of data, of which each is exact or stands for many."""
    name = each.role.need.same if each.role.need is not None else ""
    value, exact = values.get(name, (None, False))
    if not exact:
        return each.resources
    chosen = value if isinstance(value, list) else [value]
    return tuple(r for r in each.resources if r in chosen or vehicle_of(fleet, r).id in chosen)


def role_choices(
    context: TranslationContext,
    instance: ActivityInstance,
    roles: Sequence[RoleCandidates],
    offered: Sequence[tuple[ResourceId, ...]],
    *,
    fewest: bool,
) -> Iterator[RoleChoices]:
    """Yield all choices for the roles of a task. `fewest`: with no more resources than it needs."""
    ways = [
        list(_fillings(context, role, resources, fewest=fewest))
        for role, resources in zip(roles, offered, strict=True)
    ]
    for filled in itertools.product(*ways):
        context.net.size_limit.count_case(instance.node.id)
        choice = RoleChoices(filled)
        if choice.possible:
            yield choice


def _fillings(
    context: TranslationContext,
    each: RoleCandidates,
    resources: Sequence[ResourceId],
    *,
    fewest: bool,
) -> Iterator[RoleFilling]:
    least = least_of(each)
    pools = pools_among(context, resources)
    if each.named:
        if len(resources) == least:
            yield RoleFilling(each, dict.fromkeys(pools, 1), pools)
        return
    need = each.role.need
    most = least if fewest or need is None else need.most
    for count in range(least, min(most, sum(map(len, pools))) + 1):
        for amounts in _spread(pools, count):
            yield RoleFilling(each, amounts, pools)


def _spread(pools: Sequence[Pool], count: int) -> Iterator[dict[Pool, int]]:
    """Yield every way to take a number of resources from pools."""
    if not pools:
        if not count:
            yield {}
        return
    first, *others = pools
    for taken in range(min(count, len(first)), -1, -1):
        for rest in _spread(others, count - taken):
            yield {first: taken, **rest} if taken else rest


def least_of(each: RoleCandidates) -> int:
    """Return how many resources a role needs at least."""
    if each.named:
        return max(1, len(each.resources)) if not each.role.optional else len(each.resources)
    need = each.role.need
    return 0 if each.role.optional or need is None else need.least
