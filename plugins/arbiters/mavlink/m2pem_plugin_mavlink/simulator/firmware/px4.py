"""PX4 1.16: copter, rover and boat."""

import struct
from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.failsafes import Px4Failsafes
from m2pem_plugin_mavlink.simulator.firmware.px4_commands import Px4Commands
from m2pem_plugin_mavlink.simulator.firmware.px4_components import (
    LandingDetector,
    OffboardMonitor,
    Px4Reports,
    SatelliteMonitor,
)
from m2pem_plugin_mavlink.simulator.firmware.px4_modes import (
    DESCEND,
    FENCE_ACTIONS,
    HOLD,
    LAND,
    MISSION,
    NAMES,
    OFFBOARD,
    ORBIT,
    POSITION,
    RETURN,
    ROLES,
    TAKEOFF,
    custom_mode,
)
from m2pem_plugin_mavlink.simulator.firmware.px4_parameters import parameters_of, whole
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    FenceRules,
    Firmware,
    Mode,
    Parameters,
    Tuning,
)
from m2pem_plugin_mavlink.simulator.maneuvers import Descend, HoldPosition, Land, Stop
from m2pem_plugin_mavlink.simulator.missions.execution import MissionAvailability, Px4AutoMission
from m2pem_plugin_mavlink.simulator.px4_maneuvers import Hold, Offboard, Orbit, Px4Return, TakeOff
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

TYPES = {
    Kind.COPTER: dialect.MAV_TYPE_QUADROTOR,
    Kind.ROVER: dialect.MAV_TYPE_GROUND_ROVER,
    Kind.BOAT: dialect.MAV_TYPE_SURFACE_BOAT,
}

STREAMS: Mapping[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 1.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 0.1,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0.1,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 0.2,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 0.2,
    dialect.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    dialect.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: 1.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 0.25,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 10.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 1.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 2.0,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 2.0,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 2.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1.0,
    dialect.MAVLINK_MSG_ID_ORBIT_EXECUTION_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: 2.0,
    dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: 0.5,
}
"""What is sent unasked, in seconds; those that this vehicle has."""


def modes_of(kind: Kind) -> tuple[Mode, ...]:
    """The modes of a kind of vehicle. Its sticks, if it has any, are in the middle."""
    by_hand = HoldPosition if kind is Kind.COPTER else Stop
    everywhere = (
        Mode(custom_mode(1), "MANUAL", by_hand, False, armable=True, automatic=False),
        Mode(custom_mode(5), "ACRO", by_hand, False, armable=True, automatic=False),
        Mode(custom_mode(7), "STABILIZED", by_hand, False, armable=True, automatic=False),
        Mode(POSITION, "POSCTL", HoldPosition, armable=True, automatic=False),
        Mode(HOLD, "AUTO.LOITER", Hold, armable=True),
        Mode(MISSION, "AUTO.MISSION", Px4AutoMission, armable=True),
        Mode(RETURN, "AUTO.RTL", Px4Return),
        Mode(OFFBOARD, "OFFBOARD", Offboard, armable=True),
    )
    if kind is not Kind.COPTER:
        return everywhere
    return (
        *everywhere,
        Mode(custom_mode(2), "ALTCTL", HoldPosition, False, armable=True, automatic=False),
        Mode(ORBIT, "POSCTL.ORBIT", Orbit),
        Mode(TAKEOFF, "AUTO.TAKEOFF", TakeOff, armable=True),
        Mode(LAND, "AUTO.LAND", Land, needs_position=False),
        Mode(DESCEND, "AUTO.DESCEND", Descend, needs_position=False, automatic=False),
    )


class Px4(Firmware):
    """PX4 on one kind of vehicle.

    Raises:
        ValueError: it is a plane.
    """

    autopilot_id = dialect.MAV_AUTOPILOT_PX4
    types = TYPES
    version = 1 << 24 | 16 << 16 | 0 << 8 | dialect.FIRMWARE_VERSION_TYPE_DEV
    capabilities = (
        dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | dialect.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
        | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        | dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    )
    is_ardupilot = False
    tells_landed = True
    asks_for_items_as_int = True
    unknown_reports = frozenset(
        {dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT, dialect.MAVLINK_MSG_ID_FENCE_STATUS}
    )
    gimbal_needs_control = True
    armed_text, disarmed_text = "Armed by {}", "Disarmed by {}"
    capacity = "BAT1_CAPACITY"
    reason_position = "No valid position estimate"
    reason_home = reason_position
    reason_sensors = "Sensors are still calibrating"
    reason_satellites = "GPS fix too low"
    arming_denied = "Arming denied: Resolve system health failures first"
    loop_hz = 1000.0
    first_mode = HOLD
    vtol_state = dialect.MAV_VTOL_STATE_UNDEFINED
    roles = ROLES

    def __init__(self, spec: VehicleSpec) -> None:
        if spec.kind not in TYPES:
            raise ValueError(
                f"a {spec.kind} with PX4 is not simulated; there are: {', '.join(TYPES)}, "
                "or a plane with ArduPilot"
            )
        super().__init__(spec)

    def modes(self) -> Sequence[Mode]:
        """The modes of the vehicle."""
        return modes_of(self.spec.kind)

    def parameters(self) -> Mapping[str, float]:
        """The defaults, and its own number."""
        own = {"MAV_SYS_ID": self.spec.system, "MAV_TYPE": self.vehicle_type}
        return {**parameters_of(self.spec.kind), **own}

    def parameter_type(self, name: str) -> int:
        """Whole numbers are sent as such."""
        int32, real32 = dialect.MAV_PARAM_TYPE_INT32, dialect.MAV_PARAM_TYPE_REAL32
        type_: int = int32 if whole(name) else real32
        return type_

    def parameter_to_wire(self, name: str, value: float) -> float:
        """The float whose bytes are those of the whole number."""
        if not whole(name):
            return value
        number: float = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return number

    def parameter_from_wire(self, name: str, value: float) -> float:
        """The whole number whose bytes the float has."""
        if not whole(name):
            return value
        return float(struct.unpack("<i", struct.pack("<f", value))[0])

    def tuning(self, parameters: Parameters) -> Tuning:
        """Metres and seconds."""
        p, copter = parameters, self.spec.kind is Kind.COPTER
        return Tuning(
            cruise_mps=p["MPC_XY_CRUISE"] if copter else p["RO_SPEED_LIM"],
            climb_mps=p["MPC_Z_V_AUTO_UP"] if copter else 0.0,
            descent_mps=p["MPC_Z_V_AUTO_DN"] if copter else 0.0,
            land_mps=p["MPC_LAND_SPEED"] if copter else 0.0,
            return_up_m=p["RTL_RETURN_ALT"] if copter else 0.0,
            loiter_radius_m=p["NAV_LOITER_RAD"] if copter else p["NAV_ACC_RAD"],
            acceptance_m=p["NAV_ACC_RAD"],
            setpoint_timeout_s=p["COM_OF_LOSS_T"] + 1.0,
            disarm_delay_s=p["COM_DISARM_PRFLT"] + p["COM_SPOOLUP_TIME"],
        )

    def fence_rules(self, parameters: Parameters) -> FenceRules:
        """A fence that was uploaded always holds, unless there is no action."""
        action = int(parameters["GF_ACTION"])
        return FenceRules(
            enabled=action != 0,
            highest_m=parameters["GF_MAX_VER_DIST"] or None,
            radius_m=parameters["GF_MAX_HOR_DIST"] or None,
            mode=FENCE_ACTIONS.get(action),
            text="Geofence exceeded ({})",
        )

    def default_streams(self) -> Mapping[int, float]:
        """Nearly everything."""
        return STREAMS

    def base_mode(self, autopilot: AutopilotInterface) -> int:
        """Flags of the mode."""
        flags: int = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if autopilot.modes.mode.automatic:
            flags |= dialect.MAV_MODE_FLAG_AUTO_ENABLED
            flags |= dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
            flags |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED
        else:
            flags |= dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
            if autopilot.modes.mode.number != DESCEND:
                flags |= dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        if autopilot.arming.armed:
            flags |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
        return flags

    def active(self, autopilot: AutopilotInterface) -> bool:
        """As long as it is armed."""
        return autopilot.arming.armed

    def mode_number(self, base_mode: int, main: int, sub: int) -> int | None:
        """Parameters 2 and 3 are the main and the sub mode."""
        if not base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return None
        return custom_mode(main, sub)

    def components(self) -> Sequence[type[Component]]:
        """What only PX4 has."""
        return (
            Px4Failsafes,
            OffboardMonitor,
            MissionAvailability,
            Px4Commands,
            Px4Reports,
            LandingDetector,
            SatelliteMonitor,
        )

    def mode_entered(self, autopilot: AutopilotInterface) -> None:
        """It may be the one after disarming."""
        autopilot.component(LandingDetector).entered(autopilot.modes.mode)

    def arming_text(self, reason: str) -> str:
        """The reason; some are warnings while it is not armed."""
        failure = "" if reason == self.reason_satellites else " Fail"
        return f"Preflight{failure}: {reason}"

    def check_text(self, reason: str) -> str:
        """In the words of a vehicle that does not arm."""
        return self.arming_text(reason)

    def mode_text(self, mode: Mode, reason: str) -> str:
        """Without a reason."""
        return f"Switching to {NAMES.get(mode.number, mode.name)} is currently not available"
