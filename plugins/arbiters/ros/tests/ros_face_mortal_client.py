"""A client in plain rclpy that sends a goal: `ACTION LATITUDE LONGITUDE`.

It prints "ready" when the goal has feedback, and reads nothing more.
"""

import json
import sys

import rclpy
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, KeyValue
from rclpy.action import ActionClient


def main(action: str, latitude_deg: float, longitude_deg: float) -> None:
    rclpy.init()
    node = rclpy.create_node("mortal")
    client = ActionClient(node, ExecuteBehavior, action)
    place = {"type": "Point", "coordinates": [longitude_deg, latitude_deg]}
    parameters = [KeyValue(key="target", value=json.dumps(place))]
    command = BehaviorCommand(
        verb=BehaviorCommand.START, id="mortal", behavior="goto", parameters=parameters
    )
    client.wait_for_server()
    fed: list[object] = []
    client.send_goal_async(ExecuteBehavior.Goal(command=command), fed.append)
    while not fed:
        rclpy.spin_once(node, timeout_sec=0.1)
    print("ready", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]))
