"""Which vehicles and payloads each run has or had: read off its records, once each.

A run that has ended is not read again, one that goes on from where it was read. Nothing is read
before it is asked for, and then for a moment only: the rest is read when the same is asked again.
"""

import asyncio
import time
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from m2pem.api import MissionControl, RunId, RunSummary
from m2pem.api import records as r
from m2pem.errors import M2pemError

PAGE = 2000
READING_S = 1.0
"""For so long one answer reads; the executive goes on between two pages."""


@dataclass(slots=True)
class _Read:
    """How far a run was read. `whole`: there is no more of it to come."""

    seq: int = 0
    whole: bool = False
    resources: set[str] = field(default_factory=set)

    def has(self, resource: str) -> bool:
        """Whether it had a vehicle, or a payload on it, or a payload."""
        return any(each == resource or each.startswith(f"{resource}/") for each in self.resources)


class RunResources:
    """What runs have had, as far as it was read."""

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._read: dict[RunId, _Read] = {}
        self._reading = asyncio.Lock()

    async def having(
        self, resource: str, among: Iterable[RunSummary], reading_s: float = READING_S
    ) -> tuple[set[RunId], int]:
        """Return the runs among these that have had a vehicle or payload, and how many were not
        read to their end yet. The first ones are read first."""
        until_s = time.monotonic() + reading_s
        wanted = list(among)
        async with self._reading:
            for run in wanted:
                if time.monotonic() > until_s:
                    break
                await self._read_on(run, until_s)
        found = {each.run for each in wanted if self._of(each.run).has(resource)}
        unread = sum(not self._is_read(each) for each in wanted)
        return found, unread

    def keep(self, runs: Collection[RunId]) -> None:
        """Forget the runs that are deleted."""
        for run in self._read.keys() - set(runs):
            del self._read[run]

    def _of(self, run: RunId) -> _Read:
        return self._read.get(run) or _Read()

    def _is_read(self, run: RunSummary) -> bool:
        read = self._of(run.run)
        return read.whole or read.seq >= run.records

    async def _read_on(self, run: RunSummary, until_s: float) -> None:
        read = self._read.setdefault(run.run, _Read())
        while not read.whole and time.monotonic() <= until_s:
            try:
                page = await self._control.records(run.run, read.seq, PAGE)
            except M2pemError:  # it was deleted, or is damaged: what it had before that is known
                read.whole = True
                return
            for stamped in page:
                match stamped.record:
                    case r.BehaviorRequested(resources=resources):
                        read.resources.update(resources)
                    case r.ResourcesAllocated(roles=roles):
                        read.resources.update(*roles.values())
                    case r.ResourceKept(resource=resource):
                        read.resources.add(resource)
            if page:
                read.seq = page[-1].seq
            if len(page) < PAGE:
                read.whole = run.status.ended
                return
            await asyncio.sleep(0)
