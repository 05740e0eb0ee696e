"""What a command needs to drive runs, read from its words; refused before anything moves."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from m2pem.api.control import SimulationResult
from m2pem.cli.options import MADE_UP, UnusableError
from m2pem.errors import AnswersError, PluginError
from m2pem.executive.arbiters import SIMULATED
from m2pem.executive.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.findings import has_errors
from m2pem.journal.base import Journal
from m2pem.model.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.resources.fleet import Fleet, Payload, Vehicle
from m2pem.resources.fleet_file import load_fleet
from m2pem.resources.madeup import fleet_for
from m2pem.sim.answers import Answers, check_answers, load_answers


def get_fleet(name: str, mission: Mission) -> Fleet:
    """The fleet of a file, or one that is made up for the mission.

    Raises:
        FleetError: with every finding.
    """
    return fleet_for(mission) if name == MADE_UP else load_fleet(name)


def get_answers(file: Path | None, mission: Mission) -> Answers | None:
    """The answers for a mission; None without a file.

    Raises:
        AnswersError: with every finding.
    """
    if file is None:
        return None
    answers = load_answers(file)
    findings = check_answers(answers, mission)
    if has_errors(findings):
        raise AnswersError(f"{file} does not fit {mission.file}", findings)
    return answers


def refuse_speed(fleet: Fleet, speed: float, *, simulated: bool) -> None:
    """Real vehicles keep real time.

    Raises:
        UsageError: the clock would not be theirs.
    """
    if speed == 1.0 or simulated:
        return
    everything: list[Vehicle | Payload] = [*fleet.vehicles.values(), *fleet.payloads.values()]
    real = [each.id for each in everything if each.arbiter != SIMULATED]
    if real:
        raise click.UsageError(
            f"--speed {speed:g}: {', '.join(real)} of {fleet.file} would be real; add --simulate"
        )


def make_executive(
    fleet: Fleet,
    journal: Journal,
    plugins: PluginManager,
    clock: SystemClock,
    *,
    simulated: bool,
    answers: Answers | None = None,
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


def _rehearse(*arguments: Any, **options: Any) -> SimulationResult:
    from m2pem.sim.rehearsal import rehearse

    return rehearse(*arguments, **options)
