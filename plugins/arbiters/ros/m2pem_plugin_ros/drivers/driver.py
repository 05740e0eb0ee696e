"""What the arbiter asks of a way to reach one vehicle, and what it is told.

A driver needs rclpy; the arbiter makes it when it connects. All calls come on the event loop and
return at once or soon: what becomes of an order is told later, and as often as the vehicle says so.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Protocol, cast
from uuid import UUID

from m2pem.api import (
    ArbiterContext,
    BehaviorRequest,
    BehaviorState,
    Connection,
    ResolvedValue,
    Value,
)
from m2pem_plugin_ros.sensors.localization import Localization
from m2pem_plugin_ros.settings import DriverName, Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


@dataclass(frozen=True, slots=True)
class Order:
    """A behavior for the vehicle. `goal` and `run` are unique for ever, and the same after a
    restart. `preempts`: goals that it takes over from."""

    request: BehaviorRequest
    goal: UUID
    run: UUID
    preempts: tuple[UUID, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a goal stands on the vehicle. UNKNOWN: the vehicle knows nothing of it. `outputs`: of one
    that has ended; what the mission's data store gets. `held`: the vehicle says that it is held."""

    state: BehaviorState
    code: str = ""
    reason: str = ""
    outputs: Mapping[str, Value] = field(default_factory=dict)
    held: bool = False

    @property
    def is_end(self) -> bool:
        """Whether the goal was known, and has ended."""
        return self.state.terminal and self.state is not BehaviorState.UNKNOWN


@dataclass(frozen=True, slots=True)
class Health:
    """What a vehicle says of itself, beside where it is. None: it does not say."""

    mode: str = ""
    ready: bool | None = None
    not_ready_reasons: tuple[str, ...] = ()
    battery_fraction: float | None = None


class Told(Protocol):
    """What a driver tells the arbiter. Said twice, or of a goal that nobody knows, does no harm."""

    def heard(self) -> None:
        """The vehicle, or what steers it there, is alive."""
        ...

    def progress(self, goal: UUID) -> None:
        """The vehicle does it."""
        ...

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        """It has ended, for good; the state is terminal."""
        ...


@dataclass(frozen=True, slots=True)
class Seat:
    """What a driver is given. All time goes through `context.clock`, except what bounds a call."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    ros: "RosRuntime"
    localization: Localization
    told: Told


class Driver(Protocol):
    """One way to reach one vehicle. Constructed as `Driver(seat)`."""

    async def open(self) -> None:
        """Listen; the vehicle need not be there yet."""
        ...

    @property
    def health(self) -> Health:
        """What is known by now."""
        ...

    def refusal(self, request: BehaviorRequest) -> str:
        """Why a request that fits the catalogue cannot be done now; "" if it can."""
        ...

    def begin(self, order: Order) -> None:
        """Have the vehicle do this, in place of what it does, which is not told of any more."""
        ...

    def end(self, goal: UUID) -> None:
        """Have it stop, if it still does this; `told.ended` follows, also if it had ended."""
        ...

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Go on with these parameters in place of those of the same names, as far as possible."""
        ...

    def hold(self) -> None:
        """Bring the vehicle to a stand, whatever it does, and keep the order."""
        ...

    def resume(self) -> None:
        """Go on with the order that `hold` interrupted."""
        ...

    async def look(self, order: Order) -> Outcome:
        """After a restart: how the vehicle stands to a goal that was given it before. Nothing is
        begun. If it is RUNNING, the driver has it from now on, and tells of it as of its own."""
        ...

    def forget(self) -> None:
        """The vehicle is lost: its order is nobody's any more, and nothing is sent for it."""
        ...

    async def close(self) -> None:
        """Let go. The vehicle keeps doing what it does, if it can without us."""
        ...


_DRIVERS = {
    DriverName.NODE: ("m2pem_plugin_ros.drivers.node", "NodeDriver"),
    DriverName.NAV2: ("m2pem_plugin_ros.drivers.nav2", "Nav2Driver"),
    DriverName.BASE: ("m2pem_plugin_ros.drivers.base", "BaseDriver"),
}


def make_driver(seat: Seat) -> Driver:
    """The driver for a seat; not open yet.

    Raises:
        RosError: it needs a package of ROS that is not installed.
    """
    module, name = _DRIVERS[seat.settings.driver]
    return cast("Driver", getattr(import_module(module), name)(seat))
