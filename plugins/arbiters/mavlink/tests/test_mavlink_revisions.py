"""A running mission is revised while vehicles over MAVLink execute it: simulated autopilots, over
real UDP."""

from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at

from m2pem import load_fleet
from m2pem.api import Clock, LocalFrame, RunStatus
from m2pem.engine import records as r
from m2pem.errors import OperatorError
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.loopback import run_on_loopback

STARTS = {1: (0.0, 0.0), 2: (0.0, 40.0)}
SPEED = 2.0
FAR_M, NEAR_M = 200.0, 40.0


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
        f"vehicles:\n{vehicles}",
        encoding="utf-8",
    )
    return file


def place(simulator: Simulator, number: int) -> tuple[float, float]:
    """Where a rover really is: metres east and north."""
    where = simulator[number].location
    east, north, *_ = LocalFrame(HOME).to_local((where.latitude_deg, where.longitude_deg))
    return east, north


def drives(
    *targets: tuple[float, float], speed: str = "5 m/s"
) -> list[tuple[str, dict[str, object]]]:
    return [("goto", {"target": list(at(*each)), "speed": speed}) for each in targets]


def both(first: list[Any], second: list[Any]) -> bytes:
    """Two rovers at the same time: tasks A1, A2, ... and B1, B2, ..."""
    return scenarios.side_by_side(("rover1", first), ("rover2", second))


OTHER = drives((FAR_M, 40.0))
BEGUN = both(drives((FAR_M, 0.0)), OTHER)
TURNED = both(drives((0.0, NEAR_M), (0.0, 0.0)), OTHER)
ALONE = scenarios.one_after_another("rover2", *OTHER)


@pytest.mark.timeout(240)
def test_a_way_that_is_driven_is_changed_and_the_other_vehicle_goes_on(tmp_path: Path) -> None:
    async def main(clock: Clock) -> list[Any]:
        specs = [
            VehicleSpec(Kind.ROVER, number, Location(*at(*each), HOME_ALTITUDE_M), estimator_s=1.0)
            for number, each in STARTS.items()
        ]
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            fleet = load_fleet(fleet_file(tmp_path, simulator))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)
            async with executive:
                control = executive.control
                run = await control.start(BEGUN)
                await simulator.until(lambda: place(simulator, 1)[0] > 5)
                await simulator.until(lambda: place(simulator, 2)[0] > 5)
                plan = await control.plan_revision(run, ALONE)
                assert {each.element for each in plan.refusals} == {"A1", "B1"}
                assert any("behavior goto of rover1" in each.text for each in plan.refusals)
                with pytest.raises(OperatorError, match="a token is on script task A1"):
                    await control.revise(run, ALONE, plan.plan)
                plan = await control.plan_revision(run, TURNED)
                assert [(each.kind, each.element) for each in plan.effects] == [("restarts", "A1")]
                await control.revise(run, TURNED, plan.plan, by="anna")
                await simulator.until(lambda: place(simulator, 1)[1] > NEAR_M - 5)
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                east, north = place(simulator, 1)
                assert abs(east) < 10
                assert abs(north) < 10
                assert place(simulator, 2)[0] > FAR_M - 10
                return [each.record for each in await control.records(run)]

    records = run_on_loopback(main, SPEED)
    revised = [type(each) for each in records].index(r.MissionRevised)
    cancelled = [each for each in records if isinstance(each, r.BehaviorCancelRequested)]
    assert len(cancelled) == 1, "only what the revision changes is cancelled"
    after = [each for each in records[revised:] if isinstance(each, r.BehaviorRequested)]
    assert [(each.element, each.resources) for each in after] == [
        ("A1", ("rover1",)),
        ("A2", ("rover1",)),
    ]
    assert after[0].preempts == (cancelled[0].behavior,)


@pytest.mark.timeout(240)
def test_only_the_speed_of_a_way_that_is_driven_is_changed(tmp_path: Path) -> None:
    slower = both(drives((FAR_M, 0.0), speed="2 m/s"), OTHER)

    async def main(clock: Clock) -> list[Any]:
        specs = [
            VehicleSpec(Kind.ROVER, number, Location(*at(*each), HOME_ALTITUDE_M), estimator_s=1.0)
            for number, each in STARTS.items()
        ]
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            fleet = load_fleet(fleet_file(tmp_path, simulator))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)

            async def driven_m(number: int) -> float:
                """How far a rover comes in ten seconds of its clock."""
                begun_m, now_s = place(simulator, number)[0], simulator[number].autopilot.now_s
                await simulator.until(lambda: simulator[number].autopilot.now_s > now_s + 10.0)
                return place(simulator, number)[0] - begun_m

            async with executive:
                control = executive.control
                run = await control.start(BEGUN)
                await simulator.until(lambda: place(simulator, 1)[0] > 10)
                before = simulator[1].motions, simulator[2].motions
                plan = await control.plan_revision(run, slower)
                assert [(each.kind, each.element) for each in plan.effects] == [("adjusts", "A1")]
                await control.revise(run, slower, plan.plan)
                await driven_m(1)
                assert await driven_m(1) == pytest.approx(20.0, abs=2.0)
                assert (simulator[1].motions, simulator[2].motions) == before
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                return [each.record for each in await control.records(run)]

    records = run_on_loopback(main, SPEED)
    assert sum(isinstance(each, r.BehaviorAdjusted) for each in records) == 1
    assert not any(isinstance(each, r.BehaviorCancelRequested) for each in records)
