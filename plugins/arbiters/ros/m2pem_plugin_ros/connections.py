"""What the arbiter has of ROS: for each vehicle, and each payload that is commanded itself, what is
heard of it beside its driver."""

import asyncio
import math
import os
from collections.abc import Callable, Mapping
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
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.interfaces import set_stamp
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.sensors.detectors import DetectorTopic
from m2pem_plugin_ros.sensors.endpoints import Endpoints
from m2pem_plugin_ros.sensors.health import Battery, Diagnostics
from m2pem_plugin_ros.sensors.localization import Localization, TopicLocalization
from m2pem_plugin_ros.sensors.payload import PayloadSenses, PayloadSight
from m2pem_plugin_ros.settings import DetectorSettings, DriverName, Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime
    from m2pem_plugin_ros.sensors.payload import PayloadSight


class Senses(Protocol):
    """What a vehicle's sensors say."""

    @property
    def localization(self) -> Localization:
        """Where it is."""
        ...

    @property
    def battery_fraction(self) -> float | None:
        """Of a full one; None: not said."""
        ...

    @property
    def errors(self) -> tuple[str, ...]:
        """What is wrong with its parts, for people."""
        ...

    @property
    def refusal(self) -> str:
        """Why nothing may be commanded, for people: it is not one vehicle, or where it is cannot be
        known; "" if it may."""
        ...

    @property
    def absence(self) -> str:
        """Where what says that it is there is awaited, and who is there, for people."""
        ...

    @property
    def troubles(self) -> tuple[str, ...]:
        """What is missing to know well how it is, for people."""
        ...

    @property
    def changes(self) -> int:
        """Another number whenever something was heard."""
        ...


@dataclass(frozen=True, slots=True)
class Instruments:
    """Of one vehicle, or payload. `show_target` tells it where a vehicle is that it goes to,
    follows or looks at, and a payload where it is carried. `sight`: where a payload looks."""

    ros: "RosRuntime"
    senses: Senses
    show_target: Callable[[VehicleState], None]
    sight: "PayloadSight | None" = None


class Station(Protocol):
    """All connections to ROS of one arbiter."""

    async def open(self) -> Mapping[ResourceId, Instruments]:
        """Listen; returns at once, whoever is there.

        Raises:
            RosError: ROS cannot be used; the text says what would be right.
        """
        ...

    def retry(self) -> None:
        """Tell of detections whose place was not known before, if it is now."""
        ...

    async def close(self) -> None:
        """Let go of everything."""
        ...


@dataclass(frozen=True, slots=True)
class Installation:
    """What a station is made for. `hear` is given the states of payloads that detect. `vehicles`:
    also payloads with a node of their own."""

    connections: Mapping[ResourceId, Connection]
    vehicles: Mapping[ResourceId, Settings]
    detectors: Mapping[ResourceId, DetectorSettings]
    context: ArbiterContext
    hear: Callable[[PayloadState], None]


class TopicSenses:
    """Implements `Senses`: what the usual topics of one vehicle say."""

    def __init__(
        self,
        localization: TopicLocalization,
        battery: Battery,
        diagnostics: Diagnostics,
        hardware_id: str,
        endpoints: Endpoints,
    ) -> None:
        self.localization = localization
        self._endpoints = endpoints
        self._battery = battery
        self._diagnostics = diagnostics
        self._hardware_id = hardware_id
        diagnostics.watch(hardware_id)

    @property
    def battery_fraction(self) -> float | None:
        """Of a full one; None: not said."""
        return self._battery.fraction

    @property
    def errors(self) -> tuple[str, ...]:
        """What is wrong with its parts, for people."""
        return self._diagnostics.errors(self._hardware_id)

    @property
    def refusal(self) -> str:
        """Why nothing may be commanded, for people; "" if it may."""
        return self._endpoints.trouble or self.localization.wrong_frame

    @property
    def absence(self) -> str:
        """Where the vehicle is awaited, and who is there, for people."""
        return self._endpoints.absence

    @property
    def troubles(self) -> tuple[str, ...]:
        """What is missing to know well how it is, for people."""
        return self.localization.troubles

    @property
    def changes(self) -> int:
        """Another number whenever something was heard."""
        return self.localization.changes


class DdsStation:
    """Implements `Station`. If all vehicles are software in the loop, DDS stays on 127.0.0.1."""

    def __init__(self, installation: Installation) -> None:
        self._installation = installation
        self._runtimes: dict[int, RosRuntime] = {}
        self._diagnostics: dict[tuple[int, str], Diagnostics] = {}
        self._localizations: dict[ResourceId, TopicLocalization] = {}
        self._detectors: list[DetectorTopic] = []

    async def open(self) -> Mapping[ResourceId, Instruments]:
        """Listen; returns at once, whoever is there.

        Raises:
            RosError: ROS cannot be used; the text says what would be right.
        """
        known = self._installation
        if all(connection.sitl for connection in known.connections.values()):
            loopback.keep_on_loopback()
        try:
            vehicles = {
                resource: self._listen_to(resource, settings)
                for resource, settings in known.vehicles.items()
            }
            for resource, settings in known.detectors.items():
                whereabouts = self._whereabouts(resource)
                ros = self._runtime(settings.domain_id)
                self._detectors.append(
                    DetectorTopic(ros, resource, settings, known.context, whereabouts, known.hear)
                )
        except BaseException:
            await self.close()
            raise
        return vehicles

    def retry(self) -> None:
        """Tell of detections whose place was not known before, if it is now."""
        for detector in self._detectors:
            detector.retry()

    async def close(self) -> None:
        """Let go of everything."""
        runtimes = list(self._runtimes.values())
        self._runtimes.clear()
        await asyncio.gather(*(runtime.close() for runtime in runtimes))

    def _listen_to(self, resource: ResourceId, settings: Settings) -> Instruments:
        context = self._installation.context
        ros = self._runtime(settings.domain_id)
        if "/" in resource:
            sight = PayloadSight(ros, resource, settings, Complaints(context.logger, resource))
            domain = _domain(settings.domain_id)
            senses = PayloadSenses(sight, Endpoints(ros, settings, domain, is_payload=True))
            return Instruments(ros, senses, TargetTopic(ros, settings).show, sight)
        localization = TopicLocalization(ros, resource, settings, context)
        self._localizations[resource] = localization
        topic = settings.topic(settings.topics.diagnostics)
        board = (_domain(settings.domain_id), topic)
        if board not in self._diagnostics:
            self._diagnostics[board] = Diagnostics(ros, topic, context.clock)
        topics = TopicSenses(
            localization,
            Battery(ros, resource, settings, context),
            self._diagnostics[board],
            settings.hardware_id,
            Endpoints(ros, settings, _domain(settings.domain_id)),
        )
        # Other drivers ask the fleet's bus themselves where a target is.
        is_node = settings.driver is DriverName.NODE
        show_target = TargetTopic(ros, settings).show if is_node else _show_nothing
        return Instruments(ros, topics, show_target)

    def _runtime(self, domain_id: int | None) -> "RosRuntime":
        from m2pem_plugin_ros.runtime import RosRuntime  # noqa: PLC0415  # it needs rclpy

        domain = _domain(domain_id)
        if domain not in self._runtimes:
            # Two executives on one network have two journals, and so two names.
            name = f"m2pem_{self._installation.context.journal.hex[:8]}"
            self._runtimes[domain] = RosRuntime(name, domain_id=domain)
        return self._runtimes[domain]

    def _whereabouts(self, payload: ResourceId) -> Callable[[], GeoPosition | None]:
        vehicle = ResourceId(payload.partition("/")[0])
        localization = self._localizations.get(vehicle)
        if localization is not None:
            return lambda: localization.position
        bus = self._installation.context.bus

        def whereabouts() -> GeoPosition | None:
            state = bus.latest(vehicle)
            return state.position if isinstance(state, VehicleState) else None

        return whereabouts


def _show_nothing(_: VehicleState) -> None:
    return


def _domain(domain_id: int | None) -> int:
    """The domain of the environment is meant where the fleet says none."""
    if domain_id is not None:
        return domain_id
    try:
        return int(os.environ.get("ROS_DOMAIN_ID", ""))
    except ValueError:
        return 0


TOPIC = "target"


class TargetTopic:
    """Publishes m2pem_interfaces/TargetState in a vehicle's namespace."""

    def __init__(self, ros: "RosRuntime", settings: Settings) -> None:
        from m2pem_plugin_ros.installation import require_interfaces  # noqa: PLC0415
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        self._messages = require_interfaces("m2pem_interfaces").msg
        self._publisher = ros.node.create_publisher(
            self._messages.TargetState, settings.topic(TOPIC), qos.TELEMETRY
        )

    def show(self, state: VehicleState) -> None:
        """Publish a vehicle's state; without a position there is nothing to say."""
        if state.position is None:
            return
        message = self._messages.TargetState(vehicle=state.resource)
        set_stamp(message.stamp, state.time_us)
        message.position.latitude_deg = state.position.latitude_deg
        message.position.longitude_deg = state.position.longitude_deg
        message.position.altitude_m = state.position.altitude_m
        message.yaw_rad = math.nan if state.yaw_rad is None else state.yaw_rad
        velocity = state.velocity_enu_m_s or (math.nan, math.nan, math.nan)
        message.velocity.x, message.velocity.y, message.velocity.z = velocity
        self._publisher.publish(message)
