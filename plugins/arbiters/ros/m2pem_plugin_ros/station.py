"""The station over real DDS: one runtime for each ROS domain, and what is heard through it."""

import asyncio
import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from m2pem.api import GeoPosition, ResourceId, VehicleState
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.battery import Battery
from m2pem_plugin_ros.complaints import Complaints
from m2pem_plugin_ros.detectors import DetectorTopic
from m2pem_plugin_ros.diagnostics import Diagnostics
from m2pem_plugin_ros.endpoints import Endpoints
from m2pem_plugin_ros.instruments import Installation, Instruments
from m2pem_plugin_ros.localization import TopicLocalization
from m2pem_plugin_ros.payload_sight import PayloadSenses, PayloadSight
from m2pem_plugin_ros.settings import DriverName, Settings
from m2pem_plugin_ros.targets import TargetTopic

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


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
