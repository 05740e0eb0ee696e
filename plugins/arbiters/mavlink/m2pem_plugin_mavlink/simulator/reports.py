"""Telemetry of position, attitude and health, and texts for people (STATUSTEXT)."""

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.fence import Fence
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    makes,
    on_message,
)
from m2pem_plugin_mavlink.simulator.messages import Peer, Sender
from m2pem_plugin_mavlink.simulator.specification import SURFACE

CHUNK = 50
"""Bytes of text in one message (MAVLink common, STATUSTEXT)."""
RECENT_S = 2.5
"""For how long a heartbeat of a ground station counts (PX4: HEARTBEAT_TIMEOUT_US)."""


class Texts(Component):
    """Says texts, as the firmware does."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._next_id = 1
        self._received_s: dict[Peer, float] = {}
        self._said_to: Counter[Peer] = Counter()

    @on_message("HEARTBEAT")
    def _received(self, message: Any, sender: Sender) -> None:
        if message.type == dialect.MAV_TYPE_GCS:
            self._received_s[sender.peer] = self.autopilot.now_s

    def say(self, text: str, severity: int) -> None:
        """A text. ArduPilot gives ids from 1 on to texts that do not fit into one message. PX4
        says them only on links where it has received a ground station, and numbers all texts of a
        link from 0 on."""
        data = text.encode("ascii", "replace")
        if not self.autopilot.firmware.is_ardupilot:
            for peer, received_s in self._received_s.items():
                if self.autopilot.now_s - received_s <= RECENT_S:
                    for message in _chunks(data, severity, self._said_to[peer]):
                        self.autopilot.send(message, peer)
                    self._said_to[peer] += 1
            return
        id_ = 0
        if len(data) >= CHUNK:
            id_, self._next_id = self._next_id, self._next_id % 0xFFFF + 1
        for message in _chunks(data, severity, id_):
            self.autopilot.send(message)


def _chunks(data: bytes, severity: int, id_: int) -> Iterator[Any]:
    """The messages of a text; the last one is not full."""
    for number, start in enumerate(range(0, len(data) + 1, CHUNK)):
        chunk = data[start : start + CHUNK]
        yield dialect.MAVLink_statustext_message(severity, chunk, id_ & 0xFFFF, number)


SENSORS = (
    dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | dialect.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | dialect.MAV_SYS_STATUS_SENSOR_3D_MAG
    | dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | dialect.MAV_SYS_STATUS_SENSOR_GPS
    | dialect.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    | dialect.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
    | dialect.MAV_SYS_STATUS_SENSOR_YAW_POSITION
    | dialect.MAV_SYS_STATUS_SENSOR_BATTERY
    | dialect.MAV_SYS_STATUS_AHRS
)


PLACE_ALONE = 0xFFF8
"""POSITION_TARGET_TYPEMASK."""


class Reports(Component):
    """What ground stations show."""

    @makes(dialect.MAVLINK_MSG_ID_SYS_STATUS)
    def _sys_status(self) -> Any:
        autopilot = self.autopilot
        present = SENSORS | dialect.MAV_SYS_STATUS_PREARM_CHECK
        health = SENSORS
        if not autopilot.estimator.ready:
            health &= ~dialect.MAV_SYS_STATUS_AHRS
        if autopilot.estimator.gps_lost:
            health &= ~dialect.MAV_SYS_STATUS_SENSOR_GPS
        if autopilot.arming.armed or autopilot.arming.healthy:
            health |= dialect.MAV_SYS_STATUS_PREARM_CHECK
        fence = autopilot.component(Fence)
        present |= dialect.MAV_SYS_STATUS_GEOFENCE * fence.rules.enabled
        health |= dialect.MAV_SYS_STATUS_GEOFENCE * (fence.breach is None)
        return dialect.MAVLink_sys_status_message(
            present,
            present,
            health,
            50,
            round(autopilot.battery.voltage_v * 1000),
            round(autopilot.battery.current_a * 100),
            autopilot.battery.percent,
            *[0] * 6,
        )

    @makes(dialect.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT)
    def _target(self) -> Any:
        """Return only the position with its height above mean sea level; nothing without a
        target."""
        autopilot, point = self.autopilot, self.autopilot.target_point
        if point is None:
            return None
        place = autopilot.frame.to_location(point)
        return dialect.MAVLink_position_target_global_int_message(
            autopilot.boot_ms,
            dialect.MAV_FRAME_GLOBAL,
            PLACE_ALONE,
            *place.scaled[:2],
            place.altitude_amsl_m,
            *[0.0] * 8,
        )

    @makes(dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    def _global_position(self) -> Any:
        """Before the estimator is ready, ArduPilot says zeros."""
        autopilot, body = self.autopilot, self.autopilot.body
        place = autopilot.frame.to_location(autopilot.position)
        known = autopilot.estimator.ready or autopilot.estimator.found
        return dialect.MAVLink_global_position_int_message(
            autopilot.boot_ms,
            *(place.scaled if known else (0, 0, 0)),
            round((body.up_m - autopilot.home.point.up_m) * 1e3),
            round(body.north_mps * 100),
            round(body.east_mps * 100),
            round(-body.up_mps * 100),
            round(math.degrees(body.yaw_rad) * 100) % 36000,
        )

    @makes(dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
    def _local_position(self) -> Any:
        """Nothing before there is a position."""
        body = self.autopilot.body
        if not self.autopilot.estimator.ready:
            return None
        return dialect.MAVLink_local_position_ned_message(
            self.autopilot.boot_ms,
            body.north_m,
            body.east_m,
            -body.up_m,
            body.north_mps,
            body.east_mps,
            -body.up_mps,
        )

    @makes(dialect.MAVLINK_MSG_ID_ATTITUDE)
    def _attitude(self) -> Any:
        body = self.autopilot.body
        return dialect.MAVLink_attitude_message(
            self.autopilot.boot_ms,
            body.roll_rad,
            body.pitch_rad,
            body.yaw_rad,
            0.0,
            0.0,
            body.yaw_rps,
        )

    @makes(dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION)
    def _quaternion(self) -> Any:
        body = self.autopilot.body
        cr, sr = math.cos(body.roll_rad / 2), math.sin(body.roll_rad / 2)
        cp, sp = math.cos(body.pitch_rad / 2), math.sin(body.pitch_rad / 2)
        cy, sy = math.cos(body.yaw_rad / 2), math.sin(body.yaw_rad / 2)
        return dialect.MAVLink_attitude_quaternion_message(
            self.autopilot.boot_ms,
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            0.0,
            0.0,
            body.yaw_rps,
        )

    @makes(dialect.MAVLINK_MSG_ID_VFR_HUD)
    def _hud(self) -> Any:
        autopilot, body = self.autopilot, self.autopilot.body
        altitude_m = autopilot.frame.origin.altitude_amsl_m + body.up_m
        return dialect.MAVLink_vfr_hud_message(
            body.ground_speed_mps,
            body.ground_speed_mps,
            round(math.degrees(body.yaw_rad)) % 360,
            0 if not autopilot.arming.armed else 40 if body.on_ground else 50,
            altitude_m,
            body.up_mps,
        )

    @makes(dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    def _extended_state(self) -> Any:
        autopilot = self.autopilot
        state: int = dialect.MAV_LANDED_STATE_IN_AIR
        if not autopilot.firmware.tells_landed:
            state = dialect.MAV_LANDED_STATE_UNDEFINED
        elif (
            autopilot.body.on_ground or autopilot.spec.kind in SURFACE or not autopilot.arming.armed
        ):
            state = dialect.MAV_LANDED_STATE_ON_GROUND
        elif autopilot.modes.maneuver.taking_off:
            state = dialect.MAV_LANDED_STATE_TAKEOFF
        elif autopilot.modes.maneuver.landing:
            state = dialect.MAV_LANDED_STATE_LANDING
        return dialect.MAVLink_extended_sys_state_message(autopilot.firmware.vtol_state, state)

    @makes(dialect.MAVLINK_MSG_ID_TERRAIN_REPORT)
    def _terrain(self) -> Any:
        """There are no terrain data, so that the height is that above the sea. What drives or
        floats has none to tell."""
        autopilot = self.autopilot
        if not autopilot.firmware.tells_landed:
            return None
        place = autopilot.frame.to_location(autopilot.position)
        known = autopilot.estimator.ready or autopilot.estimator.found
        return dialect.MAVLink_terrain_report_message(
            *(place.scaled[:2] if known else (0, 0)),
            0,
            0.0,
            place.altitude_amsl_m if known else 0.0,
            504,
            0,
        )

    @makes(dialect.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT)
    def _navigation(self) -> Any:
        autopilot, body = self.autopilot, self.autopilot.body
        target = autopilot.target_point
        bearing_deg = distance_m = rise_m = 0.0
        if target is not None:
            bearing_deg = math.degrees(autopilot.position.bearing_rad(target))
            distance_m = autopilot.position.distance_m(target)
            rise_m = target.up_m - body.up_m
        return dialect.MAVLink_nav_controller_output_message(
            math.degrees(body.roll_rad),
            math.degrees(body.pitch_rad),
            round(bearing_deg),
            round(bearing_deg),
            min(65535, round(distance_m)),
            rise_m,
            0.0,
            0.0,
        )
