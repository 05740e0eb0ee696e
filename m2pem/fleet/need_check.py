"""The static check of roles by need: whether the fleet can fill them (docs/allocation.md)."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import TypeAlias

import rustworkx

from m2pem.errors import ExpressionError
from m2pem.findings import Severity
from m2pem.fleet.allocation import resources_of, roles_of_mission
from m2pem.fleet.facts import Fit, fits, fleet_facts, preference_s
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.graph import ResourceGraph
from m2pem.fleet.space import waits_for_space
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import Behavior, BehaviorType, OnLoss, Role, RoleKind
from m2pem.mission.candidate_facts import CANDIDATE_FACTS, FACT_TYPES, FLEET_FACTS, is_fact
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression.literals import describe
from m2pem.mission.expression.tree import Compare, In, Literal, Name, walk
from m2pem.mission.mission import Mission
from m2pem.suggestions import did_you_mean

NAMED = 6
"""Candidates that a finding names; it counts the others."""

SOLVER = "scipy"
"""The package that chooses; it is an extra of m2pem, as missions without such roles need it not."""


KnownFits: TypeAlias = dict[tuple[object, ...], list[Fit]]
"""What may fill roles that ask for the same, as it was found before."""


def check_needs(
    behavior: Behavior,
    mission: Mission,
    fleet: Fleet,
    graph: ResourceGraph,
    findings: TaskFindings,
    known: KnownFits | None = None,
) -> dict[str, tuple[ResourceId, ...]]:
    """Check the roles of a behavior that are filled when it starts.

    Returns what may fill each role by need that is right, by the role's name. `known`: is kept from
    task to task of a mission.
    """
    known = {} if known is None else known
    by_need = [role for role in behavior.roles if role.need is not None]
    if (by_need or waits_for_space(fleet)) and find_spec(SOLVER) is None:
        findings.add(
            "no-solver",
            "choosing resources, or waiting for space, needs the package scipy, which is not "
            "installed",
            "pip install 'm2pem[allocation]'",
            line=behavior.line,
        )
    possible: dict[str, tuple[ResourceId, ...]] = {}
    for role in by_need:
        if role.resource:
            continue
        if not _check_facts(role, findings):
            continue
        _check_count(behavior, role, findings)
        try:
            found = _fits(behavior, role, fleet, graph, known)
        except ExpressionError as error:
            _wrong_type(role, f"requires: {error}", findings)
            continue
        able = tuple(fit.resource for fit in found if not fit.excluded)
        _check_preference(role, able, fleet, graph, findings)
        least = role.need.least if role.need is not None and not role.optional else 0
        if len(able) < least:
            _cannot_fill(role, fleet, found, able, least, findings)
        else:
            possible[role.name] = able
            _check_loss(mission, role, able, findings)
    _check_together(behavior, fleet, possible, findings)
    return possible


def _fits(
    behavior: Behavior, role: Role, fleet: Fleet, graph: ResourceGraph, known: KnownFits
) -> list[Fit]:
    condition = role.need.condition if role.need is not None else None
    key = (role.kind, behavior.name, behavior.type, condition)
    if key not in known:
        known[key] = fits(fleet, graph, behavior, role)
    return known[key]


def _check_facts(role: Role, findings: TaskFindings) -> bool:
    """Check that facts are known, and are compared with values of their types."""
    assert role.need is not None
    right = True
    for expression in role.need.expressions:
        for name in sorted(expression.names):
            if is_fact(name) and name not in CANDIDATE_FACTS:
                right = False
                findings.add(
                    "unknown-fact",
                    f"'{name}' is no fact of a candidate",
                    did_you_mean(name, CANDIDATE_FACTS)
                    or f"there are: {', '.join(CANDIDATE_FACTS)}",
                    line=role.line,
                    role=role.name,
                )

        for node, _ in walk(expression.tree):
            match node:
                case Compare(left=Name(name=name), right=Literal(value=value)):
                    pass
                case Compare(left=Literal(value=value), right=Name(name=name)):
                    pass
                case _:
                    continue
            fact = FACT_TYPES.get(name)
            if fact is not None and value is not None and not _is_of(fact, value):
                right = False
                _wrong_type(
                    role, f"'{name}' is {_TYPES[fact]}, and never {describe(value)}", findings
                )
    return right


_TYPES = {str: "a text", float: "a number", bool: "true or false", list: "a list"}


def _is_of(fact: type[object], value: bool | int | float | str) -> bool:
    if fact is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, fact)


_REQUIRES = "write for example requires=\"vehicle.domain == 'air' and vehicle.battery > 0.4\""
_PREFERS = "write for example prefer=\"'fast' in vehicle.tags ? 60 : 0\""


def _wrong_type(role: Role, text: str, findings: TaskFindings, remedy: str = _REQUIRES) -> None:
    findings.add("bad-need", text, remedy, line=role.line, role=role.name)


def _check_preference(
    role: Role,
    able: Sequence[ResourceId],
    fleet: Fleet,
    graph: ResourceGraph,
    findings: TaskFindings,
) -> None:
    """Check that what a role prefers is a number for each candidate, if the fleet file says it."""
    preference = role.need.preference if role.need is not None else None
    if preference is None or not preference.names <= FLEET_FACTS.keys():
        return
    for resource in able:
        try:
            preference_s(preference, fleet_facts(fleet, graph, resource).get)
        except ExpressionError as error:
            _wrong_type(role, f"prefer: {error}, for {resource}", findings, _PREFERS)
            return


def _check_count(behavior: Behavior, role: Role, findings: TaskFindings) -> None:
    assert role.need is not None
    if role.need.most > 1 and behavior.type is not BehaviorType.TEAM:
        findings.add(
            "role-count",
            f"the {behavior.type.value} behavior {behavior.name} has one {behavior.type.value} in "
            f"each role, not {role.need.most}",
            'make it a team behavior (type="team"), or delete count=',
            line=role.line,
            role=role.name,
        )


def _cannot_fill(
    role: Role,
    fleet: Fleet,
    found: Sequence[Fit],
    able: Sequence[ResourceId],
    least: int,
    findings: TaskFindings,
) -> None:
    out = [f"{fit.resource}: {fit.excluded}" for fit in found if fit.excluded]
    more = f"; and {len(out) - NAMED} others" if len(out) > NAMED else ""
    has = f"{len(able)} of {fleet.file} can" if able else f"nothing in {fleet.file} can"
    wanted = f"{least} are needed, and {has} fill it" if least > 1 else f"{has} fill it"
    findings.add(
        "unfillable",
        f"{wanted}: {'; '.join(out[:NAMED]) or 'the fleet has none'}{more}",
        _unknown_tag(role, fleet) or "ask for less, or give the fleet what is asked for",
        line=role.line,
        role=role.name,
    )


def _check_loss(
    mission: Mission, role: Role, able: Sequence[ResourceId], findings: TaskFindings
) -> None:
    """Check that another can do the rest when what fills a role is lost, as far as is certain."""
    if role.on_loss is not OnLoss.REASSIGN:
        return
    if len(able) == 1:
        why = f"only {able[0]} can fill it, so that no other does the rest when it is lost"
        remedy = "ask for less, give the fleet another, or delete onLoss"
    elif role.kind is RoleKind.VEHICLE and (same := _one_stored(mission, role)):
        why = f"it is filled by '{same}' alone, so that no other does the rest"
        remedy = "write requires= in place of same, or delete onLoss"
    else:
        return
    text = f"onLoss='reassign', and {why}"
    findings.add(
        "no-other", text, remedy, line=role.line, role=role.name, severity=Severity.WARNING
    )


def _one_stored(mission: Mission, role: Role) -> str:
    """Return the name under which roles store the one vehicle that alone may fill a role; ""."""
    same = role.need.same if role.need is not None else ""
    needs = [each.need for each in roles_of_mission(mission) if each.need is not None]
    stored = [need.most for need in needs if same and need.store == same]
    return same if stored and max(stored) == 1 else ""


def _unknown_tag(role: Role, fleet: Fleet) -> str:
    """Return a hint if a role asks for a tag that nothing in the fleet has."""
    assert role.need is not None
    tags = {tag for each in fleet.vehicles.values() for tag in each.tags}
    tags |= {tag for each in fleet.payloads.values() for tag in each.tags}
    if role.need.condition is None:
        return ""
    for node, _ in walk(role.need.condition.tree):
        match node:
            case In(item=Literal(value=str(wanted)), container=Name(name=name)):
                if name.endswith(".tags") and wanted not in tags:
                    there = f"there are: {', '.join(sorted(tags))}" if tags else "it has no tags"
                    hint = did_you_mean(wanted, tags) or there
                    return f"nothing in the fleet has the tag '{wanted}'; {hint}"
    return ""


def places_of(
    behavior: Behavior, fleet: Fleet, possible: Mapping[str, tuple[ResourceId, ...]]
) -> list[tuple[Role, tuple[ResourceId, ...]]]:
    """Return for each resource that a behavior needs its role, and what may be that resource.

    `possible`: what may fill the roles by need, as `check_needs` returns it.
    """
    places: list[tuple[Role, tuple[ResourceId, ...]]] = []
    for role in behavior.roles:
        if role.name in possible and role.need is not None and not role.optional:
            places += [(role, possible[role.name])] * role.need.least
        elif role.resource:
            places += [(role, (each,)) for each in resources_of(role, fleet)]
    return places


def _check_together(
    behavior: Behavior,
    fleet: Fleet,
    possible: Mapping[str, tuple[ResourceId, ...]],
    findings: TaskFindings,
) -> None:
    """Check that all roles of one task can be filled at once, each resource in one of them."""
    places = places_of(behavior, fleet, possible)
    if len(places) < 2 or not possible:
        return
    graph: rustworkx.PyGraph = rustworkx.PyGraph()
    graph.add_nodes_from(range(len(places)))
    nodes: dict[ResourceId, int] = {}
    for place, (_, resources) in enumerate(places):
        for resource in resources:
            if resource not in nodes:
                nodes[resource] = graph.add_node(resource)
            graph.add_edge(place, nodes[resource], 1)
    filled = len(rustworkx.max_weight_matching(graph, max_cardinality=True))
    if filled < len(places):
        roles = ", ".join(dict.fromkeys(f"'{role.name}'" for role, _ in places))
        what = ", ".join(dict.fromkeys(each for _, resources in places for each in resources))
        findings.add(
            "roles-compete",
            f"the roles {roles} need {len(places)} resources at once, and only {filled} can be "
            f"given to them: they compete for {what}",
            "ask for less, or give the fleet more of them",
            line=behavior.line,
        )
