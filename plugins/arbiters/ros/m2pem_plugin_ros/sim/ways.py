"""What steers a simulated vehicle on board: nothing, an m2pem node, or Nav2."""

import logging
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Protocol, cast

from m2pem.api import ArbiterContext, Connection, PayloadState, ResourceId, VehicleState
from m2pem_plugin_ros.drivers.driver import Driver, Seat, Told
from m2pem_plugin_ros.localization import Localization
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import Bounds, DriverName
from m2pem_plugin_ros.sim.body import Chassis
from m2pem_plugin_ros.sim.clock import SimulatedClock
from m2pem_plugin_ros.sim.guard import GuardedRuntime
from m2pem_plugin_ros.sim.refusing import RefusingDriver
from m2pem_plugin_ros.sim.specification import VehicleSpec
from m2pem_plugin_ros.sim.troubles import Troubles

logger = logging.getLogger(__name__)


class Way(Protocol):
    """What steers a vehicle on board, once it is open."""

    async def open(self) -> None:
        """Serve."""
        ...

    async def close(self) -> None:
        """End, and leave the vehicle standing."""
        ...


@dataclass(frozen=True, slots=True)
class OnBoard:
    """All that a way is given."""

    spec: VehicleSpec
    ros: GuardedRuntime
    localization: Localization
    clock: SimulatedClock
    troubles: Troubles

    def make_driver(self, told: Told) -> Driver:
        """What drives the base when the m2pem node, or Nav2, says so."""
        driver: Driver = import_module("m2pem_plugin_ros.drivers.base").BaseDriver(self._seat(told))
        return cast(Driver, RefusingDriver(driver, self.troubles))

    def _seat(self, told: Told) -> Seat:
        spec = self.spec
        settings = replace(
            spec.settings, driver=DriverName.BASE, bounds=bounds_of(spec.chassis, spec)
        )
        return Seat(
            Connection(ResourceId(spec.name), spec.domain, sitl=True),
            settings,
            ArbiterContext(self.clock, _NoBus(), logger, spec.origin),
            cast(RosRuntime, self.ros),
            self.localization,
            told,
        )


class NoWay:
    """A plain base: it is steered from elsewhere."""

    async def open(self) -> None:
        """There is nothing to serve."""

    async def close(self) -> None:
        """There is nothing to end."""


def make_way(board: OnBoard) -> Way:
    """What steers the vehicle, by its driver's name."""
    namespace = board.spec.settings.namespace
    made: Any
    match board.spec.settings.driver:
        case DriverName.NODE:
            make = import_module("m2pem_plugin_ros.onboard").Onboard
            made = make(board.ros, board.spec.name, namespace, board.make_driver, clock=board.clock)
        case DriverName.NAV2:
            make = import_module("m2pem_plugin_ros.sim.nav2").Nav2Server
            made = make(board.ros, namespace, board.make_driver)
        case _:
            made = NoWay()
    return cast(Way, made)


def bounds_of(chassis: Chassis, spec: VehicleSpec) -> Bounds:
    """What whoever steers on board knows of the base."""
    return replace(
        spec.settings.bounds,
        speed_m_s=chassis.speed_m_s,
        reverse_m_s=chassis.reverse_m_s,
        acceleration_m_s2=chassis.acceleration_m_s2,
        yaw_rate_rad_s=chassis.yaw_rate_rad_s,
        turn_radius_m=chassis.turn_radius_m,
    )


class _NoBus:
    """On board, nothing is known of the fleet but what an m2pem node hears itself."""

    def latest(self, resource: str) -> VehicleState | PayloadState | None:
        return None

    def publish(self, state: VehicleState | PayloadState) -> None:
        return None

    async def subscribe(self, size: int = 100) -> AsyncIterator[VehicleState | PayloadState]:
        return
        yield
