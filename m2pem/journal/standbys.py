"""Which executives stand by for a fleet: each has one of a few places on the journal, which it
serves as others serve vehicles, so that a place is free when its process or its lease has ended.
"""

from m2pem.boot_time import boot_time_s
from m2pem.errors import FleetServedError
from m2pem.fleet.fleet import Fleet, digest_of
from m2pem.journal.base import Journal
from m2pem.journal.fleet_server import FleetServer

STANDBY_OF = "standby of "
"""Before the name of a fleet: what its standbys serve."""

PLACES = ("1", "2", "3", "4")
"""More executives may stand by; those are not shown."""


class StandbyNote:
    """The note that this executive stands by. `page`: the address of its web page, or ""."""

    def __init__(self, journal: Journal, fleet: Fleet, page: str) -> None:
        self._journal = journal
        self._fleet = standby_of(fleet.name)
        self._digest = digest_of(fleet)
        self._page = page
        self._place = ""
        self._renewed_s = 0.0

    async def renew(self) -> None:
        """Write it, or write it again after the lease had ended.

        Raises:
            JournalError: the journal cannot note it.
        """
        lease_s, now_s = self._journal.lease_s, boot_time_s()
        if self._place and (lease_s is None or now_s < self._renewed_s + lease_s / 3):
            return
        self._renewed_s = now_s
        for place in (self._place,) if self._place else PLACES:
            self._place = ""
            try:
                await self._journal.serve_fleet(self._fleet, [place], self._digest, self._page)
            except FleetServedError:
                continue
            self._place = place
            return

    async def remove(self) -> None:
        """Stand by no more.

        Raises:
            JournalError: the journal cannot note it.
        """
        self._place = ""
        await self._journal.leave_fleet(self._fleet)


async def standbys_of(journal: Journal, fleet: str) -> list[FleetServer]:
    """Return who stands by for a fleet of this name.

    Raises:
        JournalError: the journal cannot say it.
    """
    found = [await journal.fleet_server(standby_of(fleet), [place]) for place in PLACES]
    return [each for each in found if each is not None]


def standby_of(fleet: str) -> str:
    """Return the name of what the standbys of a fleet serve."""
    return f"{STANDBY_OF}{fleet}"
