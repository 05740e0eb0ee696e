"""A base class of arbiters that have one object for each resource, its unit, which commands it."""

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

from m2pem.api.arbiter import ArbiterContext, BehaviorId, BehaviorReport, Connection
from m2pem.api.async_queue import AsyncQueue
from m2pem.api.behavior_tracker import BehaviorTracker
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId

STATES_WAITING = 1000

LATE_FACTOR = 2.0
"""A round that comes later than this many periods means that this process was suspended."""


class Unit(Protocol):
    """Commands one resource."""

    def cancel(self, behavior: BehaviorId, /) -> None:
        """Stop a behavior of the resource."""
        ...

    def hold(self) -> None:
        """Stop the resource, and keep its behavior."""
        ...

    def resume(self) -> None:
        """Continue the behavior."""
        ...


U = TypeVar("U", bound=Unit)


class UnitArbiter(ABC, Generic[U]):
    """Implements what of `Arbiter` and `FencingArbiter` is the same for all. `_units` has the units
    between `connect` and `close`. The resources themselves know no epochs."""

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        may_be_missed: Callable[[VehicleState | PayloadState], bool] = lambda _: True,
    ) -> None:
        self._connections = connections
        self._context = context
        self._tracker = BehaviorTracker(self._may_take, context.logger)
        self._states: AsyncQueue[VehicleState | PayloadState] = AsyncQueue(
            STATES_WAITING, may_be_missed
        )
        self._units: dict[ResourceId, U] = {}

    @abstractmethod
    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a resource."""

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Stop the resource that executes the behavior."""
        if self._tracker.may_cancel(behavior, epoch):
            for unit in self._executing(behavior):
                unit.cancel(behavior)

    async def hold(self, resource: ResourceId) -> None:
        """Stop a resource at once; it keeps its behavior."""
        if resource in self._units:
            self._units[resource].hold()

    async def resume(self, resource: ResourceId) -> None:
        """Continue the behavior of a held resource."""
        if resource in self._units:
            self._units[resource].resume()

    async def fence(self, run: str, epoch: int) -> None:
        """Refuse lower epochs of a run here."""
        self._tracker.fence(run, epoch)

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Return the last report or, after a restart, what the resource shows. No behavior is
        started."""
        self._tracker.fence(behavior, self._context.epoch_of(behavior))
        known = self._tracker.last(behavior)
        if known.state is BehaviorState.UNKNOWN:
            return await self._find(known, native_ref)
        return known if known.state.terminal else replace(known, held=self._is_held(behavior))

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Yield reports until `close`, for one reader."""
        return self._tracker.reports()

    def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        """Yield states until `close`, for one reader. A slow reader misses old states."""
        return self._states.read()

    # --- for subclasses -------------------------------------------------------------------------

    @abstractmethod
    async def _find(self, unknown: BehaviorReport, native_ref: str | None) -> BehaviorReport:
        """Return what the resource shows of a behavior that this process does not know: `unknown`
        is the report about that."""

    def _may_take(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors that a resource may have a part in."""
        return self.catalogue(resource)

    def _is_held(self, behavior: BehaviorId) -> bool:
        """Whether a resource that executes the behavior reports that it is held."""
        del behavior
        return False

    def _executing(self, behavior: BehaviorId) -> list[U]:
        """Return the units of the resources that execute a behavior."""
        holder = self._tracker.holder
        return [unit for resource, unit in self._units.items() if holder(resource) == behavior]

    def _prohibition(self, resource: ResourceId, behavior: str) -> str:
        """Return why a resource must not be commanded so, whatever the parameters are; else ""."""
        allowed = self._connections[resource].behaviors
        if allowed is not None and behavior not in allowed:
            return f"the fleet does not allow {resource} the behavior '{behavior}'"
        return "" if resource in self._units else "the arbiter is not connected"

    async def _rounds(self, every_s: float) -> AsyncIterator[tuple[int, bool]]:
        """Yield every `every_s`, without an end: the time in microseconds, and whether this process
        was suspended before, so that messages of the resources are still to be read."""
        clock = self._context.clock
        last_us, was_late = clock.now_us(), False
        while True:
            now_us = clock.now_us()
            was_late = not was_late and now_us - last_us > LATE_FACTOR * every_s * 1e6
            last_us = now_us
            yield now_us, was_late
            await clock.sleep(every_s)
