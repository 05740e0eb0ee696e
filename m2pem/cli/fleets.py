"""Gets the fleet that a command names, and asks its arbiters what they offer."""

import logging

from m2pem.api.arbiter import ArbiterContext
from m2pem.cli.options import MADE_UP
from m2pem.executive.arbiters import FleetArbiters
from m2pem.executive.clock import SystemClock
from m2pem.gateway.bus import Bus
from m2pem.model.elements import Mission
from m2pem.plugins import PluginManager
from m2pem.resources.fleet import Fleet
from m2pem.resources.fleet_file import load_fleet
from m2pem.resources.madeup import fleet_for


def get_fleet(name: str, mission: Mission) -> Fleet:
    """The fleet of a file, or one that is made up for the mission.

    Raises:
        FleetError: with every finding.
    """
    return fleet_for(mission) if name == MADE_UP else load_fleet(name)


def arbiters_of(
    fleet: Fleet, plugins: PluginManager, *, simulated: bool = False
) -> FleetArbiters:
    """The arbiters of a fleet, for questions alone: they are never connected."""
    clock = SystemClock()
    context = ArbiterContext(
        clock,
        Bus(),
        logging.getLogger("m2pem.arbiter"),
        fleet.origin,
        {team.name: team.members for team in fleet.teams.values()},
    )
    return FleetArbiters(fleet, plugins, context, simulated=simulated)
