"""The topics /tf and /tf_static of one ROS domain, read when they are needed first."""

from typing import TYPE_CHECKING, Any

from m2pem.api import ArbiterContext
from m2pem_plugin_ros.installation import RosError, require_interfaces
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.sensors.tf_buffer import (
    Found,
    TransformBuffer,
    TransformError,
    transform_of,
)

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

MAP = "map"
"""The local frame of the fleet."""


class TfTopics:
    """The transforms of all vehicles that share the two topics."""

    def __init__(
        self, ros: "RosRuntime", topic: str, static_topic: str, context: ArbiterContext
    ) -> None:
        self._ros = ros
        self._topics = (topic, static_topic)
        self._log_throttle = LogThrottle(context.logger, topic)
        self._buffer = TransformBuffer(lambda: context.clock.now_us() / 1e6, topic)
        self._is_open = False
        self._problem = ""

    @property
    def version(self) -> int:
        """A counter that changes with each transform."""
        return self._buffer.version

    def open(self) -> None:
        """Subscribe, if it was not done before. Without the package tf2_msgs, nothing is found."""
        if self._is_open:
            return
        self._is_open = True
        try:
            message_type = require_interfaces("tf2_msgs").msg.TFMessage
        except RosError as error:
            self._problem = f"tf is not read: {error}"
            return
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        topic, static_topic = self._topics
        self._ros.subscribe(message_type, topic, self._on_moving, qos.TRANSFORMS)
        self._ros.subscribe(message_type, static_topic, self._on_static, qos.STATIC_TRANSFORMS)

    def find(self, frame: str, stamp_ns: int | None = None) -> Found:
        """Return the pose of a frame in `map`, at a time or the newest one. It opens the topics.

        Raises:
            TransformError: there is none; the text says why.
        """
        self.open()
        if self._problem:
            raise TransformError(self._problem)
        return self._buffer.find(MAP, frame, stamp_ns)

    def _on_moving(self, message: Any) -> None:
        self._take(message, is_static=False)

    def _on_static(self, message: Any) -> None:
        self._take(message, is_static=True)

    def _take(self, message: Any, *, is_static: bool) -> None:
        for each in message.transforms:
            stamp = each.header.stamp
            stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
            parent, child = each.header.frame_id, each.child_frame_id
            try:
                transform = transform_of(each.transform.translation, each.transform.rotation)
            except ValueError as error:
                wrong = f"from '{parent}' to '{child}': {error}"
            else:
                wrong = self._buffer.add(parent, child, transform, stamp_ns, is_static=is_static)
            if wrong:
                self._log_throttle.log("an invalid transform", wrong)
