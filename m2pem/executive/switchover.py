"""A switchover: an executive leaves its runs, as they are, to the one that stands by, and ends.

An operator asks for it (maintenance of a host). It happens by itself when no vehicle is received
any more and another host has a standby, which may reach them, and when runs are held as the journal
failed, which a standby can use again. The standby takes the runs up as those of an executive that
was killed; this one commands nothing more before.
"""

import asyncio
import logging
from collections.abc import Callable

from m2pem.api.health import ExecutiveAddress
from m2pem.errors import JournalError, OperatorError, StaleEpochError
from m2pem.executive.supervisor import Supervisor
from m2pem.journal.fleet_server import FleetServer
from m2pem.journal.standbys import standbys_of

log = logging.getLogger("m2pem.executive")

ANSWERED_WITHIN_S = 1.0
"""A journal that has not said by then who stands by: lost vehicles count as lost here."""


class Switchover:
    """`left` is set when the runs are left, and this executive must end. `by_operator`: an operator
    asked for it: nothing need start this executive again."""

    def __init__(self, supervisor: Supervisor, left: asyncio.Event) -> None:
        self._supervisor = supervisor
        self._left = left
        self._deciding = asyncio.Lock()
        self._taken_over_by: ExecutiveAddress | None = None
        self.by_operator = False

    async def ask(self, by: str) -> ExecutiveAddress:
        """Leave the runs to a standby, as an operator asks; returns which one stands by.

        Raises:
            OperatorError: no executive stands by; nothing has changed then.
            JournalError: the journal cannot say it.
        """
        supervisor = self._supervisor
        async with self._deciding:
            if self._taken_over_by is not None:
                self.by_operator = True
                return self._taken_over_by
            standbys = await standbys_of(supervisor.journal, supervisor.fleet.name)
            if not standbys:
                raise OperatorError(
                    f"no executive stands by for {supervisor.fleet.name}, and nothing has changed: "
                    "start one with m2pem serve --standby, on the same journal and with the same "
                    "fleet"
                )
            self.by_operator = True
            return await self._leave(standbys[0], f"{by or 'an operator'} asked for it")

    async def link_lost(self, receives_nothing: Callable[[], bool]) -> bool:
        """A link is being lost. Returns whether the runs are left to another executive: to one of
        another host, if no vehicle is received here any more.

        `receives_nothing`: whether that is so. Of links that are lost together, each waits for what
        is decided about the first: none is lost to the runs meanwhile.
        """
        async with self._deciding:
            if self._left.is_set():
                return True
            # The standbys of a journal without a lease are on this host.
            if self._supervisor.journal.lease_s is None or not receives_nothing():
                return False
            return await self._left_to_another_host()

    async def _left_to_another_host(self) -> bool:
        supervisor = self._supervisor
        try:
            async with asyncio.timeout(ANSWERED_WITHIN_S):
                standbys = await standbys_of(supervisor.journal, supervisor.fleet.name)
        except (JournalError, TimeoutError) as error:
            log.warning("who stands by is not known: %s", error or "the journal does not answer")
            return False
        elsewhere = [each for each in standbys if not each.is_here]
        if elsewhere:
            await self._leave(elsewhere[0], "no vehicle is received here any more")
        return bool(elsewhere)

    async def journal_is_back(self) -> None:
        """The journal can be used. Leave the runs to a standby, if some are held as the journal
        failed: here only `m2pem resume` would go on with them.

        Raises:
            JournalError: the journal cannot say it.
        """
        supervisor = self._supervisor
        failed = {
            each.id
            for each in supervisor.runners.values()
            if each.done.is_set() and isinstance(each.failure, JournalError)
        }
        if not failed or self._left.is_set():
            return
        standbys = await standbys_of(supervisor.journal, supervisor.fleet.name)
        if not standbys:
            return
        # Where entries are lost, only the host that had acknowledged them notices it.
        held = [
            line.run
            for line in await supervisor.journal.runs()
            if line.run in failed and line.outcome is None and line.loss is None and not line.driven
        ]
        if held:
            await self._leave(standbys[0], f"{', '.join(held)} is held, as the journal had failed")

    async def _leave(self, standby: FleetServer, why: str) -> ExecutiveAddress:
        log.warning("switchover to %s: %s", standby, why)
        await self._supervisor.leave_runs(
            StaleEpochError(f"switchover: {why}; {standby} may drive the runs from now on")
        )
        self._left.set()
        self._taken_over_by = ExecutiveAddress(standby.host, standby.pid, standby.page)
        return self._taken_over_by
