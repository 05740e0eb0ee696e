"""Detections from messages of any type: when they are one, and where."""

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.interfaces.plain_values import MessageFields
from m2pem_plugin_ros.interfaces.texts import one_line
from m2pem_plugin_ros.interfaces.types import MESSAGE, find_type
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.runtime import Inbox, RosRuntime
from m2pem_plugin_ros.runtime.publishers import other_type
from m2pem_plugin_ros.settings import OtherMessage

QUALITY = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""It fits every publisher."""
WAITING = 100
LONGEST = 300
WHOLE = "."
"""The path of the message itself."""

Found = tuple[str, Any, Any]
"""The type of a detection, its message, and the field with its position or None."""


class OtherMessages:
    """The topic of one detector. Conditions are evaluated in the thread of ROS; `hear` is called on
    the loop with each message that is a detection.

    Raises:
        RosError: the type is not installed, or has no position where the fleet says.
    """

    def __init__(
        self,
        ros: RosRuntime,
        resource: str,
        topic: str,
        other: OtherMessage,
        hear: Callable[[Found], None],
        logger: logging.Logger,
        log_throttle: LogThrottle,
    ) -> None:
        self._other = other
        self._logger = logger
        self._log_throttle = log_throttle
        try:
            type_ = find_type(other.type_name, MESSAGE)
            _check(type_, other)
        except RosError as error:
            raise RosError(f"{resource}: connection: {error}") from error
        self._inbox: Inbox[Found] = Inbox(asyncio.get_running_loop(), hear, WAITING)
        self._node = ros.node
        self._resource = resource
        self._topic = topic
        self._wrong = ""
        ros.node.create_subscription(type_, topic, self._hear, QUALITY)

    def look(self) -> None:
        """Look at the publishers, and say if their type is another. Call it now and then."""
        found = self._node.get_publishers_info_by_topic(self._topic)
        wrong = other_type(found, self._other.type_name)
        if wrong and wrong != self._wrong:
            self._logger.warning(
                "%s: %s %s, but its connection says %s: nothing is detected",
                self._resource,
                self._topic,
                wrong,
                self._other.type_name,
            )
        self._wrong = wrong

    def _hear(self, message: Any) -> None:
        try:
            data = self._other.condition.occurs(MessageFields(message), time.monotonic())
        except Exception as error:  # a message may be anything
            cause = "a message to which the condition `when`, or `type`, does not apply"
            self._log_throttle.log(cause, one_line(str(error))[:LONGEST])
            return
        if data is not None:
            place = _at(message, self._other.position) if self._other.position else None
            self._inbox.put((str(data["type"]), message, place))


def _at(message: Any, path: str) -> Any:
    """Return the field at a dotted path; None if there is none."""
    for name in path.split(".") if path != WHOLE else ():
        message = getattr(message, name, None)
    return message


def _check(type_: Any, other: OtherMessage) -> None:
    """Raise RosError if messages of a type have no position at a path."""
    if not other.position:
        return
    place = _at(type_(), other.position)
    is_place = all(hasattr(place, name) for name in ("latitude", "longitude"))
    if not is_place and not all(hasattr(place, name) for name in ("x", "y", "z")):
        raise RosError(
            f"position: {other.position!r} of {other.type_name} is neither a point (x, y, z) nor "
            "a place (latitude, longitude)"
        )
