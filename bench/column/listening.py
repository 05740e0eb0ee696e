"""What the vehicles, the head and the executive say on their topics. Needs ROS."""

import json
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import rclpy
from m2pem_interfaces.msg import MissionEvent
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState

from bench.column.series import Heard

EVENTS = QoSProfile(depth=1000)


@dataclass(slots=True)
class Commanded:
    """A behavior that was asked for. Times are of arrival, in simulated seconds; `end_s` is when it
    ended, or when it was to end."""

    element: str
    name: str
    resources: Sequence[str]
    parameters: dict[str, Any]
    begin_s: float
    end_s: float = math.inf


@dataclass(slots=True)
class Told:
    """All that was heard. `ended`: how the run ended; `elements`: into which tokens came."""

    vehicles: dict[str, Heard] = field(default_factory=lambda: defaultdict(Heard))
    head: Heard = field(default_factory=Heard)
    commanded: dict[str, Commanded] = field(default_factory=dict)
    elements: set[str] = field(default_factory=set)
    ended: str = ""


class Listener:
    """Hears odometry in the namespaces of `vehicles`, and the joints `pan` and `tilt` of a head."""

    def __init__(
        self, vehicles: dict[str, str], joint_states: str, joints: tuple[str, str], speed: float
    ) -> None:
        self.told = Told()
        self._speed = speed
        self._joints = joints
        self._vehicles = vehicles
        self.node = rclpy.create_node("column_watch")
        for name, namespace in vehicles.items():
            self._subscribe(name, f"{namespace}/odom")
        sensor = qos_profile_sensor_data
        self.node.create_subscription(JointState, joint_states, self._hear_joints, sensor)
        self.node.create_subscription(MissionEvent, "/m2pem/events", self._hear_event, EVENTS)

    def wait_until_heard(self, deadline_s: float) -> None:
        """Until all speak, and events will be heard from the first one on.

        Raises:
            TimeoutError: somebody is not there.
        """
        while missing := self._missing():
            if time.monotonic() > deadline_s:
                raise TimeoutError(f"not heard: {', '.join(missing)}")
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def listen(self, deadline_s: float) -> None:
        """Until the run has ended.

        Raises:
            TimeoutError: it has not.
        """
        while not self.told.ended:
            if time.monotonic() > deadline_s:
                raise TimeoutError("the run has not ended")
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def _missing(self) -> list[str]:
        missing = [name for name in self._vehicles if not self.told.vehicles[name].values]
        missing += [] if self.told.head.values else ["the head"]
        return missing + ([] if self.node.count_publishers("/m2pem/events") else ["the executive"])

    def _subscribe(self, name: str, topic: str) -> None:
        def hear(message: Any) -> None:
            pose = message.pose.pose
            turn, place = pose.orientation, pose.position
            yaw = math.atan2(
                2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2)
            )
            self.told.vehicles[name].add(
                _seconds(message), self._now_s(), place.x, place.y, place.z, yaw
            )

        self.node.create_subscription(Odometry, topic, hear, qos_profile_sensor_data)

    def _hear_joints(self, message: Any) -> None:
        found = dict(zip(message.name, message.position, strict=False))
        if all(joint in found for joint in self._joints):
            pan, tilt = (found[joint] for joint in self._joints)
            self.told.head.add(_seconds(message), self._now_s(), pan, tilt)

    def _hear_event(self, event: Any) -> None:
        told, data = self.told, json.loads(event.data)
        if event.type == "TokenEntered":
            told.elements.add(event.element)
        elif event.type == "BehaviorRequested":
            told.commanded[data["behavior"]] = Commanded(
                event.element, data["name"], data["resources"], data["parameters"], self._now_s()
            )
        elif event.type in ("BehaviorEnded", "BehaviorCancelRequested"):
            behavior = told.commanded[data["behavior"]]
            behavior.end_s = min(behavior.end_s, self._now_s())
        elif event.type == "RunEnded":
            told.ended = data["outcome"]

    def _now_s(self) -> float:
        return time.monotonic() * self._speed


def _seconds(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec) + float(stamp.nanosec) / 1e9
