"""A bench to try an arbiter on: everything that it says is kept, and waited for by condition."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from types import TracebackType
from uuid import UUID

from m2pem.api.arbiter import (
    Arbiter,
    ArbiterContext,
    BehaviorReport,
    BehaviorRequest,
    ResolvedValue,
)
from m2pem.api.clock import Clock
from m2pem.api.telemetry import PayloadState, TeamState, VehicleState
from m2pem.executive.clock import SystemClock
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.telemetry.bus import Bus

ORIGIN = (38.1075, -77.3192, 60.0)
JOURNAL = UUID("3f0e7d0a-6a51-4f5c-9a2c-0c1a7b1f2d11")
"""Of every executive of a test: the next one resumes what the first has left."""


def context(
    clock: Clock, teams: Mapping[str, tuple[ResourceId, ...]] | None = None
) -> ArbiterContext:
    """What an executive would lend to an arbiter."""
    logger = logging.getLogger("m2pem.testing")
    return ArbiterContext(clock, Bus(), logger, ORIGIN, teams or {}, JOURNAL)


class ArbiterBench:
    """An arbiter while it is connected: `async with ArbiterBench(arbiter, clock) as bench`.

    `reports` and `states`: all that it said so far.
    """

    def __init__(self, arbiter: Arbiter, clock: Clock) -> None:
        self.arbiter = arbiter
        self.clock = clock
        self.reports: list[BehaviorReport] = []
        self.states: list[VehicleState | PayloadState] = []
        self._news = asyncio.Event()
        self._readers: list[asyncio.Task[None]] = []

    @property
    def late_s(self) -> float:
        """How much later than promised one may hear of it: a computer may be busy for two real
        seconds."""
        return 2.0 * self.clock.speed if isinstance(self.clock, SystemClock) else 0.0

    async def __aenter__(self) -> "ArbiterBench":
        await self.arbiter.connect()
        self._readers = [
            asyncio.create_task(self._read_reports()),
            asyncio.create_task(self._read_states()),
        ]
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.arbiter.close()
        if error is None:
            done, late = await asyncio.wait(self._readers, timeout=5)
            for reader in late:
                reader.cancel()
            assert not late, "reports() and telemetry() end when the arbiter is closed"
            for reader in done:
                reader.result()
        else:
            for reader in self._readers:
                reader.cancel()

    async def start(
        self,
        id_: str,
        behavior: str,
        *resources: str,
        epoch: int = 1,
        preempts: tuple[str, ...] = (),
        **parameters: ResolvedValue,
    ) -> None:
        """Start a behavior on resources."""
        ids = tuple(ResourceId(resource) for resource in resources)
        request = BehaviorRequest(id_, epoch, behavior, parameters, ids, preempts=preempts)
        await self.arbiter.start(request)

    def of(self, id_: str) -> list[BehaviorReport]:
        """The reports of one behavior."""
        return [report for report in self.reports if report.id == id_]

    def states_of(self, id_: str) -> list[BehaviorState]:
        """What the reports of one behavior say."""
        return [report.state for report in self.of(id_)]

    def latest(self, resource: str) -> VehicleState | PayloadState | None:
        """The newest state of a resource."""
        return next((s for s in reversed(self.states) if s.resource == resource), None)

    async def until(self, true: Callable[[], bool], within_s: float) -> bool:
        """Wait for something to become true; False if it is not within so many seconds."""
        limit = asyncio.create_task(self.clock.sleep(within_s))
        try:
            while not true():
                if limit.done():
                    return False
                self._news.clear()
                news = asyncio.create_task(self._news.wait())
                await asyncio.wait([limit, news], return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
            return True
        finally:
            limit.cancel()

    async def running(self, id_: str, within_s: float = 60.0) -> None:
        """Wait until a behavior runs."""
        running = await self.until(lambda: BehaviorState.RUNNING in self.states_of(id_), within_s)
        assert running, f"{id_} was not RUNNING within {within_s:g} s; its reports: {self.of(id_)}"

    async def ended(self, id_: str, within_s: float) -> BehaviorReport:
        """Wait for the terminal report of a behavior."""
        over = await self.until(
            lambda: any(state.terminal for state in self.states_of(id_)), within_s
        )
        assert over, f"{id_} had not ended within {within_s:g} s; its reports: {self.of(id_)}"
        return self.of(id_)[-1]

    async def _read_reports(self) -> None:
        async for report in self.arbiter.reports():
            self.reports.append(report)
            self._news.set()

    async def _read_states(self) -> None:
        async for state in self.arbiter.telemetry():
            if isinstance(state, TeamState):
                continue
            self.states.append(state)
            self._news.set()
