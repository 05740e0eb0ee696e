"""What the fleet file says of the candidates for a role, and which of them may ever fill it."""

from collections.abc import Iterator
from dataclasses import dataclass

from m2pem.errors import ExpressionError
from m2pem.fleet.fleet import Fleet, Payload, Vehicle
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import Behavior, BehaviorType, Role, RoleKind
from m2pem.mission.candidate_facts import FLEET_FACTS
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import describe, shown
from m2pem.mission.expression.partial import first_false, possible_truth
from m2pem.mission.values import ReadValue, Value


def vehicle_of(fleet: Fleet, resource: ResourceId) -> Vehicle:
    """Return a vehicle, or the one that a payload is mounted on."""
    payload = fleet.payloads.get(resource)
    return fleet.vehicles[payload.vehicle if payload is not None else resource]


def fleet_facts(fleet: Fleet, graph: ResourceGraph, resource: ResourceId) -> dict[str, Value]:
    """Return the facts of a vehicle or payload that the fleet file says."""
    payload, vehicle = fleet.payloads.get(resource), vehicle_of(fleet, resource)
    facts: dict[str, Value] = {
        "vehicle.name": vehicle.id,
        "vehicle.domain": vehicle.domain.value,
        "vehicle.arbiter": vehicle.arbiter,
        "vehicle.tags": list(vehicle.tags),
        "vehicle.behaviors": _offered(graph, vehicle),
        "vehicle.payloads": [each.partition("/")[2] for each in vehicle.payloads],
        "vehicle.teams": list(graph.teams(vehicle.id)),
        "vehicle.cruise_speed": vehicle.cruise_speed_m_s,
    }
    if payload is not None:
        facts |= {
            "payload.name": payload.id.partition("/")[2],
            "payload.behaviors": _offered(graph, payload),
            "payload.tags": list(payload.tags),
            "payload.detector": payload.detector,
        }
    return facts


def _offered(graph: ResourceGraph, resource: Vehicle | Payload) -> list[Value]:
    return list(dict.fromkeys(spec.name for spec in graph.offers(resource.id)))


@dataclass(frozen=True, slots=True)
class Fit:
    """Whether a resource may fill a role, as far as the fleet file says. `excluded`: why it cannot,
    whatever happens while the mission runs; "": it may."""

    resource: ResourceId
    excluded: str = ""


def of_kind(kind: RoleKind, fleet: Fleet) -> Iterator[ResourceId]:
    """Yield what a role by need chooses from, in the order of the fleet file."""
    yield from fleet.payloads if kind is RoleKind.PAYLOAD else fleet.vehicles


def unfit(
    fleet: Fleet, graph: ResourceGraph, name: str, kind: BehaviorType, resource: ResourceId
) -> str:
    """Return why a resource performs a behavior in no mission; "": it may."""
    if vehicle_of(fleet, resource).manned:
        return "it is manned"
    if graph.spec(resource, name, kind) is None:
        alone = kind is BehaviorType.TEAM and not graph.teams(resource)
        why = ", as it is in no team of the fleet file" if alone else ""
        return f"it offers no {kind.value} behavior {name}{why}"
    return ""


def fits(fleet: Fleet, graph: ResourceGraph, behavior: Behavior, role: Role) -> list[Fit]:
    """Return all candidates of a role by need, and which of them may fill it.

    Telemetry and the data of the mission are not known before it runs: what depends on them may be
    true.

    Raises:
        ExpressionError: `requires` has a wrong type.
    """
    found: list[Fit] = []
    condition = role.need.condition if role.need is not None else None
    for resource in of_kind(role.kind, fleet):
        excluded = unfit(fleet, graph, behavior.name, behavior.type, resource)
        if not excluded and condition is not None:
            facts = fleet_facts(fleet, graph, resource)
            known = FLEET_FACTS.__contains__
            if possible_truth(condition, known, facts.get) is False:
                names = sorted(first_false(condition, known, facts.get))
                values = ", ".join(f"{name} = {shown(facts.get(name))}" for name in names)
                excluded = f"requires is false: {values}" if values else "requires is false"
        found.append(Fit(resource, excluded))
    return found


def preference_s(preference: Expression, read: ReadValue) -> float:
    """Return the seconds of travel time that a candidate is worth; null counts as 0.

    Raises:
        ExpressionError: `prefer` gives no number, or has a wrong type.
    """
    value = preference.evaluate(read)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ExpressionError(
            f"prefer gives {describe(value)}, not a number of seconds, in {preference.text!r}"
        )
    return float(value)


def possible_resources(
    fleet: Fleet, graph: ResourceGraph, behavior: Behavior, role: Role
) -> tuple[ResourceId, ...]:
    """Return what may fill a role by need, in the order of the fleet file."""
    return tuple(fit.resource for fit in fits(fleet, graph, behavior, role) if not fit.excluded)
