"""A fake arbiter for tests of missions and executives: it does what the test says, when it says.

Real behavior is the simulated arbiter's; this one is for faults and exact orders.
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
from m2pem.api.telemetry import Telemetry
from m2pem.fleet.behaviors import SHARED
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class Call:
    """What was asked of the arbiter: start, cancel, query, hold or resume, and of what."""

    what: str
    subject: str


class FakeArbiter:
    """Offers the whole shared catalogue on everything, and remembers every call in `calls`.

    `known` is what `query` answers, by behavior. `raises`: exceptions by what is asked ("start").
    `hangs`: what is asked and never returns.
    """

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        self.connections = connections
        self.context = context
        self.calls: list[Call] = []
        self.requests: dict[BehaviorId, BehaviorRequest] = {}
        self.known: dict[BehaviorId, BehaviorReport] = {}
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
    ) -> None:
        """Have the arbiter report."""
        number = self._numbers[behavior] = self._numbers.get(behavior, 0) + 1
        self._reports.put_nowait(
            BehaviorReport(behavior, number, state, code, reason, outputs=outputs or {})
        )

    def say(self, state: Telemetry) -> None:
        """Have a vehicle, a payload or a team send telemetry."""
        self._states.put_nowait(state)

    async def until_called(self, what: str, subject: str | None = None, times: int = 1) -> None:
        """Wait until it has been asked for something `times` times."""
        async with self._changed:
            await self._changed.wait_for(lambda: self.count(what, subject) >= times)

    def count(self, what: str, subject: str | None = None) -> int:
        """How often it was asked for something."""
        return sum(
            1 for call in self.calls if call.what == what and subject in (None, call.subject)
        )

    # --- the arbiter ----------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Everything."""
        return tuple(SHARED.values())

    def limits(self, resource: ResourceId) -> Limits:
        """As set in `limit`."""
        return self.limit

    async def connect(self) -> None:
        """Nothing to reach."""

    async def start(self, request: BehaviorRequest) -> None:
        """Remember the request."""
        self.requests[request.id] = request
        await self._called("start", request.id)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Remember it."""
        await self._called("cancel", behavior)

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """What `known` says, else UNKNOWN."""
        await self._called("query", behavior)
        return self.known.get(behavior, BehaviorReport(behavior, 0, BehaviorState.UNKNOWN))

    async def hold(self, resource: ResourceId) -> None:
        """Remember it."""
        await self._called("hold", resource)

    async def resume(self, resource: ResourceId) -> None:
        """Remember it."""
        await self._called("resume", resource)

    async def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as the test makes them."""
        while (report := await self._reports.get()) is not None:
            yield report

    async def telemetry(self) -> AsyncIterator[Telemetry]:
        """States as the test makes them."""
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
