"""Telemetry as the standard messages of ROS. What is not known says so, as docs/ros-face.md
tells."""

import math
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Quaternion as QuaternionMessage
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState, NavSatFix, NavSatStatus
from std_msgs.msg import Header

from m2pem.api import PayloadState, VehicleState, ellipsoidal_m, known_yaw_rad
from m2pem_plugin_ros.frames import Quaternion, Vector, quaternion_of, rotated_back
from m2pem_plugin_ros.interfaces.messages import time_of

NOT_KNOWN = -1.0
"""A variance of what is not known."""

YAW = 35
ANGULAR = (21, 28, 35)
"""Places on the diagonals of covariances of six by six."""


def attitude_of(state: VehicleState) -> Quaternion:
    """Return the rotation of a vehicle; where its yaw is not known, that of its course."""
    return quaternion_of(state.roll_rad, state.pitch_rad, known_yaw_rad(state))


def odometry(state: VehicleState, place: Vector, frame: str, child: str) -> Any:
    """Return the odometry of a vehicle at `place` in `frame`; its twist is in the frame
    `child`."""
    message = Odometry(header=_header(state.time_us, frame), child_frame_id=child)
    attitude = attitude_of(state)
    position = message.pose.pose.position
    position.x, position.y, position.z = place
    message.pose.pose.orientation = written(attitude)
    if state.yaw_rad is None:
        message.pose.covariance[YAW] = NOT_KNOWN
    for index in ANGULAR:
        message.twist.covariance[index] = NOT_KNOWN
    if state.velocity_enu_m_s is None:
        message.twist.covariance[0] = NOT_KNOWN
    else:
        linear = message.twist.twist.linear
        linear.x, linear.y, linear.z = rotated_back(state.velocity_enu_m_s, attitude)
    return message


def transform(time_us: int, parent: str, child: str, place: Vector, attitude: Quaternion) -> Any:
    """Return a transform."""
    message = TransformStamped(header=_header(time_us, parent), child_frame_id=child)
    translation = message.transform.translation
    translation.x, translation.y, translation.z = place
    message.transform.rotation = written(attitude)
    return message


def fix(state: VehicleState, frame: str) -> Any:
    """Return the position of a vehicle; without one, the status is NO_FIX."""
    message = NavSatFix(header=_header(state.time_us, frame))
    message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_UNKNOWN
    if state.position is None:
        message.status.status = NavSatStatus.STATUS_NO_FIX
        message.latitude = message.longitude = message.altitude = math.nan
        return message
    message.status.status = NavSatStatus.STATUS_FIX
    message.latitude = state.position.latitude_deg
    message.longitude = state.position.longitude_deg
    message.altitude = ellipsoidal_m(message.latitude, message.longitude, state.position.altitude_m)
    return message


def battery(state: VehicleState, frame: str) -> Any:
    """Return the battery of a vehicle, of which only the charge is known, if that."""
    nan = math.nan
    fraction = state.battery_fraction
    return BatteryState(
        header=_header(state.time_us, frame),
        voltage=nan,
        temperature=nan,
        current=nan,
        charge=nan,
        capacity=nan,
        design_capacity=nan,
        percentage=nan if fraction is None else fraction,
        present=fraction is not None,
    )


def imu(state: VehicleState, frame: str) -> Any:
    """Return the attitude of a vehicle; rates and accelerations are not known."""
    message = Imu(header=_header(state.time_us, frame), orientation=written(attitude_of(state)))
    message.angular_velocity_covariance[0] = NOT_KNOWN
    message.linear_acceleration_covariance[0] = NOT_KNOWN
    if state.yaw_rad is None:
        message.orientation_covariance[0] = NOT_KNOWN
    return message


def joint_states(states: Sequence[PayloadState], names: Sequence[tuple[str, str]]) -> Any:
    """Return the joints of the payloads of a vehicle; `names`: of pan and tilt of each.

    Joints turn as REP-103 says: pan is positive to the left, tilt is positive downwards.
    """
    message = JointState(header=_header(max(state.time_us for state in states), ""))
    for state, (pan, tilt) in zip(states, names, strict=True):
        for name, angle_rad in ((pan, state.pan_rad), (tilt, state.tilt_rad)):
            if angle_rad is not None:
                message.name.append(name)
                message.position.append(-angle_rad)
    return message


def written(q: Quaternion) -> Any:
    """Return a message of geometry_msgs."""
    return QuaternionMessage(x=q.x, y=q.y, z=q.z, w=q.w)


def _header(time_us: int, frame: str) -> Any:
    return Header(stamp=time_of(time_us), frame_id=frame)
