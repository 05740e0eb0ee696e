"""The bounds of what a vehicle may do otherwise than commanded, in one table.

They were chosen so that the missions of the repository do not come near them on simulated vehicles.
A fleet sets others by key `conformance` (docs/evidence.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

G_M_S2 = 9.81

SEEN_WITHIN_S = 3.0
"""States that are farther apart say nothing of what was between them."""

LOOKS = 3
"""What lasts is seen in so many states in a row, however long they are apart."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds in SI. What grows with the speed, `turn_m`, is added to distances on the map.

    `cross_track_m`: from the way, for `cross_track_s`: gusts and avoidance are shorter. `height_m`:
    from the heights of a leg, at most half of the height above home, for `height_s`. `fence_m`:
    outside of a fence, in two states. `fall_m_s`: downwards; autopilots descend at 5 m/s or less.
    `disarmed_above_m`: a hill on which an aircraft lands is no higher above home. `jump_m`: beyond
    what the speed explains. `waypoint_m`: how near a waypoint is passed, or the end is. `covered`:
    share of a survey's lines. `rest_m_s`: of what is at rest: GPS and wind move it slowly.
    `drift_m`: how far it goes meanwhile. `over_speed`: times the commanded speed, for
    `over_speed_s`: wind at its back. `stuck_s`: without progress; only operators are alerted, as a
    vehicle may wait for something on its way.
    """

    cross_track_m: float = 10.0
    cross_track_s: float = 5.0
    height_m: float = 15.0
    height_s: float = 5.0
    fence_m: float = 5.0
    fall_m_s: float = 8.0
    disarmed_above_m: float = 5.0
    jump_m: float = 25.0
    waypoint_m: float = 10.0
    covered: float = 0.9
    rest_m_s: float = 1.0
    drift_m: float = 30.0
    over_speed: float = 2.0
    over_speed_s: float = 10.0
    stuck_s: float = 120.0

    @classmethod
    def of(cls, *settings: Mapping[str, float]) -> Self:
        """Return the bounds with those of a fleet, then of a vehicle, in their place."""
        merged = {name: value for each in settings for name, value in each.items()}
        return replace(cls(), **merged)


def turn_m(speed_m_s: float) -> float:
    """Return how far off the way a turn may lead: the diameter of a turn with 45 degrees of bank,
    which aircraft with wings need, and multicopters and cars do not at their speeds."""
    return 2.0 * speed_m_s * speed_m_s / G_M_S2
