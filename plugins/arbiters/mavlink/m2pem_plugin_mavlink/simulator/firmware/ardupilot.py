"""ArduPilot 4.7: copter, rover (boats are rovers) and plane."""

from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.failsafes import ArduPilotFailsafes
from m2pem_plugin_mavlink.simulator.firmware.ardupilot_parameters import PARAMETERS, WHOLE_NUMBERS
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    FenceRules,
    Firmware,
    Mode,
    Parameters,
    Roles,
    Tuning,
)
from m2pem_plugin_mavlink.simulator.maneuvers import (
    CircleHere,
    Guided,
    HoldPosition,
    Land,
    PlaneTakeoff,
    ReturnToLaunch,
    Stop,
)
from m2pem_plugin_mavlink.simulator.missions.execution import AutoMission
from m2pem_plugin_mavlink.simulator.signing import SigningSetup
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind, VehicleSpec

COPTER = (
    Mode(0, "STABILIZE", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(1, "ACRO", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(2, "ALT_HOLD", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(3, "AUTO", AutoMission),
    Mode(4, "GUIDED", Guided, armable=True),
    Mode(5, "LOITER", HoldPosition, armable=True, automatic=False),
    Mode(6, "RTL", ReturnToLaunch),
    Mode(7, "CIRCLE", CircleHere),
    Mode(9, "LAND", Land, needs_position=False),
    Mode(16, "POSHOLD", HoldPosition, armable=True, automatic=False),
    Mode(17, "BRAKE", HoldPosition),
    Mode(21, "SMART_RTL", ReturnToLaunch),
)

ROVER = (
    Mode(0, "MANUAL", Stop, needs_position=False, armable=True, automatic=False),
    Mode(1, "ACRO", Stop, needs_position=False, armable=True, automatic=False),
    Mode(3, "STEERING", Stop, armable=True, automatic=False),
    Mode(4, "HOLD", Stop, needs_position=False, armable=True, automatic=False),
    Mode(5, "LOITER", HoldPosition, armable=True),
    Mode(9, "CIRCLE", CircleHere, armable=True),
    Mode(10, "AUTO", AutoMission, armable=True),
    Mode(11, "RTL", ReturnToLaunch),
    Mode(12, "SMART_RTL", ReturnToLaunch),
    Mode(15, "GUIDED", Guided, armable=True),
)

PLANE = (
    Mode(0, "MANUAL", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(1, "CIRCLE", CircleHere, needs_position=False, armable=True),
    Mode(2, "STABILIZE", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(5, "FBWA", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(6, "FBWB", HoldPosition, needs_position=False, armable=True, automatic=False),
    Mode(7, "CRUISE", HoldPosition, armable=True, automatic=False),
    Mode(10, "AUTO", AutoMission, armable=True),
    Mode(11, "RTL", ReturnToLaunch),
    Mode(12, "LOITER", HoldPosition, armable=True),
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
    Kind.COPTER: Roles(hold=5, guided=4, mission=3, rtl=6, land=9),
    Kind.ROVER: Roles(hold=4, guided=15, mission=10, rtl=11, land=None),
    Kind.BOAT: Roles(hold=5, guided=15, mission=10, rtl=11, land=None),
    Kind.PLANE: Roles(hold=12, guided=15, mission=10, rtl=11, land=None),
}

FENCE_ACTIONS: Mapping[Kind, Mapping[int, int]] = {
    Kind.COPTER: {1: 6, 2: 9, 3: 21, 4: 17, 5: 21},
    Kind.ROVER: {1: 11, 2: 4, 3: 12, 4: 12},
    Kind.BOAT: {1: 11, 2: 4, 3: 12, 4: 12},
    Kind.PLANE: {1: 11, 6: 11, 7: 11},
}
"""FENCE_ACTION to the mode that is entered at a breach; 0 only reports it."""


TYPES = {
    Kind.COPTER: dialect.MAV_TYPE_QUADROTOR,
    Kind.ROVER: dialect.MAV_TYPE_GROUND_ROVER,
    Kind.BOAT: dialect.MAV_TYPE_SURFACE_BOAT,
    Kind.PLANE: dialect.MAV_TYPE_FIXED_WING,
}

WAYPOINTS = {
    Kind.COPTER: (16, 19, 82),
    Kind.ROVER: (16, 19),
    Kind.BOAT: (16, 19),
    Kind.PLANE: (16,),
}
"""MAV_CMD of the items of which it says that they were reached."""


class ArduPilot(Firmware):
    """ArduPilot on one kind of vehicle."""

    autopilot_id = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
    types = TYPES
    version = 4 << 24 | 7 << 16 | 0 << 8 | dialect.FIRMWARE_VERSION_TYPE_DEV
    capabilities = (
        dialect.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | dialect.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
        | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    )
    is_ardupilot = True
    silent_reports = frozenset({dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION})
    capacity = "BATT_CAPACITY"
    asks_for_items_as_int = False

    def __init__(self, spec: VehicleSpec) -> None:
        super().__init__(spec)
        plane, copter = spec.kind is Kind.PLANE, spec.kind is Kind.COPTER
        self.reason_home = "AHRS: waiting for home"
        self.reason_position = self.reason_home if plane else "Need Position Estimate"
        if spec.kind in SURFACE:
            self.reason_home = "AHRS: not using configured AHRS type"
        self.reason_sensors = "Gyros inconsistent"
        self.loop_hz = 400.0 if copter else 50.0
        self.first_mode = 0
        states = (dialect.MAV_VTOL_STATE_UNDEFINED, dialect.MAV_VTOL_STATE_MC)
        self.vtol_state = states[copter]
        self.tells_landed = plane or copter
        if not copter:
            self.armed_text, self.disarmed_text = "Throttle armed", "Throttle disarmed"
        self.roles = ROLES[spec.kind]

    def modes(self) -> Sequence[Mode]:
        """The modes of the vehicle."""
        return MODES[self.spec.kind]

    def parameters(self) -> Mapping[str, float]:
        """The defaults, and its own number."""
        return {**PARAMETERS[self.spec.kind], "MAV_SYSID": self.spec.system}

    def parameter_type(self, name: str) -> int:
        """Values travel as floats, whatever their type."""
        whole, real = dialect.MAV_PARAM_TYPE_INT32, dialect.MAV_PARAM_TYPE_REAL32
        type_: int = whole if name in WHOLE_NUMBERS else real
        return type_

    def tuning(self, parameters: Parameters) -> Tuning:
        """ArduPilot has centimetres in a copter's, metres in the others' parameters."""
        p = parameters
        match self.spec.kind:
            case Kind.COPTER:
                land_high = p["LAND_SPEED_HIGH"] or p["WPNAV_SPEED_DN"]
                return Tuning(
                    cruise_mps=p["WPNAV_SPEED"] / 100,
                    climb_mps=p["WPNAV_SPEED_UP"] / 100,
                    descent_mps=land_high / 100,
                    land_mps=p["LAND_SPEED"] / 100,
                    return_up_m=p["RTL_ALT"] / 100,
                    loiter_radius_m=10.0,
                    acceptance_m=p["WPNAV_RADIUS"] / 100,
                    setpoint_timeout_s=p["GUID_TIMEOUT"],
                    disarm_delay_s=p["DISARM_DELAY"],
                )
            case Kind.PLANE:
                return Tuning(
                    cruise_mps=p["AIRSPEED_CRUISE"],
                    climb_mps=5.0,
                    descent_mps=5.0,
                    land_mps=2.0,
                    return_up_m=p["RTL_ALTITUDE"],
                    loiter_radius_m=p["WP_LOITER_RAD"],
                    acceptance_m=p["WP_RADIUS"],
                    setpoint_timeout_s=3.0,
                    disarm_delay_s=0.0,
                )
        return Tuning(
            cruise_mps=p["WP_SPEED"] or p["CRUISE_SPEED"],
            climb_mps=0.0,
            descent_mps=0.0,
            land_mps=0.0,
            return_up_m=0.0,
            loiter_radius_m=p["LOIT_RADIUS"],
            acceptance_m=p["WP_RADIUS"],
            setpoint_timeout_s=3.0,
            disarm_delay_s=0.0,
        )

    def fence_rules(self, parameters: Parameters) -> FenceRules:
        """FENCE_TYPE is a set of bits: height, circle around home, shapes, lowest height."""
        p, types = parameters, int(parameters["FENCE_TYPE"])
        return FenceRules(
            enabled=p["FENCE_ENABLE"] != 0,
            zones=bool(types & 4),
            highest_m=p["FENCE_ALT_MAX"] if types & 1 else None,
            lowest_m=p["FENCE_ALT_MIN"] if types & 8 else None,
            radius_m=p["FENCE_RADIUS"] if types & 2 else None,
            mode=FENCE_ACTIONS[self.spec.kind].get(int(p["FENCE_ACTION"])),
        )

    def components(self) -> Sequence[type[Component]]:
        """What only ArduPilot has."""
        return ArduPilotFailsafes, SigningSetup

    def default_streams(self) -> Mapping[int, float]:
        """Return the few messages that are sent without a request."""
        return {dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0, dialect.MAVLINK_MSG_ID_TIMESYNC: 10.0}

    def base_mode(self, autopilot: AutopilotInterface) -> int:
        """Flags of the mode."""
        flags: int = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if autopilot.modes.mode.automatic:
            flags |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED
        if self.tells_landed:
            flags |= dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
        if self.spec.kind is Kind.COPTER or autopilot.modes.mode.name == "MANUAL":
            flags |= dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        if autopilot.arming.armed:
            flags |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
        return flags

    def active(self, autopilot: AutopilotInterface) -> bool:
        """What flies, in the air; what drives or floats, in all modes but HOLD, armed or not."""
        if not self.tells_landed:
            return autopilot.modes.mode.name != "HOLD"
        return not autopilot.body.on_ground

    def reached_text(self, autopilot: AutopilotInterface, index: int) -> str:
        """Only of waypoints and the like."""
        item = autopilot.mission.items[index]
        if item.command not in WAYPOINTS[self.spec.kind]:
            return ""
        if self.spec.kind is Kind.COPTER:
            return f"Reached command #{index}"
        place = autopilot.frame.to_point(Location(item.latitude_deg, item.longitude_deg, 0.0))
        away = f" dist {autopilot.position.distance_m(place):.0f}m"
        return f"Reached waypoint #{index}" + (away if self.spec.kind is Kind.PLANE else "")

    def mode_number(self, base_mode: int, main: int, sub: int) -> int | None:
        """The second parameter is the mode."""
        return main if base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED else None

    def mode_text(self, mode: Mode, reason: str) -> str:
        """What drives or floats does not say which."""
        return super().mode_text(mode, reason) if self.tells_landed else "Flight mode change failed"

    def checks_sensors(self, autopilot: AutopilotInterface) -> bool:
        """Unless the checks are switched off."""
        return autopilot.parameters["ARMING_CHECK"] != 0
