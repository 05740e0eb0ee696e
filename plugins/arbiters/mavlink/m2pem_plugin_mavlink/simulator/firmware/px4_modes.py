"""The modes of PX4, by main and sub mode (PX4: px4_custom_mode.h)."""

from m2pem_plugin_mavlink.simulator.interfaces import Roles


def custom_mode(main: int, sub: int = 0) -> int:
    """The number of a mode in HEARTBEAT."""
    return main << 16 | sub << 24


POSITION, ORBIT = custom_mode(3), custom_mode(3, 1)
TAKEOFF, HOLD, MISSION = custom_mode(4, 2), custom_mode(4, 3), custom_mode(4, 4)
RETURN, LAND, OFFBOARD = custom_mode(4, 5), custom_mode(4, 6), custom_mode(6)
DESCEND = custom_mode(4, 20)

ROLES = Roles(hold=HOLD, guided=HOLD, mission=MISSION, rtl=RETURN, land=LAND)

FENCE_ACTIONS = {2: HOLD, 3: RETURN, 4: LAND, 5: LAND}
"""GF_ACTION; terminating ends in landing here."""

NAMES = {
    POSITION: "Position",
    ORBIT: "Orbit",
    TAKEOFF: "Takeoff",
    HOLD: "Hold",
    MISSION: "Mission",
    RETURN: "Return",
    LAND: "Land",
    OFFBOARD: "Offboard",
}
"""As PX4 calls them in texts."""
