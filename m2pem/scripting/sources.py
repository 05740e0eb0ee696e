"""The missions, fleets and data that scripts and commands name, and the arbiters of a fleet."""

import logging
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, Union

from m2pem.api.authoring import MissionSource
from m2pem.errors import FleetError, PluginError
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission

if TYPE_CHECKING:
    from m2pem.executive.fleet_connections import FleetArbiters
    from m2pem.plugins import PluginManager

DEFAULT_FLEET = "sim"
"""The name of a fleet of simulated vehicles that is made up from the mission."""

FleetSource: TypeAlias = Union[Fleet, str, Path]
"""A fleet that was loaded, the path of a fleet file, or "sim" for one made up from the mission."""


def load_mission(
    mission: MissionSource | Mission, search_path: Iterable[str | Path] = ()
) -> Mission:
    """Read a mission, and the files that it uses.

    `mission`: a path, a `file:` or `http:` URL, or the BPMN itself as bytes; one that was loaded is
    returned as it is. `search_path`: folders to look in for processes that it calls, after its own.

    Raises:
        MissionError: it cannot be read, or is wrong; `findings` has all of them, with file and
            line.
    """
    if isinstance(mission, Mission):
        return mission
    from m2pem.executive.loading import load_source

    return load_source(mission, [Path(each) for each in search_path])


def fleet_of(fleet: FleetSource, mission: Mission) -> Fleet:
    """The fleet that is named, for a mission.

    Raises:
        FleetError: with every finding.
    """
    if isinstance(fleet, Fleet):
        return fleet
    if fleet == DEFAULT_FLEET:
        from m2pem.fleet.default_fleet import fleet_for

        return fleet_for(mission)
    from m2pem.fleet.fleet_file import load_fleet

    return load_fleet(fleet)


def arbiters_of(fleet: Fleet, plugins: "PluginManager") -> "FleetArbiters":
    """The arbiters of a fleet, not connected: for questions alone.

    Raises:
        FleetError: an arbiter cannot use a setting; or the fleet names an arbiter that no plugin
            provides, which has no finding, only a text.
    """
    from m2pem.api.arbiter import ArbiterContext
    from m2pem.api.clock import SystemClock
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
        raise FleetError(f"{fleet.file}: {error}", ()) from error
