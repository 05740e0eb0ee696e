"""Asks a fleet's arbiters what they offer, without connecting them."""

import logging

from m2pem.api.arbiter import ArbiterContext
from m2pem.cli.options import UnusableError
from m2pem.errors import PluginError
from m2pem.executive.arbiters import FleetArbiters
from m2pem.executive.clock import SystemClock
from m2pem.fleet.fleet import Fleet
from m2pem.plugins import PluginManager
from m2pem.telemetry.bus import Bus


def arbiters_of(fleet: Fleet, plugins: PluginManager) -> FleetArbiters:
    """The arbiters of a fleet, for questions alone.

    Raises:
        UnusableError: the fleet names an arbiter that no plugin provides.
    """
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
