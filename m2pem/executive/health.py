"""Whether an executive can do its work now: probes and `m2pem doctor --running` ask it.

However many ask, and however long the disk hangs: the journal is asked once at a time, at most
once in `FRESH_S`, and each answer comes within `JOURNAL_WITHIN_S`.
"""

import asyncio
import time
from collections.abc import Sequence

from m2pem.api.health import HealthCheck, HealthStatus
from m2pem.errors import M2pemError
from m2pem.journal.base import Journal

FRESH_S = 1.0
JOURNAL_WITHIN_S = 1.5

BLOCKED_FOR_S = 10.0
"""How long it is an error that the event loop was blocked: most likely a plugin does it again."""

OK, ERROR = HealthStatus.OK, HealthStatus.ERROR


class ExecutiveHealth:
    """The executive notes here what happens to it; times are of the monotonic clock.

    `connected`: whether the arbiters are.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self.connected = False
        self._broken_off: list[str] = []
        self._blocked_until_s = 0.0
        self._blocked_by = ""
        self._asking: asyncio.Task[HealthCheck] | None = None
        self._asked_s = 0.0

    def broke_off(self, what: str) -> None:
        """Note that a listener has ended by an exception: what it would bring is missing."""
        self._broken_off.append(what)

    def blocked(self, text: str) -> None:
        """Note that the event loop was blocked; `text` says by what and how long."""
        self._blocked_by = text
        self._blocked_until_s = time.monotonic() + BLOCKED_FOR_S

    async def checks(self) -> Sequence[HealthCheck]:
        """Return the checks `journal`, `arbiters` and `event loop`."""
        return await self._check_journal(), self._check_arbiters(), self._check_loop()

    def close(self) -> None:
        """Ask the journal no more."""
        if self._asking is not None:
            self._asking.cancel()

    async def _check_journal(self) -> HealthCheck:
        now_s = time.monotonic()
        asking = self._asking
        if asking is None or (asking.done() and now_s - self._asked_s >= FRESH_S):
            self._asked_s = now_s
            asking = self._asking = asyncio.create_task(self._ask_journal())
        left_s = self._asked_s + JOURNAL_WITHIN_S - now_s
        await asyncio.wait((asking,), timeout=max(0.0, left_s))
        if asking.done() and not asking.cancelled():
            return asking.result()
        waited_s = time.monotonic() - self._asked_s
        why = f"it has not answered for {waited_s:.1f} s"
        remedy = "look at its disk, and at other programs that have the file open"
        return HealthCheck("journal", ERROR, why, remedy)

    async def _ask_journal(self) -> HealthCheck:
        try:
            await self._journal.check()
        except M2pemError as error:
            remedy = "mend the cause, start again and resume the runs"
            return HealthCheck("journal", ERROR, str(error), remedy)
        return HealthCheck("journal", OK, f"{self._journal.file or 'it is in memory and'} writes")

    def _check_arbiters(self) -> HealthCheck:
        if self._broken_off:
            why = f"broke off: {', '.join(self._broken_off)} (the log has the error)"
            remedy = "end the missions, and start the executive again"
            return HealthCheck("arbiters", ERROR, why, remedy)
        if not self.connected:
            return HealthCheck("arbiters", ERROR, "they are not connected", "wait a few seconds")
        return HealthCheck("arbiters", OK, "they are connected")

    def _check_loop(self) -> HealthCheck:
        if time.monotonic() < self._blocked_until_s:
            remedy = "tell the plugin's author, and serve without it"
            return HealthCheck("event loop", ERROR, self._blocked_by, remedy)
        return HealthCheck("event loop", OK, "it runs")
