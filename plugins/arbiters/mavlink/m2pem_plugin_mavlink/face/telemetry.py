"""The messages of one vehicle, made of m2pem's telemetry. What is not known is left out, or has the
value that the message has for it."""

import math
from collections.abc import Callable, Mapping
from typing import TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import RunStatus, VehicleState, ellipsoidal_m
from m2pem_plugin_mavlink.face import modes
from m2pem_plugin_mavlink.face.plan_messages import plan_message
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.vehicle.telemetry_decoder import enu_yaw

TYPES: Mapping[str, int] = {
    "ground": dialect.MAV_TYPE_GROUND_ROVER,
    "air": dialect.MAV_TYPE_QUADROTOR,
    "surface": dialect.MAV_TYPE_SURFACE_BOAT,
    "subsurface": dialect.MAV_TYPE_SUBMARINE,
}
MAVLINK_VERSION = 3
UINT16_UNKNOWN = 0xFFFF
SLOWEST_M_S = 0.1
"""Below it, a course over ground is not known."""


CAPABILITIES: int = (
    dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | dialect.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
)
_SENSORS: int = (
    dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | dialect.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | dialect.MAV_SYS_STATUS_SENSOR_3D_MAG
    | dialect.MAV_SYS_STATUS_SENSOR_GPS
    | dialect.MAV_SYS_STATUS_AHRS
    | dialect.MAV_SYS_STATUS_SENSOR_BATTERY
    | dialect.MAV_SYS_STATUS_PREARM_CHECK
)
"""Programs of MAVSDK wait until the first three are healthy, too (`health_all_ok`)."""

Maker: TypeAlias = Callable[[ShownVehicle], Message | None]


def wrapped_degrees(yaw_rad: float) -> float:
    """Return a heading (from north, clockwise, 0 to 360) of a yaw from east."""
    return (90.0 - math.degrees(yaw_rad)) % 360.0


def boot_ms(state: VehicleState) -> int:
    """Return the time of a state, as a number that fits `time_boot_ms`."""
    return state.time_us // 1000 & 0xFFFFFFFF


def heartbeat(vehicle: ShownVehicle) -> Message:
    """HEARTBEAT of the autopilot."""
    mode = vehicle.mode
    armed = vehicle.armed
    base = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if armed:
        base |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
    if mode is modes.MANUAL:
        base |= dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    else:
        base |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED | dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
        if mode is not modes.GUIDED:
            base |= dialect.MAV_MODE_FLAG_AUTO_ENABLED
    return message_type("HEARTBEAT").make(
        type=vehicle.type,
        autopilot=dialect.MAV_AUTOPILOT_GENERIC,
        base_mode=base,
        custom_mode=mode.number,
        system_status=dialect.MAV_STATE_ACTIVE if armed else dialect.MAV_STATE_STANDBY,
        mavlink_version=MAVLINK_VERSION,
    )


def _global_position(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None or state.position is None:
        return None
    east, north, up = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    heading = UINT16_UNKNOWN
    if state.yaw_rad is not None:
        heading = round(wrapped_degrees(state.yaw_rad) * 100) % 36_000
    return message_type("GLOBAL_POSITION_INT").make(
        time_boot_ms=boot_ms(state),
        lat=_degrees_e7(state.position.latitude_deg),
        lon=_degrees_e7(state.position.longitude_deg),
        alt=_int32(state.position.altitude_m * 1000),
        relative_alt=_int32(_height_m(vehicle, state) * 1000),
        vx=_int16(north * 100),
        vy=_int16(east * 100),
        vz=_int16(-up * 100),
        hdg=heading,
    )


def _attitude(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None or state.yaw_rad is None:
        return None
    return message_type("ATTITUDE").make(
        time_boot_ms=boot_ms(state),
        roll=state.roll_rad,
        pitch=-state.pitch_rad,
        yaw=enu_yaw(state.yaw_rad),
    )


def _vfr_hud(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None or state.position is None:
        return None
    east, north, up = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    speed = math.hypot(east, north)
    heading = 0 if state.yaw_rad is None else round(wrapped_degrees(state.yaw_rad)) % 360
    return message_type("VFR_HUD").make(
        groundspeed=speed, heading=heading, alt=state.position.altitude_m, climb=up
    )


def _sys_status(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None:
        return None
    present = _SENSORS if state.ready is not None else _SENSORS & ~_PREARM
    health = present if state.position is not None else present & ~_POSITION
    if state.ready is False:
        health &= ~_PREARM
    fences, at = vehicle.fences, state.position
    if fences:
        present |= _GEOFENCE
    if at is None or all(each.outside_m(at.latlon) <= BREACH_M for each in fences):
        health |= _GEOFENCE  # without a fence, too: MAVProxy says "fence breach" if it is missing
    return message_type("SYS_STATUS").make(
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=present,
        onboard_control_sensors_health=health,
        voltage_battery=UINT16_UNKNOWN,
        current_battery=-1,
        battery_remaining=_percent(state),
    )


_GEOFENCE: int = dialect.MAV_SYS_STATUS_GEOFENCE
BREACH_M = 1.0
"""A vehicle that is farther than this from where it may be has breached the fence."""

_PREARM: int = dialect.MAV_SYS_STATUS_PREARM_CHECK
_POSITION: int = dialect.MAV_SYS_STATUS_SENSOR_GPS | dialect.MAV_SYS_STATUS_AHRS


def _battery(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None or state.battery_fraction is None:
        return None
    return message_type("BATTERY_STATUS").make(
        temperature=0x7FFF,
        voltages=(UINT16_UNKNOWN,) * 10,
        current_battery=-1,
        current_consumed=-1,
        energy_consumed=-1,
        battery_remaining=_percent(state),
    )


def _gps(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None:
        return None
    unknown = {"eph": UINT16_UNKNOWN, "epv": UINT16_UNKNOWN, "satellites_visible": 255}
    make = message_type("GPS_RAW_INT").make
    if state.position is None:
        return make(time_usec=state.time_us, vel=UINT16_UNKNOWN, cog=UINT16_UNKNOWN, **unknown)
    east, north, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    speed = math.hypot(east, north)
    course = UINT16_UNKNOWN
    if speed > SLOWEST_M_S:
        course = round(wrapped_degrees(math.atan2(north, east)) * 100) % 36_000
    return make(
        time_usec=state.time_us,
        fix_type=dialect.GPS_FIX_TYPE_3D_FIX,
        lat=_degrees_e7(state.position.latitude_deg),
        lon=_degrees_e7(state.position.longitude_deg),
        alt=_int32(state.position.altitude_m * 1000),
        alt_ellipsoid=_int32(
            ellipsoidal_m(*state.position.latlon, state.position.altitude_m) * 1000
        ),
        vel=min(round(speed * 100), UINT16_UNKNOWN - 1),
        cog=course,
        **unknown,
    )


def _landed(vehicle: ShownVehicle) -> Message | None:
    if vehicle.domain != "air":
        landed = dialect.MAV_LANDED_STATE_ON_GROUND
    elif vehicle.behavior in ("takeoff", "land") and vehicle.airborne:
        taking_off = vehicle.behavior == "takeoff"
        landed = (
            dialect.MAV_LANDED_STATE_TAKEOFF if taking_off else dialect.MAV_LANDED_STATE_LANDING
        )
    elif vehicle.state is None or vehicle.state.altitude_above_home_m is None:
        landed = dialect.MAV_LANDED_STATE_UNDEFINED
    else:
        in_air = vehicle.airborne
        landed = dialect.MAV_LANDED_STATE_IN_AIR if in_air else dialect.MAV_LANDED_STATE_ON_GROUND
    return message_type("EXTENDED_SYS_STATE").make(landed_state=landed)


def _home(vehicle: ShownVehicle) -> Message | None:
    home = vehicle.home
    if home is None:
        return None
    return message_type("HOME_POSITION").make(
        latitude=_degrees_e7(home.latitude_deg),
        longitude=_degrees_e7(home.longitude_deg),
        altitude=_int32(home.altitude_m * 1000),
        q=(1.0, 0.0, 0.0, 0.0),
        approach_x=math.nan,
        approach_y=math.nan,
        approach_z=math.nan,
        time_usec=vehicle.state.time_us if vehicle.state is not None else 0,
    )


def _mission_current(vehicle: ShownVehicle) -> Message:
    plan, run = vehicle.plan, vehicle.plan_run
    items, current = len(plan.items), plan.current
    state = dialect.MISSION_STATE_ACTIVE if items else dialect.MISSION_STATE_NO_MISSION
    if vehicle.shows_upload:
        items, current = len(vehicle.uploaded.items), 0
        state = dialect.MISSION_STATE_NOT_STARTED
        if run is not None and (vehicle.runs_plan or run.plan.id == vehicle.uploaded.id):
            items, current = len(run.plan.items), run.current
            state = _PLAN_STATES.get(run.status, dialect.MISSION_STATE_NOT_STARTED)
    return plan_message("MISSION_CURRENT").make(
        seq=current,
        total=items or UINT16_UNKNOWN,
        mission_state=state,
        mission_mode=1 if vehicle.mode is modes.MISSION else 2,
        mission_id=vehicle.uploaded.id if vehicle.shows_upload else 0,
        fence_id=vehicle.uploaded_fence.id,
        rally_points_id=vehicle.rally_points.id,
    )


_PLAN_STATES: Mapping[RunStatus, int] = {
    RunStatus.RUNNING: dialect.MISSION_STATE_ACTIVE,
    RunStatus.PAUSED: dialect.MISSION_STATE_PAUSED,
    RunStatus.COMPLETED: dialect.MISSION_STATE_COMPLETE,
}


def _system_time(vehicle: ShownVehicle) -> Message | None:
    state = vehicle.state
    if state is None:
        return None
    return message_type("SYSTEM_TIME").make(
        time_unix_usec=state.time_us, time_boot_ms=boot_ms(state)
    )


def _version(vehicle: ShownVehicle) -> Message:
    return message_type("AUTOPILOT_VERSION").make(
        capabilities=CAPABILITIES, uid=vehicle.system, vendor_id=0, product_id=0
    )


_ON_REQUEST: Mapping[str, Maker] = {
    "AUTOPILOT_VERSION": _version,
    "SYSTEM_TIME": _system_time,
}
_PERIODIC: Mapping[str, Maker] = {
    "HEARTBEAT": heartbeat,
    "GLOBAL_POSITION_INT": _global_position,
    "ATTITUDE": _attitude,
    "VFR_HUD": _vfr_hud,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery,
    "GPS_RAW_INT": _gps,
    "EXTENDED_SYS_STATE": _landed,
    "HOME_POSITION": _home,
    "MISSION_CURRENT": _mission_current,
}
MAKERS: Mapping[int, Maker] = {
    **{message_type(name).id: maker for name, maker in {**_PERIODIC, **_ON_REQUEST}.items()},
    modes.CURRENT_MODE: lambda vehicle: modes.current_mode(vehicle.mode),
}
"""What the autopilot sends, by message id; None: not known now."""


def _percent(state: VehicleState) -> int:
    if state.battery_fraction is None:
        return -1
    return max(0, min(100, round(state.battery_fraction * 100)))


def _height_m(vehicle: ShownVehicle, state: VehicleState) -> float:
    if state.altitude_above_home_m is not None:
        return state.altitude_above_home_m
    if vehicle.home is not None and state.position is not None:
        return state.position.altitude_m - vehicle.home.altitude_m
    return 0.0


def _degrees_e7(degrees: float) -> int:
    return _int32(degrees * 1e7)


def _int32(value: float) -> int:
    return _bounded(value, 2**31)


def _int16(value: float) -> int:
    return _bounded(value, 2**15)


def _bounded(value: float, limit: int) -> int:
    if not math.isfinite(value):
        return 0
    return max(-limit, min(limit - 1, round(value)))
