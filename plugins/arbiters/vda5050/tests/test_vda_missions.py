"""Whole missions on simulated vehicles over a real broker; one whose executive is killed."""

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from vda_world import (
    AMPLE_S,
    Judge,
    Mosquitto,
    SimProcess,
    child_environment,
    connection,
    write_fleet,
)

from m2pem.testing import run_mission, scenarios
from tests.command_line import CommandLine, Program

SPEED = 6.0
NEAR, FAR = "[38.1077, -77.3192]", "[38.1090, -77.3192]"
OWN: Mapping[str, Any] = {"pick": None, "drop": None}
LOAD = {"stationType": "floor", "loadType": "EPAL"}


class World:
    """A vehicle, and executives in processes of their own."""

    def __init__(self, broker: Mosquitto, judge: Judge, folder: Path) -> None:
        self.judge, self.folder = judge, folder
        self.settings = connection(broker.url, "agv1", own_behaviors=dict(OWN), released_nodes=2)
        self.fleet = write_fleet(folder / "fleet.yaml", {"agv1": self.settings})
        self.sim = SimProcess(self.fleet, SPEED)
        self._command_line = CommandLine(folder, child_environment(folder))

    def m2pem(self, *words: str | Path) -> Program:
        return self._command_line.start_other(sys.executable, "-m", "m2pem", *words)

    def run(self, mission: bytes) -> Program:
        file = self.folder / "mission.bpmn"
        file.write_bytes(mission)
        options = ("--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json")
        return self.m2pem("run", file, "--fleet", self.fleet, *options)

    def resume(self) -> Program:
        return self.m2pem("resume", "r1", "--ocu", "none", "--format", "json")

    def close(self) -> None:
        self._command_line.end()
        self.sim.close()


@pytest.fixture
def world(broker: Mosquitto, judge: Judge, tmp_path: Path) -> Iterator[World]:
    made = World(broker, judge, tmp_path)
    yield made
    made.close()


@pytest.mark.tried_with(
    "mosquitto",
    "missions of simulated vehicles over MQTT",
    kind="Automated guided vehicles",
    result="the load is brought",
    version="2.0.11",
)
def test_a_mission_fetches_a_load_and_brings_it(world: World) -> None:
    mission = scenarios.one_after_another(
        "agv1",
        ("pick", {"target": NEAR, "loadId": "pallet7", **LOAD}),
        ("goto", {"target": FAR, "heading": "90 deg"}),
        ("drop", LOAD),
    )
    fleet = scenarios.fleet("vda5050", {"agv1": world.settings})
    arbiters = {"vda5050": Vda5050Arbiter}
    result = run_mission(mission, fleet, arbiters=arbiters, speed=SPEED, within_s=4 * AMPLE_S)
    assert result.visited == ["Start", "Task1", "Task2", "Task3", "End"]
    assert result.summary.status.value == "completed"
    assert world.sim.count("has done pick") == world.sim.count("has done drop") == 1
    assert world.sim.count("accepts order") == 3


@pytest.mark.parametrize("moment", ["driving", "done"])
def test_what_a_vehicle_does_outlives_an_executive_that_is_killed(
    world: World, moment: str
) -> None:
    target = FAR if moment == "driving" else NEAR
    mission = scenarios.one_behavior("goto", "agv1", target=target)
    first = world.run(mission)
    first.until_record("BehaviorProgressed", state="RUNNING")
    first.kill()
    if moment == "done":
        world.judge.until("state", "agv1", lambda state: state["lastNodeSequenceId"] == 2)
    second = world.resume()
    assert second.until_record("RunEnded")["outcome"] == "completed"
    status, said = second.rest()
    assert status == 0, said
    assert world.sim.count("accepts order") == 1
    orders = world.judge.of("order", "agv1")
    assert len({order["orderId"] for order in orders}) == 1
    assert json.dumps(second.records).count("PromptOpened") == 0


def test_a_route_goes_on_to_be_released_after_the_executive_was_killed(world: World) -> None:
    route = [[38.1075 + 0.0001 * number, -77.3192] for number in range(1, 9)]
    place = {
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": [[lon, lat] for lat, lon in route]},
        "properties": {"name": "way"},
    }
    fleet = world.fleet.read_text(encoding="utf-8")
    (world.folder / "way.geojson").write_text(json.dumps(place), encoding="utf-8")
    world.fleet.write_text(f"{fleet}routes: {{way: way.geojson}}\n", encoding="utf-8")
    mission = scenarios.one_behavior("single_vehicle_routing", "agv1", route="way", speed="1 m/s")
    first = world.run(mission)
    first.until_record("BehaviorProgressed", state="RUNNING")
    first.kill()
    # Without an executive, it comes to the last node that was released, and waits there.
    stands = world.judge.until(
        "state",
        "agv1",
        lambda state: (
            state["orderId"]
            and not state["driving"]
            and state["nodeStates"]
            and not state["nodeStates"][0]["released"]
        ),
    )
    assert len(stands["nodeStates"]) >= 2
    second = world.resume()
    assert second.until_record("RunEnded")["outcome"] == "completed"
    assert world.sim.count("accepts order") == 1
    last = world.judge.of("order", "agv1")[-1]
    assert last["nodes"][-1]["sequenceId"] == 16
