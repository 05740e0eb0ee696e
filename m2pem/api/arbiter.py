"""The arbiter: what commands the behaviors of vehicles and payloads (paper, section 4.2).

One object per registered name serves all its resources of a fleet. `m2pem.testing.ArbiterContract`
checks every promise made here.
"""

from collections.abc import AsyncIterator, Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeGuard
from uuid import UUID, uuid4

from m2pem.api.capabilities import ArbiterCapabilities, arbiter_capabilities
from m2pem.api.telemetry import Telemetry, VehicleState
from m2pem.fleet import parameters
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.geometry import Area
from m2pem.mission.values import Value

if TYPE_CHECKING:
    import logging

    from m2pem.api.bus import FleetBus
    from m2pem.api.clock import Clock

BehaviorId: TypeAlias = str
"""Unique in a journal: "r1.b3" is the third behavior of run r1."""

ResolvedValue: TypeAlias = parameters.ResolvedValue
"""A parameter's value after units and names are resolved: SI numbers, texts, geometries."""


@dataclass(frozen=True, slots=True)
class Connection:
    """How a resource is reached: the fleet file's `connection`, and what it is.

    `behaviors`: the names that the fleet allows; None means all that the arbiter offers.
    `failsafe`: the fleet's word for what the vehicle does by itself when its link is lost, or "".
    `fence`: the area that the vehicle may not leave; None: the fleet has none. `sitl`: software in
    the loop: what answers is a simulation on this machine. `cruise_speed_m_s`, `endurance_s`: how
    fast a vehicle goes when nobody says, and how long it can with a full battery; None: not said.
    """

    resource: ResourceId
    domain: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    behaviors: tuple[str, ...] | None = None
    detector: bool = False
    lost_after_s: float | None = None
    failsafe: str = ""
    fence: Area | None = None
    sitl: bool = False
    cruise_speed_m_s: float | None = None
    endurance_s: float | None = None


@dataclass(frozen=True, slots=True)
class ArbiterContext:
    """What the executive lends to an arbiter. All time goes through `clock`.

    `origin`: of the local ENU frame, (latitude in degrees, longitude in degrees, altitude in
    metres). `teams`: members of each team, the lead first. `journal`: names the journal that the
    ids of behaviors belong to; with it, they are unique for ever. It is the same after a restart.
    `epoch_of`: the epoch with which this executive drives the run of a behavior; 0: it does not.
    Commands that are not asked for with an epoch, such as the question for a behavior, carry it.
    """

    clock: "Clock"
    bus: "FleetBus"
    logger: "logging.Logger"
    origin: tuple[float, float, float]
    teams: Mapping[str, tuple[ResourceId, ...]] = field(default_factory=dict)
    journal: UUID = field(default_factory=uuid4)
    epoch_of: Callable[[BehaviorId], int] = field(default=lambda _: 0)


@dataclass(frozen=True, slots=True)
class Limits:
    """The bounds an arbiter promises for a resource, in seconds."""

    lost_after_s: float = 3.0
    hold_within_s: float = 1.0
    cancel_timeout_s: float = 10.0


@dataclass(frozen=True, slots=True)
class BehaviorRequest:
    """Start `behavior` on `resources`. `start` is idempotent on `id`.

    `epoch` is the run's: an arbiter refuses one lower than it has seen for the run. `parameters`
    are resolved: SI units, geometries instead of names. `preempts`: behaviors that are being
    cancelled and still hold a resource; the new one takes over from them.
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
    """What became of a behavior. `number` rises from 1 with each report of one behavior.

    ACCEPTED comes before RUNNING, exactly one terminal state comes last. `code` is an error code
    of docs/missions.md ("ROUTE_BLOCKED", ...), "" unless it failed; `reason` is for people.
    `native_ref`: the arbiter's own name for it, handed back to `query` after a restart.
    `outputs`: of a terminal report: what the mission's data store gets, under names that the
    behavior's `BehaviorSpec.writes` declares, such as `picture.files`. `held`: of an answer to
    `query`: the behavior goes on, but one of its resources is held. `not_begun`: of an answer
    UNKNOWN to `query`: the resource shows that it has not begun the behavior, beyond being made
    ready for it, so that starting it now is what its mission wants.
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


class Arbiter(Protocol):
    """Constructed as `Arbiter(connections: Mapping[ResourceId, Connection], context)`."""

    @property
    def capabilities(self) -> ArbiterCapabilities:
        """What it can do beyond this protocol: a class attribute, which may be missing."""
        return ArbiterCapabilities()

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What the resource can do. Needs no connection and no transport library."""
        ...

    def limits(self, resource: ResourceId) -> Limits:
        """The bounds that hold for the resource."""
        ...

    async def connect(self) -> None:
        """Reach the resources. Returns when listening; a silent resource is not an error."""
        ...

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior. Everything that comes of it, a refusal too, is a report."""
        ...

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """End a behavior; its report CANCELLED (or what it ended with) follows. Idempotent."""
        ...

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """What has become of a behavior, by looking at the vehicle. UNKNOWN if it is not known.

        A vehicle may have been held by an executive that is gone: then the answer says `held`, or
        UNKNOWN where the vehicle cannot say so. `resume` lets it go on.
        """
        ...

    async def hold(self, resource: ResourceId) -> None:
        """Bring the resource to a safe stand-still, keeping its behavior for `resume`."""
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
        """Let go of everything. Vehicles keep doing what they do."""
        ...


class AdjustingArbiter(Protocol):
    """An arbiter that can also change a behavior which goes on. Teams keep their spacing by it."""

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        """Go on with these parameters, such as `speed`, in place of those of the same names.

        What cannot be changed on the way, and a behavior that has ended, is left as it is.
        """
        ...


class SightedArbiter(Protocol):
    """An arbiter that can tell at any moment where a vehicle is, not only when the vehicle tells of
    itself. Teams look through it where it is offered."""

    def sight(self, resource: ResourceId) -> VehicleState | None:
        """The state of a vehicle now; None: it cannot be known now, and what its telemetry said
        last holds."""
        ...


class AddressedArbiter(Protocol):
    """An arbiter that says what it connects to. On one host, one executive commands an address; of
    an arbiter without this, all settings of a connection together count as the address."""

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """The same texts for the same vehicle in every process; none: there is nothing to share,
        because it exists in this process alone, or another resource's address covers it."""
        ...


class ReclaimingArbiter(Protocol):
    """An arbiter that ends what a vehicle goes on with after its link was lost. Without this, a
    vehicle that is heard again is told to `hold`, and its lost behavior to `cancel`."""

    async def reclaim(self, resource: ResourceId) -> str:
        """A resource that was lost is heard again: end what it does under behaviors that were LOST.

        Returns when the resource has acknowledged, and "" then; only then may it be given another
        behavior. Otherwise why it may not yet, for operators, such as its own failsafe that must
        not be interrupted: it is asked for again soon. What nobody here had it do is left alone.
        """
        ...


class DetectingArbiter(Protocol):
    """An arbiter that knows by their connections which payloads detect, beside those that the fleet
    marks with `detector: true`."""

    @property
    def detectors(self) -> Collection[ResourceId]:
        """Payloads whose detections complete the service `Detector`."""
        ...


def adjusts(arbiter: Arbiter) -> TypeGuard[AdjustingArbiter]:
    """Whether an arbiter declares that it can change a behavior which goes on."""
    return arbiter_capabilities(arbiter).adjusts


def sights(arbiter: Arbiter) -> TypeGuard[SightedArbiter]:
    """Whether an arbiter declares that it can tell at any moment where a vehicle is."""
    return arbiter_capabilities(arbiter).sights


def names_addresses(arbiter: Arbiter) -> TypeGuard[AddressedArbiter]:
    """Whether an arbiter declares that it says what it connects to."""
    return arbiter_capabilities(arbiter).addresses


def reclaims(arbiter: Arbiter) -> TypeGuard[ReclaimingArbiter]:
    """Whether an arbiter declares that it ends what a vehicle goes on with after a lost link."""
    return arbiter_capabilities(arbiter).reclaims


def detects(arbiter: Arbiter) -> TypeGuard[DetectingArbiter]:
    """Whether an arbiter declares that it knows which of its payloads detect."""
    return arbiter_capabilities(arbiter).detects
