"""The status topic of a payload with its direction (m2pem_interfaces/msg/PayloadStatus)."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from m2pem.api import GeoPosition, LinkState, PayloadState, ResourceId
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.sensors.localization import Localization
from m2pem_plugin_ros.settings import Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

TOPIC = "payload_status"
MOST_CORNERS = 1000
LARGEST = 1e6
"""Larger angles and zooms are invalid."""


@dataclass(frozen=True, slots=True)
class Look:
    """The angles, zoom and footprint of `PayloadState`; None if not known."""

    pan_rad: float | None = None
    tilt_rad: float | None = None
    zoom: float | None = None
    footprint: tuple[GeoPosition, ...] = ()


class PayloadStatusTopic:
    """Subscribes to the status of a payload. `look` is the last one."""

    def __init__(
        self, ros: "RosRuntime", resource: ResourceId, settings: Settings, log_throttle: LogThrottle
    ) -> None:
        from m2pem_plugin_ros.installation import require_interfaces  # noqa: PLC0415
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        self.look = Look()
        self.changes = 0
        self._resource = resource
        self._log_throttle = log_throttle
        messages = require_interfaces("m2pem_interfaces").msg
        ros.subscribe(
            messages.PayloadStatus, settings.topic(TOPIC), self._on_message, qos.TELEMETRY
        )

    def state(self, time_us: int, link: LinkState, behavior: str) -> PayloadState:
        """Return the state for the fleet. Of a lost payload, no direction is known."""
        look = Look() if link is LinkState.LOST else self.look
        return PayloadState(
            self._resource,
            time_us,
            look.pan_rad,
            look.tilt_rad,
            look.zoom,
            link=link,
            behavior=behavior,
            footprint=look.footprint,
        )

    def _on_message(self, message: Any) -> None:
        if message.payload not in ("", self._resource):
            self._log_throttle.log("the direction of another payload", message.payload[:100])
            return
        self.look = Look(
            _number(message.pan_rad),
            _number(message.tilt_rad),
            _number(message.zoom),
            self._footprint(message.footprint),
        )
        self.changes += 1

    def _footprint(self, corners: Any) -> tuple[GeoPosition, ...]:
        if len(corners) > MOST_CORNERS:
            self._log_throttle.log("a footprint that has too many corners", f"{len(corners)}")
            return ()
        found = tuple(
            GeoPosition(corner.latitude_deg, corner.longitude_deg, corner.altitude_m)
            for corner in corners
        )
        if not all(map(_is_on_earth, found)):
            self._log_throttle.log("a footprint that is not on Earth")
            return ()
        return found


class PayloadSensors:
    """Implements `VehicleSensors` for a payload with its own node, without a localization."""

    battery_fraction: float | None = None
    errors: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    pose: Pose | None = None
    twist: Twist | None = None
    position: GeoPosition | None = None
    age_s = math.inf
    wrong_frame = ""

    def __init__(self, status: PayloadStatusTopic) -> None:
        self._status = status

    @property
    def localization(self) -> Localization:
        return self

    @property
    def changes(self) -> int:
        return self._status.changes


def _number(value: float) -> float | None:
    return value if math.isfinite(value) and abs(value) <= LARGEST else None


def _is_on_earth(corner: GeoPosition) -> bool:
    """Return whether a position is valid; NaN is not."""
    return (
        abs(corner.latitude_deg) <= 90.0
        and abs(corner.longitude_deg) <= 180.0
        and math.isfinite(corner.altitude_m)
    )
