"""States of vehicles as messages of ROS 2 (Jazzy), in CDR, with their definitions as `ros2msg`.

Frames as in `foxglove_messages`. Altitudes of NavSatFix are above the WGS-84 ellipsoid.
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from m2pem.api import US_PER_S, LocalFrame, VehicleState, ellipsoidal_m
from m2pem_plugin_recorder.channels import Channel, ChannelMessage, Schema
from m2pem_plugin_recorder.foxglove_messages import MAP, base_link, finite, rotation

STORE = get_typestore(Stores.ROS2_JAZZY)
"""The types of ROS 2 Jazzy."""

_Header, _Time, _Fix, _FixStatus, _Odometry, _Battery = (
    STORE.types[name]
    for name in (
        "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time",
        "sensor_msgs/msg/NavSatFix",
        "sensor_msgs/msg/NavSatStatus",
        "nav_msgs/msg/Odometry",
        "sensor_msgs/msg/BatteryState",
    )
)
_Pose, _PoseCovariance, _Point, _Quaternion, _Twist, _TwistCovariance, _Vector = (
    STORE.types[f"geometry_msgs/msg/{name}"]
    for name in (
        "Pose",
        "PoseWithCovariance",
        "Point",
        "Quaternion",
        "Twist",
        "TwistWithCovariance",
        "Vector3",
    )
)
_NO_COVARIANCE = np.zeros(9)
_NO_COVARIANCE_6 = np.zeros(36)
_NO_CELLS = np.zeros(0, dtype=np.float32)
_STATUS_FIX, _SERVICE_GPS = 0, 1


@cache
def _channel(topic: str, type_: str) -> Channel:
    definition, _ = STORE.generate_msgdef(type_, ros_version=2)
    return Channel(topic, "cdr", Schema(type_, "ros2msg", definition.encode()))


def vehicle_messages(state: VehicleState, frame: LocalFrame) -> Iterator[ChannelMessage]:
    """Yield fix, odometry and battery of a vehicle, as far as they are known.

    Without a heading there is no odometry, as its twist is in the vehicle's frame.
    """
    name = state.resource
    seconds, rest_us = divmod(state.time_us, US_PER_S)
    stamp = _Time(sec=seconds, nanosec=rest_us * 1000)
    place = finite(state.position)
    if place is not None:
        fix = _Fix(
            header=_Header(stamp=stamp, frame_id=base_link(name)),
            status=_FixStatus(status=_STATUS_FIX, service=_SERVICE_GPS),
            latitude=place.latitude_deg,
            longitude=place.longitude_deg,
            altitude=ellipsoidal_m(*place.latlon, place.altitude_m),
            position_covariance=_NO_COVARIANCE,
            position_covariance_type=0,
        )
        yield _message(f"/{name}/fix", "sensor_msgs/msg/NavSatFix", state.time_us, fix)
    if place is not None and state.yaw_rad is not None:
        east, north, up = frame.to_enu(place.latitude_deg, place.longitude_deg, place.altitude_m)
        turn = rotation(state.roll_rad, state.pitch_rad, state.yaw_rad)
        x, y, z = _into(turn, state.velocity_enu_m_s or (math.nan, math.nan, math.nan))
        odometry = _Odometry(
            header=_Header(stamp=stamp, frame_id=MAP),
            child_frame_id=base_link(name),
            pose=_PoseCovariance(
                pose=_Pose(
                    position=_Point(x=east, y=north, z=up),
                    orientation=_Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3]),
                ),
                covariance=_NO_COVARIANCE_6,
            ),
            twist=_TwistCovariance(
                twist=_Twist(
                    linear=_Vector(x=x, y=y, z=z),
                    angular=_Vector(x=math.nan, y=math.nan, z=math.nan),
                ),
                covariance=_NO_COVARIANCE_6,
            ),
        )
        yield _message(f"/{name}/odom", "nav_msgs/msg/Odometry", state.time_us, odometry)
    if state.battery_fraction is not None:
        nan = math.nan
        battery = _Battery(
            header=_Header(stamp=stamp, frame_id=base_link(name)),
            voltage=nan,
            temperature=nan,
            current=nan,
            charge=nan,
            capacity=nan,
            design_capacity=nan,
            percentage=state.battery_fraction,
            power_supply_status=0,
            power_supply_health=0,
            power_supply_technology=0,
            present=True,
            cell_voltage=_NO_CELLS,
            cell_temperature=_NO_CELLS,
            location="",
            serial_number="",
        )
        yield _message(
            f"/{name}/battery_state", "sensor_msgs/msg/BatteryState", state.time_us, battery
        )


def _message(topic: str, type_: str, time_us: int, message: Any) -> ChannelMessage:
    data = bytes(STORE.serialize_cdr(message, type_))
    return ChannelMessage(_channel(topic, type_), time_us, data)


def _into(
    turn: tuple[float, float, float, float], vector: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return a vector of the map in the frame that is turned by a quaternion (x, y, z, w)."""
    x, y, z, w = turn
    a, b, c = vector
    return (
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y + w * z) * b + 2 * (x * z - w * y) * c,
        2 * (x * y - w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z + w * x) * c,
        2 * (x * z + w * y) * a + 2 * (y * z - w * x) * b + (1 - 2 * (x * x + y * y)) * c,
    )
