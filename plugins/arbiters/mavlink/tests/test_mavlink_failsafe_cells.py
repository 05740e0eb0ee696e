"""Failsafes of real autopilots under a mission of m2pem: what was recorded, and still is so."""

import json
from pathlib import Path

import pytest
from mavlink_failsafe_cells import PX4, VEHICLES
from mavlink_failsafes import FILE, Vehicle, play
from mavlink_failsafes_page import page
from mavlink_sitl import program

REPOSITORY = Path(__file__).parents[4]
KEPT = json.loads(FILE.read_text(encoding="utf-8"))
CELLS = [
    (vehicle, failsafe.name, phase)
    for vehicle in VEHICLES.values()
    for failsafe in vehicle.failsafes.values()
    for phase in vehicle.phases_of(failsafe)
]
RECORDED = [cell for cell in CELLS if cell[2] in KEPT.get(cell[0].name, {}).get(cell[1], {})]
RETURNS = ("RTL", "LAND", "DESCEND")
MOTORS = ("motors fail", "the motor fails", "a motor fails")


def _named(cells: list[tuple[Vehicle, str, str]]) -> list[str]:
    return [f"{vehicle.name}-{failsafe}-{phase}" for vehicle, failsafe, phase in cells]


def test_every_cell_is_recorded_and_no_other() -> None:
    kept = {(v, f, p) for v, failsafes in KEPT.items() for f in failsafes for p in failsafes[f]}
    assert kept == {(vehicle.name, failsafe, phase) for vehicle, failsafe, phase in CELLS}


def test_the_page_says_what_was_recorded() -> None:
    assert (REPOSITORY / "docs/failsafes.md").read_text(encoding="utf-8") == page()


@pytest.mark.parametrize(("vehicle", "failsafe", "phase"), RECORDED, ids=_named(RECORDED))
def test_nothing_made_it_worse_and_operators_were_not_left_without_a_word(
    vehicle: Vehicle, failsafe: str, phase: str
) -> None:
    seen = KEPT[vehicle.name][failsafe][phase]
    # No mode comes after RTL or LAND but one of them: m2pem interrupts no failsafe. When it has
    # arrived, a rover holds, and a PX4 that is not armed is in the mode that was commanded last.
    modes = seen["modes"]
    px4_is_down = vehicle is PX4 and seen["disarmed"]
    if px4_is_down or (seen["at home"] and modes[-1:] == ["HOLD"]):
        modes = modes[:-1]
    returning = [mode in RETURNS for mode in modes]
    assert returning == sorted(returning)
    assert seen["status"] is not None, "the mission waits for what cannot come"
    if vehicle.flies:
        stays = failsafe.startswith((*MOTORS, "no data about the terrain"))
        assert seen["disarmed"] or stays or (vehicle.circles and seen["at home"])
    else:
        assert seen["disarmed"] or seen["stands"]
    said = "\n".join(seen["said"])
    assert seen["status"] == 0 or f"{vehicle.resource} ends" in said
    # The first text of the autopilot, unless it comes when its ground station has gone, with the
    # mission, or when m2pem has given up.
    first = next(iter(seen["texts"]), "").split(" N")[0]
    gone = "GCS" in first or (first == "Radio Failsafe" and not failsafe.startswith("radio"))
    assert gone or failsafe.startswith(MOTORS) or first in said


@pytest.mark.parametrize(
    ("vehicle", "failsafe", "phase"),
    [pytest.param(*cell, marks=pytest.mark.sitl(cell[0].variable)) for cell in RECORDED],
    ids=_named(RECORDED),
)
def test_a_failsafe_still_goes_as_recorded(vehicle: Vehicle, failsafe: str, phase: str) -> None:
    binary = program(vehicle.variable)
    assert binary is not None
    instance = 9 if vehicle.firmware == "px4" else 72
    cause = vehicle.failsafes[failsafe]
    seen = play(vehicle, cause, vehicle.phases_of(cause)[phase], binary, instance)
    kept = KEPT[vehicle.name][failsafe][phase]
    # How near its home a vehicle is that is on its way there depends on the moment.
    compared = ("modes", "status", "disarmed", *(() if phase == "in RTL" else ("at home",)))
    for what in compared:
        assert seen[what] == kept[what], (what, seen, kept)
