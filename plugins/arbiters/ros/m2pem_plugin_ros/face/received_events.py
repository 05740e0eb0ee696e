"""Topics of any type whose messages are events of missions.

Conditions are evaluated in a thread of ROS of their own, at a bounded rate: a topic that is flooded
delays neither the event loop nor what the face does else. Only events reach the loop.
"""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from m2pem.api import EventThrower, Fields
from m2pem_plugin_ros.face.event_settings import ReceivedTopic
from m2pem_plugin_ros.interfaces.plain_values import MessageFields
from m2pem_plugin_ros.interfaces.texts import one_line
from m2pem_plugin_ros.runtime import Inbox, RosRuntime
from m2pem_plugin_ros.runtime.publishers import other_type

NODE = "face_events"
LOOK_EVERY_S = 0.5
MESSAGES_PER_S = 200.0
"""Of all topics. Of more, DDS drops the oldest before Python sees them."""
AT_ONCE = 20
DEPTH = 10
WAITING = 100
"""Events of one topic that wait for the loop."""
LONGEST = 300

log = logging.getLogger("m2pem.face.events")


async def receive(
    topics: Sequence[ReceivedTopic], thrower: EventThrower, namespace: str, domain_id: int | None
) -> None:
    """Receive events until cancelled.

    Raises:
        RosError: ROS cannot be started.
    """
    async with RosRuntime(NODE, namespace=namespace, domain_id=domain_id) as ros:
        pace = Pace()
        received = [TopicReceiver(ros, each, thrower, pace) for each in topics]
        while True:
            for each in received:
                each.watch()
            await asyncio.sleep(LOOK_EVERY_S)


class Pace:
    """Lets `MESSAGES_PER_S` messages pass a second. The thread sleeps before one more."""

    def __init__(self) -> None:
        self._due_s = 0.0

    def wait(self) -> None:
        """Wait until a message may be handled."""
        now_s = time.monotonic()
        earliest_s = now_s - AT_ONCE / MESSAGES_PER_S
        self._due_s = max(self._due_s, earliest_s) + 1 / MESSAGES_PER_S
        if self._due_s > now_s:
            time.sleep(self._due_s - now_s)


class TopicReceiver:
    """One topic. It is subscribed as its publishers offer it: reliable if all are, and with their
    last message if all keep it. Until there is one, a subscription that fits any."""

    def __init__(
        self, ros: RosRuntime, received: ReceivedTopic, thrower: EventThrower, pace: Pace
    ) -> None:
        self._node = ros.node
        self._received = received
        self._pace = pace
        self._inbox: Inbox[Fields] = Inbox(
            asyncio.get_running_loop(),
            lambda data: thrower.put(received.rule, data, f"ros {self._topic}"),
            WAITING,
        )
        self._stamps: deque[Any] = deque(maxlen=2 * DEPTH)
        self._failed = False
        self._wrong = ""
        self._quality = (ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE)
        self._subscription = self._subscribe()
        self._topic: str = self._subscription.topic_name

    def watch(self) -> None:
        """Look at the publishers: subscribe as they offer it, and say if their type is another."""
        found = self._node.get_publishers_info_by_topic(self._topic)
        expected = self._received.type_name
        said = other_type(found, expected)
        if said and said != self._wrong:
            log.warning(
                "ros %s %s, but %s says %s: its messages are not received",
                self._topic,
                said,
                self._received.key,
                expected,
            )
        self._wrong = said
        offered = [each.qos_profile for each in found if each.topic_type == expected]
        if offered and (quality := _quality(offered)) != self._quality:
            self._quality = quality
            before, self._subscription = self._subscription, self._subscribe()
            self._node.destroy_subscription(before)

    def _subscribe(self) -> Any:
        reliability, durability = self._quality
        quality = QoSProfile(depth=DEPTH, reliability=reliability, durability=durability)
        topic = self._received.topic
        return self._node.create_subscription(self._received.type, topic, self._hear, quality)

    def _hear(self, message: Any, info: Any) -> None:
        """Called in the thread of ROS."""
        self._pace.wait()
        stamp = info["source_timestamp"]
        if stamp in self._stamps:  # once more, by a new subscription
            return
        self._stamps.append(stamp)
        try:
            data = self._received.rule.occurs(MessageFields(message), time.monotonic())
        except Exception as error:  # a message may be anything
            if not self._failed:
                self._failed = True
                log.warning(
                    "ros %s: %s: %s; further ones are not reported",
                    self._topic,
                    self._received.key,
                    one_line(str(error))[:LONGEST],
                )
            return
        if data is not None:
            self._inbox.put(data)


def _quality(offered: Sequence[Any]) -> tuple[ReliabilityPolicy, DurabilityPolicy]:
    """Return the best quality of service that all publishers offer."""
    reliable = all(each.reliability is ReliabilityPolicy.RELIABLE for each in offered)
    latched = all(each.durability is DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return (
        ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
