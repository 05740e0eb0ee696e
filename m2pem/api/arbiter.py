"""The arbiter: what commands the behaviors of vehicles and payloads (paper, section 4.2).

One object per registered name serves all its resources of a fleet. `m2pem.testing.ArbiterContract`
checks every promise made here.
"""

from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeAlias, TypeGuard
from uuid import UUID, uuid4

from m2pem.api.capabilities import ArbiterCapabilities, arbiter_capabilities
from m2pem.api.commanded import Commanded
from m2pem.api.telemetry import Telemetry, VehicleState
from m2pem.fleet import parameters
from m2pem.fleet.fence import fence_of
from m2pem.geo.fence import Fence
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.values import Value

if TYPE_CHECKING:
    import logging

    from m2pem.api.bus import FleetBus
    from m2pem.api.clock import Clock
    from m2pem.fleet.fleet import Fleet

BehaviorId: TypeAlias = str
"""Unique in a journal: "r1.b3" is the third behavior of run r1."""

ResolvedValue: TypeAlias = parameters.ResolvedValue
"""A parameter's value after units and names are resolved: SI numbers, texts, geometries."""


@dataclass(frozen=True, slots=True)
class Connection:
    """How a resource is reached: the fleet file's `connection`, and what it is.

    `behaviors`: the names that the fleet allows; None means all that the arbiter offers.
    `failsafe`: the vehicle's own reaction to a lost link, as the fleet states it, or "".
    `fence`: where the vehicle may be; None: anywhere. `sitl`: software in
    the loop: the vehicle is simulated on this machine. `cruise_speed_m_s`: its default speed;
    `endurance_s`: how long it can move with a full battery; None: the fleet states none. `folder`:
    of the fleet file; names of files are relative to it.
    """

    resource: ResourceId
    domain: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    behaviors: tuple[str, ...] | None = None
    detector: bool = False
    lost_after_s: float | None = None
    failsafe: str = ""
    fence: Fence | None = None
    sitl: bool = False
    cruise_speed_m_s: float | None = None
    endurance_s: float | None = None
    folder: Path = field(default_factory=Path)

    @classmethod
    def of(cls, fleet: "Fleet", resource: ResourceId) -> Self:
        """Return how a resource of a fleet is reached, as its arbiter gets it."""
        payload = fleet.payloads.get(resource)
        vehicle = fleet.vehicles[resource if payload is None else payload.vehicle]
        return cls(
            resource,
            vehicle.domain.value,
            (payload or vehicle).settings,
            (payload or vehicle).behaviors,
            detector=payload is not None and payload.detector,
            lost_after_s=vehicle.lost_after_s,
            failsafe=vehicle.failsafe,
            fence=fence_of(fleet, vehicle.domain),
            sitl=vehicle.sitl,
            cruise_speed_m_s=vehicle.cruise_speed_m_s if payload is None else None,
            endurance_s=vehicle.endurance_s if payload is None else None,
            folder=Path(fleet.file).parent,
        )


@dataclass(frozen=True, slots=True)
class ArbiterContext:
    """What the executive provides to an arbiter. Use `clock` for all times.

    `origin`: of the local ENU frame, (latitude in degrees, longitude in degrees, altitude in
    metres). `teams`: members of each team, the lead first. `journal`: names the journal that the
    ids of behaviors belong to; with it, they are unique for ever. It is the same after a restart.
    `epoch_of`: the epoch with which this executive drives the run of a behavior; 0: it does not.
    Commands whose call has no epoch, such as a query, carry it. `may_send`: whether an arbiter may
    send on its own account: commands that it repeats, streams, the next step of a behavior. False
    after this process was stopped for a while, until the journal has said that it still drives its
    runs. What the executive calls is sent all the same, a hold above all. `state_folder`: the
    folder of the journal's file, for what an arbiter must keep over restarts; None: the journal is
    in memory.
    """

    clock: "Clock"
    bus: "FleetBus"
    logger: "logging.Logger"
    origin: tuple[float, float, float]
    teams: Mapping[str, tuple[ResourceId, ...]] = field(default_factory=dict)
    journal: UUID = field(default_factory=uuid4)
    epoch_of: Callable[[BehaviorId], int] = field(default=lambda _: 0)
    may_send: Callable[[], bool] = field(default=lambda: True)
    state_folder: "Path | None" = None


@dataclass(frozen=True, slots=True)
class Limits:
    """The bounds an arbiter promises for a resource, in seconds."""

    lost_after_s: float = 3.0
    hold_within_s: float = 1.0
    cancel_timeout_s: float = 10.0


@dataclass(frozen=True, slots=True)
class BehaviorRequest:
    """Start `behavior` on `resources`. `start` is idempotent on `id`.

    `epoch` is the run's: an arbiter refuses one lower than it has seen for the run, with
    `StaleCommandError`. `parameters` are resolved: SI units, geometries instead of names.
    `preempts`: behaviors that are being cancelled and still hold a resource; the new one takes over
    from them.
    """

    id: BehaviorId
    epoch: int
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    resources: tuple[ResourceId, ...]
    roles: Mapping[str, tuple[ResourceId, ...]] = field(default_factory=dict)
    preempts: tuple[BehaviorId, ...] = ()


@dataclass(frozen=True, slots=True)
class BehaviorReport:
    """The state of a behavior. `number` rises from 1 with each report of one behavior; 0 of an
    answer UNKNOWN, or more: the resource has had the behavior, and does not go on with it.

    ACCEPTED comes before RUNNING, exactly one terminal state comes last. `code` is an error code
    of docs/missions.md ("ROUTE_BLOCKED", ...), "" unless it failed; `reason` is for people.
    `native_ref`: the arbiter's own name for it, handed back to `query` after a restart.
    `outputs` (terminal reports): values for the mission's data store, under names that the
    behavior's `BehaviorSpec.writes` declares, such as `picture.files`. `held` (answers to `query`):
    the behavior goes on, but one of its resources is held. `not_begun` (answers UNKNOWN to
    `query`): the resource shows that it has not begun the behavior, at most prepared for it, so
    that it can be started now. `remaining`: the parameters by which another vehicle would do what
    is left, such as the rest of a route; None: nothing is known beyond what was reported before.
    `commanded` (the first report RUNNING, answers to `query`): what the vehicle is commanded, where
    it is not what the request of a shared behavior says, or the behavior is not shared.
    `evidence`: what telemetry showed of a behavior that has ended; the executive sets it.
    """

    id: BehaviorId
    number: int
    state: BehaviorState
    code: str = ""
    reason: str = ""
    native_ref: str | None = None
    outputs: Mapping[str, Value] = field(default_factory=dict)
    held: bool = False
    not_begun: bool = False
    remaining: Mapping[str, Value] | None = None
    epoch: int = 0
    commanded: Commanded | None = None
    evidence: Mapping[str, Value] = field(default_factory=dict)


class Arbiter(Protocol):
    """Constructed as `Arbiter(connections: Mapping[ResourceId, Connection], context)`.

    `start` and `cancel` of a lower epoch than was seen of the run raise `StaleCommandError`, and do
    nothing: another executive drives the run. `hold` is never refused.
    """

    @property
    def capabilities(self) -> ArbiterCapabilities:
        """What it can do beyond this protocol: a class attribute, which may be missing."""
        return ArbiterCapabilities()

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a resource. Needs no connection and no transport library."""
        ...

    def limits(self, resource: ResourceId) -> Limits:
        """Return the bounds of a resource."""
        ...

    async def connect(self) -> None:
        """Connect to the resources. A resource that does not answer is not an error."""
        ...

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior. Its states are reported, a refusal too."""
        ...

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """End a behavior; its report CANCELLED (or what it ended with) follows. Idempotent."""
        ...

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Return the state of a behavior, by querying the vehicle. UNKNOWN if it is not known.

        Commands of an executive that drove the run before are refused from now on.
        If an earlier executive has held the vehicle, the answer says `held`, or UNKNOWN if the
        vehicle cannot report that. `resume` lets it go on.
        """
        ...

    async def hold(self, resource: ResourceId) -> None:
        """Bring the resource to a safe standstill, and keep its behavior for `resume`."""
        ...

    async def resume(self, resource: ResourceId) -> None:
        """Go on with the behavior that `hold` interrupted."""
        ...

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        ...

    def telemetry(self) -> AsyncIterator[Telemetry]:
        """States as they come, for one reader, until `close`."""
        ...

    async def close(self) -> None:
        """Close all connections. Vehicles go on with their behaviors."""
        ...


class AdjustingArbiter(Protocol):
    """An arbiter that can also change a running behavior. Teams keep their spacing by it."""

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> Awaitable[str] | None:
        """Go on with these parameters, such as `speed`, in place of those of the same names.

        It hands over, as `start` does, and does not wait for the vehicle. An arbiter whose vehicles
        answer returns what can be awaited for that answer: "" when the vehicle has taken them, or
        need not any more, else why it goes on as before, for operators. None: there is no answer.

        Parameters that cannot be changed on the way, and behaviors that have ended, stay as they
        are.
        """
        ...


class SightedArbiter(Protocol):
    """An arbiter that knows the state of a vehicle at any time, not only when telemetry arrives.
    Teams prefer it to telemetry."""

    def sight(self, resource: ResourceId) -> VehicleState | None:
        """Return the state of a vehicle now; None: not known now, so that its last telemetry
        counts."""
        ...


class AddressedArbiter(Protocol):
    """An arbiter that says what it connects to. On one host, one executive commands an address; of
    an arbiter without this, all settings of a connection together count as the address."""

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """The same texts for the same vehicle in every process; none: there is nothing to share,
        because it exists in this process alone, or another resource's address covers it."""
        ...


class ReclaimingArbiter(Protocol):
    """An arbiter that ends a lost behavior when the link returns. Without this, the executive calls
    `cancel` for the lost behavior and `hold` for the vehicle."""

    async def reclaim(self, resource: ResourceId) -> str:
        """End the LOST behaviors of a resource whose link has returned.

        Return "" when the resource has acknowledged; only then may it get another behavior.
        Otherwise return the reason, for operators, such as its own failsafe that must not be
        interrupted: the executive calls again soon. Commands of other clients are not ended.
        """
        ...


class FencingArbiter(Protocol):
    """An arbiter that passes the epochs of runs on to its vehicles, and can let go of behaviors.

    Without this, a vehicle learns of a takeover by the first command for it, and an executive that
    was replaced ends its own behaviors there by closing all arbiters only.
    """

    async def fence(self, run: str, epoch: int) -> None:
        """Have every vehicle refuse commands of the run that have a lower epoch.

        The executive calls it when it has taken the run over, before it asks for any behavior.
        """
        ...

    async def disown(self, run: str) -> None:
        """Send nothing more for the behaviors of a run, and forget them: another executive drives
        it.

        Streams and repeated commands end, and the vehicles are not commanded: they go on with what
        they do. Reports about it are ignored.
        """
        ...


class DetectingArbiter(Protocol):
    """An arbiter that knows from their connections which payloads are detectors, beside those that
    the fleet marks with `detector: true`."""

    @property
    def detectors(self) -> Collection[ResourceId]:
        """Payloads whose detections complete the service `Detector`."""
        ...


def adjusts(arbiter: Arbiter) -> TypeGuard[AdjustingArbiter]:
    """Whether an arbiter declares that it can change a behavior which goes on."""
    return arbiter_capabilities(arbiter).adjusts


def sights(arbiter: Arbiter) -> TypeGuard[SightedArbiter]:
    """Whether an arbiter declares that it knows the state of a vehicle at any time."""
    return arbiter_capabilities(arbiter).sights


def names_addresses(arbiter: Arbiter) -> TypeGuard[AddressedArbiter]:
    """Whether an arbiter declares that it says what it connects to."""
    return arbiter_capabilities(arbiter).addresses


def reclaims(arbiter: Arbiter) -> TypeGuard[ReclaimingArbiter]:
    """Whether an arbiter declares that it ends what a vehicle goes on with after a lost link."""
    return arbiter_capabilities(arbiter).reclaims


def fences(arbiter: Arbiter) -> TypeGuard[FencingArbiter]:
    """Whether an arbiter declares that it passes epochs on, and lets go of behaviors."""
    return arbiter_capabilities(arbiter).fences


def detects(arbiter: Arbiter) -> TypeGuard[DetectingArbiter]:
    """Whether an arbiter declares that it knows which of its payloads detect."""
    return arbiter_capabilities(arbiter).detects
