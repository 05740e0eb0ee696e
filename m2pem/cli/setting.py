"""What a command needs to drive runs, read from its words; refused before anything moves."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from m2pem.api.control import SimulationResult
from m2pem.cli.options import UnusableError
from m2pem.errors import PluginError
from m2pem.executive.arbiters import SIMULATED
from m2pem.executive.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.executive.script import Script
from m2pem.fleet.fleet import Fleet, Payload, Vehicle
from m2pem.journal.base import Journal
from m2pem.plugins import PluginManager


def refuse_speed(fleet: Fleet, speed: float, *, simulated: bool) -> None:
    """Real vehicles keep real time.

    Raises:
        UsageError: the clock would not be theirs.
    """
    if speed == 1.0 or simulated:
        return
    everything: list[Vehicle | Payload] = [*fleet.vehicles.values(), *fleet.payloads.values()]
    sitl = {vehicle.id for vehicle in fleet.vehicles.values() if vehicle.sitl}
    real = [
        each.id
        for each in everything
        if each.arbiter != SIMULATED and each.id.partition("/")[0] not in sitl
    ]
    if real:
        raise click.UsageError(
            f"--speed {speed:g}: {', '.join(real)} of {fleet.file} would be real; add --simulate, "
            "or mark what is software in the loop with `sitl: true`"
        )


def make_executive(
    fleet: Fleet,
    journal: Journal,
    plugins: PluginManager,
    clock: SystemClock,
    *,
    simulated: bool,
    answers: Script | None = None,
    search_path: Sequence[Path] = (),
) -> Executive:
    """An executive that has not connected yet.

    Raises:
        UnusableError: the fleet names an arbiter that no plugin provides.
    """
    try:
        return Executive(
            fleet,
            journal,
            plugins,
            clock,
            simulated=simulated,
            script=answers,
            speed=clock.speed,
            rehearse=_rehearse,
            search_path=search_path,
        )
    except PluginError as error:
        raise UnusableError(f"{fleet.file}: {error}") from error


async def _rehearse(*arguments: Any, **options: Any) -> SimulationResult:
    from m2pem.rehearsal.rehearser import rehearse_apart

    return await rehearse_apart(*arguments, **options)
