from pathlib import Path

import pytest

from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.mission.behavior import ServiceCall

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
