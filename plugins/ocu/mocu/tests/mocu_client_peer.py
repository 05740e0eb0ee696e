"""An operator's program in plain rclpy: it does what it is told by lines, and tells all it hears.

Each line that it reads is JSON, and calls a service: `{"id": 1, "namespace": "/m2pem", "service":
"list_runs", "fields": {...}}`. A `bpmn` field is the name of a file. Each line that it prints is
JSON: a response with the id of its call, or what came by a topic. Arguments: namespaces.
"""

import array
import json
import sys
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped
from m2pem_interfaces import msg, srv
from rcl_interfaces.msg import Log
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ROSOUT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SERVICES = QoSProfile(depth=2000)

TOPICS = {
    "prompts": (msg.OpenPrompts, LATCHED),
    "prompt_events": (msg.Prompt, QoSProfile(depth=100)),
    "status": (msg.MissionStatus, LATCHED),
    "active_elements": (msg.ActiveElements, LATCHED),
    "events": (msg.MissionEvent, QoSProfile(depth=1000)),
    "payloads": (msg.PayloadStatuses, LATCHED),
    "teams": (msg.TeamStatuses, LATCHED),
    "schedule": (msg.Schedule, LATCHED),
    "schedule_events": (msg.ScheduleEvent, QoSProfile(depth=100)),
    "shared_spaces": (msg.SharedSpaces, LATCHED),
    "footprints/ugv2/camera": (PolygonStamped, LATCHED),
}


def say(**what: Any) -> None:
    # One write, as two threads speak.
    sys.stdout.write(json.dumps(what, ensure_ascii=False) + "\n")
    sys.stdout.flush()


def plain(value: Any) -> Any:
    """A message as JSON can say it."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return int.from_bytes(value, "little")
    if isinstance(value, list | tuple | array.array):
        return [plain(each) for each in value]
    return value


def fill(message: Any, fields: dict[str, Any]) -> Any:
    types = message.get_fields_and_field_types()
    for name, given in fields.items():
        value = given
        if name == "bpmn":
            value = array.array("B", Path(given).read_bytes())
        elif isinstance(given, dict):
            value = fill(getattr(message, name), given)
        elif given and isinstance(given, list) and isinstance(given[0], dict):
            kind = getattr(msg, types[name].removeprefix("sequence<").strip(">").split("/")[-1])
            value = [fill(kind(), each) for each in given]
        setattr(message, name, value)
    return message


class Caller:
    def __init__(self, node: Any) -> None:
        self._node = node
        self._clients: dict[str, Any] = {}

    def call(self, order: dict[str, Any]) -> None:
        kind = getattr(srv, "".join(word.title() for word in order["service"].split("_")))
        name = f"{order['namespace']}/{order['service']}"
        if name not in self._clients:
            self._clients[name] = self._node.create_client(kind, name, qos_profile=SERVICES)
        client = self._clients[name]
        while not client.service_is_ready():
            time.sleep(0.005)
        request = fill(kind.Request(), order["fields"])
        for _ in range(order.get("times", 1)):
            future = client.call_async(request)
            future.add_done_callback(lambda f: say(id=order["id"], response=plain(f.result())))


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("operator")
    namespaces = sys.argv[1:]

    def tell(namespace: str, topic: str) -> Any:
        return lambda message: say(namespace=namespace, topic=topic, message=plain(message))

    for namespace in namespaces:
        for topic, (kind, quality) in TOPICS.items():
            name = f"{namespace}/{topic}"
            node.create_subscription(kind, name, tell(namespace, topic), quality)
    node.create_subscription(DiagnosticArray, "/diagnostics", tell("", "diagnostics"), 10)
    node.create_subscription(Log, "/rosout", tell("", "rosout"), ROSOUT)

    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        try:
            executor.spin()
        except ExternalShutdownException:
            return

    threading.Thread(target=spin, daemon=True).start()
    caller = Caller(node)
    say(ready=True)
    for line in sys.stdin:
        caller.call(json.loads(line))


if __name__ == "__main__":
    main()
