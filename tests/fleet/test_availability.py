from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.fleet.availability import Availability
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.catalogue import ResourceId

from .fleets import patrol

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
    expected: dict[ResourceId, str] = {}
    for step in history:
        if step[0] == "release":
            ledger.release(step[1])
            expected = {r: holder for r, holder in expected.items() if holder != step[1]}
        else:
            _, wanted, behavior, preempts = step
            free = all(expected.get(r, behavior) in {behavior, *preempts} for r in wanted)
            assert (ledger.acquire(sorted(wanted), behavior, preempts) is None) is free
            if free:
                expected.update(dict.fromkeys(wanted, behavior))
        assert {r: ledger.holder(r) for r in FOUR if ledger.holder(r)} == expected
