"""The settings of ROS vehicles, payloads with a node, and detectors in the fleet file
(docs/ros.md).

A payload has a node of its own if its `driver` is m2pem and its namespace is not that of its
vehicle. A payload inherits the connection of its vehicle. So a detector has a node only if its own
`driver`, `own_behaviors`, or allowed `behaviors` say so.
"""

import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import Any

from m2pem.api import (
    BehaviorSpec,
    BehaviorType,
    Connection,
    ConnectionReader,
    Dimension,
    EventCondition,
    ResourceId,
    read_declared_behaviors,
    read_template,
)
from m2pem.errors import PluginError
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.interfaces.types import MESSAGE, full_name


def domain_of(domain_id: int | None) -> int:
    """Return the domain. Without one in the fleet, it is that of the environment."""
    if domain_id is not None:
        return domain_id
    try:
        return int(os.environ.get("ROS_DOMAIN_ID", ""))
    except ValueError:
        return 0


_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
NAME = re.compile(rf"/?{_TOKEN}(/{_TOKEN})*")
HIGHEST_DOMAIN = 232


class RosConnectionReader(ConnectionReader):
    """Reads names of ROS besides. Unknown keys and invalid values are errors."""

    def domain_id(self) -> int | None:
        """Return the ROS domain; None means that of the environment."""
        if self.values.get("domain_id") is None:
            return None
        return self.whole("domain_id", None, 0, HIGHEST_DOMAIN)

    def namespace(self, default: str | None = None) -> str:
        """Return the namespace with its leading "/"; "" is the root."""
        value = self.values.get("namespace", default)
        if value is None:
            raise self.error(
                "namespace",
                "it is missing: write the namespace of the vehicle's nodes, such as /evsg1",
            )
        if value == "/" or (value == "" and default == ""):
            return ""
        if not isinstance(value, str) or not NAME.fullmatch(value):
            raise self.error("namespace", f"{value!r} is not a ROS namespace such as /evsg1")
        return f"/{value.removeprefix('/')}"

    def topic(self, key: str, default: str) -> str:
        """Return the name of a topic."""
        value = self.values.get(key, default)
        if not isinstance(value, str) or not NAME.fullmatch(value):
            raise self.error(key, f"{value!r} is not the name of a ROS topic such as {default}")
        return value

    def positive(
        self, key: str, default: float, dimension: Dimension, *, zero: bool = False
    ) -> float:
        """Return a quantity in SI, above 0, or with `zero` not below it."""
        number = self.quantity(key, default, dimension)
        if number < 0.0 or (number == 0.0 and not zero):
            raise self.error(key, f"{self.values[key]!r} is {'below' if zero else 'not above'} 0")
        return number


DOMAINS = ("ground", "surface")
"""Domains of the vehicles of this arbiter."""


class DriverName(StrEnum):
    """The drivers of vehicles."""

    NODE = "m2pem"
    NAV2 = "nav2"
    BASE = "base"


class Via(StrEnum):
    """How an m2pem node is commanded."""

    TOPICS = "topics"
    ACTION = "action"


class RouteAction(StrEnum):
    """The Nav2 action for routes."""

    THROUGH = "through"
    WAYPOINTS = "waypoints"


class OdomFrame(StrEnum):
    """Where the pose of a vehicle comes from (REP-105): its odometry in `map`, its odometry in
    `odom` with fixes, or tf."""

    MAP = "map"
    ODOM = "odom"
    TF = "tf"


class FixAltitude(StrEnum):
    """What the altitude of a vehicle's NavSatFix counts from: the WGS-84 ellipsoid, by the
    message's definition, or mean sea level, as receivers have it and some drivers publish it."""

    ELLIPSOID = "ellipsoid"
    MEAN_SEA_LEVEL = "mean_sea_level"


class DetectorMessage(StrEnum):
    """The type of a detector's messages: m2pem_interfaces/msg/Detection, or std_msgs/msg/String."""

    DETECTION = "detection"
    STRING = "string"


@dataclass(frozen=True, slots=True)
class Topics:
    """Names of topics. Names without a leading "/" are in the namespace of the vehicle."""

    odom: str = "odom"
    fix: str = "fix"
    battery: str = "battery_state"
    diagnostics: str = "/diagnostics"
    cmd_vel: str = "cmd_vel"
    teleop: str = "cmd_vel_teleop"
    tf: str = "/tf"
    tf_static: str = "/tf_static"


@dataclass(frozen=True, slots=True)
class Bounds:
    """The limits of a plain base in SI units. With `turn_radius_m` 0, it turns on the spot."""

    speed_m_s: float = 2.0
    reverse_m_s: float = 1.0
    acceleration_m_s2: float = 1.0
    yaw_rate_rad_s: float = 1.0
    turn_radius_m: float = 0.0
    lateral_m_s2: float = 1.5


@dataclass(frozen=True, slots=True)
class Settings:
    """The connection of a vehicle, or of a payload with an m2pem node. `namespace` has its leading
    "/"; "" is the root. `odom_frame`: with "map", odometry is in the local frame of the fleet; with
    "odom", it begins anywhere, and NavSatFix gives the position (REP-105); with "tf", the pose is
    that of `base_frame` in `map` on /tf. `base_frame`: "" means the `child_frame_id` of odometry.
    `stamped`: cmd_vel is a TwistStamped. `hardware_id`: in /diagnostics; by default the name in the
    fleet."""

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
    base_frame: str = ""
    fix_altitude: FixAltitude = FixAltitude.ELLIPSOID

    def topic(self, name: str) -> str:
        """Return the full name of a topic, action or service of the vehicle."""
        return in_namespace(self.namespace, name)


@dataclass(frozen=True, slots=True)
class OtherMessage:
    """Messages of another type than those of detections. `condition`: when one is a detection, with
    its `type` as data. `position`: the path of the field with its position; "": it has none."""

    type_name: str
    condition: EventCondition
    position: str = ""


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """The connection of a detector: the full name of its topic, and the type of detections whose
    messages have none. `other` None: `message` says what the messages are."""

    namespace: str
    topic: str
    domain_id: int | None = None
    type: str = ""
    message: DetectorMessage = DetectorMessage.DETECTION
    other: OtherMessage | None = None


def in_namespace(namespace: str, name: str) -> str:
    """Return the full name. A name with a leading "/" is full already."""
    return name if name.startswith("/") else f"{namespace}/{name}"


_KEYS = (*(each.name for each in fields(Settings)), "sim")
"""`sim` is for the simulator of the vehicle, and not read here."""

OTHER_KEYS = ("when", "every", "rate", "position")
"""Keys of a detector whose messages have another type."""
DETECTOR_KEYS = ("namespace", "domain_id", "topic", "message", "type", "sim", *OTHER_KEYS)
NODE_KEYS = ("driver", "via", "own_behaviors")
"""Further keys of a payload with an m2pem node."""

BOUNDS = {
    "speed": "speed_m_s",
    "reverse_speed": "reverse_m_s",
    "acceleration": "acceleration_m_s2",
    "yaw_rate": "yaw_rate_rad_s",
    "turn_radius": "turn_radius_m",
    "lateral_acceleration": "lateral_m_s2",
}
"""Keys of the fleet for the fields of `Bounds`."""


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """Read the settings of all vehicles.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read_vehicle(connection)
        for resource, connection in connections.items()
        if "/" not in resource
    }
    _check_namespaces(read)
    return read


def _check_namespaces(read: Mapping[ResourceId, Settings]) -> None:
    reached: dict[tuple[int | None, str], ResourceId] = {}
    for resource, settings in read.items():
        other = reached.setdefault((settings.domain_id, settings.namespace), resource)
        if other != resource:
            problem = f"{other} has the same namespace, {settings.namespace or '/'}"
            raise RosConnectionReader(resource, {}).error("namespace", problem)


def read_detectors(
    connections: Mapping[ResourceId, Connection], with_node: Collection[ResourceId] = ()
) -> dict[ResourceId, DetectorSettings]:
    """Read the settings of all detectors: payloads with a `topic`, or `detector: true`.
    `with_node`: payloads that have a node, too.

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
    reader = RosConnectionReader(resource, connection.settings)
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
            raise reader.error(
                key, f"the key is for the driver {of} only; this vehicle has {driver}"
            )
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
        _base_frame(reader),
        reader.choice("fix_altitude", FixAltitude, FixAltitude.ELLIPSOID),
    )


def _base_frame(reader: RosConnectionReader) -> str:
    if "base_frame" in reader.values and reader.values.get("odom_frame") != OdomFrame.TF:
        raise reader.error("base_frame", "the key is for 'odom_frame: tf' only")
    return reader.text("base_frame", "")


def _topics(reader: RosConnectionReader) -> Topics:
    usual = {each.name: str(each.default) for each in fields(Topics)}
    reader.refuse_others(usual)
    return Topics(**{key: reader.topic(key, default) for key, default in usual.items()})


def _bounds(reader: RosConnectionReader) -> Bounds:
    reader.refuse_others(BOUNDS)
    usual = Bounds()
    return Bounds(
        reader.positive("speed", usual.speed_m_s, Dimension.SPEED),
        reader.positive("reverse_speed", usual.reverse_m_s, Dimension.SPEED),
        reader.positive("acceleration", usual.acceleration_m_s2, Dimension.ACCELERATION),
        reader.positive("yaw_rate", usual.yaw_rate_rad_s, Dimension.ANGULAR_SPEED),
        reader.positive("turn_radius", usual.turn_radius_m, Dimension.DISTANCE, zero=True),
        reader.positive("lateral_acceleration", usual.lateral_m_s2, Dimension.ACCELERATION),
    )


def inherited(
    connection: Connection, connections: Mapping[ResourceId, Connection]
) -> Mapping[str, Any] | None:
    """Return the settings that a payload inherits from its vehicle; None if the vehicle has another
    arbiter."""
    vehicle = connections.get(ResourceId(connection.resource.partition("/")[0]))
    return vehicle.settings if vehicle is not None else None


def own_settings(
    connection: Connection, of_vehicle: Mapping[str, Any] | None, known: Collection[str] = ()
) -> dict[str, Any]:
    """Return the settings of a payload that differ from its vehicle's, and all that are `known`. If
    `of_vehicle` is None, the vehicle has another arbiter, and only `known` keys are returned."""
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
    reader = RosConnectionReader(connection.resource, own)
    node_keys = NODE_KEYS if connection.resource in with_node else ()
    reader.refuse_others((*DETECTOR_KEYS, *node_keys))
    topic = reader.topic("topic", "detections")
    namespace = reader.namespace("" if topic.startswith("/") else None)
    type_ = reader.text("type", "")
    full = in_namespace(namespace, topic)
    if "/" in str(own.get("message", "")):
        other = _read_other(reader)
        return DetectorSettings(namespace, full, reader.domain_id(), type_, other=other)
    message = reader.choice("message", DetectorMessage, DetectorMessage.DETECTION)
    if extra := next((key for key in OTHER_KEYS if key in own), ""):
        raise reader.error(extra, f"it goes with a type of ROS as `message`: {EXAMPLE_TYPE}")
    return DetectorSettings(namespace, full, reader.domain_id(), type_, message)


EXAMPLE_TYPE = "std_msgs/msg/Float32"


def _read_other(reader: RosConnectionReader) -> OtherMessage:
    if "type" not in reader.values:
        raise reader.error("type", "it is missing: what is detected, such as smoke")
    try:
        name = full_name(reader.text("message", ""), MESSAGE)
    except RosError as error:
        raise reader.error("message", str(error)) from error
    condition = EventCondition.read(reader, {"type": read_template(reader, "type")})
    return OtherMessage(name, condition, reader.text("position", ""))


_PAYLOAD_KEYS = (*DETECTOR_KEYS, *NODE_KEYS)


def read_payloads(
    connections: Mapping[ResourceId, Connection], vehicles: Mapping[ResourceId, Settings]
) -> dict[ResourceId, Settings]:
    """Read the settings of all payloads with a node. `vehicles` are the settings of the vehicles.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read_payload(connection, inherited(connection, connections))
        for resource, connection in connections.items()
        if "/" in resource and _has_node(connection, connections)
    }
    _check_namespaces({**vehicles, **read})
    return read


def _has_node(connection: Connection, connections: Mapping[ResourceId, Connection]) -> bool:
    values, of_vehicle = connection.settings, inherited(connection, connections)
    own = _own_keys(connection, of_vehicle)
    if values.get("driver") != DriverName.NODE:
        if "driver" in own and of_vehicle is not None:
            problem = f"{own['driver']!r} is not a driver of payloads: those with a node have m2pem"
            raise RosConnectionReader(connection.resource, own).error("driver", problem)
        return False
    if "driver" in own or "own_behaviors" in own:
        return True
    detects = connection.detector or "topic" in values
    return "namespace" in own and (connection.behaviors is not None or not detects)


def _read_payload(connection: Connection, of_vehicle: Mapping[str, Any] | None) -> Settings:
    resource, own = connection.resource, _own_keys(connection, of_vehicle)
    reader = RosConnectionReader(resource, own)
    reader.refuse_others(_PAYLOAD_KEYS)
    whole = RosConnectionReader(resource, connection.settings)
    return Settings(
        whole.namespace(),
        whole.domain_id(),
        DriverName.NODE,
        whole.choice("via", Via, Via.TOPICS),
        own_behaviors=read_declared_behaviors(
            resource, own.get("own_behaviors"), BehaviorType.PAYLOAD
        ),
    )


def _own_keys(connection: Connection, of_vehicle: Mapping[str, Any] | None) -> dict[str, Any]:
    # The settings of a vehicle of another arbiter are not known: only those of the payload count.
    return own_settings(connection, of_vehicle, _PAYLOAD_KEYS if of_vehicle is None else ())
