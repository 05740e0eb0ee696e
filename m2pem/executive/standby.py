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
from m2pem.journal.standbys import StandbyNote

ASK_EACH_S = 0.2


async def stand_by(
    journal: Journal,
    fleet: Fleet,
    locks: VehicleLocks,
    say: Callable[[str, FleetServer | None], None],
    page: str = "",
) -> None:
    """Return when this executive serves the fleet, and no other one commands its vehicles.

    `locks`: of its vehicles. `say` gets what it waits for, and for which executive if that is
    known, each time that this changes. `page`: the address of its web page, or "". The journal
    has a note meanwhile that it stands by.

    Raises:
        FleetError: another fleet of this name is served: its runs could not be taken over.
        JournalError: the journal, a file of this host, cannot be used.
    """
    said, changes = "", 0
    note = StandbyNote(journal, fleet, page)
    try:
        while (found := await _try(journal, fleet, locks)) is not None:
            why, server = found
            if why != said:
                say(why, server)
                said = why
            with suppress(JournalError):  # it is said at the next try
                await note.renew()
            with suppress(TimeoutError):
                changes = await asyncio.wait_for(journal.changed(changes), ASK_EACH_S)
        if said:
            say(f"taking over {fleet.name}", None)
    finally:
        with suppress(JournalError):  # it ends with the lease
            await note.remove()


async def _try(
    journal: Journal, fleet: Fleet, locks: VehicleLocks
) -> tuple[str, FleetServer | None] | None:
    """Serve the fleet, if no other executive does; else return what is waited for, and for whom."""
    try:
        server = await _served_by(journal, fleet, locks)
    except JournalError as error:
        if journal.lease_s is None:
            raise
        return f"standing by for {fleet.name}: {error}", None  # the database may come back
    if server is not None:
        if server.digest not in ("", digest_of(fleet)):
            raise FleetError(
                f"{fleet.file}: {server} serves another fleet with the name {fleet.name}, whose "
                "runs could not be taken over: give both the same fleet file and --simulate, or "
                "give this fleet another name",
                (),
            )
        return f"standing by for {fleet.name}: {server} serves it", server
    try:
        locks.acquire()
    except VehicleInUseError as error:
        await journal.leave_fleet(fleet.name)
        await asyncio.sleep(ASK_EACH_S)  # other standbys are notified of it, and try
        return f"standing by for {fleet.name}: {error}", None
    locks.release()
    return None


async def _served_by(journal: Journal, fleet: Fleet, locks: VehicleLocks) -> FleetServer | None:
    """Serve the fleet; returns who else does, and None if this executive does now."""
    try:
        await locks.serve(journal, fleet)
    except FleetServedError:
        return await journal.fleet_server(fleet.name, locks.resources) or FleetServer()
    return None
