"""A node in plain rclpy that subscribes to what the face `ros` publishes of vehicles.

python bench/programs/ros_reader.py stop|count <vehicles>

They are v0, v1 and so on; all subscriptions are reliable. `stop`: with the first odometry it says
"stopped", and stands still (SIGSTOP). `count`: it says "ready" with the first odometry of each
vehicle, and from then on, once a second, how many messages have come.
"""

import os
import signal
import sys
import time
from typing import Any

import rclpy
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, NavSatFix

RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
TOPICS = {"odom": Odometry, "fix": NavSatFix, "battery_state": BatteryState, "imu": Imu}


def main() -> None:
    """Read until the end of the process."""
    stops, count = sys.argv[1] == "stop", int(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node("reader")
    missing = set(range(count))
    came = 0

    def hear(number: int, message: Any) -> None:
        nonlocal came
        came += 1
        if not missing or type(message) is not Odometry:
            return
        missing.discard(number)
        if stops:
            print("stopped", flush=True)
            os.kill(os.getpid(), signal.SIGSTOP)
        elif not missing:
            print("ready", flush=True)

    for number in range(count):
        for leaf, kind in TOPICS.items():
            node.create_subscription(
                kind, f"/v{number}/{leaf}", lambda it, number=number: hear(number, it), RELIABLE
            )
    told_s = time.monotonic()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.5)
        if not missing and time.monotonic() >= told_s + 1:
            told_s = time.monotonic()
            print(came, flush=True)


if __name__ == "__main__":
    main()
