"""Roles evaluated over a fleet whose telemetry changes: as if all were evaluated afresh."""

from dataclasses import replace
from functools import partial
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from m2pem.allocation.assignment import Request, assign
from m2pem.allocation.candidates import Candidates, Place
from m2pem.allocation.explanation import MAX_LISTED, lack, reason, what_was_considered
from m2pem.allocation.needs import Occupancy, RoleEvaluator, Task
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Domain, Fleet, SharedSpace, Vehicle
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import Behavior, BehaviorType, Need, Role, RoleKind
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import parse
from m2pem.mission.geometry import Area

NAMES = tuple(ResourceId(f"v{number}") for number in range(5))
CONDITIONS = (
    "true",
    "vehicle.battery > 0.5",
    "'light' in vehicle.tags",
    "vehicle.travel_time < 500",
)
PREFERENCES = ("0", "vehicle.battery * 100", "vehicle.name == 'v1' ? 30 : 0")


def fleet_of(names: tuple[ResourceId, ...]) -> Fleet:
    """A fleet of vehicles of which every other is light."""
    vehicles = {
        name: Vehicle(name, Domain.GROUND, "sim", {}, tags=("light",) if number % 2 else ())
        for number, name in enumerate(names)
    }
    return Fleet("test", "test.yaml", vehicles, origin=(0.0, 0.0, 0.0))


FLEET = fleet_of(NAMES)
GRAPH = ResourceGraph(FLEET, lambda _: list(SHARED.values()))


def state(name: ResourceId, battery: float, latitude: float) -> VehicleState:
    place = GeoPosition(latitude, 0.0, 0.0)
    return VehicleState(name, 0, place, battery_fraction=battery)


CHANGES = st.dictionaries(
    st.sampled_from(NAMES),
    st.tuples(st.sampled_from((0.2, 0.6, 1.0)), st.sampled_from((0.001, 0.004, 0.01))),
)
HELD = st.frozensets(st.sampled_from(NAMES))
TASKS = st.lists(
    st.tuples(st.sampled_from(CONDITIONS), st.sampled_from(PREFERENCES), st.sampled_from((0, 9e-3)))
)


def decision(
    evaluator: RoleEvaluator, tasks: list[tuple[str, str, float]], held: frozenset[ResourceId]
) -> list[Any]:
    """What tasks get, and what is said of each."""
    occupied = {name: Occupancy("r9.b1") for name in held}
    roles = {}
    for number, (condition, preference, latitude) in enumerate(tasks):
        need = Need(parse(condition), preference=parse(preference))
        role = Role("driver", RoleKind.VEHICLE, "", 1, need=need)
        behavior = Behavior(BehaviorType.VEHICLE, "goto", 1, (), (role,))
        where = partial(Place, ((latitude, 0.0),))
        task = Task(behavior, where, lambda _: None, (), occupied)
        roles[f"r1.a{number}"] = (evaluator.role(role, task),)
    requests = [Request(each, tuple(r.options for r in found)) for each, found in roles.items()]
    chosen = assign(requests, {name: place for place, name in enumerate(NAMES)})
    return [
        (chosen.get(each), what_was_considered(found, chosen.get(each, {}), ()), lack(found, {}))
        for each, found in roles.items()
    ]


@given(st.lists(st.tuples(CHANGES, HELD, TASKS), max_size=5))
def test_what_has_not_changed_is_not_evaluated_again_and_is_still_right(steps):
    states: dict[ResourceId, VehicleState] = {}
    evaluator = RoleEvaluator(Candidates(FLEET, GRAPH, states.get))
    for changes, held, tasks in steps:
        states |= {name: state(name, *facts) for name, facts in changes.items()}
        evaluator.look_again()
        afresh = RoleEvaluator(Candidates(FLEET, GRAPH, states.get))
        assert decision(evaluator, tasks, held) == decision(afresh, tasks, held)


def test_telemetry_that_excludes_no_other_candidate_changes_nothing():
    states = {name: state(name, 1.0, 0.001) for name in NAMES}
    evaluator = RoleEvaluator(Candidates(FLEET, GRAPH, states.get))
    decision(evaluator, [("vehicle.battery > 0.5", "0", 0)], frozenset(NAMES))
    states[NAMES[0]] = state(NAMES[0], 0.6, 0.01)
    assert not evaluator.telemetry_changes_candidates()
    states[NAMES[0]] = state(NAMES[0], 0.2, 0.01)
    assert evaluator.telemetry_changes_candidates()


def test_what_a_task_lacks_names_the_first_candidates_of_a_large_fleet():
    names = tuple(ResourceId(f"v{number}") for number in range(MAX_LISTED + 5))
    fleet = fleet_of(names)
    graph = ResourceGraph(fleet, lambda _: list(SHARED.values()))
    evaluator = RoleEvaluator(Candidates(fleet, graph, lambda _: None))
    role = Role("driver", RoleKind.VEHICLE, "", 1, need=Need())
    behavior = Behavior(BehaviorType.VEHICLE, "goto", 1, (), (role,))
    occupied = {name: Occupancy("r9.b1") for name in names}
    found = evaluator.role(role, Task(behavior, Place, lambda _: None, (), occupied))
    assert list(lack((found,), {}).holders) == list(names[:MAX_LISTED])


def test_a_vehicle_whose_way_leaves_the_fence_is_not_chosen_when_another_can_get_there():
    def ring(*corners: tuple[float, float]) -> tuple[tuple[float, float, None], ...]:
        return tuple((north / 1e5, east / 1e5, None) for east, north in (*corners, corners[0]))

    pond = ring((40, 40), (60, 40), (60, 60), (40, 60))
    area = Area((ring((0, 0), (100, 0), (100, 100), (0, 100)), pond))
    fleet = replace(FLEET, geometries={"yard": area}, fence="yard")
    near, far, *_ = NAMES
    states = {
        near: VehicleState(near, 0, GeoPosition(50e-5, 30e-5, 0.0)),  # across the pond
        far: VehicleState(far, 0, GeoPosition(5e-5, 95e-5, 0.0)),
    }
    evaluator = RoleEvaluator(Candidates(fleet, GRAPH, states.get))
    role = Role("driver", RoleKind.VEHICLE, "", 1, need=Need(parse("vehicle.name in ['v0','v1']")))

    def given(behavior: str, place: tuple[float, float]) -> tuple[dict[str, Any], str]:
        where = partial(Place, (place,))
        kind = BehaviorType.VEHICLE
        task = Task(Behavior(kind, behavior, 1, (), (role,)), where, lambda _: None, (), {})
        found = evaluator.role(role, task)
        chosen = assign([Request("a", (found.options,))], {n: i for i, n in enumerate(NAMES)})
        return chosen.get("a", {}), reason((found,), {})

    across = (50e-5, 70e-5)
    assert given("goto", across)[0] == {"driver": (far,)}
    for beside in ("follow", "orbit"):  # where the target is, the vehicle need not be
        assert given(beside, (50e-5, 50e-5))[0] == {"driver": (near,)}
    assert given("goto", (5e-5, 5e-5))[0] == {"driver": (near,)}
    nothing, why = given("goto", (50e-5, 150e-5))
    assert nothing == {}
    assert "v0 is excluded (where the task begins, [0.000500, 0.001500], is 56 m outside" in why
    states[near] = VehicleState(near, 0, GeoPosition(50e-5, 65e-5, 0.0))
    evaluator.look_again()
    assert given("goto", across)[0] == {"driver": (near,)}


def test_a_vehicle_whose_way_enters_closed_space_cannot_get_there():
    ring = ((40, 40), (60, 40), (60, 60), (40, 60), (40, 40))
    pond = Area((tuple((north / 1e5, east / 1e5, None) for east, north in ring),))
    closed = {"pond": SharedSpace("pond", 0)}
    fleet = replace(FLEET, geometries={"pond": pond}, closed_space=closed)
    near = NAMES[0]
    states = {near: VehicleState(near, 0, GeoPosition(50e-5, 30e-5, 0.0))}
    candidates = Candidates(fleet, GRAPH, states.get)
    assert "enters 'pond', which is closed" in candidates.breach(near, Place(((50e-5, 70e-5),)))
    assert candidates.breach(near, Place(((5e-5, 5e-5),))) == ""
