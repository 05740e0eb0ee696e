"""The quality of service of all topics and services (docs/ros.md)."""

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def _latched(depth: int) -> QoSProfile:
    latched = DurabilityPolicy.TRANSIENT_LOCAL
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE, durability=latched)


STATUS = _latched(1)
"""A late subscriber gets the last message: vehicle_status, status, prompts, active_elements."""

BEHAVIOR_STATUS = _latched(10)
"""A late subscriber gets the last ten, as they are of several behaviors."""

COMMANDS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""Volatile: a late subscriber must not execute an old command."""

VELOCITIES = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
"""For cmd_vel: only the latest command counts."""

EVENTS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""Reliable, with a long queue: no event may be lost."""

TELEMETRY = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For sensors. A reliable reader never matches a best-effort writer; this one matches both."""

TRANSFORMS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For /tf. A reliable reader never matches a best-effort writer; this one matches both."""

STATIC_TRANSFORMS = _latched(100)
"""For /tf_static: a late subscriber gets the last message of each publisher."""

SERVICES = QoSProfile(depth=2000, reliability=ReliabilityPolicy.RELIABLE)
"""For clients and servers. Of more simultaneous calls, DDS loses the oldest silently. Waiting calls
are refused in turn, so that only a client's own flood comes this far."""

NO_PUBLISHER_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)
NO_SUBSCRIPTION_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)
"""rclpy looks at every event of every endpoint of an executor whenever a message comes. All that
these events do is to log that types or QoS differ, which `sensors.endpoints` says by name."""
