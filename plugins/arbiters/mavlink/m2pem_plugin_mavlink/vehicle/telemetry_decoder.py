"""Decodes the messages of a vehicle into `AutopilotState`, in SI units and east-north-up."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import GeoPosition
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.vehicle.modes import Modes
from m2pem_plugin_mavlink.vehicle.state import AutopilotState
from m2pem_plugin_mavlink.vehicle.touchdown import Touchdown

BOOT_TIME_BACK_MS = 10_000
"""Messages overtake each other by less than this, also in simulated time that passes ten times as
fast. No autopilot is ready so soon after it was switched on."""

FASTEST = 10.0
"""An autopilot has not restarted if its clock runs for longer than this many times the time since
its last message, and `BOOT_TIME_BACK_MS`: that message is late."""

STANDS_BELOW_M, STANDS_BELOW_M_S = 0.5, 0.3

_UNKNOWN_UINT16 = 0xFFFF
_IGNORES_POSITION = 0b111
"""POSITION_TARGET_TYPEMASK."""
_PREARM = dialect.MAV_SYS_STATUS_PREARM_CHECK
_ARMED = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_LANDED = {
    dialect.MAV_LANDED_STATE_ON_GROUND: True,
    dialect.MAV_LANDED_STATE_IN_AIR: False,
    dialect.MAV_LANDED_STATE_TAKEOFF: False,
    dialect.MAV_LANDED_STATE_LANDING: False,
}
_BREACHES = {
    dialect.FENCE_BREACH_MINALT: "lowest altitude",
    dialect.FENCE_BREACH_MAXALT: "highest altitude",
    dialect.FENCE_BREACH_BOUNDARY: "boundary",
}


def enu_yaw(heading_rad: float) -> float:
    """Convert a heading (from north, clockwise) to a yaw (from east, counter-clockwise), or a yaw
    to a heading, in -pi..pi."""
    return math.remainder(math.pi / 2 - heading_rad, math.tau)


class TelemetryDecoder:
    """`take` receives each message of the autopilot, in order.

    `flies`: the vehicle leaves the ground. The reported height above home of other vehicles is not
    used: some of their autopilots report the height above mean sea level.
    """

    def __init__(self, state: AutopilotState, modes: Modes, *, flies: bool) -> None:
        self.state = state
        self.modes = modes
        self.flies = flies
        self._boot_ms = 0
        self._landed_is_said: bool | None = None
        self._touchdown = Touchdown()
        if not flies:
            state.landed = True
        named: Mapping[str, Callable[[Any], None]] = {
            "HEARTBEAT": self._heartbeat,
            "SYS_STATUS": self._sys_status,
            "GPS_RAW_INT": self._gps,
            "ATTITUDE": self._attitude,
            "LOCAL_POSITION_NED": self._local_position,
            "GLOBAL_POSITION_INT": self._global_position,
            "MISSION_CURRENT": self._mission_current,
            "MISSION_ITEM_REACHED": self._mission_item_reached,
            "EKF_STATUS_REPORT": self._estimator,
            "ESTIMATOR_STATUS": self._estimator,
            "BATTERY_STATUS": self._battery,
            "HOME_POSITION": self._home,
            "EXTENDED_SYS_STATE": self._extended_sys_state,
            "TERRAIN_REPORT": self._terrain,
            "ALTITUDE": self._altitude,
            "FENCE_STATUS": self._fence,
            "POSITION_TARGET_GLOBAL_INT": self._target,
        }
        self._takers = {message_type(name).id: take for name, take in named.items()}

    @property
    def wants(self) -> frozenset[int]:
        """The ids of the messages that are decoded."""
        return frozenset(self._takers)

    def take(self, message: Message, now_s: float) -> None:
        """Decode a message, unless it is late."""
        state = self.state
        id_ = message.TYPE.id
        if state.boot_s is None:
            self._booted(now_s)
        if (boot_ms := getattr(message, "time_boot_ms", None)) is not None:
            if self._is_late(boot_ms, now_s):
                return
            self._boot_ms = max(boot_ms, self._boot_ms)
            state.clock_s = now_s
        state.at_s = state.messages_s[id_] = now_s
        self._takers[id_](message)
        if id_ == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            state.heartbeat_s = now_s
        state.changes += 1

    def _booted(self, now_s: float) -> None:
        """The vehicle sends for the first time, or its clock has gone back."""
        self.state.forget_the_last_boot()
        self._landed_is_said = None
        self._touchdown = Touchdown()
        if not self.flies:
            self.state.landed = True
        self.state.boot_s = now_s
        self.state.boots += 1
        self._boot_ms = 0

    def _is_late(self, boot_ms: int, now_s: float) -> bool:
        """Whether a message was made long before others that came. A clock that has gone back as it
        does by a restart is that of another boot."""
        if boot_ms + BOOT_TIME_BACK_MS >= self._boot_ms:
            return False
        since_s = now_s - (now_s if self.state.clock_s is None else self.state.clock_s)
        if boot_ms > FASTEST * since_s * 1e3 + BOOT_TIME_BACK_MS:
            return True
        self._booted(now_s)
        return False

    def _heartbeat(self, message: Any) -> None:
        self.state.custom_mode = message.custom_mode
        self.state.mode = self.modes.purpose(message.custom_mode)
        self.state.armed = bool(message.base_mode & _ARMED)
        if self.state.at_s is not None:
            self._touchdown.take_heartbeat(self.state.armed, self.state.at_s)
        self._judge_landed()

    def _sys_status(self, message: Any) -> None:
        state = self.state
        used = message.onboard_control_sensors_present & message.onboard_control_sensors_enabled
        healthy = bool(message.onboard_control_sensors_health & _PREARM)
        state.prearm_passed = healthy if used & _PREARM else None
        if message.battery_remaining >= 0:
            state.battery_fraction = min(message.battery_remaining, 100) / 100.0

    def _battery(self, message: Any) -> None:
        if message.id == 0 and message.battery_remaining >= 0:
            self.state.battery_fraction = min(message.battery_remaining, 100) / 100.0

    def _gps(self, message: Any) -> None:
        self.state.gps_fix = message.fix_type

    def _attitude(self, message: Any) -> None:
        if all(map(math.isfinite, (message.roll, message.pitch, message.yaw))):
            state = self.state
            # NED to ENU turns the axes of the body from forward-right-down to forward-left-up.
            state.roll_rad, state.pitch_rad = message.roll, -message.pitch
            state.yaw_rad = enu_yaw(message.yaw)

    def _local_position(self, message: Any) -> None:
        north, east, down = message.vx, message.vy, message.vz
        if all(map(math.isfinite, (north, east, down))):
            self.state.velocity_enu_m_s = (east, north, -down)

    def _global_position(self, message: Any) -> None:
        state = self.state
        position = _place(message.lat, message.lon, message.alt)
        if position is None:
            return
        state.position = position
        if self.flies:
            state.altitude_above_home_m = message.relative_alt / 1000.0
        elif state.home is not None:
            state.altitude_above_home_m = position.altitude_m - state.home.altitude_m
        state.velocity_enu_m_s = (message.vy / 100.0, message.vx / 100.0, -message.vz / 100.0)
        if state.yaw_rad is None and message.hdg != _UNKNOWN_UINT16:
            state.yaw_rad = enu_yaw(math.radians(message.hdg / 100.0))
        if self.flies and state.at_s is not None and state.altitude_above_home_m is not None:
            height_m, velocity = state.altitude_above_home_m, state.velocity_enu_m_s
            self._touchdown.take_position(state.at_s, height_m, position.altitude_m, velocity)
        self._judge_landed()

    def _mission_current(self, message: Any) -> None:
        state = self.state
        state.mission_sequence = message.seq
        if message.total:  # 0: the autopilot does not report it
            state.mission_total = 0 if message.total == _UNKNOWN_UINT16 else message.total
        state.mission_state = message.mission_state or None

    def _mission_item_reached(self, message: Any) -> None:
        self.state.reached_sequence = message.seq

    def _estimator(self, message: Any) -> None:
        self.state.estimator_flags = message.flags

    def _home(self, message: Any) -> None:
        self.state.home = _place(message.latitude, message.longitude, message.altitude)

    def _target(self, message: Any) -> None:
        """Read the target; autopilots report its height above mean sea level."""
        ignored = message.type_mask & _IGNORES_POSITION
        place = _place(message.lat_int, message.lon_int, message.alt * 1e3)
        self.state.target = None if ignored else place

    def _extended_sys_state(self, message: Any) -> None:
        landed = _LANDED.get(message.landed_state)
        if landed is not None and self.flies:
            self._landed_is_said = landed
            self._judge_landed()

    def _terrain(self, message: Any) -> None:
        if message.loaded and math.isfinite(message.current_height):
            self.state.altitude_above_terrain_m = message.current_height

    def _altitude(self, message: Any) -> None:
        if 0.0 <= message.bottom_clearance < math.inf:  # below 0: not known
            self.state.altitude_above_terrain_m = message.bottom_clearance

    def _fence(self, message: Any) -> None:
        """Read whether the vehicle is outside of its fence (mavlink.io, "FENCE_STATUS")."""
        state = self.state
        breached = message.breach_status != 0
        if breached and not state.fence_breach:
            state.fence_breached_s = state.at_s
        state.fence_breach = _BREACHES.get(message.breach_type, "fence") if breached else ""

    def _judge_landed(self) -> None:
        """Judge whether an aircraft is on the ground, by its report or, without one, by its
        motors, height and speed; of one that was disarmed both are true only once it rests."""
        state, landed = self.state, self._landed_is_said
        if not self.flies:
            return
        if landed is None and state.armed is False:
            landed = True
        elif landed is None and state.altitude_above_home_m is not None:
            low = state.altitude_above_home_m < STANDS_BELOW_M
            landed = low and state.speed_m_s < STANDS_BELOW_M_S
        state.fell_from_m = self._touchdown.fell_from_m
        if landed is not None:
            state.landed = landed and self._touchdown.has_landed(state.at_s or 0.0)


def _place(latitude_e7: int, longitude_e7: int, altitude_mm: float) -> GeoPosition | None:
    """Return the position; None for values that autopilots send while they know none, or that are
    impossible."""
    latitude, longitude = latitude_e7 / 1e7, longitude_e7 / 1e7
    if (latitude_e7 == 0 and longitude_e7 == 0) or abs(latitude) > 90.0 or abs(longitude) > 180.0:
        return None
    return GeoPosition(latitude, longitude, altitude_mm / 1000.0)
