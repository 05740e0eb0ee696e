"""The base class of behaviors: what a vehicle does for one request."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from m2pem.api import BehaviorState, Fence, FleetBus, LatLon, ResolvedValue, Value
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

CheckpointState: TypeAlias = Mapping[str, float | str | list[float] | None]
"""What a behavior needs after a restart, in addition to its parameters; stored as JSON."""

ANY_MODE: frozenset[FlightMode] = frozenset(FlightMode)


MOVES_WITHIN_S = 60.0
"""Default of `Behavior.max_still_s`: longer than autopilots need to start, or to wait for
obstacles."""


class BehaviorFailedError(Exception):
    """The behavior cannot be executed or continued. `code`: an error code of docs/missions.md."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


class TakenOverError(BehaviorFailedError):
    """Another client, a pilot or a failsafe has the vehicle: nothing more is sent to it."""

    def __init__(self, reason: str, code: str = "TAKEN_OVER") -> None:
        super().__init__(reason, code)


@dataclass(frozen=True, slots=True)
class BehaviorContext:
    """The request and its surroundings: the vehicle, the parameters, the fleet's bus (telemetry of
    other vehicles), and the origin of the fleet's ENU frame (latitude and longitude in degrees,
    altitude in metres).

    `now_s`: seconds of the arbiter's clock, which goes on over a restart. `fence`: what the vehicle
    may not leave. `cruise_m_s`: the speed that `set_speed` has set. `actuators`: names that the
    fleet gives to actuators ("servo 9").
    """

    vehicle: Vehicle
    parameters: Mapping[str, ResolvedValue]
    bus: FleetBus
    origin: tuple[float, float, float]
    now_s: Callable[[], float]
    fence: Fence | None = None
    cruise_m_s: float | None = None
    actuators: Mapping[str, str] = field(default_factory=dict)


class Behavior(ABC):
    """One behavior of one vehicle.

    The arbiter asks for a `refusal` and calls `begin` (again, if the vehicle was held before
    `begin` had returned), then `finished` several times a second. At a hold it calls `paused`,
    after it `resume`. `run_in_background` runs at the same time and is cancelled with the behavior:
    it repeats setpoints, for example.

    `modes`: the flight modes in which the behavior continues; any other mode that was not commanded
    here means that the vehicle was taken over. `moves_vehicle`: beginning this behavior ends the
    motion before it.
    """

    name: ClassVar[str]
    modes: frozenset[FlightMode]
    plane_modes: ClassVar[frozenset[FlightMode]] = frozenset()
    """Further modes of a vehicle that cannot stop in the air."""
    moves_vehicle: ClassVar[bool] = True
    max_still_s: ClassVar[float | None] = None
    """For how long its vehicle may stand still before it has failed, in s; None: for ever."""

    def __init__(self, context: BehaviorContext) -> None:
        self.context = context
        self.vehicle = context.vehicle
        if self.vehicle.state.loiter_radius_m is not None:
            self.modes |= self.plane_modes

    def refusal(self) -> str:
        """Return why the behavior cannot be executed; "" if it can. Send nothing."""
        return ""

    def breach(self, place: LatLon, name: str) -> str:
        """Return where the straight way to a place would leave the fence; "" if it does not."""
        fence, here = self.context.fence, self.vehicle.state.position
        start = None if here is None else here.latlon
        return "" if fence is None else fence.breach([place], start, lambda _: name)

    @abstractmethod
    async def begin(self) -> None:
        """Command the vehicle; return when it executes the behavior.

        Raises:
            BehaviorFailedError, ExchangeError: it cannot.
        """

    @abstractmethod
    def finished(self) -> bool:
        """Return whether the behavior is complete.

        Raises:
            BehaviorFailedError: it has failed.
        """

    def waits(self) -> str:
        """Return why the vehicle rightly stays where it is, in words; "" if it should go on."""
        return ""

    def result(self) -> str:
        """Return what operators read of a behavior that has succeeded; "" if nothing more."""
        return ""

    def paused(self) -> None:  # noqa: B027  # most have no clock of their own
        """The vehicle is being held: stop measuring time."""

    async def resume(self) -> None:
        """Command the vehicle again after a hold."""
        await self.begin()

    def adjust(self, speed_m_s: float) -> bool:
        """Use this speed from now on; return False if the behavior has no speed to change. The
        controller sends the speed to the vehicle."""
        return False

    def left(self, least_m: float | None = None) -> Mapping[str, Value] | None:
        """Return what is left of the behavior, as in `BehaviorReport.remaining`, if it is worth a
        report: when `least_m`, or else a few percent, were done since the last one."""
        return None

    async def run_in_background(self) -> None:  # noqa: B027  # most have none
        """Repeat what must be repeated while the behavior is active and not held."""

    async def clean_up(self) -> None:  # noqa: B027  # most leave nothing behind
        """Undo what must not outlive the behavior, when another one replaces it without a stop."""

    @abstractmethod
    async def reattach(self) -> BehaviorState:
        """After a restart, compare with the vehicle, and only read from it. Return RUNNING (it
        executes this behavior), SUCCEEDED (it has completed it) or UNKNOWN."""

    def checkpoint(self) -> CheckpointState:
        """Return what `restore` needs after a restart, in addition to parameters that are no routes
        or areas."""
        return {}

    def restore(self, checkpoint: CheckpointState) -> None:  # noqa: B027  # most need nothing
        """Take over a checkpoint; called before `reattach`."""


class SetBehavior(Behavior):
    """Sets something that moves no vehicle, by one command."""

    modes = ANY_MODE
    moves_vehicle = False

    def finished(self) -> bool:
        """Return True: `begin` returns when the autopilot has accepted."""
        return True

    async def reattach(self) -> BehaviorState:
        """Return UNKNOWN: no autopilot reports what it was set to."""
        return BehaviorState.UNKNOWN
