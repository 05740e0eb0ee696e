"""A vehicle in plain rclpy, with nothing of m2pem but its interfaces.

    ros_plain_peer.py NAMESPACE node|base|nav2 FRAME [TYPE [FAULT]]

`node` keeps to docs/ros-nodes.md; `base` takes `cmd_vel`, and goes on with the last command that it
got; `nav2` drives as long as it has a goal of `navigate_to_pose`. FRAME: of its odometry; TYPE: of
`cmd_vel`, Twist or TwistStamped, `latched`, which subscribes to a latched Twist only, or `pose`,
which publishes odometry as a PoseStamped. On /link, NAMESPACE makes it deaf and dumb, and "" lets
it speak again: it drives on meanwhile. FAULT `early`: it says after a metre that a goal succeeded;
`runaway`: it confirms a cancel, and drives on; `jump`: its odometry jumps 50 m once; `backwards`:
it drives the other way. On /truth it says what it does, whatever its link: name, speed, behaviors
begun, and the epochs of the CANCELs that it has received.
"""

import contextlib
import sys
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, VehicleStatus
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

PERIOD_S = 0.05
SPEED_M_S = 1.0
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Plain:
    """One vehicle."""

    def __init__(
        self, namespace: str, kind: str, frame: str, type_: str = "Twist", fault: str = ""
    ) -> None:
        self.node = node = rclpy.create_node("vehicle", namespace=namespace)
        self.namespace, self.kind, self.frame, self.type = namespace, kind, frame, type_
        self.fault = fault
        self.east, self.jumped, self.speed, self.steps = 0.0, 0.0, 0.0, 0
        self.doing, self.begun, self.cancels = "", 0, []
        self.known: dict[str, tuple[int, int]] = {}
        self.epochs: dict[str, int] = {}
        self.linked = True
        self.handle, self.over = None, None
        odometry = PoseStamped if type_ == "pose" else Odometry
        self.odom = node.create_publisher(odometry, "odom", 5)
        self.truth = node.create_publisher(String, "/truth", 10)
        node.create_subscription(String, "/link", self.hear_link, 10)
        if kind == "base":
            stamped = type_ == "TwistStamped"
            node.create_subscription(
                TwistStamped if stamped else Twist,
                "cmd_vel",
                lambda message: self.hear_velocity(message.twist if stamped else message),
                LATCHED if type_ == "latched" else 10,
            )
        elif kind == "nav2":
            self.serve_goals()
        else:
            latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self.says = node.create_publisher(BehaviorStatus, "behavior_status", latched)
            self.status = node.create_publisher(VehicleStatus, "vehicle_status", LATCHED)
            node.create_subscription(BehaviorCommand, "command", self.hear_command, 10)
        node.create_timer(PERIOD_S, self.step)

    def serve_goals(self) -> None:
        async def state(_: Any, response: Any) -> Any:
            if not self.linked:
                await rclpy.Future()  # no answer
            response.current_state = State(id=State.PRIMARY_STATE_ACTIVE, label="active")
            return response

        def accept(_: Any) -> GoalResponse:
            return GoalResponse.ACCEPT if self.linked else GoalResponse.REJECT

        def cancel(_: Any) -> CancelResponse:
            return CancelResponse.ACCEPT if self.linked else CancelResponse.REJECT

        async def drive(handle: Any) -> Any:
            self.speed, self.begun = SPEED_M_S, self.begun + 1
            over = self.over = rclpy.Future()
            self.handle = handle
            await over
            if self.fault != "runaway":
                self.speed = 0.0
            handle.succeed() if self.fault == "early" else handle.canceled()
            return NavigateToPose.Result()

        reentrant = ReentrantCallbackGroup()
        name = "bt_navigator/get_state"
        self.node.create_service(GetState, name, state, callback_group=reentrant)
        ActionServer(
            *(self.node, NavigateToPose, "navigate_to_pose", drive),
            goal_callback=accept,
            cancel_callback=cancel,
            callback_group=reentrant,
        )

    def hear_link(self, message: Any) -> None:
        self.linked = message.data != self.namespace

    def hear_velocity(self, twist: Any) -> None:
        if self.linked:
            self.begun += self.speed == 0.0 and twist.linear.x != 0.0
            self.speed = -twist.linear.x if self.fault == "backwards" else twist.linear.x

    def hear_command(self, command: Any) -> None:
        if not self.linked:
            return
        highest = self.epochs[command.run] = max(self.epochs.get(command.run, 0), command.epoch)
        is_past = command.epoch < highest
        if command.verb == BehaviorCommand.START and command.id not in self.known and not is_past:
            self.doing, self.speed, self.begun = command.id, SPEED_M_S, self.begun + 1
            self.say(command.id, 1, BehaviorStatus.ACCEPTED)
            self.say(command.id, 2, BehaviorStatus.RUNNING)
        elif command.verb == BehaviorCommand.CANCEL:
            self.cancels.append(f"{command.epoch}{'refused' if is_past else ''}")
            if command.id == self.doing and not is_past:
                self.doing = ""
                if self.fault != "runaway":
                    self.speed = 0.0
                self.say(command.id, 3, BehaviorStatus.CANCELLED)
        elif command.verb == BehaviorCommand.QUERY:
            self.say(command.id, *self.known.get(command.id, (0, BehaviorStatus.UNKNOWN)))

    def say(self, id_: str, number: int, state: int) -> None:
        if number:
            self.known[id_] = (number, state)
        self.says.publish(BehaviorStatus(id=id_, number=number, state=state))

    def step(self) -> None:
        self.steps += 1
        early = self.fault == "early" and self.east > 1.0
        cancelled = self.handle is not None and self.handle.is_cancel_requested
        if self.handle is not None and (cancelled or early) and not self.over.done():
            self.over.set_result(None)
        if self.doing and early:
            self.say(self.doing, 3, BehaviorStatus.SUCCEEDED)
            self.doing, self.speed = "", 0.0
        self.east += self.speed * PERIOD_S
        if self.fault == "jump" and self.east > 1.0:
            self.jumped = 50.0
        words = [self.namespace, f"{self.speed:.2f}", str(self.begun), ",".join(self.cancels)]
        self.truth.publish(String(data=" ".join(words)))
        if not self.linked:
            return
        if self.type == "pose":
            self.odom.publish(PoseStamped())
        else:
            message = Odometry()
            message.header.frame_id = self.frame
            message.header.stamp = self.node.get_clock().now().to_msg()
            message.pose.pose.position.x = self.east + self.jumped
            message.pose.pose.orientation.w = 1.0
            message.twist.twist.linear.x = self.speed
            self.odom.publish(message)
        if self.kind == "node" and self.steps % 4 == 0:
            name = self.namespace.removeprefix("/")
            self.status.publish(VehicleStatus(vehicle=name, behavior=self.doing))


def main() -> None:
    rclpy.init()
    plain = Plain(*sys.argv[1:])
    print("ready", flush=True)
    with contextlib.suppress(ExternalShutdownException, KeyboardInterrupt):
        rclpy.spin(plain.node)


if __name__ == "__main__":
    main()
