"""What a behavior commands one vehicle, as data that telemetry can be compared with.

The core derives it from the request of a shared behavior. An arbiter whose behavior is carried out
in another way says so with its first report RUNNING (`BehaviorReport.commanded`).
"""

from dataclasses import dataclass
from enum import StrEnum

from m2pem.mission.geometry import Coordinate

LatLonLine = tuple[tuple[float, float], tuple[float, float]]
"""From one place to another, each in WGS-84 degrees."""


class ExpectedEnd(StrEnum):
    """What telemetry shows of a behavior that has succeeded."""

    NONE = "none"
    """Nothing that could be compared."""
    PLACE = "place"
    """The vehicle has passed the last waypoint."""
    COVERED = "covered"
    """It has covered the lines."""
    MOVED = "moved"
    """It has moved by `distance_m`."""
    LANDED = "landed"
    HEIGHT = "height"
    """It has reached `height_m`."""
    HOME = "home"
    """It is at its home."""
    REST = "rest"
    """It stays where it is."""


@dataclass(frozen=True, slots=True)
class Commanded:
    """What one vehicle is commanded to do; as it is by default, only safety is watched.

    `way`: waypoints in the order in which they are passed, `frames` the altitude frame of each
    ("relative", "amsl" or "terrain"); an altitude of None is not compared. `straight`: the vehicle
    moves along the straight lines between them, and to the first. `loop`: they are passed again and
    again. `lines`: what a survey covers, in any order; a place counts as covered when the vehicle
    passes it within `reach_m`. `tolerance_m`: how near the last waypoint is there, if the request
    says. `height_m`, in `height_frame`: of `ExpectedEnd.HEIGHT`. `speed_m_s`: over ground; None:
    not compared. `in_air`: an aircraft is in the air all the time. `comes_down`: it is on its way
    to the ground, so that a deviation does not stop it in the air.
    """

    way: tuple[Coordinate, ...] = ()
    frames: tuple[str, ...] = ()
    straight: bool = False
    loop: bool = False
    lines: tuple[LatLonLine, ...] = ()
    reach_m: float = 0.0
    end: ExpectedEnd = ExpectedEnd.NONE
    tolerance_m: float | None = None
    height_m: float | None = None
    height_frame: str = "relative"
    distance_m: float = 0.0
    speed_m_s: float | None = None
    in_air: bool = False
    comes_down: bool = False
