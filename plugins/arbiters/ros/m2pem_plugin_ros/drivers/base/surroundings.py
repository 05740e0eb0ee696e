"""Places and other vehicles, in the local frame in which the base is driven."""

import math

from m2pem.api import (
    ArbiterContext,
    GeoPosition,
    LinkState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.frames import to_local
from m2pem_plugin_ros.pilot import Target
from m2pem_plugin_ros.pose import Pose

COURSE_ABOVE_M_S = 0.3
"""Of who does not say where its bow points, it is known from its course, at such a speed."""


class Surroundings:
    """As the fleet's bus and origin say."""

    def __init__(self, context: ArbiterContext) -> None:
        self._context = context

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres."""
        origin = self._context.origin
        east, north, _ = to_local(GeoPosition(latitude_deg, longitude_deg, origin[2]), origin)
        return east, north

    def vehicle(self, name: str) -> Target | None:
        """Another vehicle; None: it was never heard, or is not any more."""
        state = self._context.bus.latest(ResourceId(name)) if name else None
        if not isinstance(state, VehicleState) or state.position is None:
            return None
        if state.link is LinkState.LOST:
            return None
        east, north = self.level(state.position.latitude_deg, state.position.longitude_deg)
        east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        yaw = state.yaw_rad
        if yaw is None:
            moves = math.hypot(east_m_s, north_m_s) > COURSE_ABOVE_M_S
            yaw = math.atan2(north_m_s, east_m_s) if moves else 0.0
        age_s = max(0.0, (self._context.clock.now_us() - state.time_us) / 1e6)
        if not math.isfinite(east + north + east_m_s + north_m_s + yaw):
            return None
        return Target(Pose(east, north, yaw), east_m_s, north_m_s, age_s)
