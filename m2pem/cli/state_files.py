"""Files in which simulated vehicles outlive the executive, so that a crash can be resumed.

A file's name stands in the settings of the fleet's simulated resources, and so in the run's
snapshot of the fleet: whoever resumes the run finds the vehicles.
"""

import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from m2pem.engine.state import RunStatus
from m2pem.executive.arbiters import SIMULATED
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet, Payload, Vehicle
from m2pem.fleet.snapshot import dump

STATE = "state"
"""The setting of a simulated resource that names its file."""


def with_own_state(fleet: Fleet, journal: Path | None, *, simulated: bool) -> Fleet:
    """The fleet, kept in a new file beside the journal: nobody else has these vehicles."""
    return _with_state(fleet, journal, secrets.token_hex(4), simulated)


def with_shared_state(fleet: Fleet, journal: Path | None, *, simulated: bool) -> Fleet:
    """The fleet, kept in the file that this fleet always has beside this journal."""
    name = hashlib.sha256(dump(fleet)).hexdigest()[:8]
    return _with_state(fleet, journal, name, simulated)


def _with_state(fleet: Fleet, journal: Path | None, name: str, simulated: bool) -> Fleet:
    if journal is None:
        return fleet
    path = f"{_prefix(journal)}{name}"

    def settings(arbiter: str, own: Mapping[str, Any]) -> Mapping[str, Any]:
        """What the fleet says itself goes first."""
        return {STATE: path, **own} if simulated or arbiter == SIMULATED else own

    return replace(
        fleet,
        vehicles={
            name: replace(vehicle, settings=settings(vehicle.arbiter, vehicle.settings))
            for name, vehicle in fleet.vehicles.items()
        },
        payloads={
            name: replace(payload, settings=settings(payload.arbiter, payload.settings))
            for name, payload in fleet.payloads.items()
        },
    )


def tidy_up(executive: Executive, journal: Path | None) -> None:
    """Delete the files made here, unless a run has not ended and needs them to be resumed."""
    if journal is None or any(
        runner.failure is not None or runner.run.state.status is not RunStatus.ENDED
        for runner in executive.runners.values()
    ):
        return
    everything: list[Vehicle | Payload] = [
        *executive.fleet.vehicles.values(),
        *executive.fleet.payloads.values(),
    ]
    for path in {str(each.settings.get(STATE, "")) for each in everything}:
        if path.startswith(_prefix(journal)):
            for suffix in ("", "-wal", "-shm"):
                Path(f"{path}{suffix}").unlink(missing_ok=True)


def _prefix(journal: Path) -> str:
    return f"{journal.resolve()}-sim-"
