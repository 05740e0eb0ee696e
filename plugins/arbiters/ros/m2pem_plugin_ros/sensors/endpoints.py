"""Checks the publishers of a vehicle's topics: one node, and the right type.

ROS has no arbitration: two vehicles in one namespace both obey one command, and mismatched types
never connect, without an error. So the graph is checked before a vehicle is commanded.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from m2pem_plugin_ros.settings import DriverName, Settings, Via

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

NAMELESS = "a node whose name is not known yet"
LEASE = "a crashed one is listed for up to 20 s"
ODOMETRY = "nav_msgs/msg/Odometry"
VEHICLE_STATUS = "m2pem_interfaces/msg/VehicleStatus"
BEHAVIOR_STATUS = "m2pem_interfaces/msg/BehaviorStatus"
GOALS = "action_msgs/msg/GoalStatusArray"
NAV2_ACTIONS = ("navigate_to_pose", "navigate_through_poses", "follow_waypoints", "backup")


@dataclass(frozen=True, slots=True)
class Single:
    """A topic that must have one publisher of one type."""

    topic: str
    type: str


class Endpoints:
    """The endpoints of one vehicle, or of a payload with its own node (`is_payload`)."""

    def __init__(
        self, ros: "RosRuntime", settings: Settings, domain: int, *, is_payload: bool = False
    ) -> None:
        self._node = ros.node
        self._settings = settings
        self._domain = domain
        self._singles = _singles(settings, is_payload=is_payload)

    @property
    def problem(self) -> str:
        """Why the vehicle must not be commanded: too many publishers, or a wrong type; "" if all is
        right."""
        for single in self._singles:
            found = self._node.get_publishers_info_by_topic(single.topic)
            if len(found) > 1:
                return (
                    f"{single.topic} in ROS domain {self._domain} has {len(found)} publishers:"
                    f" {_named(found)}. A vehicle has one, and a namespace of its own ({LEASE})"
                )
            if wrong := [each for each in found if each.topic_type != single.type]:
                return (
                    f"{single.topic} is of type {wrong[0].topic_type} ({_named(wrong)}),"
                    f" but {single.type} is expected"
                )
        if self._settings.driver is DriverName.BASE:
            return self._wrong_command_type()
        return ""

    @property
    def absence(self) -> str:
        """The expected topic of the vehicle and its publishers, as text."""
        awaited = self._singles[0]
        found = self._node.get_publishers_info_by_topic(awaited.topic)
        there = f"has the publisher {_named(found)}" if found else "has no publisher"
        return (
            f"{awaited.topic} ({awaited.type}) {there} in ROS domain {self._domain},"
            f" namespace {self._settings.namespace or '/'}"
        )

    def _wrong_command_type(self) -> str:
        settings = self._settings
        topic = settings.topic(settings.topics.cmd_vel)
        expected = f"geometry_msgs/msg/{'TwistStamped' if settings.stamped else 'Twist'}"
        found = self._node.get_subscriptions_info_by_topic(topic)
        if not found or any(each.topic_type == expected for each in found):
            return ""
        remedy = f"write 'stamped: {'false' if settings.stamped else 'true'}' in its connection"
        return (
            f"{topic} is subscribed to as {found[0].topic_type} ({_named(found)}), and m2pem"
            f" publishes {expected}, which that does not get; {remedy}"
        )


def _singles(settings: Settings, *, is_payload: bool) -> tuple[Single, ...]:
    """Return the topics. The first one shows that the vehicle is there."""
    odometry = Single(settings.topic(settings.topics.odom), ODOMETRY)
    if settings.driver is DriverName.BASE:
        return (odometry,)
    if settings.driver is DriverName.NAV2:
        goals = (settings.topic(f"{name}/_action/status") for name in NAV2_ACTIONS)
        return (odometry, *(Single(topic, GOALS) for topic in goals))
    status = Single(settings.topic("vehicle_status"), VEHICLE_STATUS)
    if settings.via is Via.ACTION:
        said = Single(settings.topic("execute_behavior/_action/status"), GOALS)
    else:
        said = Single(settings.topic("behavior_status"), BEHAVIOR_STATUS)
    return (status, said) if is_payload else (status, said, odometry)


def _named(found: Sequence[Any]) -> str:
    """Return the full names and gids of nodes. Two nodes may have the same name."""
    return ", ".join(sorted(f"{_name(each)} (gid {_gid(each)})" for each in found))


def _name(endpoint: Any) -> str:
    if endpoint.node_name == "_NODE_NAME_UNKNOWN_":  # an endpoint is discovered before its node
        return NAMELESS
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def _gid(endpoint: Any) -> str:
    return bytes(endpoint.endpoint_gid)[:16].hex()
