"""Whether a vehicle stands, by its odometry."""

import math

from m2pem.api import Clock
from m2pem_plugin_ros.localization import Localization

STANDS_M_S = 0.05
STANDS_RAD_S = 0.05
FRESH_S = 1.0
LOOK_EVERY_S = 0.1


def moves(localization: Localization) -> str:
    """Why the vehicle does not stand, as far as is known; "" if it does."""
    twist = localization.twist
    if twist is None or localization.age_s > FRESH_S:
        return "its odometry is not heard"
    speed_m_s = math.hypot(twist.forward_m_s, twist.left_m_s)
    if speed_m_s > STANDS_M_S:
        return f"it moves at {speed_m_s:.1f} m/s"
    return "it turns" if abs(twist.yaw_rad_s) > STANDS_RAD_S else ""


async def stands(localization: Localization, clock: Clock, within_s: float) -> str:
    """Wait until it stands in two looks on end; returns "", or why it does not in time."""
    until_us = clock.now_us() + within_s * 1e6
    looks = 0
    while True:
        why = moves(localization)
        looks = 0 if why else looks + 1
        if looks > 1:
            return ""
        if clock.now_us() >= until_us:
            return why or "it has just come to a stand"
        await clock.sleep(LOOK_EVERY_S)
