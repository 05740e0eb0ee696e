"""The modes of ArduPilot's vehicles, by their numbers (ArduPilot: mode.h of each vehicle)."""

from collections.abc import Mapping, Sequence

from m2pem_plugin_mavlink.sim.firmware.firmware import Roles
from m2pem_plugin_mavlink.sim.maneuvers.guided import Guided
from m2pem_plugin_mavlink.sim.maneuvers.landing import Land
from m2pem_plugin_mavlink.sim.maneuvers.plane_takeoff import PlaneTakeoff
from m2pem_plugin_mavlink.sim.maneuvers.returning import ReturnToLaunch
from m2pem_plugin_mavlink.sim.maneuvers.standing import CircleHere, Halt, Stay
from m2pem_plugin_mavlink.sim.missions.execution import Auto
from m2pem_plugin_mavlink.sim.modes import Mode
from m2pem_plugin_mavlink.sim.specification import Kind

COPTER = (
    Mode(0, "STABILIZE", Stay, needs_position=False, armable=True, automatic=False),
    Mode(1, "ACRO", Stay, needs_position=False, armable=True, automatic=False),
    Mode(2, "ALT_HOLD", Stay, needs_position=False, armable=True, automatic=False),
    Mode(3, "AUTO", Auto),
    Mode(4, "GUIDED", Guided, armable=True),
    Mode(5, "LOITER", Stay, armable=True, automatic=False),
    Mode(6, "RTL", ReturnToLaunch),
    Mode(7, "CIRCLE", CircleHere),
    Mode(9, "LAND", Land, needs_position=False),
    Mode(16, "POSHOLD", Stay, armable=True, automatic=False),
    Mode(17, "BRAKE", Stay),
    Mode(21, "SMART_RTL", ReturnToLaunch),
)

ROVER = (
    Mode(0, "MANUAL", Halt, needs_position=False, armable=True, automatic=False),
    Mode(1, "ACRO", Halt, needs_position=False, armable=True, automatic=False),
    Mode(3, "STEERING", Halt, armable=True, automatic=False),
    Mode(4, "HOLD", Halt, needs_position=False, armable=True, automatic=False),
    Mode(5, "LOITER", Stay, armable=True),
    Mode(9, "CIRCLE", CircleHere, armable=True),
    Mode(10, "AUTO", Auto, armable=True),
    Mode(11, "RTL", ReturnToLaunch),
    Mode(12, "SMART_RTL", ReturnToLaunch),
    Mode(15, "GUIDED", Guided, armable=True),
)

PLANE = (
    Mode(0, "MANUAL", Stay, needs_position=False, armable=True, automatic=False),
    Mode(1, "CIRCLE", CircleHere, needs_position=False, armable=True),
    Mode(2, "STABILIZE", Stay, needs_position=False, armable=True, automatic=False),
    Mode(5, "FBWA", Stay, needs_position=False, armable=True, automatic=False),
    Mode(6, "FBWB", Stay, needs_position=False, armable=True, automatic=False),
    Mode(7, "CRUISE", Stay, armable=True, automatic=False),
    Mode(10, "AUTO", Auto, armable=True),
    Mode(11, "RTL", ReturnToLaunch),
    Mode(12, "LOITER", Stay, armable=True),
    Mode(13, "TAKEOFF", PlaneTakeoff, armable=True),
    Mode(15, "GUIDED", Guided, armable=True),
)

MODES: Mapping[Kind, Sequence[Mode]] = {
    Kind.COPTER: COPTER,
    Kind.ROVER: ROVER,
    Kind.BOAT: ROVER,
    Kind.PLANE: PLANE,
}

ROLES: Mapping[Kind, Roles] = {
    Kind.COPTER: Roles(hold=5, guided=4, mission=3, back=6, land=9),
    Kind.ROVER: Roles(hold=4, guided=15, mission=10, back=11, land=None),
    Kind.BOAT: Roles(hold=5, guided=15, mission=10, back=11, land=None),
    Kind.PLANE: Roles(hold=12, guided=15, mission=10, back=11, land=None),
}

FENCE_ACTIONS: Mapping[Kind, Mapping[int, int]] = {
    Kind.COPTER: {1: 6, 2: 9, 3: 21, 4: 17, 5: 21},
    Kind.ROVER: {1: 11, 2: 4, 3: 12, 4: 12},
    Kind.BOAT: {1: 11, 2: 4, 3: 12, 4: 12},
    Kind.PLANE: {1: 11, 6: 11, 7: 11},
}
"""FENCE_ACTION to the mode that is entered at a breach; 0 only reports it."""
