"""Incidents of vehicles over MAVLink: simulated autopilots, over real UDP."""

from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at

from m2pem import load_fleet
from m2pem.api import Clock, LocalFrame, RunStatus
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.loopback import run_on_loopback

STARTS = {1: (0.0, 0.0), 2: (0.0, 20.0)}
SPEED = 1.0
TARGET_EAST_M = 40.0


def fleet_file(folder: Path, simulator: Simulator) -> Path:
    vehicles = "".join(
        f"  rover{number}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 40 s\n"
        f"    connection: {{url: 'udpout://{host}:{port}', system_id: {number}}}\n"
        for number in STARTS
        for host, port in [simulator[number].address]
    )
    file = folder / "fleet.yaml"
    file.write_text(
        f"version: 1\norigin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: {HOME_ALTITUDE_M}}}\n"
        f"on_error: incident\nvehicles:\n{vehicles}",
        encoding="utf-8",
    )
    return file


def east_of(simulator: Simulator, number: int) -> float:
    """Where a rover really is."""
    where = simulator[number].location
    return LocalFrame(HOME).to_local((where.latitude_deg, where.longitude_deg))[0]


def test_a_rover_stands_until_an_operator_decides_and_another_one_takes_over(
    tmp_path: Path,
) -> None:
    latitude, longitude = at(TARGET_EAST_M, 10.0)
    drive = scenarios.one_behavior(
        "goto", "rover1", target=f"[{latitude}, {longitude}]", speed="${speed}"
    )

    async def main(clock: Clock) -> list[Any]:
        specs = [
            VehicleSpec(Kind.ROVER, number, Location(*at(*place), HOME_ALTITUDE_M), estimator_s=1.0)
            for number, place in STARTS.items()
        ]
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            fleet = load_fleet(fleet_file(tmp_path, simulator))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)
            async with executive:
                control = executive.control
                run = await control.start(drive, data={"speed": "fast"})
                await until_incident(clock, executive, "REJECTED")
                await control.resolve_incident(run, "i1", "set_data", data={"speed": 5})
                await control.resolve_incident(run, "i1", "retry")
                await simulator.until(lambda: east_of(simulator, 1) > 5)
                await control.take("rover1", by="anna")
                await until_incident(clock, executive, "TAKEN_OVER")
                await control.give_back("rover1", by="anna")
                await control.resolve_incident(
                    run, f"{run}.i2", "retry_with", roles={"actor": ["rover2"]}, by="anna"
                )
                await simulator.until(lambda: east_of(simulator, 2) > TARGET_EAST_M - 5)
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                assert east_of(simulator, 1) < TARGET_EAST_M - 5
                return [each.record for each in await control.records(run)]

    records = run_on_loopback(main, SPEED)
    choices = [each.choice.value for each in records if isinstance(each, r.IncidentResolved)]
    assert choices == ["retry", "retry_with"]
    driven = [each.resources for each in records if isinstance(each, r.BehaviorRequested)]
    assert driven == [("rover1",), ("rover1",), ("rover2",)]


async def until_incident(clock: Clock, executive: Executive, code: str) -> None:
    while code not in {each.code for each in await executive.control.incidents()}:
        await clock.sleep(0.05)
