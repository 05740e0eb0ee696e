"""A clock that is set, and a suspended computer, with real processes whose clocks are moved.

The fleet has `max_outage: 10 min`.
"""

import signal
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, fleet_with_state
from tests.executive.conftest import behavior, flow, mission
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


SUSPENDED_S = 900
MINUTES_12, DAYS_2 = timedelta(minutes=12), timedelta(days=2)
FAR = '<m2pem:property name="target" value="[38.20, -77.3192, 60]"/>'


def timer(element: str, when: str) -> str:
    return (
        f'<intermediateCatchEvent id="{element}"><timerEventDefinition>{when}'
        f"</timerEventDefinition></intermediateCatchEvent>{flow('S', element)}{flow(element, 'E')}"
    )


def suspended_mission() -> bytes:
    """A drive of 10 km; timers that are due while the computer is suspended, and in two days."""
    now = datetime.now(UTC)
    soon, late = (f"{now + each:%Y-%m-%dT%H:%M:%SZ}" for each in (MINUTES_12, DAYS_2))
    return mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><endEvent id="E"/>'
        f"{behavior('Drive', 'goto', 'evsg1', parameters=FAR)}{flow('S', 'Drive')}"
        f"{flow('Drive', 'E')}{timer('Duration', '<timeDuration>PT8M</timeDuration>')}"
        f"{timer('Date', f'<timeDate>{soon}</timeDate>')}"
        f"{timer('Later', f'<timeDate>{late}</timeDate>')}</process>"
    )


def test_after_a_suspend_a_run_looks_at_its_vehicles_before_its_timers_fire(
    faulty: CommandLine, faults: Faults, tmp_path: Path
) -> None:
    """The clock on the wall is set meanwhile: no date follows."""
    fleet, state = fleet_with_state(tmp_path)
    (tmp_path / "suspended.bpmn").write_bytes(suspended_mission())
    program = faulty.start("serve", "--fleet", fleet, "--ocu", "none", "--format", "json")
    assert "serving" in program.stderr.readline()
    assert faulty.run("start", "suspended.bpmn")[0] == 0
    program.until_record("BehaviorProgressed", state="RUNNING")
    program.send(signal.SIGSTOP)
    faults.set(
        f"clock {time.CLOCK_BOOTTIME} {SUSPENDED_S}",
        f"clock {time.CLOCK_REALTIME} {SUSPENDED_S + 3 * DAY_S}",
    )
    program.send(signal.SIGCONT)
    program.until_said(f"the executive did nothing for {SUSPENDED_S} s")
    asked = program.until_record("PromptOpened")
    assert f"the executive did nothing for {SUSPENDED_S} s" in asked["text"]
    assert "EventTriggered" not in [each["record"] for each in program.records]
    wait_until_recorded(state, EffectKind.HOLD)
    for element in ("Duration", "Date"):
        left = program.until_record("TokenLeft", element=element, outcome="completed")
        assert SUSPENDED_S < left["t"] < SUSPENDED_S + 60
    faulty.run("stop", "r1")
    program.until_record("TokenLeft", element="Later", outcome="terminated")
