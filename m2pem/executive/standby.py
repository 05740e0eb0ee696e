"""A standby: an executive that waits until it may serve a fleet, and commands no vehicle before.

It opens no connection to a vehicle: a second sender would disturb the executive that serves.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from m2pem.errors import FleetError, FleetServedError, JournalError
from m2pem.executive.vehicle_locks import VehicleInUseError, VehicleLocks
from m2pem.fleet.fleet import Fleet, digest_of
from m2pem.journal.base import Journal
from m2pem.journal.fleet_server import FleetServer

ASK_EACH_S = 0.2


async def stand_by(
    journal: Journal, fleet: Fleet, locks: VehicleLocks, say: Callable[[str], None]
) -> None:
    """Return when this executive serves the fleet, and no other one commands its vehicles.

    `locks`: of its vehicles. `say` is told what it waits for, each time that this changes.

    Raises:
        FleetError: another fleet of this name is served: its runs could not be taken over.
        JournalError: the journal, a file of this host, cannot be used.
    """
    said, changes = "", 0
    while (why := await _try(journal, fleet, locks)) is not None:
        if why != said:
            say(why)
            said = why
        with suppress(TimeoutError):
            changes = await asyncio.wait_for(journal.changed(changes), ASK_EACH_S)
    if said:
        say(f"taking over {fleet.name}")


async def _try(journal: Journal, fleet: Fleet, locks: VehicleLocks) -> str | None:
    """Serve the fleet, if no other executive does; else return what is waited for."""
    try:
        server = await _served_by(journal, fleet, locks)
    except JournalError as error:
        if journal.lease_s is None:
            raise
        return f"standing by for {fleet.name}: {error}"  # the database may come back
    if server is not None:
        if server.digest not in ("", digest_of(fleet)):
            raise FleetError(
                f"{fleet.file}: {server} serves another fleet with the name {fleet.name}, whose "
                "runs could not be taken over: give both the same fleet file and --simulate, or "
                "give this fleet another name",
                (),
            )
        return f"standing by for {fleet.name}: {server} serves it"
    try:
        locks.acquire()
    except VehicleInUseError as error:
        await journal.leave_fleet(fleet.name)
        await asyncio.sleep(ASK_EACH_S)  # other standbys are told of it, and try
        return f"standing by for {fleet.name}: {error}"
    locks.release()
    return None


async def _served_by(journal: Journal, fleet: Fleet, locks: VehicleLocks) -> FleetServer | None:
    """Serve the fleet; returns who else does, and None if this executive does now."""
    try:
        await locks.serve(journal, fleet)
    except FleetServedError:
        return await journal.fleet_server(fleet.name, locks.resources) or FleetServer()
    return None
