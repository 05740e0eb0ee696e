"""Whether this executive still drives its runs: after it was stopped a while, and by its lease.

A process that was stopped (SIGSTOP, a suspended machine, a blocked event loop) may have lost its
runs to another executive, and learns of it at its next entry in the journal. That is too late: what
it was about to send goes out first. So after such a time nothing is sent before the journal has
said that the claims of all runs hold. Holds and an operator's STOP do not wait for that.

In a journal that several hosts share, claims hold for a lease, which the journal renews. When two
thirds of it have passed without that, the runs are held and end here, as when the journal fails:
no other executive may command their vehicles yet. When all of it has passed, nothing more is sent.
"""

import asyncio
import logging
import math
from collections.abc import Callable, Mapping

from m2pem.api.runs import RunId
from m2pem.boot_time import boot_time_s
from m2pem.errors import JournalError, M2pemError, StaleEpochError
from m2pem.executive.outages import StallMonitor
from m2pem.executive.runner import Runner
from m2pem.journal.base import Journal

log = logging.getLogger("m2pem.executive")

TICK_S = 0.25
STOPPED_AFTER_S = 1.0
"""A process that has not run for so long asks the journal; with a short lease, a third of it."""

ANSWERED_WITHIN_S = 2.0
"""A journal that has not answered by then counts as failed: the run is held."""


_NOT_RENEWED = (
    "the journal has not confirmed for {passed_s:.1f} s that this executive drives {run}; after "
    "{lease_s:g} s another one may"
)
_ENDED = (
    "the journal did not renew the lease of this executive in time, so {run} was held, and another "
    "one may drive it from now on"
)


class Ownership:
    """The claims of an executive's runs.

    `replaced` is called for a run that another executive has claimed, or may have claimed because
    the lease has ended; `unknown` for one of which the journal cannot say it: when they return,
    nothing that moves a vehicle goes out for the run. `stalls` says when the process was stopped.
    """

    def __init__(
        self,
        journal: Journal,
        stalls: StallMonitor,
        runners: Mapping[RunId, Runner],
        replaced: Callable[[RunId, StaleEpochError], None],
        unknown: Callable[[RunId, M2pemError], None],
    ) -> None:
        self._journal = journal
        self._stalls = stalls
        self._runners = runners
        self._replaced = replaced
        self._unknown = unknown
        self._stops = 0
        self._confirmed = 0
        self._opened = 0
        self._asking = asyncio.Lock()
        self._held: dict[RunId, tuple[Runner, float]] = {}
        stalls.after(min(STOPPED_AFTER_S, (journal.lease_s or math.inf) / 3), self._stopped)

    def may_send(self) -> bool:
        """Whether arbiters may send by themselves: see `ArbiterContext.may_send`."""
        return self._look() in (self._confirmed, self._opened)

    def open(self) -> None:
        """Let arbiters send at once: an operator's STOP, or a hold, must go out."""
        self._opened = self._look()

    async def confirmed(self) -> None:
        """Return when the journal has been asked since the process was stopped last."""
        if self._look() == self._confirmed:
            return
        async with self._asking:
            while (stops := self._look()) != self._confirmed:
                await self.ask()
                self._confirmed = stops

    async def watch(self) -> None:
        """Look at the lease, and ask the journal each time that the process was stopped, until
        cancelled."""
        tick_s = min(TICK_S, (self._journal.lease_s or TICK_S) / 20)
        while True:
            await self._look_at_lease()
            await self.confirmed()
            await asyncio.sleep(tick_s)

    async def ask(self) -> None:
        """Ask the journal whether the claims of all runs hold."""
        await asyncio.gather(*(self._ask_of(runner) for runner in self._driven()))

    # --- inside ---------------------------------------------------------------------------------

    async def _look_at_lease(self) -> None:
        """Hold runs while they surely are this executive's; let go of them when they are not."""
        now_s = boot_time_s()
        for run, (runner, ends_s) in tuple(self._held.items()):
            if now_s >= ends_s:
                del self._held[run]
                if self._runners.get(run) is runner:
                    self._replaced(run, StaleEpochError(_ENDED.format(run=run)))
        until_s, lease_s = self._journal.owned_until_s, self._journal.lease_s
        if until_s is None or lease_s is None or now_s < until_s - lease_s / 3:
            return
        if now_s >= until_s:
            await self.ask()  # too late for a hold: another one may command the vehicles
            return
        passed_s = now_s - (until_s - lease_s)
        for runner in self._driven():
            if runner.id not in self._held:
                self._held[runner.id] = runner, until_s
                text = _NOT_RENEWED.format(run=runner.id, passed_s=passed_s, lease_s=lease_s)
                self._unknown(runner.id, JournalError(text))

    def _driven(self) -> list[Runner]:
        return [each for each in self._runners.values() if not each.done.is_set()]

    def _look(self) -> int:
        """How often this process was stopped until now."""
        self._stalls.look()
        return self._stops

    def _stopped(self, stopped_s: float) -> None:
        self._stops += 1
        log.warning(
            "the executive did not run for %.1f s: it asks its journal before it goes on", stopped_s
        )

    async def _ask_of(self, runner: Runner) -> None:
        try:
            async with asyncio.timeout(ANSWERED_WITHIN_S):
                await self._journal.check_claim(runner.id, runner.epoch)
        except StaleEpochError as error:
            self._replaced(runner.id, error)
        except TimeoutError:
            text = (
                f"the journal has not said within {ANSWERED_WITHIN_S:g} s whether this executive "
                f"still drives {runner.id}, after it was stopped"
            )
            self._unknown(runner.id, JournalError(text))
        except M2pemError as error:
            self._unknown(runner.id, error)
