"""What a fleet says of the connection to a ROS vehicle, or to a detector on it (docs/ros.md)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.api import Connection, ResourceId


class DriverName(StrEnum):
    """The ways to reach a vehicle."""

    NODE = "m2pem"
    NAV2 = "nav2"
    BASE = "base"


class Via(StrEnum):
    """How an m2pem node is commanded."""

    TOPICS = "topics"
    ACTION = "action"


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
    """Of a vehicle. `odom_frame`: "map": its odometry is in the fleet's local frame; "odom": it
    begins anywhere, and NavSatFix says where (REP-105). `stamped`: cmd_vel is a TwistStamped.
    `hardware_id`: the vehicle's in /diagnostics."""

    namespace: str
    domain_id: int | None = None
    driver: DriverName = DriverName.NODE
    via: Via = Via.TOPICS
    topics: Topics = field(default_factory=Topics)
    odom_frame: str = "map"
    stamped: bool = False
    bounds: Bounds = field(default_factory=Bounds)
    hardware_id: str = ""


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """Of a payload: the topic with its detections, of m2pem_interfaces/msg/Detection."""

    namespace: str
    topic: str
    domain_id: int | None = None
    type: str = ""


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """The settings of all vehicles.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    raise NotImplementedError


def read_detectors(
    connections: Mapping[ResourceId, Connection],
) -> dict[ResourceId, DetectorSettings]:
    """The settings of all payloads.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    raise NotImplementedError
