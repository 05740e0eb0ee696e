"""A payload's node in plain rclpy, as docs/ros-nodes.md says how to write one: `NAMESPACE NAME`.

It wipes its lens (`wipe_lens`), which writes how often it has; anything else it rejects.
"""

import contextlib
import json
import math
import sys

import rclpy
from m2pem_interfaces.msg import (
    BehaviorCommand,
    BehaviorStatus,
    GeoPoint,
    KeyValue,
    PayloadStatus,
    TargetState,
    VehicleStatus,
)
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = DurabilityPolicy.TRANSIENT_LOCAL
SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


class Wiper(Node):
    def __init__(self, namespace: str, name: str) -> None:
        super().__init__("wiper", namespace=namespace)
        self.payload = name
        self.wiped = 0
        self.known: dict[str, BehaviorStatus] = {}
        self.carrier = math.nan
        latched = QoSProfile(depth=10, durability=LATCHED)
        self.statuses = self.create_publisher(BehaviorStatus, "behavior_status", latched)
        one = QoSProfile(depth=1, durability=LATCHED)
        self.vehicle = self.create_publisher(VehicleStatus, "vehicle_status", one)
        self.look = self.create_publisher(PayloadStatus, "payload_status", SENSOR)
        self.create_subscription(BehaviorCommand, "command", self.command, 10)
        self.create_subscription(TargetState, "target", self.target, SENSOR)
        self.create_timer(0.1, self.tell)

    def target(self, message: TargetState) -> None:
        self.carrier = message.position.latitude_deg

    def tell(self) -> None:
        self.vehicle.publish(VehicleStatus(vehicle=self.payload, battery=math.nan))
        # Its zoom says where its vehicle is, so that a test sees that it was told.
        corners = [
            GeoPoint(latitude_deg=38.0, longitude_deg=-77.0, altitude_m=float(i)) for i in (1, 2, 3)
        ]
        for zoom, pan, footprint in (
            (1.0, 5.0, [GeoPoint(latitude_deg=91.0)]),
            (self.carrier, 0.5, corners),
        ):
            self.look.publish(
                PayloadStatus(
                    payload=self.payload,
                    pan_rad=pan,
                    tilt_rad=math.inf,
                    zoom=zoom,
                    footprint=footprint,
                )
            )
        self.look.publish(PayloadStatus(payload="another/one", pan_rad=9.0))

    def command(self, command: BehaviorCommand) -> None:
        if command.verb == BehaviorCommand.QUERY or command.id in self.known:
            unknown = BehaviorStatus(id=command.id, state=BehaviorStatus.UNKNOWN)
            self.statuses.publish(self.known.get(command.id, unknown))
        elif command.verb == BehaviorCommand.START:
            self.begin(command)

    def begin(self, command: BehaviorCommand) -> None:
        (allocation,) = command.allocation
        if command.behavior != "wipe_lens" or allocation.resources != [self.payload]:
            self.say(command.id, 1, BehaviorStatus.REJECTED, reason="it wipes, and no more")
            return
        values = {pair.key: json.loads(pair.value) for pair in command.parameters}
        self.wiped += values["times"]
        self.say(command.id, 1, BehaviorStatus.ACCEPTED)
        self.say(command.id, 2, BehaviorStatus.RUNNING)
        outputs = {"wiper.times": json.dumps(self.wiped), "wiper.broken": "NaN"}
        self.say(command.id, 3, BehaviorStatus.SUCCEEDED, outputs=outputs)

    def say(
        self,
        id_: str,
        number: int,
        state: int,
        reason: str = "",
        outputs: dict[str, str] | None = None,
    ) -> None:
        status = BehaviorStatus(id=id_, number=number, state=state, reason=reason)
        status.outputs = [KeyValue(key=key, value=text) for key, text in (outputs or {}).items()]
        self.known[id_] = status
        self.statuses.publish(status)


def main() -> None:
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(Wiper(*sys.argv[1:]))
    print("ready", flush=True)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
