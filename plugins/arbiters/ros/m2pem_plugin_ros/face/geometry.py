"""Rotations of vehicles and of the fleet's local frame, as quaternions (REP-103, REP-105)."""

import math

from m2pem_plugin_ros.frames import Quaternion, rotated

Vector = tuple[float, float, float]


def quaternion_of(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Return the rotation from the frame of a vehicle (x forward, y left, z up) to ENU.

    Roll is about x, pitch about y (positive: nose down), yaw about z, from east.
    """
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return Quaternion(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def rotated_back(vector: Vector, q: Quaternion) -> Vector:
    """Return a vector of ENU in the frame of a vehicle whose rotation is `q`."""
    return rotated(vector, Quaternion(-q.x, -q.y, -q.z, q.w))


def earth_from_enu(latitude_deg: float, longitude_deg: float) -> Quaternion:
    """Return the rotation from ENU at a place to the axes of the Earth (ECEF)."""
    about_z = (math.radians(longitude_deg) + math.pi / 2) / 2
    about_x = (math.pi / 2 - math.radians(latitude_deg)) / 2
    cz, sz = math.cos(about_z), math.sin(about_z)
    cx, sx = math.cos(about_x), math.sin(about_x)
    return Quaternion(cz * sx, sz * sx, sz * cx, cz * cx)
