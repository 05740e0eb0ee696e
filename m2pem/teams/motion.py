"""How vehicles of each domain are taken to move, as arbiters do not say."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

REACTION_S = 1.0
"""From a change of what is seen to a vehicle that begins to brake: telemetry, thought, command."""


@dataclass(frozen=True, slots=True)
class Motion:
    """`nominal_m_s`: the speed of a march when nobody says. `braking_m_s2`: what a vehicle that is
    told to stop brakes with at least."""

    nominal_m_s: float
    braking_m_s2: float

    def stopping_m(self, speed_m_s: float) -> float:
        """The way from what is seen at that speed to the stand."""
        return speed_m_s * REACTION_S + speed_m_s**2 / (2 * self.braking_m_s2)

    def safe_m_s(self, distance_m: float) -> float:
        """The highest speed from which it stops within the distance; 0 without any."""
        if distance_m <= 0:
            return 0.0
        lag = self.braking_m_s2 * REACTION_S
        return math.sqrt(lag**2 + 2 * self.braking_m_s2 * distance_m) - lag


MOTIONS: Mapping[str, Motion] = {
    "ground": Motion(5.0, 2.0),
    "air": Motion(10.0, 2.0),
    "surface": Motion(4.0, 0.4),
    "subsurface": Motion(1.5, 0.25),
}
"""By domain."""
