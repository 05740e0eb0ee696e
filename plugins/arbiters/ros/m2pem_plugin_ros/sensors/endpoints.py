"""Checks the endpoints of a vehicle's topics: one node, the right type, a QoS that matches.

ROS has no arbitration: two vehicles in one namespace both obey one command, and endpoints whose
types or QoS differ never connect, without an error. So the graph is checked before a vehicle is
commanded, and searched for a vehicle that is not where the fleet says.
"""

import difflib
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from m2pem_plugin_ros.sensors.graph import NAMELESS, Graph, node_of
from m2pem_plugin_ros.settings import DriverName, Settings, Via

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

LEASE = "a crashed one is listed for up to 20 s"
ODOMETRY = "nav_msgs/msg/Odometry"
VEHICLE_STATUS = "m2pem_interfaces/msg/VehicleStatus"
BEHAVIOR_STATUS = "m2pem_interfaces/msg/BehaviorStatus"
GOALS = "action_msgs/msg/GoalStatusArray"
NAV2_ACTIONS = ("navigate_to_pose", "navigate_through_poses", "follow_waypoints", "backup")


@dataclass(frozen=True, slots=True)
class Single:
    """A topic that must have one publisher of one type. `quality` is that of m2pem's subscription,
    by its name in `runtime.qos`."""

    topic: str
    type: str
    quality: str


class Endpoints:
    """The endpoints of one vehicle, or of a payload with its own node (`is_payload`). Vehicles of
    one domain share its `graph`.

    `elsewhere` are other ROS domains in which the vehicle was found.
    """

    def __init__(
        self,
        ros: "RosRuntime",
        settings: Settings,
        domain: int,
        *,
        is_payload: bool = False,
        graph: Graph | None = None,
    ) -> None:
        self._node = ros.node
        self._graph = graph or Graph(ros.node)
        self._said: tuple[object, str] = (None, "")
        """What was found instead of the vehicle, and the text about it."""
        self._settings = settings
        self.domain = domain
        resolve = ros.node.resolve_topic_name  # names may be remapped (--ros-args)
        self._singles = tuple(
            replace(single, topic=resolve(single.topic))
            for single in _singles(settings, is_payload=is_payload)
        )
        self.elsewhere: tuple[int, ...] = ()

    @property
    def awaited(self) -> Single:
        """The topic that shows that the vehicle is there."""
        return self._singles[0]

    @property
    def problem(self) -> str:
        """Why the vehicle must not be commanded: too many publishers, the face of another fleet, a
        wrong type, or a QoS that cannot match; "" if all is right."""
        for single in self._singles:
            found = self._node.get_publishers_info_by_topic(single.topic)
            if faces := [each for each in found if self._is_face(each)]:
                return (
                    f"{single.topic} in ROS domain {self.domain} is published by {_named(faces)},"
                    " the face of another executive, for a vehicle of its fleet: give that face a"
                    " namespace"
                )
            if len(found) > 1:
                return (
                    f"{single.topic} in ROS domain {self.domain} has {len(found)} publishers:"
                    f" {_named(found)}. A vehicle has one, and a namespace of its own ({LEASE})"
                )
            if wrong := [each for each in found if each.topic_type != single.type]:
                return (
                    f"{single.topic} is of type {wrong[0].topic_type} ({_named(wrong)}),"
                    f" but {single.type} is expected"
                )
            for each in found:
                if why := _mismatch(each.qos_profile, _quality(single.quality)):
                    return (
                        f"{single.topic} is published with a QoS that m2pem's subscription does not"
                        f" get ({_named([each])}): {why}"
                    )
        if self._settings.driver is DriverName.BASE:
            return self._wrong_command()
        return ""

    @property
    def is_listed(self) -> bool:
        """Whether the expected topic of the vehicle has a publisher."""
        return bool(self._node.count_publishers(self.awaited.topic))

    @property
    def absence(self) -> str:
        """The expected topic of the vehicle, its publishers, and what is there instead."""
        awaited = self.awaited
        found = self._node.get_publishers_info_by_topic(awaited.topic)
        there = f"has the publisher {_named(found)}" if found else "has no publisher"
        where = (
            f"{awaited.topic} ({awaited.type}) {there} in ROS domain {self.domain},"
            f" namespace {self._settings.namespace or '/'}"
        )
        if found:
            return where
        there_is = (self.elsewhere, self._graph.nodes(), self._graph.topics_of(awaited.type))
        if self._said[0] != there_is:
            self._said = there_is, self._instead(awaited)
        return f"{where}: {self._said[1]}"

    def _instead(self, awaited: Single) -> str:
        """Return what is there instead of a vehicle, and what would be right."""
        if self.elsewhere:
            named = " and ".join(map(str, self.elsewhere))
            return (
                f"it is published in ROS domain {named}: write 'domain_id: {self.elsewhere[0]}' in"
                f" its connection, or start the vehicle with ROS_DOMAIN_ID={self.domain}"
            )
        nodes = self._graph.nodes()
        if not nodes:
            return f"there is no other ROS node in domain {self.domain}; {self._why_domain()}"
        namespace = self._settings.namespace or "/"
        alike = self._graph.topics_of(awaited.type)
        prefix = f"{namespace.rstrip('/')}/"
        if own := sorted(topic for topic in alike if topic.startswith(prefix)):
            name = own[0].removeprefix(prefix)
            return (
                f"in its namespace the same type is published on {_listed(own)}: name it under"
                f" 'topics' in its connection ({name})"
            )
        leaf = awaited.topic.removeprefix(prefix.rstrip("/"))
        others = [topic.removesuffix(leaf) or "/" for topic in alike if topic.endswith(leaf)]
        if others:
            nearest = difflib.get_close_matches(namespace, others, n=1, cutoff=0.0)[0]
            return (
                f"the same topic is in the namespace {_listed(sorted(others))}: write"
                f" 'namespace: {nearest}' in its connection, or start its nodes in {namespace}"
            )
        spaces: dict[str, list[str]] = {}
        for node in nodes:
            spaces.setdefault(node.rpartition("/")[0] or "/", []).append(node)
        if namespace in spaces:
            return (
                f"in its namespace there is {_listed(spaces[namespace])}, which does not publish it"
            )
        nearest = difflib.get_close_matches(namespace, sorted(spaces), n=1, cutoff=0.0)[0]
        return (
            f"there are {len(nodes)} other nodes, none in that namespace; the nearest one is"
            f" {nearest}"
        )

    def _why_domain(self) -> str:
        said = os.environ.get("ROS_DOMAIN_ID", "")
        environment = f"ROS_DOMAIN_ID of this process is {said or 'not set'}"
        if self._settings.domain_id is None:
            return environment
        return f"its connection says domain_id: {self.domain}, {environment}"

    def _is_face(self, endpoint: Any) -> bool:
        """Whether an endpoint is of the face of an executive, which shows vehicles of its fleet."""
        name = node_of(endpoint)
        return name != NAMELESS and self._node.count_publishers(f"{name}/fleet_state") > 0

    def _wrong_command(self) -> str:
        settings = self._settings
        topic = self._node.resolve_topic_name(settings.topic(settings.topics.cmd_vel))
        expected = f"geometry_msgs/msg/{'TwistStamped' if settings.stamped else 'Twist'}"
        found = self._node.get_subscriptions_info_by_topic(topic)
        if not found:
            return ""
        right = [each for each in found if each.topic_type == expected]
        if not right:
            remedy = f"write 'stamped: {'false' if settings.stamped else 'true'}' in its connection"
            return (
                f"{topic} is subscribed to as {found[0].topic_type} ({_named(found)}), and m2pem"
                f" publishes {expected}, which that does not get; {remedy}"
            )
        reasons = [_mismatch(_quality("VELOCITIES"), each.qos_profile) for each in right]
        if all(reasons):
            return (
                f"{topic} is subscribed to with a QoS that m2pem's commands do not have"
                f" ({_named(right)}): {reasons[0]}"
            )
        return ""


def _singles(settings: Settings, *, is_payload: bool) -> tuple[Single, ...]:
    """Return the topics. The first one shows that the vehicle is there."""
    odometry = Single(settings.topic(settings.topics.odom), ODOMETRY, "TELEMETRY")
    if settings.driver is DriverName.BASE:
        return (odometry,)
    if settings.driver is DriverName.NAV2:
        goals = (settings.topic(f"{name}/_action/status") for name in NAV2_ACTIONS)
        return (odometry, *(Single(topic, GOALS, "STATUS") for topic in goals))
    status = Single(settings.topic("vehicle_status"), VEHICLE_STATUS, "STATUS")
    if settings.via is Via.ACTION:
        topic = settings.topic("execute_behavior/_action/status")
        said = Single(topic, GOALS, "STATUS")
    else:
        said = Single(settings.topic("behavior_status"), BEHAVIOR_STATUS, "BEHAVIOR_STATUS")
    return (status, said) if is_payload else (status, said, odometry)


def _quality(name: str) -> Any:
    from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

    return getattr(qos, name)


def _mismatch(publisher: Any, subscription: Any) -> str:
    """Return why a subscription gets nothing from a publisher; "" if it gets something.

    rclpy's own check takes the unbounded durations of DDS for bounds.
    """
    from rclpy.qos import (  # noqa: PLC0415  # it is loaded where ROS is only
        DurabilityPolicy,
        LivelinessPolicy,
        ReliabilityPolicy,
    )

    best_effort, volatile = ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE
    if best_effort == publisher.reliability != subscription.reliability:
        return "it is published best effort, and subscribed to reliably"
    if volatile == publisher.durability != subscription.durability:
        return "it is published volatile, and subscribed to transient local"
    if _bound_ns(publisher.deadline) > _bound_ns(subscription.deadline):
        return "the subscription has a deadline that the publisher does not promise"
    automatic, manual = LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC
    is_manual = subscription.liveliness == manual and publisher.liveliness == automatic
    lease_ns = _bound_ns(publisher.liveliness_lease_duration)
    if is_manual or lease_ns > _bound_ns(subscription.liveliness_lease_duration):
        return "the subscription has a liveliness that the publisher does not promise"
    return ""


def _bound_ns(duration: Any) -> float:
    """Return the nanoseconds of a bound; both 0 and the most mean that there is none."""
    nanoseconds = int(duration.nanoseconds)
    return nanoseconds if 0 < nanoseconds < UNBOUNDED_NS else math.inf


UNBOUNDED_NS = 9_000_000_000_000_000_000
LISTED = 5


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def _named(found: Sequence[Any]) -> str:
    """Return the full names and gids of nodes. Two nodes may have the same name."""
    return ", ".join(sorted(f"{node_of(each)} (gid {_gid(each)})" for each in found))


def _gid(endpoint: Any) -> str:
    return bytes(endpoint.endpoint_gid)[:16].hex()
