"""The qualities of service of all topics and services (docs/ros.md)."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

STATUS = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Who joins late gets the last one: vehicle_status, status, prompts, active_elements."""

BEHAVIOR_STATUS = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Who joins late gets the last ten, since they are of several behaviors."""

COMMANDS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""Never latched: who joins late must not carry out an old one."""

EVENTS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""None may be lost on the way to who listens."""

TELEMETRY = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of sensors. A reliable reader would never match a writer of best effort; this reads from both."""

SERVICES = QoSProfile(depth=2000, reliability=ReliabilityPolicy.RELIABLE)
"""For both ends of a service: of more calls at once than that, DDS loses the oldest silently. Those
that wait are refused in turn, so that it takes a client's own flood to come so far."""
