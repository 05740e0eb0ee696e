"""A plain base in plain rclpy: it does what cmd_vel says and publishes odometry in the frame map.

The topic "orders" changes it: "home" (it stands at the origin, and all is well), "mute" and "speak"
(odometry), "stick 0.5 0.2" (an operator's stick is held so) and "stick off", "intrude" (a second
publisher of cmd_vel appears), "block" (the wheels do not turn). What it is commanded goes to the
topic "said". Arguments: the namespace, "plain" or "stamped" commands, and a factor for time.
"""

import contextlib
import math
import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String

PERIOD_S = 0.02
LATE_S = 3 * PERIOD_S
"""Of what is later than that on a busy computer, nothing passes for the base."""

COMMAND_LASTS_S = 0.5
LAG_S = 0.1


class Base:
    def __init__(self, namespace: str, stamped: bool, speed: float) -> None:
        self.node = rclpy.create_node("base", namespace=namespace)
        self.stamped = stamped
        self.speed = speed
        self.east = self.north = self.yaw = 0.0
        self.forward = self.turning = 0.0
        self.wanted = (0.0, 0.0)
        self.wanted_at = 0.0
        self.mute = self.blocked = False
        self.stick: tuple[float, float] | None = None
        self.intruder: Any = None
        self.kind = TwistStamped if stamped else Twist
        self.last = time.monotonic()
        self.odometry = self.node.create_publisher(Odometry, "odom", qos_profile_sensor_data)
        self.said = self.node.create_publisher(String, "said", 100)
        self.stick_topic = self.node.create_publisher(self.kind, "cmd_vel_teleop", 1)
        self.node.create_subscription(self.kind, "cmd_vel", self.hear, 10)
        self.node.create_subscription(String, "orders", self.obey, 10)
        self.node.create_timer(PERIOD_S, self.move)

    def hear(self, message: Any) -> None:
        twist = message.twist if self.stamped else message
        self.wanted = (twist.linear.x, twist.angular.z)
        self.wanted_at = time.monotonic()
        self.said.publish(String(data=f"{twist.linear.x} {twist.angular.z}"))

    def move(self) -> None:
        now = time.monotonic()
        dt, self.last = min(now - self.last, LATE_S) * self.speed, now
        heard = now - self.wanted_at < COMMAND_LASTS_S
        wanted = self.wanted if heard and not self.blocked else (0.0, 0.0)
        part = 1.0 - math.exp(-dt / LAG_S)
        self.forward += part * (wanted[0] - self.forward)
        self.turning += part * (wanted[1] - self.turning)
        self.yaw += self.turning * dt
        self.east += self.forward * math.cos(self.yaw) * dt
        self.north += self.forward * math.sin(self.yaw) * dt
        if not self.mute:
            self.odometry.publish(self.where())
        if self.stick is not None:
            twist = Twist()
            twist.linear.x, twist.angular.z = self.stick
            self.stick_topic.publish(TwistStamped(twist=twist) if self.stamped else twist)

    def where(self) -> Odometry:
        message = Odometry()
        message.header.stamp = self.node.get_clock().now().to_msg()
        message.header.frame_id = "map"
        message.pose.pose.position.x = self.east
        message.pose.pose.position.y = self.north
        message.pose.pose.orientation.z = math.sin(self.yaw / 2)
        message.pose.pose.orientation.w = math.cos(self.yaw / 2)
        message.twist.twist.linear.x = self.forward
        message.twist.twist.angular.z = self.turning
        return message

    def obey(self, order: String) -> None:
        words = order.data.split()
        if words[0] == "home":
            self.east = self.north = self.yaw = self.forward = self.turning = 0.0
            self.wanted, self.mute, self.blocked, self.stick = (0.0, 0.0), False, False, None
            if self.intruder is not None:
                self.node.destroy_publisher(self.intruder)
        elif words[0] in ("mute", "speak"):
            self.mute = words[0] == "mute"
        elif words[0] == "stick":
            self.stick = None if words[1] == "off" else (float(words[1]), float(words[2]))
        elif words[0] == "intrude":
            self.intruder = self.node.create_publisher(self.kind, "cmd_vel", 1)
        elif words[0] == "block":
            self.blocked = True


def main() -> None:
    namespace, kind, speed = sys.argv[1:]
    rclpy.init()
    base = Base(namespace, kind == "stamped", float(speed))
    print("ready", flush=True)
    with contextlib.suppress(ExternalShutdownException):
        rclpy.spin(base.node)


if __name__ == "__main__":
    main()
