"""A fake arbiter for tests of missions and executives: the test says what it does, and when.

It is for faults and exact orders of events. The simulated arbiter has realistic behavior.
"""

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass

from m2pem.api.arbiter import (
    ArbiterContext,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    Connection,
    Limits,
)
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.commanded import Commanded
from m2pem.api.telemetry import Telemetry
from m2pem.fleet.behaviors import SHARED
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class Call:
    """A call of the arbiter: start, cancel, query, hold or resume, and its subject; disown of a
    run."""

    what: str
    subject: str


class FakeArbiter:
    """Offers the whole shared catalogue on every resource, and keeps every call in `calls`.

    `known`: the answers of `query`, by behavior. `fenced`: the epochs of runs that were taken over.
    `raises`: exceptions by method ("start").
    `hangs`: methods that never return.
    """

    capabilities = ArbiterCapabilities(fences=True)

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        self.connections = connections
        self.context = context
        self.calls: list[Call] = []
        self.requests: dict[BehaviorId, BehaviorRequest] = {}
        self.known: dict[BehaviorId, BehaviorReport] = {}
        self.fenced: dict[str, int] = {}
        self.raises: dict[str, Exception] = {}
        self.hangs: set[str] = set()
        self.limit = Limits()
        self._numbers: dict[BehaviorId, int] = {}
        self._reports: asyncio.Queue[BehaviorReport | None] = asyncio.Queue()
        self._states: asyncio.Queue[Telemetry | None] = asyncio.Queue()
        self._changed = asyncio.Condition()

    # --- for the test ---------------------------------------------------------------------------

    def report(
        self,
        behavior: BehaviorId,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: Mapping[str, Value] | None = None,
        remaining: Mapping[str, Value] | None = None,
        epoch: int = 0,
        commanded: Commanded | None = None,
    ) -> None:
        """Make the arbiter report the state of a behavior, after what `known` says of it."""
        known = self.known.get(behavior)
        before = self._numbers.get(behavior, known.number if known is not None else 0)
        number = self._numbers[behavior] = before + 1
        self._reports.put_nowait(
            BehaviorReport(
                behavior,
                number,
                state,
                code,
                reason,
                outputs=outputs or {},
                remaining=remaining,
                epoch=epoch,
                commanded=commanded,
            )
        )

    def say(self, state: Telemetry) -> None:
        """Make a vehicle, a payload or a team send telemetry."""
        self._states.put_nowait(state)

    async def until_called(self, what: str, subject: str | None = None, times: int = 1) -> None:
        """Wait until a method was called `times` times."""
        async with self._changed:
            await self._changed.wait_for(lambda: self.count(what, subject) >= times)

    def count(self, what: str, subject: str | None = None) -> int:
        """Return how often a method was called."""
        return sum(
            1 for call in self.calls if call.what == what and subject in (None, call.subject)
        )

    # --- the arbiter ----------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        return tuple(SHARED.values())

    def limits(self, resource: ResourceId) -> Limits:
        return self.limit

    async def connect(self) -> None:
        """Do nothing: there is no vehicle to connect to."""

    async def start(self, request: BehaviorRequest) -> None:
        """Keep the request in `requests`."""
        self.requests[request.id] = request
        await self._called("start", request.id)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        await self._called("cancel", behavior)

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Return the report in `known`, else UNKNOWN."""
        await self._called("query", behavior)
        return self.known.get(behavior, BehaviorReport(behavior, 0, BehaviorState.UNKNOWN))

    async def hold(self, resource: ResourceId) -> None:
        await self._called("hold", resource)

    async def resume(self, resource: ResourceId) -> None:
        await self._called("resume", resource)

    async def fence(self, run: str, epoch: int) -> None:
        """Keep the epoch in `fenced`."""
        self.fenced[run] = epoch

    async def disown(self, run: str) -> None:
        await self._called("disown", run)

    async def reports(self) -> AsyncIterator[BehaviorReport]:
        """Yield the reports that the test makes."""
        while (report := await self._reports.get()) is not None:
            yield report

    async def telemetry(self) -> AsyncIterator[Telemetry]:
        """Yield the telemetry that the test sends."""
        while (state := await self._states.get()) is not None:
            yield state

    async def close(self) -> None:
        """End the streams."""
        self._reports.put_nowait(None)
        self._states.put_nowait(None)

    async def _called(self, what: str, subject: str) -> None:
        async with self._changed:
            self.calls.append(Call(what, subject))
            self._changed.notify_all()
        if what in self.hangs:
            await asyncio.Event().wait()
        if what in self.raises:
            raise self.raises[what]
