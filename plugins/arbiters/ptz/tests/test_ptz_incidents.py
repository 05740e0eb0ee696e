"""Incidents of cameras over MAVLink: what a camera fails in, and every choice about it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

from m2pem import load_fleet
from m2pem.api import Clock
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing.loopback import run_on_loopback
from tests.incident_rows import CHOICES, Desk, Provocation, Table, act, over_socket

SPEED = 2.0
VEHICLES = {1: "rover1", 2: "spare1"}


class Camera(Table):
    """A camera whose storage is full."""

    vehicle, spare = "rover1/ptz", "spare1/ptz"
    behavior = "take_picture"
    simulator: Simulator

    def data(self) -> dict[str, Any]:
        return {}

    def provocations(self) -> dict[str, Provocation]:
        faults = self.simulator[1].autopilot.injected_faults

        def full(so: bool) -> Any:
            return act(lambda: setattr(faults, "camera_full", so))

        known = self.common()
        return {
            "its storage is full": Provocation("FAILED", before=full(True), mend=full(False)),
            "an operator has it": known["an operator has it"],
        }


def fleet_file(folder: Path, simulator: Simulator) -> Path:
    vehicles = "".join(
        f"  {name}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 20 s\n"
        f"    connection: {{url: 'udpout://{host}:{port}', system_id: {number}}}\n"
        "    payloads: {ptz: {arbiter: ptz, connection: {driver: mavlink, stabilized: true, "
        f"pictures: '{folder / 'pictures'}'}}}}}}\n"
        for number, name in VEHICLES.items()
        for host, port in [simulator[number].address]
    )
    file = folder / "fleet.yaml"
    file.write_text(f"version: 1\nvehicles:\n{vehicles}", encoding="utf-8")
    return file


def play_rows(folder: Path, rows: Sequence[tuple[str, str]]) -> None:
    """Play rows on one executive and one set of cameras."""

    async def main(clock: Clock) -> None:
        specs = [
            VehicleSpec(Kind.ROVER, number, gimbal=True, camera=True, estimator_s=1.0)
            for number in VEHICLES
        ]
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            journal = MemoryJournal()
            fleet = load_fleet(fleet_file(folder, simulator))
            executive = Executive(fleet, journal, PluginManager(), clock, speed=SPEED)
            async with executive, over_socket(executive, folder) as control:
                camera = Camera()
                camera.simulator, camera.desk = simulator, Desk(control, clock)
                await camera.play(rows, journal)

    run_on_loopback(main, SPEED)


def test_each_choice_about_a_camera_that_fails(tmp_path: Path) -> None:
    play_rows(tmp_path, [("its storage is full", choice) for choice in CHOICES])


@pytest.mark.long
def test_each_choice_about_a_camera_that_an_operator_has(tmp_path: Path) -> None:
    play_rows(tmp_path, [("an operator has it", choice) for choice in CHOICES])
