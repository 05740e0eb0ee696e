"""The files that command-line arguments name: fleets, answers, and the arbiters of a fleet.

Readers of files take a while to load, so each is imported when its file is named.
"""

import logging
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.cli.options import MADE_UP, UnusableError

if TYPE_CHECKING:
    from m2pem.executive.fleet_connections import FleetArbiters
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission
    from m2pem.plugins import PluginManager
    from m2pem.rehearsal.answers import Answers


def get_fleet(name: str, mission: "Mission") -> "Fleet":
    """The fleet of a file, or one that is made up for the mission.

    Raises:
        FleetError: with every finding.
    """
    if name == MADE_UP:
        from m2pem.fleet.default_fleet import fleet_for

        return fleet_for(mission)
    from m2pem.fleet.fleet_file import load_fleet

    return load_fleet(name)


def get_answers(file: Path | None, mission: "Mission") -> "Answers | None":
    """The answers for a mission; None without a file.

    Raises:
        AnswersError: with every finding.
    """
    if file is None:
        return None
    from m2pem.errors import AnswersError
    from m2pem.findings import has_errors
    from m2pem.rehearsal.answers import check_answers, load_answers

    answers = load_answers(file)
    findings = check_answers(answers, mission)
    if has_errors(findings):
        raise AnswersError(f"{file} does not fit {mission.file}", findings)
    return answers


def arbiters_of(fleet: "Fleet", plugins: "PluginManager") -> "FleetArbiters":
    """The arbiters of a fleet, for questions alone.

    Raises:
        UnusableError: the fleet names an arbiter that no plugin provides.
    """
    from m2pem.api.arbiter import ArbiterContext
    from m2pem.api.clock import SystemClock
    from m2pem.errors import PluginError
    from m2pem.executive.fleet_connections import FleetArbiters
    from m2pem.telemetry.bus import Bus

    context = ArbiterContext(
        SystemClock(),
        Bus(),
        logging.getLogger("m2pem.arbiter"),
        fleet.origin,
        {team.name: team.members for team in fleet.teams.values()},
    )
    try:
        return FleetArbiters(fleet, plugins, context)
    except PluginError as error:
        raise UnusableError(f"{fleet.file}: {error}") from error
