"""Publishers of the face: none where another node publishes the same topic, no work where nobody
subscribes."""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from m2pem_plugin_ros.face.rate_limiter import RateLimiter
from m2pem_plugin_ros.runtime.qos import NO_PUBLISHER_EVENTS
from m2pem_plugin_ros.sensors.graph import UNKNOWN_NODE, node_of

TELEMETRY = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""Reliable, as the displays of RViz and the nodes of Nav2 subscribe by default; a subscriber of
sensor data, which is best-effort, gets it, too. It never waits for a reader: the oldest message is
dropped."""

T = TypeVar("T")

log = logging.getLogger("m2pem.face.ros")


def publishers_of(node: Node, topic: str) -> list[str]:
    """Return the full name of the node of each publisher of a topic, of those that are known."""
    return [
        node_of(endpoint)
        for endpoint in node.get_publishers_info_by_topic(topic)
        if endpoint.node_name != UNKNOWN_NODE
    ]


class TelemetryPublisher(Generic[T]):
    """Publishes a topic of a vehicle at a bounded rate while somebody subscribes.

    `make`: returns the message for an item, or None for none. `watch` is to be called now and then.
    """

    def __init__(
        self,
        node: Node,
        message_type: Any,
        topic: str,
        rate_hz: float,
        make: Callable[[T], Any],
    ) -> None:
        self._node = node
        self._make = make
        self._create = partial(
            node.create_publisher,
            message_type,
            topic,
            TELEMETRY,
            event_callbacks=NO_PUBLISHER_EVENTS,
        )
        self._publisher: Any = self._create()
        self.topic: str = self._publisher.topic_name
        """Its name after remapping."""
        self._limiter = RateLimiter(rate_hz, self._publish)
        self._is_wanted = False
        self._failed = False

    def put(self, item: T) -> None:
        """Publish an item, or a newer one soon."""
        if self._is_wanted:
            self._limiter.put(item)

    def watch(self) -> None:
        """Look who subscribes, and who else publishes: to another publisher the topic is left until
        that is gone."""
        if self._publisher is None:
            if not self._node.count_publishers(self.topic):
                self._publisher = self._create()
                log.warning("%s is published by the face again: no other node does", self.topic)
        elif other := self._other():
            log.warning("%s is left to the node %s, which publishes it", self.topic, other)
            self.close()
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
        else:
            self._is_wanted = self._publisher.get_subscription_count() > 0

    def close(self) -> None:
        """Publish nothing until `watch` is called again."""
        self._is_wanted = False
        self._limiter.clear()

    def _other(self) -> str:
        """Return another node that publishes the topic; "" if there is none, or it has our name, as
        the face of an executive has that is replaced by this one."""
        if self._node.count_publishers(self.topic) <= 1:
            return ""
        own = self._node.get_fully_qualified_name()
        return next((name for name in publishers_of(self._node, self.topic) if name != own), "")

    def _publish(self, item: T) -> None:
        try:
            message = self._make(item)
            if message is not None:
                self._publisher.publish(message)
        except Exception:  # a state that no message can carry must not end the telemetry
            if not self._failed:
                self._failed = True
                log.exception("%r cannot be published on %s", item, self.topic)
