"""The modes of PX4, by main and sub mode (PX4: px4_custom_mode.h)."""

from m2pem_plugin_mavlink.sim.firmware.firmware import Roles
from m2pem_plugin_mavlink.sim.maneuvers.climbing import TakeOff
from m2pem_plugin_mavlink.sim.maneuvers.holding import Hold
from m2pem_plugin_mavlink.sim.maneuvers.landing import Descend, Land
from m2pem_plugin_mavlink.sim.maneuvers.offboard import Offboard
from m2pem_plugin_mavlink.sim.maneuvers.orbiting import Orbit
from m2pem_plugin_mavlink.sim.maneuvers.px4_return import Px4Return
from m2pem_plugin_mavlink.sim.maneuvers.standing import Halt, Stay
from m2pem_plugin_mavlink.sim.missions.px4_mission import Px4Mission
from m2pem_plugin_mavlink.sim.modes import Mode
from m2pem_plugin_mavlink.sim.specification import Kind


def custom_mode(main: int, sub: int = 0) -> int:
    """The number of a mode in HEARTBEAT."""
    return main << 16 | sub << 24


POSITION, ORBIT = custom_mode(3), custom_mode(3, 1)
TAKEOFF, HOLD, MISSION = custom_mode(4, 2), custom_mode(4, 3), custom_mode(4, 4)
RETURN, LAND, OFFBOARD = custom_mode(4, 5), custom_mode(4, 6), custom_mode(6)
DESCEND = custom_mode(4, 20)

ROLES = Roles(hold=HOLD, guided=HOLD, mission=MISSION, back=RETURN, land=LAND)

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


def modes_of(kind: Kind) -> tuple[Mode, ...]:
    """The modes of a kind of vehicle. Its sticks, if it has any, are in the middle."""
    by_hand = Stay if kind is Kind.COPTER else Halt
    everywhere = (
        Mode(custom_mode(1), "MANUAL", by_hand, False, armable=True, automatic=False),
        Mode(custom_mode(5), "ACRO", by_hand, False, armable=True, automatic=False),
        Mode(custom_mode(7), "STABILIZED", by_hand, False, armable=True, automatic=False),
        Mode(POSITION, "POSCTL", Stay, armable=True, automatic=False),
        Mode(HOLD, "AUTO.LOITER", Hold, armable=True),
        Mode(MISSION, "AUTO.MISSION", Px4Mission, armable=True),
        Mode(RETURN, "AUTO.RTL", Px4Return),
        Mode(OFFBOARD, "OFFBOARD", Offboard, armable=True),
    )
    if kind is not Kind.COPTER:
        return everywhere
    return (
        *everywhere,
        Mode(custom_mode(2), "ALTCTL", Stay, False, armable=True, automatic=False),
        Mode(ORBIT, "POSCTL.ORBIT", Orbit),
        Mode(TAKEOFF, "AUTO.TAKEOFF", TakeOff, armable=True),
        Mode(LAND, "AUTO.LAND", Land, needs_position=False),
        Mode(DESCEND, "AUTO.DESCEND", Descend, needs_position=False, automatic=False),
    )
