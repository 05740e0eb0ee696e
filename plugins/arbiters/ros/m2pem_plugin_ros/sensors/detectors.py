"""Detections: from the topic of a detector to the bus of the fleet."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from m2pem.api import (
    ArbiterContext,
    Detection,
    GeoPosition,
    PayloadState,
    ResourceId,
    mean_sea_level_m,
)
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.interfaces.data_values import is_denormal
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.sensors.localization import FARTHEST_M
from m2pem_plugin_ros.sensors.tf_buffer import TransformError
from m2pem_plugin_ros.sensors.tf_topics import MAP, TfTopics
from m2pem_plugin_ros.settings import DetectorMessage, DetectorSettings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime
    from m2pem_plugin_ros.sensors.other_messages import OtherMessages

LONGEST_TYPE = 200
WAITING = 100
"""Detections that wait for a position of the vehicle. Of more, the oldest are dropped."""

LATE_S = 60.0
"""A stamp that is older than this, or in the future, comes from another clock."""

_ELLIPSOIDAL = ("geographic_msgs.", "sensor_msgs.")
"""Packages whose places (GeoPoint, NavSatFix) have altitudes above the WGS-84 ellipsoid; other
interfaces have no rule, and m2pem's own count from mean sea level."""

_GEOGRAPHIC = 1
_LOCAL = 2


@dataclass(frozen=True, slots=True)
class _Found:
    """`position` None means that of the vehicle; an altitude of NaN means that of the vehicle."""

    type: str
    time_us: int
    position: GeoPosition | None


class DetectorTopic:
    """The detections of one payload. It is subscribed until the runtime is closed.

    `vehicle_position` returns the position of the vehicle, if it is known. A detection without a
    position has that of the vehicle. Until it is known, the detection waits for the next `retry`.
    """

    def __init__(
        self,
        ros: "RosRuntime",
        resource: ResourceId,
        settings: DetectorSettings,
        context: ArbiterContext,
        vehicle_position: Callable[[], GeoPosition | None],
        hear: Callable[[PayloadState], None],
        tf: TfTopics,
    ) -> None:
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        self._resource = resource
        self._settings = settings
        self._context = context
        self._vehicle_position = vehicle_position
        self._on_message = hear
        self._tf = tf
        self._log_throttle = LogThrottle(context.logger, resource)
        self._waiting: deque[_Found] = deque(maxlen=WAITING)
        self._other: OtherMessages | None = None
        if settings.other is not None:
            from m2pem_plugin_ros.sensors import other_messages  # noqa: PLC0415  # it needs rclpy

            self._other = other_messages.OtherMessages(
                ros,
                resource,
                settings.topic,
                settings.other,
                self._on_other,
                context.logger,
                self._log_throttle,
            )
        elif settings.message is DetectorMessage.STRING:
            from std_msgs.msg import String  # noqa: PLC0415  # it is loaded where ROS is only

            ros.subscribe(String, settings.topic, self._on_text, qos.EVENTS)
        else:
            from m2pem_plugin_ros.installation import require_interfaces  # noqa: PLC0415

            message_type = require_interfaces("m2pem_interfaces").msg.Detection
            ros.subscribe(message_type, settings.topic, self._on_detection, qos.EVENTS)

    def retry(self) -> None:
        """Publish the waiting detections, if the position of the vehicle is known now, and look who
        publishes."""
        if self._other is not None:
            self._other.look()
        while self._waiting and self._publish(self._waiting[0]):
            self._waiting.popleft()

    def _on_text(self, message: Any) -> None:
        self._take(message.data, self._context.clock.now_us(), None)

    def _on_detection(self, message: Any) -> None:
        if message.source not in ("", self._resource, self._resource.partition("/")[2]):
            return  # several payloads share the topic
        self._take(message.type, self._time_of(message), self._position_of(message))

    def _on_other(self, found: "tuple[str, Any, Any]") -> None:
        """A message of another type, and the field with its position, which may be None."""
        type_, message, place = found
        position = None
        if hasattr(place, "latitude"):
            altitude_m = float(getattr(place, "altitude", math.nan))
            if type(place).__module__.startswith(_ELLIPSOIDAL):
                altitude_m = mean_sea_level_m(place.latitude, place.longitude, altitude_m)
            position = self._geographic(place.latitude, place.longitude, altitude_m)
        elif place is not None:
            numbers = (place.x, place.y, place.z)
            position = self._local(getattr(message, "header", None), numbers)
        self._take(type_, self._time_of(message), position)

    def _time_of(self, message: Any) -> int:
        """Return the time of a message: that of its header, if that is of our clock."""
        now_us = self._context.clock.now_us()
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is None:
            return now_us
        stamp_us = int(stamp.sec) * 1_000_000 + int(stamp.nanosec) // 1000
        return stamp_us if 0 <= now_us - stamp_us <= LATE_S * 1e6 else now_us

    def _position_of(self, message: Any) -> GeoPosition | None:
        if message.position_kind == _GEOGRAPHIC:
            geo = message.position_geographic
            return self._geographic(geo.latitude_deg, geo.longitude_deg, geo.altitude_m)
        if message.position_kind == _LOCAL:
            place = message.position_local
            return self._local(message.header, (place.x, place.y, place.z))
        return None

    def _geographic(
        self, latitude_deg: float, longitude_deg: float, altitude_m: float
    ) -> GeoPosition | None:
        is_given = not any(map(is_denormal, (latitude_deg, longitude_deg, altitude_m)))
        if is_given and abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0:
            return GeoPosition(latitude_deg, longitude_deg, altitude_m)
        cause = "an invalid position of a detection"
        numbers = f"({latitude_deg:g}, {longitude_deg:g}, {altitude_m:g})"
        self._log_throttle.log(cause, numbers)
        return None

    def _local(self, header: Any, numbers: tuple[float, float, float]) -> GeoPosition | None:
        """Return a place in the frame of a header; None: `map`."""
        if not all(abs(each) <= FARTHEST_M and not is_denormal(each) for each in numbers):
            cause = "an invalid position of a detection"
            self._log_throttle.log(cause, f"({numbers[0]:g}, {numbers[1]:g}, {numbers[2]:g})")
            return None
        try:
            east_m, north_m, up_m = numbers if header is None else self._in_map(header, numbers)
        except TransformError as error:
            cause = "the position of a detection in a frame of which the pose is not known"
            self._log_throttle.log(cause, f"'{header.frame_id}': {error}")
            return None
        return to_geodetic(east_m, north_m, up_m, self._context.origin)

    def _in_map(self, header: Any, place: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return a place of the header's frame in `map`.

        Raises:
            TransformError: tf does not tell where the frame is.
        """
        frame = header.frame_id.removeprefix("/")
        if frame == MAP:
            return place
        stamp_ns = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
        return self._tf.find(frame, stamp_ns or None).transform.apply(place)

    def _take(self, type_: str, time_us: int, position: GeoPosition | None) -> None:
        type_ = type_.strip() or self._settings.type
        if not type_:
            self._log_throttle.log("a detection without a type")
            return
        if len(type_) > LONGEST_TYPE:
            self._log_throttle.log("a detection whose type is too long", f"{len(type_)} characters")
            return
        found = _Found(type_, time_us, position)
        if self._waiting or not self._publish(found):
            if len(self._waiting) == WAITING:
                self._log_throttle.log("detections, as the vehicle's position is not known")
            self._waiting.append(found)

    def _publish(self, found: _Found) -> bool:
        position = found.position
        if position is None:
            position = self._vehicle_position()
        if position is None:
            return False
        if not math.isfinite(position.altitude_m):
            own = self._vehicle_position()
            altitude_m = own.altitude_m if own is not None else self._context.origin[2]
            position = GeoPosition(position.latitude_deg, position.longitude_deg, altitude_m)
        detection = Detection(found.type, self._resource, position, found.time_us)
        now_us = self._context.clock.now_us()
        self._on_message(PayloadState(self._resource, now_us, detections=(detection,)))
        return True
