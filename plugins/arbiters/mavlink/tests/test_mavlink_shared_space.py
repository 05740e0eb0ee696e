"""Two rovers over MAVLink that need one bridge from both sides: one waits until the other has left
it. They are simulated autopilots, over real UDP."""

import json
from pathlib import Path
from typing import Any

import mavlink_sitl
import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_mission_flights import fly
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at

from m2pem import load_fleet
from m2pem.api import Clock, LocalFrame, RunStatus
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.loopback import run_on_loopback

STARTS = {1: (0.0, 0.0), 2: (150.0, 8.0)}
BRIDGE = (80.0, 100.0)
"""From where to where it is, in metres east of the first rover."""

SPEED = 1.0
"""While the executive reads a mission, time passes as on the wall."""


def write_bridge(folder: Path) -> None:
    west, east = BRIDGE
    ring = [
        at(*each)[::-1] for each in ((west, -10), (east, -10), (east, 10), (west, 10), (west, -10))
    ]
    (folder / "bridge.geojson").write_text(
        json.dumps({"type": "Polygon", "coordinates": [ring]}), encoding="utf-8"
    )


def write_fleet(folder: Path, vehicles: str, space: str) -> Path:
    file = folder / "fleet.yaml"
    file.write_text(
        f"version: 1\norigin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: {HOME_ALTITUDE_M}}}\n"
        f"vehicles:\n{vehicles}areas: {{bridge: bridge.geojson}}\nshared_space: {{{space}}}\n",
        encoding="utf-8",
    )
    return file


def fleet_file(folder: Path, simulator: Simulator, space: str) -> Path:
    """A fleet of both, with a bridge."""
    write_bridge(folder)
    vehicles = "".join(
        f"  rover{number}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 40 s\n"
        f"    connection: {{url: 'udpout://{host}:{port}', system_id: {number}}}\n"
        for number in STARTS
        for host, port in [simulator[number].address]
    )
    return write_fleet(folder, vehicles, space)


def east_of(simulator: Simulator, number: int) -> float:
    """Where a rover really is."""
    where = simulator[number].location
    return LocalFrame(HOME).to_local((where.latitude_deg, where.longitude_deg))[0]


def target(east: float, north: float) -> str:
    latitude, longitude = at(east, north)
    return f"[{latitude}, {longitude}]"


def drive(rover: str, east: float, north: float) -> bytes:
    return scenarios.one_behavior("goto", rover, target=target(east, north), speed="5 m/s")


@pytest.mark.parametrize("waits", [True, False])
def test_two_rovers_cross_a_bridge_from_both_sides(tmp_path: Path, waits: bool) -> None:
    async def main(clock: Clock) -> list[Any]:
        specs = [
            VehicleSpec(Kind.ROVER, number, Location(*at(*place), HOME_ALTITUDE_M), estimator_s=1.0)
            for number, place in STARTS.items()
        ]
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            on_conflict = "wait" if waits else "refuse"
            space = f"bridge: {{capacity: 1, on_conflict: {on_conflict}}}"
            fleet = load_fleet(fleet_file(tmp_path, simulator, space))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)
            async with executive:
                control = executive.control
                first = await control.start(drive("rover1", 150.0, -8.0))
                await simulator.until(lambda: east_of(simulator, 1) > 10)
                second = await control.start(drive("rover2", 0.0, -10.0))
                most = 0

                def over() -> bool:
                    nonlocal most
                    west, east = BRIDGE
                    places = (east_of(simulator, number) for number in STARTS)
                    most = max(most, sum(west < place < east for place in places))
                    return east_of(simulator, 1) > 140 and (not waits or east_of(simulator, 2) < 5)

                await simulator.until(over)
                assert most == 1
                ends = [await control.wait(run) for run in (first, second)]
                records = [each.record for each in await control.records(second)]
                waited = any(isinstance(each, r.AllocationDelayed) for each in records)
                assert waited is waits
                return ends

    one, two = run_on_loopback(main, SPEED)
    assert one.status is RunStatus.COMPLETED
    assert two.status is (RunStatus.COMPLETED if waits else RunStatus.FAILED)
    if not waits:
        assert "rover2 would enter bridge (capacity 1) at enu [" in two.detail
        assert "taken by rover1, which does r1.b1 (goto)" in two.detail


@pytest.mark.timeout(600)
@pytest.mark.sitl("M2PEM_ARDUROVER")
def test_two_real_rovers_cross_a_bridge_one_after_the_other(tmp_path: Path) -> None:
    """ArduRover, in programs of its own: both set out in one mission, from both sides."""
    port = mavlink_sitl.free_port()
    write_bridge(tmp_path)
    vehicles = "".join(
        f"  rover{number}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 60 s\n"
        f"    sitl: true\n    connection:\n      url: udpin://127.0.0.1:{port}\n"
        f"      system_id: {number}\n      sitl: {{home: {[*at(*place)]}}}\n"
        for number, place in STARTS.items()
    )
    fleet = write_fleet(tmp_path, vehicles, "bridge: 1")
    mission = tmp_path / "mission.bpmn"
    ways = {"rover1": (150.0, -8.0), "rover2": (0.0, -8.0)}
    mission.write_bytes(
        scenarios.side_by_side(
            *((rover, [("goto", {"target": target(*to)})]) for rover, to in ways.items())
        )
    )
    programs = mavlink_sitl.programs_folder(tmp_path / "bin", "ardurover")
    flight = fly(programs, fleet, mission, tmp_path / "vehicles", 5.0)
    assert flight.status == 0, (flight.errors, flight.records[-5:])
    begins = {}
    crossing = {}
    for record, begin_s, end_s in flight.behaviors("goto"):
        (rover,) = record["resources"]
        begins[rover] = begin_s
        samples = flight.between(rover, begin_s, end_s)
        on_it = [each.at_s for each in samples if BRIDGE[0] < each.place[0] < BRIDGE[1]]
        crossing[rover] = min(on_it), max(on_it)
    first, second = sorted(begins, key=begins.__getitem__)
    assert crossing[first][1] < begins[second] < crossing[second][0]
