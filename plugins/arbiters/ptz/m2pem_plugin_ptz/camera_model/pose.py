"""A camera in the world: how its pan and tilt go with places and headings."""

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
class Stance:
    """How a vehicle stands. Angles as in `VehicleState`."""

    position: GeoPosition
    yaw_rad: float
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Deck:
    """What a camera turns on. `enu`: turns vectors of the camera at pan 0 and tilt 0 into ENU.

    `pan_zero_rad`: where pan 0 points, from the bow, clockwise.
    """

    enu: Matrix
    pan_zero_rad: float = 0.0

    def angles(self, enu: Vector) -> tuple[float, float]:
        """The pan and the tilt of a direction."""
        bearing, tilt = deck_angles(self.enu.T @ enu)
        return bearing - self.pan_zero_rad, tilt

    def as_pan_zero_sees(self, enu: Vector) -> Vector:
        """Directions of ENU, one in each row, in the frame of a deck whose bow is at pan 0."""
        turned: Vector = enu @ self.enu @ enu_of_deck(0.0, 0.0, -self.pan_zero_rad)
        return turned

    def vector(self, pan_rad: float, tilt_rad: float) -> Vector:
        """The direction, in ENU, of a pan and a tilt."""
        vector: Vector = self.enu @ deck_vector(pan_rad + self.pan_zero_rad, tilt_rad)
        return vector

    def towards(self, heading_rad: float, elevation_rad: float) -> tuple[float, float]:
        """The pan and the tilt that look to a heading, from north, clockwise."""
        return self.angles(enu_vector(heading_rad, elevation_rad))

    def heading(self, pan_rad: float, tilt_rad: float) -> tuple[float, float]:
        """The heading and the elevation to which a pan and a tilt look."""
        return enu_angles(self.vector(pan_rad, tilt_rad))

    def axes(self, pan_rad: float, tilt_rad: float) -> Matrix:
        """Turns ENU into what the camera sees: ahead, left and up in the picture."""
        ahead = deck_vector(pan_rad + self.pan_zero_rad, tilt_rad)
        level = deck_vector(pan_rad + self.pan_zero_rad, 0.0)
        left = np.array([-level[1], level[0], 0.0])
        return np.array([ahead, left, np.cross(ahead, left)]) @ self.enu.T


def deck(
    mounting: Mounting, roll_rad: float, pitch_rad: float, yaw_rad: float, *, stabilized: bool
) -> Deck:
    """What a camera turns on, on a vehicle that stands so. A stabilized one keeps its horizon."""
    if stabilized:
        roll_rad = pitch_rad = 0.0
    return Deck(enu_of_deck(roll_rad, pitch_rad, yaw_rad), mounting.pan_rad)


@dataclass(frozen=True, slots=True)
class Eye:
    """A camera and where it is: in ECEF, and `position`, with ENU there."""

    deck: Deck
    place: Vector
    position: GeoPosition
    enu: Matrix

    def seen(self, place: Vector) -> Vector:
        """From the camera to a place of ECEF, in ENU, metres. Several places: one in each row."""
        vector: Vector = (place - self.place) @ self.enu.T
        return vector

    def at(self, place: Vector) -> tuple[float, float]:
        """The pan and the tilt that look at a place of ECEF."""
        return self.deck.angles(self.seen(place))


def eye(stance: Stance, mounting: Mounting, *, stabilized: bool) -> Eye:
    """The camera of a vehicle that stands so."""
    enu = enu_of_ecef(stance.position)
    body = enu_of_deck(stance.roll_rad, stance.pitch_rad, stance.yaw_rad)
    offset = body @ np.array([mounting.forward_m, mounting.left_m, mounting.up_m])
    place = ecef(stance.position) + enu.T @ offset
    position = geodetic(place)
    turns_on = deck(
        mounting, stance.roll_rad, stance.pitch_rad, stance.yaw_rad, stabilized=stabilized
    )
    # A few metres aside, ENU is turned by less than a thousandth of a millirad; exact all the same.
    here = enu_of_ecef(position)
    return Eye(Deck(here @ enu.T @ turns_on.enu, mounting.pan_rad), place, position, here)
