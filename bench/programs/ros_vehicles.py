"""A process of vehicles with arbiter nodes, in plain rclpy, as far as an executive needs them.

python bench/programs/ros_vehicles.py <vehicles> <Hz of odometry and status> [<first> [endless]]

They are v0, v1 and so on, from `first` on, in namespaces of those names. Each stands in its place,
accepts whatever it is commanded, and has done it at once; v0 never gets to an end. With `endless`
nobody does, and cancels are told of, too. On standard output, the line before "ready" says when the
nodes began to be made (ns since the epoch), and each after it what a vehicle was commanded: its
number, the verb, and when the callback was called.
"""

import sys
import time
from functools import partial

import rclpy
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, VehicleStatus
from nav_msgs.msg import Odometry
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

APART_M = 10.0
NEVER_ENDS = 0
TOLD = (BehaviorCommand.START, BehaviorCommand.HOLD, BehaviorCommand.RESUME)
LATCHED = DurabilityPolicy.TRANSIENT_LOCAL


class Vehicle:
    """One of them, on a node that all share."""

    def __init__(self, node: Node, number: int, endless: bool) -> None:
        self._number = number
        self._ends = not endless and number != NEVER_ENDS
        self._told = (*TOLD, BehaviorCommand.CANCEL) if endless else TOLD
        name = f"v{number}"
        self._status = VehicleStatus(vehicle=name, readiness=VehicleStatus.READY, battery=0.8)
        self._odometry = Odometry(child_frame_id="base_link")
        self._odometry.header.frame_id = "map"
        self._odometry.pose.pose.position.x = number * APART_M
        self._odometry.pose.pose.orientation.w = 1.0
        self._seen: set[str] = set()
        depth = QoSProfile(depth=10)
        latched, latched_10 = (QoSProfile(depth=each, durability=LATCHED) for each in (1, 10))
        # Without events, of which rclpy looks at every one whenever a message or timer comes.
        publisher = partial(
            node.create_publisher,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        self._odom = publisher(Odometry, f"/{name}/odom", depth)
        self._states = publisher(VehicleStatus, f"/{name}/vehicle_status", latched)
        self._said = publisher(BehaviorStatus, f"/{name}/behavior_status", latched_10)
        node.create_subscription(
            BehaviorCommand,
            f"/{name}/command",
            self._hear,
            depth,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

    def tell(self, node: Node) -> None:
        """Say where and how it is."""
        now = node.get_clock().now().to_msg()
        self._odometry.header.stamp = self._status.stamp = now
        self._odom.publish(self._odometry)
        self._states.publish(self._status)

    def _hear(self, command: BehaviorCommand) -> None:
        came_ns = time.time_ns()
        if command.verb == BehaviorCommand.START:
            if command.id in self._seen:
                return
            self._seen.add(command.id)
        elif command.verb in (BehaviorCommand.HOLD, BehaviorCommand.RESUME):
            held = command.verb == BehaviorCommand.HOLD
            if self._status.held == held:  # said again
                return
            self._status.held = held
            self._states.publish(self._status)
        if command.verb == BehaviorCommand.START:
            self._say(command.id, BehaviorStatus.ACCEPTED, BehaviorStatus.RUNNING)
            if self._ends:
                self._say(command.id, BehaviorStatus.SUCCEEDED)
        elif command.verb == BehaviorCommand.CANCEL:
            self._say(command.id, BehaviorStatus.CANCELLED)
        if command.verb in self._told:
            print(self._number, command.verb, came_ns, flush=True)

    def _say(self, behavior: str, *states: int) -> None:
        for state in states:
            number = min(state, 3)
            self._status.behavior = behavior if number < 3 else ""
            self._said.publish(BehaviorStatus(id=behavior, number=number, state=state))
        self._states.publish(self._status)


def main() -> None:
    """Be the vehicles until the end of the process."""
    count, rate_hz, first = int(sys.argv[1]), float(sys.argv[2]), int([*sys.argv, "0"][3])
    print(time.time_ns(), flush=True)
    rclpy.init()
    node = rclpy.create_node(f"vehicles_{first}")
    endless = "endless" in sys.argv
    vehicles = [Vehicle(node, number, endless) for number in range(first, first + count)]
    told = 0
    began_s = time.monotonic()

    def tell() -> None:
        nonlocal told
        due = int((time.monotonic() - began_s) * rate_hz * count)
        while told < due:
            vehicles[told % count].tell(node)
            told += 1

    for vehicle in vehicles:
        vehicle.tell(node)
    node.create_timer(0.005, tell)
    print("ready", flush=True)
    try:
        rclpy.spin(node)
    except (Exception, KeyboardInterrupt):  # at the end, whatever it did just then fails
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
