"""The topics of a plain base: velocity commands, and those of an operator's joystick."""

import asyncio
import logging
from typing import Any

import geometry_msgs.msg
from rclpy.duration import Duration

from m2pem_plugin_ros.pose import Twist
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.settings import Settings

ARRIVED_WITHIN_S = 0.5

logger = logging.getLogger(__name__)


class CommandTopic:
    """Publishes velocity commands."""

    def __init__(self, ros: RosRuntime, settings: Settings) -> None:
        self._node = ros.node
        self._stamped = settings.stamped
        name = settings.topic(settings.topics.cmd_vel)
        self._publisher = ros.publisher(_message_type(settings), name, qos.VELOCITIES)

    @property
    def name(self) -> str:
        return str(self._publisher.topic_name)

    @property
    def is_subscribed(self) -> bool:
        """Whether a subscriber gets the commands."""
        return bool(self._publisher.get_subscription_count())

    def send(self, twist: Twist) -> None:
        velocity = geometry_msgs.msg.Twist()
        velocity.linear.x = twist.forward_m_s
        velocity.angular.z = twist.yaw_rad_s
        if not self._stamped:
            self._publisher.publish(velocity)
            return
        message = geometry_msgs.msg.TwistStamped(twist=velocity)
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id = "base_link"
        self._publisher.publish(message)

    def others(self) -> int:
        """Return how many other nodes publish commands for the base."""
        return max(0, int(self._node.count_publishers(self.name)) - 1)

    async def stop(self) -> None:
        """Publish the zero command, and wait until it is acknowledged, or for a short time."""
        self.send(Twist())
        arrived = await asyncio.to_thread(
            self._publisher.wait_for_all_acked, Duration(seconds=ARRIVED_WITHIN_S)
        )
        if not arrived:
            logger.warning("%s: the last command, to stop, was not acknowledged", self.name)


class TeleopTopic:
    """The last velocity command of an operator's joystick."""

    def __init__(self, ros: RosRuntime, settings: Settings) -> None:
        self._loop = asyncio.get_running_loop()
        self._stamped = settings.stamped
        self._received_s = -1e9
        self.twist: Twist | None = None
        name = settings.topic(settings.topics.teleop)
        ros.subscribe(_message_type(settings), name, self._on_message, qos.TELEMETRY)

    @property
    def age_s(self) -> float:
        """Age in real seconds, as the operator is a real person."""
        return self._loop.time() - self._received_s

    def _on_message(self, message: Any) -> None:
        twist = message.twist if self._stamped else message
        self.twist = Twist(twist.linear.x, twist.angular.z)
        self._received_s = self._loop.time()


def _message_type(settings: Settings) -> Any:
    return geometry_msgs.msg.TwistStamped if settings.stamped else geometry_msgs.msg.Twist
