"""A revision changes only a speed, and the autopilot does not take it: operators read which vehicle
goes on as before, and why. Simulated autopilots, over real UDP."""

from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import HOME_ALTITUDE_M, at
from pymavlink.dialects.v20 import ardupilotmega as dialect
from test_mavlink_revisions import FAR_M, OTHER, SPEED, STARTS, both, drives, fleet_file, place

from m2pem import load_fleet
from m2pem.api import AlertSeverity, Clock, OperatorAlert, RunStatus
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing.loopback import run_on_loopback

CHANGE_SPEED = dialect.MAV_CMD_DO_CHANGE_SPEED
BEGUN = both(drives((FAR_M, 0.0)), OTHER)
SLOWER = both(drives((FAR_M, 0.0), speed="2 m/s"), OTHER)

pytestmark = pytest.mark.timeout(240)


def rovers(firmware: str) -> list[VehicleSpec]:
    places = {number: Location(*at(*each), HOME_ALTITUDE_M) for number, each in STARTS.items()}
    return [
        VehicleSpec(Kind.ROVER, number, home, firmware=firmware, estimator_s=1.0)
        for number, home in places.items()
    ]


async def passed(simulator: Simulator, seconds: float) -> None:
    """Let time pass, by the clock of the first rover."""
    until_s = simulator[1].autopilot.now_s + seconds
    await simulator.until(lambda: simulator[1].autopilot.now_s > until_s)


async def not_adjusted(executive: Executive, simulator: Simulator) -> OperatorAlert:
    """Wait until the list of alerts has one of a vehicle that may keep its speed."""
    while True:
        for alert in await executive.control.alerts():
            if alert.code == "NOT_ADJUSTED":
                return alert
        await passed(simulator, 0.2)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("result", "said", "why"),
    [
        (
            Result.FAILED,
            "Speed: not in this weather",
            "it does not take 2 m/s, and goes on at its old speed (DO_CHANGE_SPEED: failed "
            "(Speed: not in this weather))",
        ),
        (
            Result.DENIED,
            "",
            "it does not take 2 m/s, and goes on at its old speed (DO_CHANGE_SPEED: denied, in "
            "this state or with these values)",
        ),
        (
            None,
            "",
            "it has not acknowledged 2 m/s (DO_CHANGE_SPEED: no answer; sent 5 times in 5 s)",
        ),
    ],
    ids=["failed", "denied", "silent"],
)
def test_operators_read_that_an_autopilot_does_not_take_a_speed(
    tmp_path: Path, firmware: str, result: Result | None, said: str, why: str
) -> None:
    async def main(clock: Clock) -> tuple[OperatorAlert, list[Any]]:
        async with Simulator(rovers(firmware), speed=SPEED, to=None) as simulator:
            fleet = load_fleet(fleet_file(tmp_path, simulator))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)

            async def driven_m() -> float:
                """How far the first rover comes in five seconds of its clock."""
                begun_m = place(simulator, 1)[0]
                await passed(simulator, 5.0)
                return place(simulator, 1)[0] - begun_m

            async with executive:
                control = executive.control
                run = await control.start(BEGUN)
                await simulator.until(lambda: place(simulator, 1)[0] > 10)
                simulator[1].faults.refuse_command(CHANGE_SPEED, result, said)
                plan = await control.plan_revision(run, SLOWER)
                assert [(each.kind, each.element) for each in plan.effects] == [("adjusts", "A1")]
                await control.revise(run, SLOWER, plan.plan)
                alert = await not_adjusted(executive, simulator)
                assert await driven_m() == pytest.approx(25.0, abs=3.0), "it goes on as before"
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                of_speeds = [each for each in await control.alerts() if "speed" in each.text]
                assert [each.alert for each in of_speeds] == [alert.alert], "it is said once"
                return alert, [each.record for each in await control.records(run)]

    alert, records = run_on_loopback(main, SPEED)
    assert alert.severity is AlertSeverity.WARNING
    assert alert.resources == ("rover1",)
    assert alert.text == f"rover1 may keep the speed that goto had before the revision: {why}"
    assert not any(isinstance(each, r.BehaviorCancelRequested) for each in records)


def test_a_pause_does_not_wait_for_the_answer(tmp_path: Path) -> None:
    async def main(clock: Clock) -> None:
        async with Simulator(rovers("ardupilot"), speed=SPEED, to=None) as simulator:
            fleet = load_fleet(fleet_file(tmp_path, simulator))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)
            async with executive:
                control = executive.control
                run = await control.start(BEGUN)
                await simulator.until(lambda: place(simulator, 1)[0] > 10)
                simulator[1].faults.refuse_command(CHANGE_SPEED, None)
                plan = await control.plan_revision(run, SLOWER)
                await control.revise(run, SLOWER, plan.plan)
                asked_s = simulator[1].autopilot.now_s
                await control.pause(run)
                await simulator.until(lambda: simulator[1].autopilot.modes.mode.name == "HOLD")
                assert simulator[1].autopilot.now_s - asked_s < 2.0
                simulator[1].faults.allow_command(CHANGE_SPEED)
                await control.resume(run)
                assert (await control.wait(run)).status is RunStatus.COMPLETED
                found = [each.code for each in await control.alerts()]
                assert "NOT_ADJUSTED" not in found, "it was sent again, and taken"

    run_on_loopback(main, SPEED)
