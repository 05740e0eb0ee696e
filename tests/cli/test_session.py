import asyncio
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest

from m2pem.cli.session import refuse_speed
from m2pem.engine.state import RunStatus
from m2pem.executive.executive import Executive
from m2pem.executive.simulated_state import tidy_up, with_own_state, with_shared_state
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from tests.command_line import FLEET

MIXED_FLEET = """
version: 1
name: mixed
vehicles:
  uav1: {{domain: air, arbiter: mavlink, {uav1}payloads: {{cam: {{arbiter: ptz}}}}}}
  ugv1: {{domain: ground, arbiter: sim}}
"""


def refusal(fleet: Fleet, speed: float) -> str:
    """Why the fleet cannot run at this speed; empty if it can."""
    try:
        refuse_speed(fleet, speed)
    except click.UsageError as error:
        return str(error)
    return ""


def test_what_is_neither_simulated_nor_software_in_the_loop_keeps_real_time(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(MIXED_FLEET.format(uav1=""), encoding="utf-8")
    refused = refusal(load_fleet(file), 10.0)
    assert re.search(r"--speed 10: uav1, uav1/cam of .* `sitl: true`", refused)
    assert refusal(load_fleet(file), 1.0) == ""
    assert refusal(simulated_fleet(load_fleet(file)), 10.0) == ""


def test_software_in_the_loop_runs_as_fast_as_it_is_told_with_its_payloads(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(MIXED_FLEET.format(uav1="sitl: true, "), encoding="utf-8")
    assert refusal(load_fleet(file), 10.0) == ""


@pytest.fixture
def fleet() -> Fleet:
    """All of it simulated, but evsg2, which is real."""
    read = load_fleet(FLEET)
    vehicles = dict(read.vehicles)
    evsg2 = next(each for each in vehicles.values() if each.id == "evsg2")
    vehicles[evsg2.id] = replace(evsg2, arbiter="ros")
    return replace(read, vehicles=vehicles)


def states(fleet: Fleet) -> dict[str, Any]:
    everything = [*fleet.vehicles.values(), *fleet.payloads.values()]
    return {each.id: each.settings["state"] for each in everything if "state" in each.settings}


def test_simulated_resources_share_one_file_beside_the_journal(
    fleet: Fleet, tmp_path: Path
) -> None:
    kept = states(with_own_state(fleet, tmp_path / "journal.db"))
    assert set(kept) == {"evsg1", "evsg1/gpr", "evsg2/ptz", "evsg3", "lead"}
    (path,) = set(kept.values())
    assert path.startswith(f"{tmp_path}/journal.db-sim-")


def test_all_are_simulated_if_that_is_asked(fleet: Fleet, tmp_path: Path) -> None:
    kept = states(with_own_state(simulated_fleet(fleet), tmp_path / "journal.db"))
    assert len(kept) == len(fleet.vehicles) + len(fleet.payloads)


def test_each_run_has_a_file_of_its_own(fleet: Fleet, tmp_path: Path) -> None:
    journal = tmp_path / "journal.db"
    assert with_own_state(fleet, journal) != with_own_state(fleet, journal)


def test_a_service_has_the_same_file_again(fleet: Fleet, tmp_path: Path) -> None:
    journal = tmp_path / "journal.db"
    simulated = simulated_fleet(fleet)
    first = with_shared_state(simulated, journal, fleet)
    assert first == with_shared_state(simulated, journal, fleet)
    other = replace(fleet, name="other")
    assert states(first) != states(with_shared_state(simulated_fleet(other), journal, other))


def test_a_journal_in_memory_has_no_file(fleet: Fleet) -> None:
    assert with_own_state(fleet, None) == fleet


def test_what_the_fleet_says_itself_is_kept(fleet: Fleet, tmp_path: Path) -> None:
    lead = next(each for each in fleet.vehicles.values() if each.id == "lead")
    own = replace(lead, settings={**lead.settings, "state": "/srv/lead"})
    fleet = replace(fleet, vehicles={**fleet.vehicles, own.id: own})
    kept = with_own_state(simulated_fleet(fleet), tmp_path / "journal.db")
    assert states(kept)["lead"] == "/srv/lead"


@pytest.mark.parametrize(
    ("status", "failure", "replaced", "kept"),
    [
        (RunStatus.ENDED, None, False, False),
        (RunStatus.RUNNING, None, False, True),
        (RunStatus.ENDED, ValueError(), False, True),
        (RunStatus.ENDED, None, True, True),
    ],
)
def test_the_file_goes_when_nobody_needs_it(
    fleet: Fleet,
    tmp_path: Path,
    status: RunStatus,
    failure: Exception | None,
    replaced: bool,
    kept: bool,
) -> None:
    superseded = asyncio.Event()
    if replaced:
        superseded.set()
    journal = tmp_path / "journal.db"
    fleet = with_own_state(simulated_fleet(fleet), journal)
    (state,) = set(states(fleet).values())
    for name in (journal, Path(state), Path(f"{state}-wal")):
        name.touch()
    run = SimpleNamespace(state=SimpleNamespace(status=status))
    runners = {"r1": SimpleNamespace(run=run, failure=failure)}
    executive = SimpleNamespace(
        fleet=fleet, runners=runners, superseded=superseded, journal=MemoryJournal()
    )
    tidy_up(cast("Executive", executive), journal)
    assert Path(state).exists() is kept
    assert Path(f"{state}-wal").exists() is kept
    assert journal.exists()
