"""tf: earth -> map -> VEHICLE/odom -> VEHICLE/base_link (REP-105).

The local frame of the fleet is `map`. m2pem knows one position of a vehicle, so that its `odom` is
the same as `map`. Where `odom` of a ROS vehicle is, is left to the vehicle, whose odometry m2pem
reads by tf: only map -> VEHICLE/base_link is published for it, and with `odom_frame: tf` nothing.
Frames that another node publishes are left to it until it is gone.
"""

import asyncio
import logging
import math
from collections import deque
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from tf2_msgs.msg import TFMessage

from m2pem.api import LocalFrame, ResourceId, VehicleState
from m2pem_plugin_ros.face import telemetry_messages as messages
from m2pem_plugin_ros.face.names import BASE, EARTH, Names
from m2pem_plugin_ros.face.publisher import publishers_of
from m2pem_plugin_ros.face.rate_limiter import RateLimiter
from m2pem_plugin_ros.face.vehicle_topics import VehicleTopics
from m2pem_plugin_ros.frames import Quaternion, Vector, earth_from_enu
from m2pem_plugin_ros.runtime import RosRuntime, qos

TF = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)

SENT = 100
"""Stamps that were sent of each frame are remembered, to tell our own transforms from those of
others."""

LISTENED = 2
"""Calls of `watch` before frames are published where others publish some, too: a robot must not see
its own frames twice."""

GONE_AFTER_S = 5.0
"""A transform on /tf that was not received from others for so long is left to them no more. What
they publish on /tf_static stays, until no other node publishes there."""

TOGETHER_S = 0.01
"""Transforms of several vehicles that come within so short a time are one message."""

NO_ROTATION = Quaternion(0.0, 0.0, 0.0, 1.0)
NO_WAY = (0.0, 0.0, 0.0)

log = logging.getLogger("m2pem.face.ros")


@dataclass(slots=True)
class _Left:
    """A frame that is left to other nodes. `received_s`: when they published it last, by the clock
    of the event loop. `own`: the static transform that the face has for it."""

    topic: str
    received_s: float
    own: Any = None


class FramesPublisher:
    """Publishes the frames of a fleet. `put` and `watch` are called on the event loop."""

    def __init__(
        self, ros: RosRuntime, frame: LocalFrame, names: Names, rate_hz: float, now_us: int
    ) -> None:
        self._ros = ros
        self._node: Node = ros.node
        self._names = names
        self._now_us = now_us
        self._publisher = self._node.create_publisher(TFMessage, "/tf", TF)
        self._static = self._node.create_publisher(TFMessage, "/tf_static", qos.STATUS)
        self._topics: dict[ResourceId, VehicleTopics] = {}
        self._children: set[str] = set()
        """The frames `base_link` of the vehicles."""
        self._left: dict[str, _Left] = {}
        self._latest: dict[ResourceId, VehicleState] = {}
        self._failed: set[ResourceId] = set()
        self._sent: dict[str, deque[tuple[int, int]]] = {}
        self._loop = asyncio.get_running_loop()
        self._rate_hz = rate_hz
        self._limiters: dict[ResourceId, RateLimiter[VehicleState]] = {}
        self._publishing: asyncio.TimerHandle | None = None
        self._is_wanted = self._namesake_said = False
        self._listened = 0
        self._subscriptions: dict[str, Any] = {}
        self._statics: dict[str, Any] = {}
        """The transforms that stay, by the frame that they lead to."""
        latitude_deg, longitude_deg, _ = frame.origin
        rotation = earth_from_enu(latitude_deg, longitude_deg)
        self._add_static(EARTH, names.map_frame, frame.geocentric, rotation)

    def add(self, vehicle: ResourceId, topics: VehicleTopics) -> None:
        """Publish the frames of a vehicle from now on; `publish_static` when all are added."""
        self._topics[vehicle] = topics
        self._limiters[vehicle] = RateLimiter(self._rate_hz, self._collect)
        base = self._names.frame(vehicle, BASE)
        self._children.add(base)
        self._sent[base] = deque(maxlen=SENT)
        map_frame, odom_frame = self._names.map_frame, self._names.odom_frame(vehicle)
        if odom_frame != map_frame:
            self._add_static(map_frame, odom_frame, NO_WAY, NO_ROTATION)
        if self._names.tells_frames(vehicle):
            self._left[base] = _Left("/tf", math.inf)

    def publish_static(self) -> None:
        """Publish the transforms that stay, latched."""
        self._static.publish(TFMessage(transforms=list(self._statics.values())))

    def put(self, state: VehicleState) -> None:
        """Publish where a vehicle is, soon and with others."""
        if self._is_wanted and state.position is not None:
            self._limiters[state.resource].put(state)

    def watch(self) -> None:
        """Look who subscribes, listen to other publishers if there are any, and take back what they
        publish no more."""
        self._take_back()
        own = "/tf" in self._subscriptions
        self._listened += own
        is_alone = self._node.count_publishers(self._publisher.topic_name) <= 1
        has_readers = self._publisher.get_subscription_count() > own
        self._is_wanted = has_readers and (is_alone or self._listened >= LISTENED)
        for topic, hear, quality in (
            ("/tf", self._hear, TF),
            ("/tf_static", self._hear_static, qos.STATIC_TRANSFORMS),
        ):
            if topic not in self._subscriptions and self._node.count_publishers(topic) > 1:
                self._subscriptions[topic] = self._ros.subscribe(TFMessage, topic, hear, quality)

    def close(self) -> None:
        """Publish nothing more."""
        self._is_wanted = False
        for limiter in self._limiters.values():
            limiter.clear()
        if self._publishing is not None:
            self._publishing.cancel()

    # --- inside ---------------------------------------------------------------------------------

    def _collect(self, state: VehicleState) -> None:
        self._latest[state.resource] = state
        if self._publishing is None:
            self._publishing = self._loop.call_later(TOGETHER_S, self._publish)

    def _publish(self) -> None:
        self._publishing = None
        transforms = []
        for vehicle, state in self._latest.items():
            try:
                transform = self._topics[vehicle].transform(state)
            except Exception:  # a state that no transform can have must not end the face
                if vehicle not in self._failed:
                    self._failed.add(vehicle)
                    log.exception("no transform of %s can be published: %r", vehicle, state)
                continue
            if transform is not None and transform.child_frame_id not in self._left:
                transforms.append(transform)
                self._sent[transform.child_frame_id].append(_stamp(transform))
        self._latest.clear()
        if transforms:
            self._publisher.publish(TFMessage(transforms=transforms))

    def _add_static(self, parent: str, child: str, place: Vector, rotation: Quaternion) -> None:
        transform = messages.transform(self._now_us, parent, child, place, rotation)
        self._statics[child] = transform

    def _hear(self, message: Any) -> None:
        """Messages of our own come, too: they have stamps that were sent."""
        for transform in message.transforms:
            child = transform.child_frame_id.removeprefix("/")
            if (left := self._left.get(child)) is not None:
                left.received_s = max(left.received_s, self._loop.time())
                continue
            sent = self._sent.get(child)
            if child in self._statics or (sent is not None and _stamp(transform) not in sent):
                self._leave(child, transform.header.frame_id, "/tf")

    def _hear_static(self, message: Any) -> None:
        for transform in message.transforms:
            child = transform.child_frame_id.removeprefix("/")
            if child in self._left:
                continue
            own = self._statics.get(child)
            differs = own is not None and (
                transform.transform != own.transform
                or transform.header.frame_id != own.header.frame_id
            )
            if differs or child in self._children:
                self._leave(child, transform.header.frame_id, "/tf_static")

    def _leave(self, child: str, parent: str, topic: str) -> None:
        if self._may_be_namesake():
            return
        self._left[child] = _Left(topic, self._loop.time(), self._statics.pop(child, None))
        log.warning(
            "another node publishes the transform %r -> %r: it is left to that node", parent, child
        )
        if self._left[child].own is not None:
            self.publish_static()

    def _take_back(self) -> None:
        for child, left in list(self._left.items()):
            is_silent = left.topic == "/tf" and self._loop.time() - left.received_s > GONE_AFTER_S
            is_alone = left.received_s < math.inf and self._node.count_publishers(left.topic) <= 1
            if not (is_silent or is_alone):
                continue
            del self._left[child]
            log.warning(
                "the transform to %r is published by the face again: no other node does", child
            )
            if left.own is not None:
                self._statics[child] = left.own
                self.publish_static()

    def _may_be_namesake(self) -> bool:
        """Whether the face of another executive, which this one replaces, may have published it."""
        topic = self._publisher.topic_name
        known, name = publishers_of(self._node, topic), self._node.get_fully_qualified_name()
        if known.count(name) > 1:
            if not self._namesake_said:
                self._namesake_said = True
                log.warning(
                    "another node is %s, too: the face of an executive that this one replaces, or "
                    "of a second one in this ROS domain, which needs a namespace of its own",
                    name,
                )
            return True
        return bool(len(known) < self._node.count_publishers(topic))


def _stamp(transform: Any) -> tuple[int, int]:
    stamp = transform.header.stamp
    return stamp.sec, stamp.nanosec
