"""The connections of the arbiter to ROS: one runtime for each ROS domain, and the topics of each
vehicle."""

import asyncio
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from m2pem.api import (
    ArbiterContext,
    Connection,
    GeoPosition,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.interfaces import set_stamp
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.sensors.detectors import DetectorTopic
from m2pem_plugin_ros.sensors.domain_search import search_domains
from m2pem_plugin_ros.sensors.endpoints import Endpoints
from m2pem_plugin_ros.sensors.graph import Graph
from m2pem_plugin_ros.sensors.health import Battery, Diagnostics
from m2pem_plugin_ros.sensors.localization import Localization, TopicLocalization
from m2pem_plugin_ros.sensors.payload import PayloadSensors, PayloadStatusTopic
from m2pem_plugin_ros.sensors.tf_topics import TfTopics
from m2pem_plugin_ros.settings import DetectorSettings, DriverName, Settings, Topics, domain_of

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


class VehicleSensors(Protocol):
    """The sensor data of a vehicle."""

    @property
    def localization(self) -> Localization: ...

    @property
    def battery_fraction(self) -> float | None:
        """0 to 1; None if it is not known."""
        ...

    @property
    def errors(self) -> tuple[str, ...]:
        """Errors of components of the vehicle, as text."""
        ...

    @property
    def problems(self) -> tuple[str, ...]:
        """Data that is missing, as text."""
        ...

    @property
    def changes(self) -> int:
        """A counter that changes with each message."""
        ...


@dataclass(frozen=True, slots=True)
class VehicleConnection:
    """The ROS connection of one vehicle or payload. `publish_target` sends the state of a vehicle
    that it goes to, follows or looks at; to a payload, also the state of its own vehicle.
    `payload_status` is the status topic of a payload."""

    ros: "RosRuntime"
    sensors: VehicleSensors
    endpoints: Endpoints
    publish_target: Callable[[VehicleState], None]
    payload_status: PayloadStatusTopic | None = None

    @property
    def refusal(self) -> str:
        """Why the vehicle must not be commanded: its endpoints are ambiguous, or its pose cannot be
        known. "" if it may be commanded."""
        return self.endpoints.problem or self.sensors.localization.wrong_frame


class VehicleConnections(Protocol):
    """All ROS connections of one arbiter."""

    async def open(self) -> Mapping[ResourceId, VehicleConnection]:
        """Subscribe to all topics, and return at once. The vehicles need not be there.

        Raises:
            RosError: ROS cannot be used; the text gives the remedy.
        """
        ...

    async def search(self, absent: Collection[ResourceId], within_s: float) -> None:
        """Search other ROS domains for absent vehicles. Their `Endpoints` say what was found."""
        ...

    def retry(self) -> None:
        """Publish the detections that waited for a position of their vehicle, if it is known
        now."""
        ...

    async def close(self) -> None:
        """Close all connections."""
        ...


@dataclass(frozen=True, slots=True)
class ConnectionsSetup:
    """The arguments of `VehicleConnections`. `hear` receives the states of payloads that detect.
    `vehicles` contains payloads with a node of their own, too."""

    connections: Mapping[ResourceId, Connection]
    vehicles: Mapping[ResourceId, Settings]
    detectors: Mapping[ResourceId, DetectorSettings]
    context: ArbiterContext
    hear: Callable[[PayloadState], None]


class TopicSensors:
    """Implements `VehicleSensors` with the topics of one vehicle."""

    def __init__(
        self,
        localization: TopicLocalization,
        battery: Battery,
        diagnostics: Diagnostics,
        hardware_id: str,
    ) -> None:
        self.localization = localization
        self._battery = battery
        self._diagnostics = diagnostics
        self._hardware_id = hardware_id
        diagnostics.watch(hardware_id)

    @property
    def battery_fraction(self) -> float | None:
        return self._battery.fraction

    @property
    def errors(self) -> tuple[str, ...]:
        return self._diagnostics.errors(self._hardware_id)

    @property
    def problems(self) -> tuple[str, ...]:
        return self.localization.problems

    @property
    def changes(self) -> int:
        return self.localization.changes


class DdsConnections:
    """Implements `VehicleConnections` over DDS. If all vehicles are simulated, DDS stays on
    127.0.0.1."""

    def __init__(self, installation: ConnectionsSetup) -> None:
        self._setup = installation
        self._runtimes: dict[int, RosRuntime] = {}
        self._graphs: dict[int, Graph] = {}
        self._diagnostics: dict[tuple[int, str], Diagnostics] = {}
        self._tf: dict[tuple[int, str, str], TfTopics] = {}
        self._localizations: dict[ResourceId, TopicLocalization] = {}
        self._endpoints: dict[ResourceId, Endpoints] = {}
        self._detectors: list[DetectorTopic] = []
        self._watching: list[asyncio.Task[None]] = []

    async def open(self) -> Mapping[ResourceId, VehicleConnection]:
        known = self._setup
        if all(connection.sitl for connection in known.connections.values()):
            loopback.keep_on_loopback()
        try:
            vehicles = {}
            for resource, own in known.vehicles.items():
                vehicles[resource] = self._listen_to(resource, own)
                await asyncio.sleep(0)  # DDS needs milliseconds for each subscription
            for resource, settings in known.detectors.items():
                vehicle_position = self._vehicle_position(resource)
                ros = self._runtime(settings.domain_id)
                tf = self._tf_of(resource, settings.domain_id)
                self._detectors.append(
                    DetectorTopic(
                        ros, resource, settings, known.context, vehicle_position, known.hear, tf
                    )
                )
        except BaseException:
            await self.close()
            raise
        return vehicles

    async def search(self, absent: Collection[ResourceId], within_s: float) -> None:
        domains = {0, *self._runtimes, domain_of(None)}
        endpoints = [self._endpoints[resource] for resource in absent]
        await search_domains(endpoints, domains, self._runtimes, within_s)

    def retry(self) -> None:
        for detector in self._detectors:
            detector.retry()

    async def close(self) -> None:
        watching, self._watching = self._watching, []
        await cancel_and_wait(*watching)
        runtimes = list(self._runtimes.values())
        self._runtimes.clear()
        await asyncio.gather(*(runtime.close() for runtime in runtimes))

    def _listen_to(self, resource: ResourceId, settings: Settings) -> VehicleConnection:
        context = self._setup.context
        ros = self._runtime(settings.domain_id)
        if "/" in resource:
            payload_status = PayloadStatusTopic(
                ros, resource, settings, LogThrottle(context.logger, resource)
            )
            endpoints = self._endpoints_of(ros, settings, is_payload=True)
            self._endpoints[resource] = endpoints
            show = TargetPublisher(ros, settings).show
            sensors = PayloadSensors(payload_status)
            return VehicleConnection(ros, sensors, endpoints, show, payload_status)
        tf = self._tf_of(resource, settings.domain_id)
        localization = TopicLocalization(ros, resource, settings, context, tf)
        self._localizations[resource] = localization
        topic = settings.topic(settings.topics.diagnostics)
        key = (domain_of(settings.domain_id), topic)
        if key not in self._diagnostics:
            self._diagnostics[key] = Diagnostics(ros, topic, context.clock)
        endpoints = self._endpoints_of(ros, settings)
        self._endpoints[resource] = endpoints
        topics = TopicSensors(
            localization,
            Battery(ros, resource, settings, context),
            self._diagnostics[key],
            settings.hardware_id,
        )
        # Other drivers read targets from the fleet's bus.
        is_node = settings.driver is DriverName.NODE
        publish_target = TargetPublisher(ros, settings).show if is_node else _publish_nothing
        return VehicleConnection(ros, topics, endpoints, publish_target)

    def _endpoints_of(
        self, ros: "RosRuntime", settings: Settings, *, is_payload: bool = False
    ) -> Endpoints:
        domain = domain_of(settings.domain_id)
        if domain not in self._graphs:
            self._graphs[domain] = Graph(ros.node)
        return Endpoints(ros, settings, domain, is_payload=is_payload, graph=self._graphs[domain])

    def _runtime(self, domain_id: int | None) -> "RosRuntime":
        from m2pem_plugin_ros.runtime import RosRuntime  # noqa: PLC0415  # it needs rclpy

        domain = domain_of(domain_id)
        if domain not in self._runtimes:
            # The name of the journal distinguishes executives on one network.
            name = f"m2pem_{self._setup.context.journal.hex[:8]}"
            ros = self._runtimes[domain] = RosRuntime(name, domain_id=domain, spreads=True)
            if ros.uses_sim_time:
                self._watch_clock(ros)
        return self._runtimes[domain]

    def _tf_of(self, resource: ResourceId, domain_id: int | None) -> TfTopics:
        """Return the transforms of a vehicle, or of the vehicle of a payload. Most share them."""
        vehicle = self._setup.vehicles.get(ResourceId(resource.partition("/")[0]))
        names = Topics()
        topic, static_topic = names.tf, names.tf_static
        if vehicle is not None:
            topic = vehicle.topic(vehicle.topics.tf)
            static_topic = vehicle.topic(vehicle.topics.tf_static)
        key = (domain_of(domain_id), topic, static_topic)
        if key not in self._tf:
            ros = self._runtime(domain_id)
            self._tf[key] = TfTopics(ros, topic, static_topic, self._setup.context)
        return self._tf[key]

    def _watch_clock(self, ros: "RosRuntime") -> None:
        from m2pem_plugin_ros.runtime.clock_watch import ClockWatch  # noqa: PLC0415  # rclpy

        context = self._setup.context
        watch = ClockWatch(ros, context.clock, context.logger)
        self._watching.append(asyncio.get_running_loop().create_task(watch.run()))

    def _vehicle_position(self, payload: ResourceId) -> Callable[[], GeoPosition | None]:
        vehicle = ResourceId(payload.partition("/")[0])
        localization = self._localizations.get(vehicle)
        if localization is not None:
            return lambda: localization.position
        bus = self._setup.context.bus

        def vehicle_position() -> GeoPosition | None:
            state = bus.latest(vehicle)
            return state.position if isinstance(state, VehicleState) else None

        return vehicle_position


def _publish_nothing(_: VehicleState) -> None:
    return


TOPIC = "target"


class TargetPublisher:
    """Publishes the state of other vehicles on `target` (m2pem_interfaces/TargetState), in the
    namespace of a vehicle."""

    def __init__(self, ros: "RosRuntime", settings: Settings) -> None:
        from m2pem_plugin_ros.installation import require_interfaces  # noqa: PLC0415
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        self._messages = require_interfaces("m2pem_interfaces").msg
        self._stamp_us = ros.stamp_us
        self._publisher = ros.publisher(
            self._messages.TargetState, settings.topic(TOPIC), qos.TELEMETRY
        )

    def show(self, state: VehicleState) -> None:
        """Publish a state. States without a position are skipped."""
        if state.position is None:
            return
        message = self._messages.TargetState(vehicle=state.resource)
        set_stamp(message.stamp, self._stamp_us(state.time_us))
        message.position.latitude_deg = state.position.latitude_deg
        message.position.longitude_deg = state.position.longitude_deg
        message.position.altitude_m = state.position.altitude_m
        message.yaw_rad = math.nan if state.yaw_rad is None else state.yaw_rad
        velocity = state.velocity_enu_m_s or (math.nan, math.nan, math.nan)
        message.velocity.x, message.velocity.y, message.velocity.z = velocity
        self._publisher.publish(message)
