"""Incidents of vehicles over MAVLink: simulated autopilots, over real UDP."""

import asyncio
import json
from collections.abc import Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at
from mavlink_sitl import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem import load_fleet
from m2pem.api import Clock, LocalFrame, RunStatus
from m2pem.api.clock import SystemClock
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.loopback import run_on_loopback
from tests.command_line import Program, command_line
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
                await until_incident(control, clock, "REJECTED")
                await control.resolve_incident(run, "i1", "set_data", data={"speed": 5})
                await control.resolve_incident(run, "i1", "retry")
                await simulator.until(lambda: east_of(simulator, 1) > 5)
                await control.take("rover1", by="anna")
                await until_incident(control, clock, "TAKEN_OVER")
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


# --- every error and every choice -----------------------------------------------------------------

ROVERS = {1: "rover1", 2: SPARE}
ROWS_SPEED = 2.0
FENCED_M = 200.0
NEAR_M, FAR_M = 0.0, 150.0


class Field(Table):
    """Two rovers in a fence, an executive that may preempt, and an operator at its socket."""

    vehicle = "rover1"
    simulator: Simulator

    def data(self) -> dict[str, Any]:
        """To the other end of the field."""
        east = FAR_M if east_of(self.simulator, 1) < (NEAR_M + FAR_M) / 2 else NEAR_M
        return {"speed": 5, "target": [*at(east, 0.0)]}

    def provocations(self) -> dict[str, Provocation]:
        faults, reposition = self.simulator[1].faults, dialect.MAV_CMD_DO_REPOSITION

        async def restore(_: str) -> None:
            faults.restore_link()
            await self.available()

        return {
            **self.common(),
            "a command is refused": Provocation(
                "FAILED",
                before=act(lambda: faults.refuse_command(reposition)),
                mend=act(lambda: faults.allow_command(reposition)),
            ),
            "out of the fence": Provocation(
                "REJECTED", {"target": [*at(FENCED_M + 50, 0.0)]}, mend=self.set_right
            ),
            "the link is lost": Provocation("LINK_LOST", during=act(faults.cut_link), mend=restore),
            "the battery is low": Provocation(
                "BATTERY_LOW",
                during=act(faults.set_battery),
                mend=act(lambda: faults.set_battery(1.0)),
            ),
            "a pilot takes over": Provocation(
                "TAKEN_OVER", during=act(lambda: faults.take_over("MANUAL"))
            ),
        }


def fenced_fleet(folder: Path, simulator: Simulator) -> Path:
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
    places = [at(east * FENCED_M, north * FENCED_M) for east, north in corners]
    ring = [[longitude, latitude] for latitude, longitude in places]
    fence = {"type": "Polygon", "coordinates": [ring]}
    (folder / "fence.geojson").write_text(json.dumps(fence), encoding="utf-8")
    vehicles = "".join(
        f"  {name}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 20 s\n"
        f"    connection: {{url: 'udpout://{host}:{port}', system_id: {number}}}\n"
        for number, name in ROVERS.items()
        for host, port in [simulator[number].address]
    )
    file = folder / "fleet.yaml"
    file.write_text(
        f"version: 1\norigin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: {HOME_ALTITUDE_M}}}\n"
        "allocation: {preemption: true}\nareas: {fence: fence.geojson}\nfence: fence\n"
        f"vehicles:\n{vehicles}",
        encoding="utf-8",
    )
    return file


def play_rows(folder: Path, rows: Sequence[tuple[str, str]]) -> None:
    """Play rows on one executive and one set of rovers."""

    async def main(clock: Clock) -> None:
        specs = [
            VehicleSpec(
                Kind.ROVER,
                number,
                Location(*at(0.0, 20.0 * (number - 1)), HOME_ALTITUDE_M),
                estimator_s=1.0,
            )
            for number in ROVERS
        ]
        async with Simulator(specs, speed=ROWS_SPEED, to=None) as simulator:
            fleet = load_fleet(fenced_fleet(folder, simulator))
            journal = MemoryJournal()
            executive = Executive(fleet, journal, PluginManager(), clock, speed=ROWS_SPEED)
            async with executive, over_socket(executive, folder) as control:
                field = Field()
                field.simulator, field.desk = simulator, Desk(control, clock)
                await field.play(rows, journal)

    run_on_loopback(main, ROWS_SPEED)


ERRORS = (
    "a command is refused",
    "out of the fence",
    "the link is lost",
    "the battery is low",
    "a pilot takes over",
    "a task takes it",
    "an operator has it",
    "an operator takes over",
    "a wrong parameter",
)


def test_each_choice_about_an_error_of_a_rover(tmp_path: Path) -> None:
    play_rows(tmp_path, list(zip(ERRORS, CHOICES, strict=False)))


@pytest.mark.long
@pytest.mark.parametrize("error", ERRORS)
def test_every_choice_about_every_error_of_a_rover(tmp_path: Path, error: str) -> None:
    play_rows(tmp_path, [(error, choice) for choice in CHOICES])


# --- kill -9 while the incidents are open ---------------------------------------------------------

KILLED_SPEED = 5.0
FAULTS = {
    "a pilot takes over": "mode MANUAL at 15 s",
    "the link is lost": "cut link at 15 s for 60 s",
    "the battery is low": "battery low at 15 s",
    "a command is refused": f"refuse command {dialect.MAV_CMD_DO_REPOSITION}",
}
"""Of vehicles in a process of their own, after they were armed."""
CODES = {
    "a pilot takes over": "TAKEN_OVER",
    "the link is lost": "LINK_LOST",
    "the battery is low": "BATTERY_LOW",
    "a command is refused": "FAILED",
}
AFTER_KILL = (
    ("a pilot takes over", "retry"),
    ("the link is lost", "retry_with"),
    ("the battery is low", "skip"),
    ("a wrong parameter", "set_data"),
    ("an operator has it", "move"),
    ("a command is refused", "end"),
)


class Apart(Table):
    """A rover in a process of its own, whose faults are planned."""

    def __init__(self, number: int) -> None:
        self.number, self.vehicle = number, f"rover{number}"

    def data(self) -> dict[str, Any]:
        return {"speed": 5, "target": [*at(FAR_M, 20.0 * self.number)]}

    def provocations(self) -> dict[str, Provocation]:
        return {**self.common(), **{name: Provocation(code) for name, code in CODES.items()}}


@pytest.mark.long
def test_each_choice_is_made_after_kill_9_and_the_replay_is_equal(tmp_path: Path) -> None:
    tables = [Apart(number) for number in range(1, len(AFTER_KILL) + 1)]
    names = [*(each.vehicle for each in tables), SPARE]
    vehicles = "".join(
        f"  {name}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 5 s\n"
        f"    connection: {{url: 'udpin://127.0.0.1:{{port}}', system_id: {number}}}\n"
        "    sitl: true\n"
        for number, name in enumerate(names, 1)
    )
    port, fleet, journal = free_port(), tmp_path / "fleet.yaml", tmp_path / "journal.db"
    fleet.write_text(
        f"version: 1\norigin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: {HOME_ALTITUDE_M}}}\n"
        f"vehicles:\n{vehicles.replace('{port}', str(port))}",
        encoding="utf-8",
    )
    planned = [
        f"{table.number}: {FAULTS[error]}"
        for table, (error, _) in zip(tables, AFTER_KILL, strict=True)
        if error in FAULTS
    ]
    with contextmanager(command_line)(tmp_path) as m2pem:
        speed = f"{KILLED_SPEED:g}"
        m2pem.start(
            *("sim", "mavlink", "--rovers", str(len(names)), "--speed", speed, "--ekf", "1s"),
            *("--home", f"{HOME[0]},{HOME[1]},{HOME_ALTITUDE_M:g}"),
            *("--to", f"udp://127.0.0.1:{port}"),
            *(word for fault in planned for word in ("--fault", fault)),
        )

        def serve() -> Program:
            words = ("--fleet", fleet, "--journal", journal, "--speed", speed, "--ocu", "none")
            program = m2pem.start("serve", *words)
            while "serving" not in program.stderr.readline():
                pass
            return program

        rows = [(table, *row) for table, row in zip(tables, AFTER_KILL, strict=True)]
        asyncio.run(decide_after_kill(serve, journal, SystemClock(KILLED_SPEED), rows))
