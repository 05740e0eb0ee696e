"""The file beside a journal in which simulated vehicles keep where they are, for a resume."""

import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from m2pem.engine.state import RunStatus
from m2pem.executive.executive import Executive
from m2pem.executive.lost_marks import LostMarks
from m2pem.fleet.fleet import SIMULATED, Fleet, Payload, Vehicle, digest_of

STATE = "state"
"""The setting of a simulated resource that names its file."""


def with_own_state(fleet: Fleet, journal: Path | None) -> Fleet:
    """Return the fleet with its state in a new file beside the journal, for this run alone."""
    return _with_state(fleet, journal, secrets.token_hex(4))


def with_shared_state(fleet: Fleet, journal: Path | None, written: Fleet) -> Fleet:
    """Return the fleet with its state in the file that belongs to this fleet and journal.

    `written`: the fleet as its own file says.
    """
    return _with_state(fleet, journal, digest_of(written)[:8])


def _with_state(fleet: Fleet, journal: Path | None, name: str) -> Fleet:
    if journal is None:
        return fleet
    path = f"{_prefix(journal)}{name}"

    hosted = {vehicle.id for vehicle in fleet.vehicles.values() if vehicle.host}

    def settings(each: Vehicle | Payload) -> Mapping[str, Any]:
        """Return the settings; those of the fleet have precedence."""
        is_here = each.id.partition("/")[0] not in hosted
        own = each.settings
        return {STATE: path, **own} if each.arbiter == SIMULATED and is_here else own

    return replace(
        fleet,
        vehicles={
            name: replace(vehicle, settings=settings(vehicle))
            for name, vehicle in fleet.vehicles.items()
        },
        payloads={
            name: replace(payload, settings=settings(payload))
            for name, payload in fleet.payloads.items()
        },
    )


def tidy_up(executive: Executive, journal: Path | None) -> None:
    """Delete the files made here, unless a run has not ended and needs them to be resumed, or
    another executive serves the fleet by now.

    Simulated vehicles do nothing more then: none is marked as lost.
    """
    if (
        journal is None
        or executive.superseded.is_set()
        or any(
            runner.failure is not None or runner.run.state.status is not RunStatus.ENDED
            for runner in executive.runners.values()
        )
    ):
        return
    everything: list[Vehicle | Payload] = [
        *executive.fleet.vehicles.values(),
        *executive.fleet.payloads.values(),
    ]
    marks = LostMarks(journal, executive.journal.identity, executive.fleet)
    for each in everything:
        path = str(each.settings.get(STATE, ""))
        if path.startswith(_prefix(journal)):
            for suffix in ("", "-wal", "-shm"):
                Path(f"{path}{suffix}").unlink(missing_ok=True)
            for file in marks.files(each.id):
                file.unlink(missing_ok=True)


def _prefix(journal: Path) -> str:
    return f"{journal.resolve()}-sim-"
