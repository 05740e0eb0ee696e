"""What steers a simulated vehicle on board: nothing, an m2pem node, or Nav2."""

import logging
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Protocol, cast

from m2pem.api import (
    ArbiterContext,
    Connection,
    FleetBus,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.drivers.driver import Driver, Seat, Told
from m2pem_plugin_ros.localization import Localization
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import Bounds, DriverName
from m2pem_plugin_ros.sim.clock import SimulatedClock
from m2pem_plugin_ros.sim.guard import GuardedRuntime
from m2pem_plugin_ros.sim.own_driver import OwnDriver
from m2pem_plugin_ros.sim.specification import VehicleSpec
from m2pem_plugin_ros.sim.troubles import Troubles
from m2pem_plugin_ros.sim.vehicle import Vehicle

logger = logging.getLogger(__name__)


class Way(Protocol):
    """What steers a vehicle on board, once it is open."""

    async def open(self) -> None:
        """Serve."""
        ...

    async def close(self) -> None:
        """End, and leave the vehicle standing."""
        ...


class NoWay:
    """A plain base: it is steered from elsewhere."""

    async def open(self) -> None:
        """There is nothing to serve."""

    async def close(self) -> None:
        """There is nothing to end."""


@dataclass(frozen=True, slots=True)
class OnBoard:
    """All that a way is given."""

    vehicle: Vehicle
    ros: GuardedRuntime
    localization: Localization
    clock: SimulatedClock
    troubles: Troubles

    def make_driver(self, told: Told, bus: FleetBus) -> Driver:
        """What drives the base when the m2pem node, or Nav2, says so."""
        spec = self.vehicle.spec
        seat = Seat(
            Connection(ResourceId(spec.name), spec.domain, sitl=True),
            replace(spec.settings, driver=DriverName.BASE, bounds=_bounds(spec)),
            ArbiterContext(self.clock, bus, logger, spec.origin),
            cast(RosRuntime, self.ros),
            self.localization,
            told,
        )
        driver: Driver = import_module("m2pem_plugin_ros.drivers.base").BaseDriver(seat)
        return cast(Driver, OwnDriver(driver, self.vehicle.battery, self.troubles))


def make_way(board: OnBoard) -> Way:
    """What steers the vehicle, by its driver's name.

    Raises:
        RosError: a package that it needs, such as nav2_msgs, is not there.
    """
    match board.vehicle.spec.settings.driver:
        case DriverName.NODE:
            return _node(board)
        case DriverName.NAV2:
            return _nav2(board)
        case _:
            return NoWay()


def _node(board: OnBoard) -> Way:
    onboard: Any = import_module("m2pem_plugin_ros.onboard")
    bus: FleetBus = import_module("m2pem_plugin_ros.onboard.targets").Targets()
    spec = board.vehicle.spec
    made = onboard.Onboard(
        board.ros,
        spec.name,
        spec.settings.namespace,
        lambda told: board.make_driver(told, bus),
        clock=board.clock,
        bus=bus,
        logger=logger,
    )
    return cast(Way, made)


def _nav2(board: OnBoard) -> Way:
    nav2: Any = import_module("m2pem_plugin_ros.sim.nav2")
    spec = board.vehicle.spec
    made = nav2.Nav2Server(
        board.ros,
        spec.settings.namespace,
        lambda told: board.make_driver(told, _NoBus()),
        board.localization,
        spec.origin,
    )
    return cast(Way, made)


def _bounds(spec: VehicleSpec) -> Bounds:
    """What whoever steers on board knows of the base."""
    chassis = spec.chassis
    return replace(
        spec.settings.bounds,
        speed_m_s=chassis.speed_m_s,
        reverse_m_s=chassis.reverse_m_s,
        acceleration_m_s2=chassis.acceleration_m_s2,
        yaw_rate_rad_s=chassis.yaw_rate_rad_s,
        turn_radius_m=chassis.turn_radius_m,
    )


class _NoBus:
    """Nav2 knows nothing of the fleet."""

    def latest(self, resource: str) -> VehicleState | PayloadState | None:
        return None

    def publish(self, state: VehicleState | PayloadState) -> None:
        return None

    async def subscribe(self, size: int = 100) -> AsyncIterator[VehicleState | PayloadState]:
        return
        yield
