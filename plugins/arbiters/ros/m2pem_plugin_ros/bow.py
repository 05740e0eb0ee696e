"""Where another vehicle points, as far as it is known."""

import math

from m2pem.api import VehicleState

COURSE_ABOVE_M_S = 0.3
"""Of who does not say where its bow points, it is known from its course, at such a speed."""


def bow_rad(state: VehicleState) -> float:
    """From east, counter-clockwise; 0 if nothing is known."""
    if state.yaw_rad is not None:
        return state.yaw_rad
    east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    moves = math.hypot(east_m_s, north_m_s) > COURSE_ABOVE_M_S
    return math.atan2(north_m_s, east_m_s) if moves else 0.0
