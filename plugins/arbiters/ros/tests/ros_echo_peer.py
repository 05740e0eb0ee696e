"""The other side of the tests of the runtime, in plain rclpy.

It echoes what comes on /ping to /pong, latches /greeting, answers /answer, accepts what comes on
/command, and does behaviors: "goto" succeeds after one feedback, "wait" runs until it is cancelled.
"""

import contextlib
import time
from typing import Any

import rclpy
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus
from m2pem_interfaces.srv import AnswerPrompt
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("echo")
    pong = node.create_publisher(String, "pong", 1000)
    node.create_subscription(String, "ping", pong.publish, 1000)
    node.create_publisher(String, "greeting", LATCHED).publish(String(data="hello"))

    accepted = node.create_publisher(BehaviorStatus, "behavior_status", 10)

    def accept(command: Any) -> None:
        said = " ".join(f"{each.key}={each.value}" for each in command.parameters)
        state = BehaviorStatus.ACCEPTED
        status = BehaviorStatus(id=command.id, number=1, state=state, native_ref=said)
        status.outputs = command.parameters
        accepted.publish(status)

    node.create_subscription(BehaviorCommand, "command", accept, 10)

    def answer(request: Any, response: Any) -> Any:
        response.success, response.message = True, f"{request.prompt}: {request.decision}"
        return response

    def execute(handle: Any) -> Any:
        status = BehaviorStatus(
            id=handle.request.command.id, number=1, state=BehaviorStatus.RUNNING
        )
        handle.publish_feedback(ExecuteBehavior.Feedback(status=status))
        while handle.request.command.behavior == "wait" and not handle.is_cancel_requested:
            time.sleep(0.01)
        status.number = 2
        if handle.is_cancel_requested:
            handle.canceled()
            status.state = BehaviorStatus.CANCELLED
        else:
            handle.succeed()
            status.state = BehaviorStatus.SUCCEEDED
        return ExecuteBehavior.Result(status=status)

    node.create_service(AnswerPrompt, "answer", answer, qos_profile=QoSProfile(depth=10))
    ActionServer(
        node,
        ExecuteBehavior,
        "execute_behavior",
        execute,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
    )
    print("ready", flush=True)
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
