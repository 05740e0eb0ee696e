"""The pose of a camera in the world, and the frame in which it turns."""

import math
from dataclasses import dataclass

import numpy as np

from m2pem.api import GeoPosition
from m2pem_plugin_ptz.camera_model.frames import (
    Matrix,
    Vector,
    deck_angles,
    deck_vector,
    ecef,
    enu_angles,
    enu_of_deck,
    enu_of_ecef,
    enu_vector,
    geodetic,
)
from m2pem_plugin_ptz.settings import Mounting


@dataclass(frozen=True, slots=True)
class VehiclePose:
    """The pose of a vehicle. Angles as in `VehicleState`."""

    position: GeoPosition
    yaw_rad: float
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class MountFrame:
    """The frame in which a camera turns. `enu` rotates vectors of the camera at pan 0 and tilt 0 to
    ENU. `pan_zero_rad`: direction of pan 0, clockwise from the vehicle's heading."""

    enu: Matrix
    pan_zero_rad: float = 0.0

    def angles(self, enu: Vector) -> tuple[float, float]:
        """Return pan and tilt of a direction."""
        bearing, tilt = deck_angles(self.enu.T @ enu)
        return bearing - self.pan_zero_rad, tilt

    def as_pan_zero_sees(self, enu: Vector) -> Vector:
        """Rotate directions in ENU, one a row, to the frame of a deck whose heading is pan 0."""
        turned: Vector = enu @ self.enu @ enu_of_deck(0.0, 0.0, -self.pan_zero_rad)
        return turned

    def vector(self, pan_rad: float, tilt_rad: float) -> Vector:
        """Return the direction of pan and tilt, in ENU."""
        vector: Vector = self.enu @ deck_vector(pan_rad + self.pan_zero_rad, tilt_rad)
        return vector

    def towards(self, heading_rad: float, elevation_rad: float) -> tuple[float, float]:
        """Return pan and tilt towards a heading, from north, clockwise."""
        return self.angles(enu_vector(heading_rad, elevation_rad))

    def heading(self, pan_rad: float, tilt_rad: float) -> tuple[float, float]:
        """Return heading and elevation of pan and tilt."""
        return enu_angles(self.vector(pan_rad, tilt_rad))

    def axes(self, pan_rad: float, tilt_rad: float) -> Matrix:
        """Return the rotation from ENU to the picture: ahead, left and up."""
        bearing = pan_rad + self.pan_zero_rad
        ahead, up = deck_vector(bearing, tilt_rad), deck_vector(bearing, tilt_rad + math.pi / 2)
        left = deck_vector(bearing - math.pi / 2, 0.0)
        return np.array([ahead, left, up]) @ self.enu.T


def mount_frame(
    mounting: Mounting, roll_rad: float, pitch_rad: float, yaw_rad: float, *, stabilized: bool
) -> MountFrame:
    """Return the frame of a camera on a vehicle with this attitude. A stabilized camera keeps its
    horizon."""
    if stabilized:
        roll_rad = pitch_rad = 0.0
    return MountFrame(enu_of_deck(roll_rad, pitch_rad, yaw_rad), mounting.pan_rad)


@dataclass(frozen=True, slots=True)
class CameraPose:
    """A camera and its position: `place` in ECEF, `position`, and the rotation to ENU there."""

    mount_frame: MountFrame
    place: Vector
    position: GeoPosition
    enu: Matrix

    def vector_to(self, place: Vector) -> Vector:
        """Return the vector from the camera to a point of ECEF, in ENU, in metres. Several points:
        one in each row."""
        vector: Vector = (place - self.place) @ self.enu.T
        return vector

    def at(self, place: Vector) -> tuple[float, float]:
        """Return pan and tilt towards a point of ECEF."""
        return self.mount_frame.angles(self.vector_to(place))


def camera_pose(pose: VehiclePose, mounting: Mounting, *, stabilized: bool) -> CameraPose:
    """Return the pose of a camera on a vehicle."""
    enu = enu_of_ecef(pose.position)
    body = enu_of_deck(pose.roll_rad, pose.pitch_rad, pose.yaw_rad)
    offset = body @ np.array([mounting.forward_m, mounting.left_m, mounting.up_m])
    place = ecef(pose.position) + enu.T @ offset
    position = geodetic(place)
    turns_on = mount_frame(
        mounting, pose.roll_rad, pose.pitch_rad, pose.yaw_rad, stabilized=stabilized
    )
    # A few metres aside, ENU is turned by less than a thousandth of a millirad; exact all the same.
    here = enu_of_ecef(position)
    return CameraPose(
        MountFrame(here @ enu.T @ turns_on.enu, mounting.pan_rad), place, position, here
    )
