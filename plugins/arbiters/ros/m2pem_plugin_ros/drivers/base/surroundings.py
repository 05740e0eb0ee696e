"""Places and other vehicles, in the local frame in which the base is driven."""

import math

from m2pem.api import (
    ArbiterContext,
    Area,
    Fence,
    GeoPosition,
    LinkState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.bow import bow_rad
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pilot import Target
from m2pem_plugin_ros.pilot.plane import Place
from m2pem_plugin_ros.pose import Pose


class Surroundings:
    """As the fleet's bus, origin and fence say."""

    def __init__(self, context: ArbiterContext, fence: Area | None = None) -> None:
        self._context = context
        self._fence = None if fence is None else Fence(fence)

    def outside_m(self, place: Place) -> float:
        """How far a place is outside the fence; 0 inside, or if there is none."""
        if self._fence is None:
            return 0.0
        position = to_geodetic(*place, 0.0, self._context.origin)
        return self._fence.outside_m((position.latitude_deg, position.longitude_deg))

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
        yaw = bow_rad(state)
        age_s = max(0.0, (self._context.clock.now_us() - state.time_us) / 1e6)
        if not math.isfinite(east + north + east_m_s + north_m_s + yaw):
            return None
        return Target(Pose(east, north, yaw), east_m_s, north_m_s, age_s)
