"""Incidents of ROS vehicles: a plain base stands until an operator has decided, and drives on; and
every error of a vehicle with Nav2, with every choice."""

from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.simulator.fleet import read_specs
from m2pem_plugin_ros.simulator.simulation import Simulation
from m2pem_plugin_ros.testing import Peer
from ros_e2e_programs import Program, programs
from ros_e2e_world import APART_M, Lane, fleet_file
from test_ros_plain_vehicles import ORIGIN, PEER, Truth, until

from m2pem.api import ResourceId, RunStatus, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.telemetry.bus import Bus
from m2pem.testing import scenarios
from tests.incident_rows import (
    CHOICES,
    SPARE,
    Desk,
    Provocation,
    Table,
    act,
    decide_after_kill,
    over_socket,
    until_incident,
)

FLEET = """
version: 1
name: test
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
on_error: incident
vehicles:
  ugv1:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /ugv1, domain_id: {domain}, driver: base}}
"""


async def test_a_base_stands_with_an_incident_and_drives_after_a_retry(
    ros_domain: int, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(domain=ros_domain))
    place = to_geodetic(500.0, 0.0, 0.0, ORIGIN)
    target = f"[{place.latitude_deg}, {place.longitude_deg}]"
    drive = scenarios.one_behavior("goto", "ugv1", target=target, speed="${speed}")
    with Peer(PEER, ros_domain, ["/ugv1", "base", "map"]):
        async with (
            RosRuntime("incidents", domain_id=ros_domain) as ros,
            Executive(
                load_fleet(file), MemoryJournal(), PluginManager(), SystemClock()
            ) as executive,
        ):
            control, clock, truth = executive.control, SystemClock(), Truth(ros)
            run = await control.start(drive, data={"speed": "fast"})
            await until_incident(control, clock, "REJECTED")
            await control.resolve_incident(run, "i1", "set_data", data={"speed": 1}, by="anna")
            await control.resolve_incident(run, "i1", "retry", by="anna")
            await until(lambda: truth.speed() > 0.3)
            await control.take("ugv1", by="anna")
            await until_incident(control, clock, "TAKEN_OVER")
            await until(lambda: truth.speed() == 0.0)
            await control.give_back("ugv1", by="anna")
            assert (await control.holders())["ugv1"] == f"{run}.i2"
            await control.resolve_incident(run, "i2", "retry", by="anna")
            await until(lambda: truth.speed() > 0.3)
            await control.stop(run, by="anna")
            await until(lambda: truth.speed() == 0.0)
            assert (await control.wait(run)).status is RunStatus.STOPPED


# --- every error and every choice -----------------------------------------------------------------

SPEED = 2.0
NEAR_M, FAR_M = 0.0, 24.0
NO_PATH, TOO_LATE, FAILED_TO = 208, 107, 100
"""Error codes of Nav2."""


class Street(Table):
    """Two vehicles with Nav2, one of which goes up and down a street."""

    vehicle = "rover1"
    simulation: Simulation
    bus: Bus

    async def is_ready(self) -> bool:
        """Whether Nav2 answers, too: a vehicle that is received may not have started it yet."""
        state = self.bus.latest(ResourceId(self.vehicle))
        return isinstance(state, VehicleState) and bool(state.ready)

    def data(self) -> dict[str, Any]:
        """To the other end of the street."""
        north = self.simulation[self.vehicle].vehicle.body.pose.north_m
        to = FAR_M if north < (NEAR_M + FAR_M) / 2 else NEAR_M
        return {"speed": 5, "target": [*Lane(0.0, FAR_M).position(to)]}

    def far(self) -> dict[str, Any]:
        return {"target": [*Lane(0.0, FAR_M).position(10 * FAR_M)]}

    def provocations(self) -> dict[str, Provocation]:
        simulated = self.simulation[self.vehicle]

        def put(name: str, value: object) -> Callable[..., Awaitable[None]]:
            return act(lambda: setattr(simulated.nav2.faults, name, value))

        def charged(fraction: float) -> Callable[..., Awaitable[None]]:
            return act(lambda: setattr(simulated.vehicle.battery, "fraction", fraction))

        def aborts(code: str, number: int) -> Provocation:
            return Provocation(code, before=put("error_code", number), mend=put("error_code", 0))

        async def start(_: str) -> None:
            simulated.start()
            await self.available()
            await self.desk.until(self.is_ready, "", f"{self.vehicle} is ready")

        return {
            **self.common(),
            "Nav2 fails": aborts("FAILED", FAILED_TO),
            "no path": aborts("ROUTE_BLOCKED", NO_PATH),
            "too late": aborts("TIMEOUT", TOO_LATE),
            "a goal is refused": Provocation(
                "REJECTED", before=put("reject", True), mend=put("reject", False)
            ),
            "the link is lost": Provocation("LINK_LOST", during=act(simulated.kill), mend=start),
            "the battery is low": Provocation(
                "BATTERY_LOW", during=charged(0.1), mend=charged(1.0)
            ),
        }


ERRORS = (
    "no path",
    "too late",
    "a goal is refused",
    "the link is lost",
    "the battery is low",
    "a task takes it",
    "Nav2 fails",
    "an operator has it",
    "an operator takes over",
    "a wrong parameter",
)


async def play_rows(folder: Path, domain: int, rows: Sequence[tuple[str, str]]) -> None:
    """Play rows on one executive and one set of vehicles."""
    connection = {"driver": "nav2", "domain_id": domain}
    vehicles = dict.fromkeys(("rover1", SPARE), connection)
    allocation = {"preemption": True}
    file = fleet_file(folder, vehicles, FAR_M, lost_after="8 s", allocation=allocation)
    fleet, clock = load_fleet(file), SystemClock(SPEED)
    async with Simulation([*read_specs(fleet, {})], speed=SPEED, domain_id=domain) as simulation:
        journal = MemoryJournal()
        executive = Executive(fleet, journal, PluginManager(), clock, speed=SPEED)
        async with executive, over_socket(executive, folder) as control:
            street = Street()
            street.simulation, street.desk = simulation, Desk(control, clock)
            street.bus = executive.bus
            await street.play(rows, journal)


async def test_each_choice_about_an_error_of_a_vehicle_with_nav2(
    ros_domain: int, tmp_path: Path
) -> None:
    await play_rows(tmp_path, ros_domain, list(zip(ERRORS, CHOICES, strict=False)))


@pytest.mark.long
@pytest.mark.parametrize("error", ERRORS)
async def test_every_choice_about_every_error_of_a_vehicle_with_nav2(
    ros_domain: int, tmp_path: Path, error: str
) -> None:
    await play_rows(tmp_path, ros_domain, [(error, choice) for choice in CHOICES])


# --- kill -9 while the incidents are open ---------------------------------------------------------

AFTER_KILL = (
    ("no path", "retry"),
    ("too late", "retry_with"),
    ("a goal is refused", "skip"),
    ("a wrong parameter", "set_data"),
    ("an operator has it", "move"),
    ("the battery is low", "end"),
)
FAULTS = {
    "no path": f"nav2 abort {NO_PATH}",
    "too late": f"nav2 abort {TOO_LATE}",
    "a goal is refused": "nav2 reject",
}
"""Of vehicles in a process of their own, from its start."""


class Apart(Table):
    """A vehicle in a process of its own, whose faults are typed there."""

    simulated: Program

    def __init__(self, number: int) -> None:
        self.number, self.vehicle = number, f"rover{number}"

    def data(self) -> dict[str, Any]:
        lane = Lane(APART_M * (self.number - 1), FAR_M)
        return {"speed": 5, "target": [*lane.position(FAR_M)]}

    def provocations(self) -> dict[str, Provocation]:
        def fault(text: str) -> Callable[..., Awaitable[None]]:
            return act(lambda: self.simulated.type(f"{self.vehicle}: {text}"))

        return {
            **self.common(),
            "no path": Provocation("ROUTE_BLOCKED", mend=fault("nav2 abort 0")),
            "too late": Provocation("TIMEOUT", mend=fault("nav2 abort 0")),
            "a goal is refused": Provocation("REJECTED"),
            "the battery is low": Provocation("BATTERY_LOW", during=fault("battery low")),
        }


@pytest.mark.long
async def test_each_choice_is_made_after_kill_9_and_the_replay_is_equal(
    ros_domain: int, tmp_path: Path
) -> None:
    tables = [Apart(number) for number in range(1, len(AFTER_KILL) + 1)]
    connection = {"driver": "nav2"}
    vehicles = dict.fromkeys((*(each.vehicle for each in tables), SPARE), connection)
    fleet, journal = fleet_file(tmp_path, vehicles, FAR_M), tmp_path / "journal.db"
    planned = [
        f"{table.vehicle}: {FAULTS[error]}"
        for table, (error, _) in zip(tables, AFTER_KILL, strict=True)
        if error in FAULTS
    ]
    words = ("--fleet", fleet, "--journal", journal, "--speed", f"{SPEED:g}", "--ocu", "none")
    with programs(tmp_path, ros_domain) as m2pem:
        faults = [word for fault in planned for word in ("--fault", fault)]
        simulated = m2pem.simulate(fleet, SPEED, *faults)

        def serve() -> Program:
            return m2pem.m2pem("serve", *words)

        for each in tables:
            each.simulated = simulated
        rows = [(table, *row) for table, row in zip(tables, AFTER_KILL, strict=True)]
        await decide_after_kill(serve, journal, SystemClock(SPEED), rows)
