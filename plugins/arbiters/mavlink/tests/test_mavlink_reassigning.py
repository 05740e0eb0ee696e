"""A copter is cut off in a route, and another flies the rest: simulated autopilots, real UDP."""

import json
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from mavlink_copters import ROUND, simulated, task, write
from mavlink_sitl import free_port

from tests.command_line import command_line
from tests.executive.conftest import mission, sequence

SPEED = "30"
ROUNDS = 2
PILOT = (
    "requires=\"vehicle.domain == 'air'\" onLoss='reassign' store='pilot' "
    "prefer=\"vehicle.name == 'uav1' ? 1000 : 0\""
)
MISSION = mission(
    sequence(
        task("Up1", "takeoff", "vehicle='uav1'", altitude="10"),
        task("Up2", "takeoff", "vehicle='uav2'", altitude="10"),
        task("Fly", "single_vehicle_routing", PILOT, route="around", speed="8 m/s"),
        task("Down", "land", "same='pilot'"),
    )
)
"""Both copters take off; one flies the route, and lands."""


def test_another_copter_flies_the_rest_and_the_first_one_is_stopped_when_it_returns(
    tmp_path: Path,
) -> None:
    port = free_port()
    file, fleet = write(tmp_path, port, MISSION, lost_after="40 s", rounds=ROUNDS, copters=2)
    with contextmanager(command_line)(tmp_path) as m2pem:
        m2pem.start(*simulated(port, SPEED, "1: cut link at 80 s for 70 s", copters=2))
        words = ("--speed", SPEED, "--ocu", "none", "--format", "json")
        status, output, errors = m2pem.run("run", file, "--fleet", fleet, *words)
    assert status == 0, errors
    records = [json.loads(line) for line in output.splitlines()]
    flown = of_kind(records, "BehaviorRequested", element="Fly")
    assert [each["resources"] for each in flown] == [["uav1"], ["uav2"]]
    (reassigned,) = of_kind(records, "WorkReassigned")
    assert (reassigned["code"], reassigned["excluded"]) == ("LINK_LOST", ["uav1"])
    assert flown[1]["parameters"] == reassigned["parameters"]
    left = reassigned["parameters"]["route"]["geometry"]["coordinates"]
    assert 1 <= len(left) < len(ROUND * ROUNDS)
    assert left[-1][:2] == pytest.approx(ROUND[-1], abs=1e-6)
    (landed,) = of_kind(records, "BehaviorRequested", element="Down")
    assert landed["resources"] == ["uav2"]
    (returned,) = of_kind(records, "ResourceReturned")
    assert returned["resource"] == "uav1"
    assert "uav1: its link is restored, it has ended what it did before, and is free" in errors


def of_kind(records: list[dict[str, Any]], name: str, **fields: str) -> list[dict[str, Any]]:
    return [
        each
        for each in records
        if each["record"] == name and all(each[key] == value for key, value in fields.items())
    ]
