"""The interface of drivers. A driver connects to one vehicle.

A driver needs rclpy; the arbiter makes it in `connect`. All calls are made on the event loop and
return quickly. The driver reports the progress of an order by `DriverEvents`, and may report it
again.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Protocol, cast, runtime_checkable
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
    """A behavior for the vehicle. `goal` and `run` are unique, and the same after a restart.
    `preempts` lists the goals that this one replaces."""

    request: BehaviorRequest
    goal: UUID
    run: UUID
    preempts: tuple[UUID, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """The state of a goal on the vehicle. UNKNOWN: the vehicle does not know the goal. `outputs` of
    a goal that has ended go to the mission's data store. `held`: the vehicle reports that it is
    held. `remaining`: what it last reported that is left; None: nothing. `known`, of UNKNOWN: the
    vehicle has had the goal, which was cancelled there, by a hold or by another client."""

    state: BehaviorState
    code: str = ""
    reason: str = ""
    outputs: Mapping[str, Value] = field(default_factory=dict)
    held: bool = False
    remaining: Mapping[str, Value] | None = None
    known: bool = False

    @property
    def is_end(self) -> bool:
        """Whether the goal was known and has ended."""
        return self.state.terminal and self.state is not BehaviorState.UNKNOWN


@dataclass(frozen=True, slots=True)
class Health:
    """What a vehicle reports of itself besides its pose. None: not reported."""

    mode: str = ""
    ready: bool | None = None
    not_ready_reasons: tuple[str, ...] = ()
    battery_fraction: float | None = None


class DriverEvents(Protocol):
    """What a driver reports to the arbiter. Repeated reports, and reports of unknown goals, are
    ignored."""

    def alive(self) -> None:
        """A message of the vehicle, or of its software, was received."""
        ...

    def progress(self, goal: UUID) -> None:
        """The vehicle executes the goal."""
        ...

    def remains(self, goal: UUID, remaining: Mapping[str, Value]) -> None:
        """The vehicle reports what is left of the goal: the parameters by which another one would
        do it. Of routes, the arbiter knows it without that."""
        ...

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        """The goal has ended. The state of `outcome` is terminal."""
        ...

    def superseded(self, run: str, newest: int) -> None:
        """The vehicle has refused a command of a run, as it has seen a newer epoch of it."""
        ...


@dataclass(frozen=True, slots=True)
class DriverSetup:
    """The arguments of a driver. `context.clock` is used for all times, except timeouts of
    calls."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    ros: "RosRuntime"
    localization: Localization
    events: DriverEvents


class Driver(Protocol):
    """The connection to one vehicle. It is created as `Driver(setup)`."""

    async def open(self) -> None:
        """Connect. The vehicle need not be there yet."""
        ...

    @property
    def health(self) -> Health:
        """The last known health."""
        ...

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why a valid request cannot be done now; "" if it can."""
        ...

    def begin(self, order: Order) -> None:
        """Start an order in place of the current one. The replaced order is not reported any
        more."""
        ...

    def end(self, goal: UUID) -> None:
        """Stop a goal. `events.ended` follows, also if it had ended already."""
        ...

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Change parameters of a goal as far as the vehicle can."""
        ...

    def hold(self) -> None:
        """Stop the vehicle, and keep the order."""
        ...

    def resume(self) -> None:
        """Continue the order after `hold`."""
        ...

    async def query(self, order: Order) -> Outcome:
        """After a restart, return the state of a goal that was sent before. Nothing is started. If
        the goal is RUNNING, the driver adopts it and reports its progress."""
        ...

    def claim(self, run: UUID, epoch: int) -> None:
        """Have the vehicle refuse lower epochs of a run, if it can compare them."""
        ...

    def abandon(self) -> None:
        """Drop the order of a vehicle that is lost, or whose run another executive drives. Nothing
        more is sent for it."""
        ...

    async def close(self) -> None:
        """Disconnect. The vehicle goes on with what it does, if it can without a connection."""
        ...


@runtime_checkable
class Discovering(Protocol):
    """A driver whose vehicle is discovered: DDS drops what is published to a subscriber that it has
    not matched yet."""

    def missing(self, request: BehaviorRequest) -> str:
        """Return what of the vehicle a request needs that is not discovered yet; "" if nothing
        is."""
        ...


_DRIVERS = {
    DriverName.NODE: ("m2pem_plugin_ros.drivers.node", "NodeDriver"),
    DriverName.NAV2: ("m2pem_plugin_ros.drivers.nav2", "Nav2Driver"),
    DriverName.BASE: ("m2pem_plugin_ros.drivers.base", "BaseDriver"),
}


def make_driver(setup: DriverSetup) -> Driver:
    """Make the driver that the fleet names. It is not open yet.

    Raises:
        RosError: it needs a package of ROS that is not installed.
    """
    module, name = _DRIVERS[setup.settings.driver]
    return cast("Driver", getattr(import_module(module), name)(setup))
