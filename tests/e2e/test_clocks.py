"""A clock that is set, with real processes whose clocks are moved.

The fleet has `max_outage: 10 min`.
"""

import time
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, fleet_with_state
from tests.faults import Faults

from .test_full_disk import DRIVE, wait_until_recorded

DAY_S = 86_400


def test_a_run_that_is_resumed_when_the_clock_went_back_holds_its_vehicles_and_asks(
    faulty: CommandLine, faults: Faults, tmp_path: Path
) -> None:
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    program = faulty.start("run", "drive.bpmn", "--fleet", fleet, "--ocu", "plain")
    program.until_text("Noted")
    program.kill()
    faults.set(f"clock {time.CLOCK_REALTIME} {-3 * DAY_S}")
    resumed = faulty.start("resume", "r1", "--ocu", "plain")
    resumed.until_text("is not known: the clock went back")
    wait_until_recorded(state, EffectKind.HOLD)
    resumed.type("stop")
    assert resumed.rest()[0] == 130
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert kinds.count(EffectKind.START) == 1


def test_a_clock_that_is_set_during_a_run_changes_nothing_in_it(
    faulty: CommandLine, faults: Faults, tmp_path: Path
) -> None:
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    program = faulty.start("run", "drive.bpmn", "--fleet", fleet, "--ocu", "plain")
    program.until_text("Noted")
    for days in (3, -3):
        faults.set(f"clock {time.CLOCK_REALTIME} {days * DAY_S}")
        for _ in range(3):
            line = program.until_text("Noted")
            assert float(line.split()[0]) < 60
    program.type("stop")
    assert program.rest()[0] == 130
    assert EffectKind.HOLD not in [effect.kind for effect in recorded_effects(state)]
