"""The onboard control of a simulated vehicle: an m2pem node, or Nav2."""

import logging
import math
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Protocol, cast

from m2pem.api import (
    US_PER_S,
    ArbiterContext,
    BehaviorRequest,
    Clock,
    Connection,
    FleetBus,
    GeoPosition,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.drivers.driver import Driver, DriverEvents, DriverSetup, Health
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sensors.localization import Localization
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.dynamics import limits, wrapped_rad
from m2pem_plugin_ros.simulator.faults import TrafficFaults
from m2pem_plugin_ros.simulator.sensors import Battery, Reading
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.traffic import FilteredRuntime
from m2pem_plugin_ros.simulator.vehicle import Vehicle

logger = logging.getLogger(__name__)


class OnboardControl(Protocol):
    """The software that controls a vehicle on board."""

    async def open(self) -> None:
        """Start."""
        ...

    async def close(self) -> None:
        """Stop the vehicle, and close."""
        ...


@dataclass(frozen=True, slots=True)
class ControlContext:
    """The arguments of an onboard control."""

    vehicle: Vehicle
    ros: FilteredRuntime
    localization: Localization
    clock: Clock
    traffic_faults: TrafficFaults

    def make_driver(self, events: DriverEvents, bus: FleetBus) -> Driver:
        """Make the driver of the base for the m2pem node, or for Nav2."""
        spec = self.vehicle.spec
        bounds = replace(spec.settings.bounds, **limits(spec.chassis))
        setup = DriverSetup(
            Connection(ResourceId(spec.name), spec.domain, sitl=True),
            replace(spec.settings, driver=DriverName.BASE, bounds=bounds),
            ArbiterContext(self.clock, bus, logger, spec.origin),
            cast(RosRuntime, self.ros),
            self.localization,
            events,
        )
        driver: Driver = import_module("m2pem_plugin_ros.drivers.base").BaseDriver(setup)
        return cast(Driver, SimulatedDriver(driver, self.vehicle.battery, self.traffic_faults))


def make_onboard_control(context: ControlContext) -> OnboardControl:
    """Make the onboard control for the driver of the vehicle, which is not a plain base.

    Raises:
        RosError: a package that it needs, such as nav2_msgs, is not there.
    """
    is_node = context.vehicle.spec.settings.driver is DriverName.NODE
    return _node(context) if is_node else _nav2(context)


def _node(context: ControlContext) -> OnboardControl:
    onboard: Any = import_module("m2pem_plugin_ros.onboard.node")
    bus: FleetBus = import_module("m2pem_plugin_ros.onboard.target_bus").TargetBus()
    spec = context.vehicle.spec
    made = onboard.OnboardNode(
        context.ros,
        spec.name,
        spec.settings.namespace,
        lambda events: context.make_driver(events, bus),
        clock=context.clock,
        bus=bus,
        logger=logger,
    )
    return cast(OnboardControl, made)


def _nav2(context: ControlContext) -> OnboardControl:
    nav2: Any = import_module("m2pem_plugin_ros.simulator.nav2")
    spec = context.vehicle.spec
    made = nav2.Nav2Server(
        context.ros,
        spec.settings.namespace,
        lambda events: context.make_driver(events, _NoBus()),
        context.localization,
        spec.origin,
    )
    return cast(OnboardControl, made)


class _NoBus:
    """A bus without states: Nav2 knows nothing of the fleet."""

    def latest(self, resource: str) -> VehicleState | PayloadState | None:
        return None

    def publish(self, state: VehicleState | PayloadState) -> None:
        return None

    async def subscribe(self, size: int = 100) -> AsyncIterator[VehicleState | PayloadState]:
        return
        yield


class SimulatedDriver:
    """A driver with the battery of the simulated vehicle, which may refuse behaviors as a fault."""

    def __init__(self, driver: Driver, battery: Battery, traffic_faults: TrafficFaults) -> None:
        self._driver, self._battery, self._traffic_faults = driver, battery, traffic_faults

    def __getattr__(self, name: str) -> Any:
        return getattr(self._driver, name)

    @property
    def health(self) -> Health:
        return replace(self._driver.health, battery_fraction=self._battery.fraction)

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why a request cannot be done now; "" if it can."""
        if self._traffic_faults.refusal is not None:
            return self._traffic_faults.refusal
        return self._driver.refusal(request)


class SimulatedLocalization:
    """Implements `m2pem_plugin_ros.sensors.localization.Localization` by the odometry of the
    simulated vehicle, with its faults. It does not use DDS, so that many vehicles in one process
    stay cheap."""

    wrong_frame = ""

    def __init__(self, spec: VehicleSpec, clock: Clock) -> None:
        self._spec, self._clock = spec, clock
        self.pose: Pose | None = None
        self.twist: Twist | None = None
        self._stamp_us = -1
        self._received_us: int | None = None

    def hear(self, reading: Reading) -> None:
        """Process a reading. Old and invalid readings are ignored."""
        pose = reading.pose
        if reading.time_us <= self._stamp_us or not math.isfinite(pose.east_m + pose.yaw_rad):
            return
        self.pose = self._in_map(pose)
        self.twist = reading.twist
        self._stamp_us = reading.time_us
        self._received_us = self._clock.now_us()

    @property
    def position(self) -> GeoPosition | None:
        if self.pose is None:
            return None
        origin = self._spec.origin
        place = to_geodetic(self.pose.east_m, self.pose.north_m, 0.0, origin)
        return GeoPosition(place.latitude_deg, place.longitude_deg, origin[2])

    @property
    def age_s(self) -> float:
        if self._received_us is None:
            return math.inf
        return (self._clock.now_us() - self._received_us) / US_PER_S

    def _in_map(self, pose: Pose) -> Pose:
        """Return the pose in the frame `map`. The vehicle knows where its odometry began."""
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
