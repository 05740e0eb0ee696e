"""Nodes in plain rclpy that break the rules, each in its own way: `ros_lying_peer.py`.

The namespace says how: /stranger tells of behaviors that nobody gave it, /parrot ends each twice
and counts backwards, /flood says 5000 statuses a second beside the true ones, /mute is there and
answers no START, /refuser refuses goals, and /fool accepts them and ends them with the status of
another. None of them says that it is held.
"""

import contextlib
from typing import Any

import rclpy
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, VehicleStatus
from rclpy.action import ActionServer, GoalResponse
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LATCHED_10 = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LIES = ("stranger", "parrot", "flood", "mute", "refuser", "fool")


class Liar:
    def __init__(self, node: Node, lie: str) -> None:
        self.lie = lie
        self.statuses = node.create_publisher(BehaviorStatus, "behavior_status", LATCHED_10)
        self.vehicle = node.create_publisher(VehicleStatus, "vehicle_status", LATCHED)
        self.current = ""
        self.last: Any = None
        self.ticks = 0
        node.create_subscription(BehaviorCommand, "command", self.command, 10)
        node.create_timer(0.1, self.tell)
        if lie == "flood":
            node.create_timer(0.01, self.pour)
        if lie in ("refuser", "fool"):
            response = GoalResponse.REJECT if lie == "refuser" else GoalResponse.ACCEPT
            self.server = ActionServer(
                node,
                ExecuteBehavior,
                "execute_behavior",
                self.execute,
                goal_callback=lambda _: response,
            )

    def tell(self) -> None:
        self.ticks += 1
        self.vehicle.publish(
            VehicleStatus(vehicle=self.lie, behavior=self.current, mode=f"{self.ticks}")
        )

    def say(self, id_: str, number: int, state: int, **more: str) -> None:
        status = BehaviorStatus(id=id_, number=number, state=state, **more)
        self.statuses.publish(status)
        if id_ == self.current:
            self.last = status

    def pour(self) -> None:
        for number in range(50):
            self.say("nobody's", number % 3, number % 11, reason="r" * 100)

    def command(self, command: Any) -> None:
        if command.verb == BehaviorCommand.QUERY and self.last is not None:
            self.statuses.publish(self.last)
        if command.verb != BehaviorCommand.START or self.lie == "mute":
            return
        id_ = self.current = command.id
        self.say(id_, 1, BehaviorStatus.ACCEPTED)
        if self.lie == "stranger":
            for other in ("r1.b1", f"{id_}x", ""):
                self.say(other, 9, BehaviorStatus.FAILED)
            self.say(id_, 2, 77)
            self.say(id_, 0, BehaviorStatus.FAILED)
        self.say(id_, 2, BehaviorStatus.RUNNING)
        if self.lie == "parrot":
            self.say(id_, 1, BehaviorStatus.FAILED, code="LATE")
        if command.behavior == "drive_stop":
            self.say(id_, 3, BehaviorStatus.SUCCEEDED)
            self.current = ""
            if self.lie == "parrot":
                self.say(id_, 4, BehaviorStatus.FAILED)
                self.say(id_, 3, BehaviorStatus.SUCCEEDED)

    def execute(self, handle: Any) -> Any:
        handle.succeed()
        status = BehaviorStatus(id="another", number=3, state=BehaviorStatus.FAILED)
        return ExecuteBehavior.Result(status=status)


def main() -> None:
    rclpy.init()
    executor = SingleThreadedExecutor()
    liars = []
    for lie in LIES:
        node = rclpy.create_node("liar", namespace=lie)
        liars.append(Liar(node, lie))
        executor.add_node(node)
    print("ready", flush=True)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
