"""Failsafes of a real ArduCopter under a mission of m2pem: what was recorded, and still is so."""

import json
from pathlib import Path

import pytest
from mavlink_failsafes import FAILSAFES, FILE, PHASES, play
from mavlink_failsafes_page import page
from mavlink_sitl import program

REPOSITORY = Path(__file__).parents[4]
KEPT = json.loads(FILE.read_text(encoding="utf-8"))
CELLS = [(failsafe, phase) for failsafe in FAILSAFES for phase in PHASES]
RETURNS = ("RTL", "LAND")


def test_every_cell_is_recorded_and_no_other() -> None:
    recorded = [(failsafe, phase) for failsafe, cells in KEPT.items() for phase in cells]
    assert sorted(recorded) == sorted(CELLS)


def test_the_page_says_what_was_recorded() -> None:
    assert (REPOSITORY / "docs/failsafes.md").read_text(encoding="utf-8") == page()


@pytest.mark.parametrize(("failsafe", "phase"), CELLS)
def test_nothing_made_it_worse_and_operators_were_not_left_without_a_word(
    failsafe: str, phase: str
) -> None:
    seen = KEPT[failsafe][phase]
    # No mode comes after RTL or LAND but one of them: m2pem interrupts no failsafe.
    returning = [mode in RETURNS for mode in seen["modes"]]
    assert returning == sorted(returning)
    assert seen["status"] is not None, "the mission waits for what cannot come"
    assert seen["disarmed"] or failsafe.startswith("motors fail")
    said = "\n".join(seen["said"])
    assert seen["status"] == 0 or "uav1 ends" in said
    # Texts of the autopilot that come before its ground station has gone, with the mission.
    before = "|".join(seen["texts"]).split("GCS")[0].split("|")[0]
    late = failsafe.startswith("motors fail")  # it may notice that when m2pem has given up
    assert late or before.split(" N")[0] in said


@pytest.mark.sitl("M2PEM_ARDUCOPTER")
@pytest.mark.parametrize(("failsafe", "phase"), CELLS)
def test_a_failsafe_still_goes_as_recorded(failsafe: str, phase: str) -> None:
    binary = program("M2PEM_ARDUCOPTER")
    assert binary is not None
    seen = play(FAILSAFES[failsafe], PHASES[phase], binary, 72)
    kept = KEPT[failsafe][phase]
    for what in ("modes", "status", "disarmed", "at home"):
        assert seen[what] == kept[what], (what, seen, kept)
