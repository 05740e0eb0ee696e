"""What a vehicle does for one request."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from m2pem.api import BehaviorState, Fence, FleetBus, ResolvedValue
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

CheckpointState: TypeAlias = Mapping[str, float | str | list[float] | None]
"""What a behavior must know to be recognised after a restart, beside its parameters; goes into a
text of JSON."""

ANY_MODE: frozenset[FlightMode] = frozenset(FlightMode)


MOVES_WITHIN_S = 60.0
"""`Behavior.still_s` of what is on its way somewhere. It may be slow to set out, or wait for what
is in its way; no autopilot needs that long."""


class BehaviorFailedError(Exception):
    """It cannot be done, or not any more. `code`: an error code of docs/missions.md."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


@dataclass(frozen=True, slots=True)
class BehaviorContext:
    """What is to be done, by whom, and where: the fleet's bus (positions of other vehicles) and the
    origin of its ENU frame (latitude and longitude in degrees, altitude in metres).

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
    """One behavior. The arbiter asks for a `refusal`, calls `begin` once (again, if it was held
    before that had ended), then `finished` several times a second; `paused` and `go_on` at a hold
    and after it. `steps`, if it has any, run beside that and are cancelled with it (a setpoint that
    must be repeated).

    `modes`: those in which it goes on; another one, that nobody here asked for, says that somebody
    else has taken the vehicle over. `steers`: beginning it ends what the vehicle did before.
    """

    name: ClassVar[str]
    modes: frozenset[FlightMode]
    moves_vehicle: ClassVar[bool] = True
    max_still_s: ClassVar[float | None] = None
    """For how long its vehicle may stand still before it has failed, in s; None: for ever."""

    def __init__(self, context: BehaviorContext) -> None:
        self.context = context
        self.vehicle = context.vehicle

    def refusal(self) -> str:
        """Why it cannot be done; "" if it can. Nothing has been sent yet."""
        return ""

    @abstractmethod
    async def begin(self) -> None:
        """Have the vehicle do it; returns when it does.

        Raises:
            BehaviorFailedError, ExchangeError: it cannot.
        """

    @abstractmethod
    def finished(self) -> bool:
        """Whether it is done.

        Raises:
            BehaviorFailedError: it has failed.
        """

    def paused(self) -> None:  # noqa: B027  # most have no clock of their own
        """The vehicle is being held."""

    @abstractmethod
    async def resume(self) -> None:
        """Have the vehicle go on after it was held."""

    def adjust(self, speed_m_s: float) -> bool:
        """Mean to go on at that speed from now on; False: its speed cannot be changed. The vehicle
        is told by the helm, and again by what is sent after a hold."""
        return False

    async def run_in_background(self) -> None:  # noqa: B027  # most have none
        """What must be done over and over while it goes on and is not held."""

    async def clean_up(self) -> None:  # noqa: B027  # most leave nothing behind
        """Undo what must not outlive it; another behavior takes over without a stop."""

    @abstractmethod
    async def reattach(self) -> BehaviorState:
        """After a restart, by looking at the vehicle and asking it nothing but what it has: RUNNING
        (it does just this), SUCCEEDED (it has done it) or UNKNOWN."""

    def checkpoint(self) -> CheckpointState:
        """What `recall` needs after a restart, beside parameters that are no routes or areas."""
        return {}

    def restore(self, checkpoint: CheckpointState) -> None:  # noqa: B027  # most need nothing
        """Before `recognised`: what `memory` said when it began."""
