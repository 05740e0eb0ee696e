"""What a fleet says of the connection to a ROS vehicle, or to a detector on it (docs/ros.md)."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import Any

from m2pem.api import BehaviorSpec, Connection, Dimension, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ros.connection_reader import ConnectionReader
from m2pem_plugin_ros.declared_behaviors import read_declared_behaviors

DOMAINS = ("ground", "surface")
"""Of the vehicles that this arbiter commands."""


class DriverName(StrEnum):
    """The ways to reach a vehicle."""

    NODE = "m2pem"
    NAV2 = "nav2"
    BASE = "base"


class Via(StrEnum):
    """How an m2pem node is commanded."""

    TOPICS = "topics"
    ACTION = "action"


class RouteAction(StrEnum):
    """By which action of Nav2 a route is driven."""

    THROUGH = "through"
    WAYPOINTS = "waypoints"


class OdomFrame(StrEnum):
    """What the odometry of a vehicle is relative to (REP-105)."""

    MAP = "map"
    ODOM = "odom"


class DetectorMessage(StrEnum):
    """What a detector publishes: m2pem_interfaces/msg/Detection, or std_msgs/msg/String."""

    DETECTION = "detection"
    STRING = "string"


@dataclass(frozen=True, slots=True)
class Topics:
    """Names of topics; those that do not begin with "/" are in the vehicle's namespace."""

    odom: str = "odom"
    fix: str = "fix"
    battery: str = "battery_state"
    diagnostics: str = "/diagnostics"
    cmd_vel: str = "cmd_vel"
    teleop: str = "cmd_vel_teleop"


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a plain base can do. `turn_radius_m` 0: it turns on the spot. SI units."""

    speed_m_s: float = 2.0
    reverse_m_s: float = 1.0
    acceleration_m_s2: float = 1.0
    yaw_rate_rad_s: float = 1.0
    turn_radius_m: float = 0.0
    lateral_m_s2: float = 1.5


@dataclass(frozen=True, slots=True)
class Settings:
    """Of a vehicle, or a payload with an m2pem node. `namespace`: with its leading "/", "" is the
    root. `odom_frame`: "map": its odometry is in the fleet's local frame; "odom": it begins
    anywhere, and NavSatFix says where (REP-105). `stamped`: cmd_vel is a TwistStamped.
    `hardware_id`: the vehicle's in /diagnostics; its name in the fleet, if the fleet does not
    say."""

    namespace: str
    domain_id: int | None = None
    driver: DriverName = DriverName.NODE
    via: Via = Via.TOPICS
    topics: Topics = field(default_factory=Topics)
    odom_frame: OdomFrame = OdomFrame.MAP
    stamped: bool = False
    bounds: Bounds = field(default_factory=Bounds)
    hardware_id: str = ""
    route_action: RouteAction = RouteAction.THROUGH
    own_behaviors: tuple[BehaviorSpec, ...] = ()

    def topic(self, name: str) -> str:
        """The full name of a topic, action or service of the vehicle."""
        return in_namespace(self.namespace, name)


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """Of a payload: the full name of the topic with its detections, and their type where the
    messages do not say one."""

    namespace: str
    topic: str
    domain_id: int | None = None
    type: str = ""
    message: DetectorMessage = DetectorMessage.DETECTION


def in_namespace(namespace: str, name: str) -> str:
    """The full name; one that begins with "/" is full already."""
    return name if name.startswith("/") else f"{namespace}/{name}"


_KEYS = (*(each.name for each in fields(Settings)), "sim")
"""`sim` is what a simulated vehicle is like; whoever simulates it reads that."""

DETECTOR_KEYS = ("namespace", "domain_id", "topic", "message", "type", "sim")
NODE_KEYS = ("driver", "via", "own_behaviors")
"""What a payload with an m2pem node may say beside."""

BOUNDS = {
    "speed": "speed_m_s",
    "reverse_speed": "reverse_m_s",
    "acceleration": "acceleration_m_s2",
    "yaw_rate": "yaw_rate_rad_s",
    "turn_radius": "turn_radius_m",
    "lateral_acceleration": "lateral_m_s2",
}
"""What fleets call the fields of `Bounds`."""


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """The settings of all vehicles.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read_vehicle(connection)
        for resource, connection in connections.items()
        if "/" not in resource
    }
    reached: dict[tuple[int | None, str], ResourceId] = {}
    for resource, settings in read.items():
        other = reached.setdefault((settings.domain_id, settings.namespace), resource)
        if other != resource:
            problem = f"{settings.namespace or '/'} is that of {other}, too"
            raise ConnectionReader(resource, {}).error("namespace", problem)
    return read


def read_detectors(
    connections: Mapping[ResourceId, Connection], with_node: Collection[ResourceId] = ()
) -> dict[ResourceId, DetectorSettings]:
    """The settings of all payloads that detect: they have a `topic`, or `detector: true`.
    `with_node`: those whose connection also tells of the node that they have.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    return {
        resource: _read_detector(connection, inherited(connection, connections), with_node)
        for resource, connection in connections.items()
        if "/" in resource and (connection.detector or "topic" in connection.settings)
    }


def _read_vehicle(connection: Connection) -> Settings:
    resource = connection.resource
    if connection.domain not in DOMAINS:
        raise PluginError(
            f"{resource}: domain: the arbiter 'ros' commands vehicles of the domains "
            f"{' and '.join(DOMAINS)}, not {connection.domain}; the arbiter 'mavlink' does"
        )
    reader = ConnectionReader(resource, connection.settings)
    reader.refuse_others(_KEYS)
    reader.inner("sim", "{heading: 60 deg}")
    driver = reader.choice("driver", DriverName, DriverName.NODE)
    only = {
        "via": DriverName.NODE,
        "own_behaviors": DriverName.NODE,
        "route_action": DriverName.NAV2,
    }
    for key, of in only.items():
        if key in connection.settings and driver is not of:
            raise reader.error(key, f"it is for the driver {of} only, and this one is {driver}")
    return Settings(
        reader.namespace(),
        reader.domain_id(),
        driver,
        reader.choice("via", Via, Via.TOPICS),
        _topics(reader.inner("topics", "{odom: odometry/global}")),
        reader.choice("odom_frame", OdomFrame, OdomFrame.MAP),
        reader.flag("stamped", False),
        _bounds(reader.inner("bounds", "{speed: 2 m/s}")),
        reader.text("hardware_id", resource),
        reader.choice("route_action", RouteAction, RouteAction.THROUGH),
        read_declared_behaviors(resource, connection.settings.get("own_behaviors")),
    )


def _topics(reader: ConnectionReader) -> Topics:
    usual = {each.name: str(each.default) for each in fields(Topics)}
    reader.refuse_others(usual)
    return Topics(**{key: reader.topic(key, default) for key, default in usual.items()})


def _bounds(reader: ConnectionReader) -> Bounds:
    reader.refuse_others(BOUNDS)
    usual = Bounds()
    return Bounds(
        reader.number("speed", usual.speed_m_s, Dimension.SPEED),
        reader.number("reverse_speed", usual.reverse_m_s, Dimension.SPEED),
        reader.number("acceleration", usual.acceleration_m_s2, Dimension.ACCELERATION),
        reader.number("yaw_rate", usual.yaw_rate_rad_s, Dimension.ANGULAR_SPEED),
        reader.number("turn_radius", usual.turn_radius_m, Dimension.DISTANCE, zero=True),
        reader.number("lateral_acceleration", usual.lateral_m_s2, Dimension.ACCELERATION),
    )


def inherited(
    connection: Connection, connections: Mapping[ResourceId, Connection]
) -> Mapping[str, Any] | None:
    """What a payload's connection has of its vehicle's; None: that is another arbiter's."""
    vehicle = connections.get(ResourceId(connection.resource.partition("/")[0]))
    return vehicle.settings if vehicle is not None else None


def own_settings(
    connection: Connection, of_vehicle: Mapping[str, Any] | None, known: Collection[str] = ()
) -> dict[str, Any]:
    """What a payload's connection says beyond its vehicle's, and of `known` what it has at all.
    `of_vehicle` None: that is another arbiter's, and what is not `known` is its business."""
    return {
        key: value
        for key, value in connection.settings.items()
        if key in known
        or (of_vehicle is not None and (key not in of_vehicle or of_vehicle[key] != value))
    }


def _read_detector(
    connection: Connection, of_vehicle: Mapping[str, Any] | None, with_node: Collection[ResourceId]
) -> DetectorSettings:
    own = own_settings(connection, of_vehicle, DETECTOR_KEYS)
    reader = ConnectionReader(connection.resource, own)
    node_keys = NODE_KEYS if connection.resource in with_node else ()
    reader.refuse_others((*DETECTOR_KEYS, *node_keys))
    topic = reader.topic("topic", "detections")
    namespace = reader.namespace("" if topic.startswith("/") else None)
    message = reader.choice("message", DetectorMessage, DetectorMessage.DETECTION)
    type_ = reader.text("type", "")
    return DetectorSettings(
        namespace, in_namespace(namespace, topic), reader.domain_id(), type_, message
    )
