"""The sensors of vehicles, in plain rclpy: it publishes what it is told to.

Arguments: "package/Type@topic" for each publisher. On /say it is told, as JSON, a list of
[topic, fields]; "fields" are nested as in the message. When all are published it answers on /said.
"""

import contextlib
import json
import sys
import time
from importlib import import_module
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

WITHIN_S = 30.0


def message_type(name: str) -> Any:
    package, kind = name.split("/")
    return getattr(import_module(f"{package}.msg"), kind)


def fill(message: Any, fields: dict[str, Any]) -> Any:
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif name == "status" and isinstance(value, list):
            part = message_type("diagnostic_msgs/DiagnosticStatus")
            message.status = [fill(part(), each) for each in value]
        elif name == "transforms":
            part = message_type("geometry_msgs/TransformStamped")
            message.transforms = [fill(part(), each) for each in value]
        elif name == "level":
            message.level = bytes([value])
        else:
            setattr(message, name, value)
    return message


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("sensors")
    publishers = {}
    for argument in sys.argv[1:]:
        kind, topic = argument.split("@")
        qos = QoSProfile(depth=1000)
        if topic.endswith("tf_static"):
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        publishers[topic] = (
            message_type(kind),
            node.create_publisher(message_type(kind), topic, qos),
        )
    said = node.create_publisher(String, "/said", QoSProfile(depth=10))

    def say(message: Any) -> None:
        for topic, fields in json.loads(message.data):
            kind, publisher = publishers[topic]
            until = time.monotonic() + WITHIN_S
            while not publisher.get_subscription_count() and time.monotonic() < until:
                time.sleep(0.01)
            publisher.publish(fill(kind(), fields))
        said.publish(String(data="done"))

    node.create_subscription(String, "/say", say, QoSProfile(depth=10))
    print("ready", flush=True)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
