"""What any ROS node sees of a mixed fleet: odometry, fix, battery and tf of each vehicle; and an
action client that sends one somewhere.

Plain rclpy: it knows of m2pem its interfaces alone. Ends with 0 when all was received, and the
vehicle has arrived.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, NavSatFix
from tf2_msgs.msg import TFMessage

WITHIN_S = 60.0
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Client:
    """One node, with the last message of each topic."""

    def __init__(self, vehicles: list[str]) -> None:
        self.node = rclpy.create_node("any_client")
        self.vehicles = vehicles
        self.last: dict[str, Any] = {}
        self.frames: dict[str, Any] = {}
        for name in vehicles:
            kinds = (("odom", Odometry), ("fix", NavSatFix), ("battery_state", BatteryState))
            for topic, kind in kinds:
                self._follow(f"/{name}/{topic}", kind)
        self.node.create_subscription(TFMessage, "/tf", self._transforms, 100)
        self.node.create_subscription(TFMessage, "/tf_static", self._transforms, LATCHED)

    def _follow(self, topic: str, kind: type) -> None:
        # Some vehicles publish reliably, others not: who takes what comes receives both.
        keep = lambda each: self.last.update({topic: each})  # noqa: E731
        self.node.create_subscription(kind, topic, keep, qos_profile_sensor_data)

    def _transforms(self, message: TFMessage) -> None:
        for each in message.transforms:
            self.frames[each.child_frame_id] = each

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Spin until something is true."""
        end = time.monotonic() + WITHIN_S
        while not condition():
            if time.monotonic() > end:
                raise SystemExit(f"not received within {WITHIN_S:g} s: {what}")
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def missing(self) -> list[str]:
        """What has not been received yet."""
        topics = [
            f"/{name}/{topic}"
            for name in self.vehicles
            for topic in ("odom", "fix", "battery_state")
        ]
        frames = ["map", *(f"{name}/base_link" for name in self.vehicles)]
        return [
            *(topic for topic in topics if topic not in self.last),
            *(f"the frame {frame}" for frame in frames if frame not in self.frames),
        ]

    def in_map(self, frame: str) -> tuple[float, float]:
        """East and north of a frame in `map`. All frames between have one yaw, that of `map`."""
        east = north = 0.0
        while frame != "map":
            transform = self.frames[frame]
            east += transform.transform.translation.x
            north += transform.transform.translation.y
            frame = transform.header.frame_id
        return east, north

    def show(self) -> None:
        """Print one line for each vehicle."""
        self.until(lambda: not self.missing(), "topics and frames of all vehicles")
        for name in self.vehicles:
            odometry = self.last[f"/{name}/odom"]
            fix, battery = self.last[f"/{name}/fix"], self.last[f"/{name}/battery_state"]
            east, north = self.in_map(f"{name}/base_link")
            print(
                f"ROS: {name}: east {odometry.pose.pose.position.x:.1f} m, "
                f"north {odometry.pose.pose.position.y:.1f} m in {odometry.header.frame_id}; "
                f"tf {east:.1f}, {north:.1f}; fix {fix.latitude:.6f}, {fix.longitude:.6f}; "
                f"battery {100 * battery.percentage:.0f} %",
                flush=True,
            )

    def execute(self, vehicle: str, behavior: str, **parameters: Any) -> None:
        """Execute a behavior, and wait for its end."""
        action = ActionClient(self.node, ExecuteBehavior, f"/{vehicle}/execute_behavior")
        self.until(action.server_is_ready, f"the action of {vehicle}")
        values = [KeyValue(key=key, value=json.dumps(each)) for key, each in parameters.items()]
        command = BehaviorCommand(verb=BehaviorCommand.START, behavior=behavior, parameters=values)
        goal = action.send_goal_async(ExecuteBehavior.Goal(command=command))
        self.until(goal.done, "an answer to the goal")
        if not goal.result().accepted:
            raise SystemExit(f"{vehicle} refused {behavior}")
        result = goal.result().get_result_async()
        self.until(result.done, f"the end of {behavior}")
        status = result.result().result.status
        if status.state != BehaviorStatus.SUCCEEDED:
            raise SystemExit(f"{vehicle}: {behavior} ended: {status.code}: {status.reason}")
        print(f"ROS: {vehicle}: {behavior} succeeded", flush=True)


def main() -> None:
    """Show the vehicles, and send one somewhere."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("vehicles", nargs="+")
    parser.add_argument("--fly", help="the vehicle that takes off and flies to --to")
    parser.add_argument("--to", default="38.1078,-77.3190,15", help="latitude,longitude,altitude")
    arguments = parser.parse_args()
    rclpy.init()
    client = Client(arguments.vehicles)
    client.show()
    if arguments.fly:
        latitude, longitude, altitude = map(float, arguments.to.split(","))
        place = {"type": "Point", "coordinates": [longitude, latitude, altitude]}
        client.execute(arguments.fly, "takeoff", altitude=altitude)
        client.execute(arguments.fly, "goto", target=place)
        fix = client.last[f"/{arguments.fly}/fix"]
        if math.dist((fix.latitude, fix.longitude), (latitude, longitude)) > 5e-5:
            raise SystemExit(f"{arguments.fly} is at {fix.latitude}, {fix.longitude}")
    client.node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
