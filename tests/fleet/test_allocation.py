"""Allocation and availability of resources."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.fleet.allocation import AllocationError, Availability, allocate
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.behavior import ServiceCall
from m2pem.mission.catalogue import ResourceId

from .fleets import patrol
from .missions import drive, payload, team, vehicle


def test_roles_are_filled_in_their_order(tmp_path: Path) -> None:
    task = drive(vehicle("evsg3", "b"), vehicle("evsg1", "a"), payload("evsg3/ptz"))
    allocation = allocate(task, patrol(tmp_path))
    assert allocation.resources == ("evsg3", "evsg1", "evsg3/ptz")
    assert allocation.roles == {"b": ("evsg3",), "a": ("evsg1",), "camera": ("evsg3/ptz",)}


def test_a_team_is_spelled_out_with_its_lead_first(tmp_path: Path) -> None:
    allocation = allocate(drive(team("section")), patrol(tmp_path))
    assert allocation.resources == ("evsg1", "evsg3")
    assert allocation.roles == {"section": ("evsg1", "evsg3")}


def test_a_resource_of_two_roles_is_held_once(tmp_path: Path) -> None:
    allocation = allocate(drive(team("section"), vehicle("evsg3")), patrol(tmp_path))
    assert allocation.resources == ("evsg1", "evsg3")


def test_an_optional_role_that_the_fleet_lacks_is_left_out(tmp_path: Path) -> None:
    task = drive(vehicle("evsg1"), payload("evsg1/ptz", optional=True))
    assert allocate(task, patrol(tmp_path)).roles == {"driver": ("evsg1",)}


def test_a_service_is_allocated_alike(tmp_path: Path) -> None:
    call = ServiceCall("Detector", 3, (payload("evsg1/gpr"),))
    assert allocate(call, patrol(tmp_path)).resources == ("evsg1/gpr",)


def test_a_role_that_the_fleet_lacks_is_named(tmp_path: Path) -> None:
    fleet = patrol(tmp_path)
    with pytest.raises(AllocationError) as refused:
        allocate(drive(vehicle("evsg7")), fleet)
    assert str(refused.value) == f"role 'driver': {fleet.file} has no vehicle 'evsg7'"


EVSG1, EVSG3, PTZ, LEAD = map(ResourceId, ("evsg1", "evsg3", "evsg3/ptz", "lead"))


@pytest.fixture
def ledger(tmp_path: Path) -> Availability:
    return Availability(patrol(tmp_path))


def test_a_resource_is_held_until_its_behavior_is_released(ledger: Availability) -> None:
    assert ledger.acquire([EVSG1, EVSG3], "r1.b1") is None
    assert ledger.holder(EVSG1) == "r1.b1"
    assert ledger.held_by("r1.b1") == (EVSG1, EVSG3)
    assert ledger.acquire([EVSG1], "r2.b1") == "evsg1 is held by behavior r1.b1"
    ledger.release("r1.b1")
    assert ledger.holder(EVSG1) is None
    assert ledger.acquire([EVSG1], "r2.b1") is None


def test_a_refusal_gives_nothing_and_names_everything(ledger: Availability) -> None:
    ledger.acquire([EVSG3], "r1.b1")
    ledger.withdraw(PTZ, "lost")
    assert ledger.acquire([EVSG1, EVSG3, PTZ], "r1.b2") == (
        "evsg3 is held by behavior r1.b1; evsg3/ptz is unavailable: lost"
    )
    assert ledger.holder(EVSG1) is None


def test_asking_again_for_what_is_held_is_no_error(ledger: Availability) -> None:
    assert ledger.acquire([EVSG1], "r1.b1") is None
    assert ledger.acquire([EVSG1, EVSG3], "r1.b1") is None


def test_a_vehicle_and_its_payload_are_held_apart(ledger: Availability) -> None:
    assert ledger.acquire([EVSG3], "r1.b1") is None
    assert ledger.acquire([PTZ], "r1.b2") is None
    ledger.withdraw(EVSG3, "lost")
    assert ledger.reason(PTZ) == ""


def test_what_is_being_cancelled_gives_way_and_its_release_takes_nothing_back(
    ledger: Availability,
) -> None:
    ledger.acquire([EVSG1, EVSG3], "r1.b1")
    assert ledger.acquire([EVSG1], "r1.b2", preempts=["r1.b1"]) is None
    assert (ledger.holder(EVSG1), ledger.holder(EVSG3)) == ("r1.b2", "r1.b1")
    ledger.release("r1.b1")
    assert (ledger.holder(EVSG1), ledger.holder(EVSG3)) == ("r1.b2", None)


def test_what_gave_way_has_its_vehicle_again_if_the_one_that_took_over_ends_first(
    ledger: Availability,
) -> None:
    ledger.acquire([EVSG1], "r1.b1")
    ledger.acquire([EVSG1], "r1.b2", preempts=["r1.b1"])
    ledger.release("r1.b2")
    assert ledger.holder(EVSG1) == "r1.b1"
    assert ledger.acquire([EVSG1], "r2.b1") == "evsg1 is held by behavior r1.b1"
    ledger.release("r1.b1")
    assert ledger.acquire([EVSG1], "r2.b1") is None


def test_what_an_arbiter_has_already_is_not_refused(ledger: Availability) -> None:
    ledger.withdraw(EVSG1, "with ann")
    ledger.adopt([EVSG1], "r1.b1")
    ledger.adopt([EVSG1], "r1.b2")
    assert ledger.holder(EVSG1) == "r1.b2"


def test_a_withdrawn_resource_is_refused_until_restored(ledger: Availability) -> None:
    ledger.acquire([EVSG1], "r1.b1")
    ledger.withdraw(EVSG1, "taken over by operator A")
    assert ledger.holder(EVSG1) == "r1.b1"
    assert ledger.acquire([EVSG1], "r1.b2", preempts=["r1.b1"]) == (
        "evsg1 is unavailable: taken over by operator A"
    )
    ledger.restore(EVSG1)
    assert ledger.acquire([EVSG1], "r1.b2", preempts=["r1.b1"]) is None


def test_a_manned_vehicle_is_unavailable_until_it_is_handed_over(ledger: Availability) -> None:
    assert ledger.acquire([LEAD], "r1.b1") == "lead is unavailable: manned"
    ledger.restore(LEAD)
    assert ledger.acquire([LEAD], "r1.b1") is None


def test_a_resource_that_the_fleet_lacks_is_never_available(ledger: Availability) -> None:
    ghost = ResourceId("ghost")
    assert ledger.acquire([ghost], "r1.b1") == "ghost is unavailable: not in the fleet"
    with pytest.raises(KeyError):
        ledger.withdraw(ghost, "lost")


FOUR = tuple(map(ResourceId, "abcd"))
FLEET = Fleet("four", "four.yaml", {v: Vehicle(v, Domain.AIR, "sim", {}) for v in FOUR})
behaviors = st.sampled_from(["b1", "b2", "b3"])
steps = st.one_of(
    st.tuples(st.just("acquire"), st.sets(st.sampled_from(FOUR)), behaviors, st.sets(behaviors)),
    st.tuples(st.just("release"), behaviors),
)


@given(st.lists(steps, max_size=30))
def test_a_resource_changes_hands_only_by_release_or_preemption(history: list) -> None:
    ledger = Availability(FLEET)
    expected: dict[ResourceId, list[str]] = {resource: [] for resource in FOUR}
    for step in history:
        if step[0] == "release":
            ledger.release(step[1])
            expected = {r: [b for b in stack if b != step[1]] for r, stack in expected.items()}
        else:
            _, wanted, behavior, preempts = step
            free = all({*expected[r][-1:]} <= {behavior, *preempts} for r in wanted)
            assert (ledger.acquire(sorted(wanted), behavior, preempts) is None) is free
            for resource in wanted if free else ():
                before = [b for b in expected[resource] if b != behavior]
                expected[resource] = [*before, behavior]
        assert {r: ledger.holder(r) for r in FOUR} == {
            r: stack[-1] if stack else None for r, stack in expected.items()
        }
