"""What a maneuver asks of the vehicle's motion. Kinematics turn it into movement."""

from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.geometry import Point


@dataclass(frozen=True, slots=True)
class Rest:
    """No thrust. What is in the air comes down."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Be at a point. A plane flies over it, and comes back.

    `climb_mps` and `descent_mps` bound the vertical speed; `yaw_rad` None: face the way it goes;
    `reverse`: a rover drives there backwards.
    """

    point: Point
    speed_mps: float
    climb_mps: float = 2.5
    descent_mps: float = 1.5
    yaw_rad: float | None = None
    reverse: bool = False


@dataclass(frozen=True, slots=True)
class Go:
    """Have a velocity over the ground. Yaw: an angle, a rate, or (both None) as it is.

    A rover turns towards the velocity and drives on.
    """

    north_mps: float
    east_mps: float
    up_mps: float = 0.0
    yaw_rad: float | None = None
    yaw_rps: float | None = None


@dataclass(frozen=True, slots=True)
class Drive:
    """Go forward (backward if negative) along the own heading, and turn."""

    speed_mps: float
    yaw_rps: float = 0.0
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class Circle:
    """Go around a point; `radius_m` negative: counterclockwise. Copters face the center."""

    center: Point
    radius_m: float
    speed_mps: float


Demand = Rest | Reach | Go | Drive | Circle
