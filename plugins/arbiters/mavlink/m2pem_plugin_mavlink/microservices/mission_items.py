"""The items of a mission, as they are uploaded and downloaded (MISSION_ITEM_INT)."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item. `frame`: a MAV_FRAME; `command`: a MAV_CMD; `params`: its param1..param4, NaN for
    "as it is"; `latitude_deg`, `longitude_deg` (WGS-84), `altitude_m`: its x, y, z where it has a
    place. `autocontinue`: go on by itself afterwards."""

    command: int
    frame: int
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0
    autocontinue: bool = True

    def same_as(self, other: "MissionItem") -> bool:
        """Whether they say the same, but for what storing them may change: an autopilot keeps
        coordinates in 1e-7 degrees and altitudes as floats of 32 or fewer bits."""
        return (
            (self.command, self.frame) == (other.command, other.frame)
            and abs(self.latitude_deg - other.latitude_deg) < 2.5e-7
            and abs(self.longitude_deg - other.longitude_deg) < 2.5e-7
            and math.isclose(self.altitude_m, other.altitude_m, rel_tol=1e-6, abs_tol=0.01)
        )
