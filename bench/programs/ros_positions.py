"""A node in plain rclpy that tells when odometry was published or has come, by its position.

python bench/programs/ros_positions.py publish|read <topic> <Hz>

`publish`: a rover in the namespace of the topic moves a metre north with each odometry, at random
times; it says so with its status, too. Each line on standard output: the metres north, and when (ns
since the epoch).
"""

import random
import sys
import time

import rclpy
from m2pem_interfaces.msg import VehicleStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def say(odometry: Odometry) -> None:
    """Say where it is, and that it is now."""
    print(odometry.pose.pose.position.y, time.time_ns(), flush=True)


def publish(node: Node, topic: str, rate_hz: float) -> None:
    """Move until the end of the process."""
    namespace = topic.rpartition("/")[0]
    status = VehicleStatus(vehicle=namespace[1:], readiness=VehicleStatus.READY, battery=0.8)
    states = node.create_publisher(VehicleStatus, f"{namespace}/vehicle_status", LATCHED)
    odometries = node.create_publisher(Odometry, topic, 10)
    odometry = Odometry(child_frame_id="base_link")
    odometry.header.frame_id = "map"
    odometry.pose.pose.orientation.w = 1.0
    rng = random.Random(5)
    while rclpy.ok():
        time.sleep(rng.uniform(0.5, 1.5) / rate_hz)
        odometry.pose.pose.position.y += 1.0
        odometry.header.stamp = status.stamp = node.get_clock().now().to_msg()
        say(odometry)
        odometries.publish(odometry)
        states.publish(status)


def main() -> None:
    """Publish or read."""
    kind, topic, rate_hz = sys.argv[1], sys.argv[2], float(sys.argv[3])
    rclpy.init()
    node = rclpy.create_node(f"positions_{kind}")
    print("ready", flush=True)
    try:
        if kind == "publish":
            publish(node, topic, rate_hz)
        node.create_subscription(Odometry, topic, say, 10)
        rclpy.spin(node)
    except (Exception, KeyboardInterrupt):  # at the end, whatever it did just then fails
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
