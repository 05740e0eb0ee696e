"""What steers a simulated vehicle on board: nothing, an m2pem node, or Nav2."""

import logging
import math
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Protocol, cast

from m2pem.api import (
    ArbiterContext,
    BehaviorRequest,
    Connection,
    FleetBus,
    GeoPosition,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.drivers.driver import Driver, Health, Seat, Told
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sensors.localization import Localization
from m2pem_plugin_ros.settings import Bounds, DriverName
from m2pem_plugin_ros.simulator.clock import US_PER_S, SimulatedClock
from m2pem_plugin_ros.simulator.dynamics import wrapped_rad
from m2pem_plugin_ros.simulator.faults import Troubles
from m2pem_plugin_ros.simulator.sensors import Battery, Reading
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.traffic import GuardedRuntime
from m2pem_plugin_ros.simulator.vehicle import Vehicle

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
    onboard: Any = import_module("m2pem_plugin_ros.onboard.node")
    bus: FleetBus = import_module("m2pem_plugin_ros.onboard.target_bus").Targets()
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
    nav2: Any = import_module("m2pem_plugin_ros.simulator.nav2")
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


class OwnDriver:
    """Any driver; it also knows of the vehicle's battery."""

    def __init__(self, driver: Driver, battery: Battery, troubles: Troubles) -> None:
        self._driver, self._battery, self._troubles = driver, battery, troubles

    def __getattr__(self, name: str) -> Any:
        return getattr(self._driver, name)

    @property
    def health(self) -> Health:
        """What is known by now."""
        return replace(self._driver.health, battery_fraction=self._battery.fraction)

    def refusal(self, request: BehaviorRequest) -> str:
        """Why it cannot be done now; "" if it can."""
        if self._troubles.refusal is not None:
            return self._troubles.refusal
        return self._driver.refusal(request)


class OwnLocalization:
    """Keeps the promises of `m2pem_plugin_ros.sensors.localization.Localization`."""

    def __init__(self, spec: VehicleSpec, clock: SimulatedClock) -> None:
        self._spec, self._clock = spec, clock
        self._pose: Pose | None = None
        self._twist: Twist | None = None
        self._stamp_us = -1
        self._heard_us: int | None = None

    def hear(self, reading: Reading) -> None:
        """Take a reading; one that is old or no place at all is as good as none."""
        pose = reading.pose
        if reading.time_us <= self._stamp_us or not math.isfinite(pose.east_m + pose.yaw_rad):
            return
        self._pose = self._in_map(pose)
        self._twist = reading.twist
        self._stamp_us = reading.time_us
        self._heard_us = self._clock.now_us()

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame."""
        return self._pose

    @property
    def twist(self) -> Twist | None:
        """In the vehicle's own frame."""
        return self._twist

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84, altitude above mean sea level."""
        if self._pose is None:
            return None
        origin = self._spec.origin
        place = to_geodetic(self._pose.east_m, self._pose.north_m, 0.0, origin)
        return GeoPosition(place.latitude_deg, place.longitude_deg, origin[2])

    @property
    def age_s(self) -> float:
        """How long ago the pose was heard; infinite before the first."""
        if self._heard_us is None:
            return math.inf
        return (self._clock.now_us() - self._heard_us) / US_PER_S

    def _in_map(self, pose: Pose) -> Pose:
        """The vehicle knows where its odometry began."""
        if self._spec.settings.odom_frame == "map":
            return pose
        start = self._spec.start
        cosine, sine = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        return Pose(
            start.east_m + pose.east_m * cosine - pose.north_m * sine,
            start.north_m + pose.east_m * sine + pose.north_m * cosine,
            wrapped_rad(start.yaw_rad + pose.yaw_rad),
            start.up_m,
        )
