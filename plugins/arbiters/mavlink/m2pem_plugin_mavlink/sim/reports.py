"""Telemetry of position, attitude and health."""

import math
from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.part import Part, ReportMaker
from m2pem_plugin_mavlink.sim.specification import Kind

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


class Reports(Part):
    """What ground stations show."""

    def reports(self) -> Mapping[int, ReportMaker]:
        """By message id."""
        return {
            dialect.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._local_position,
            dialect.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self._quaternion,
            dialect.MAVLINK_MSG_ID_VFR_HUD: self._hud,
            dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_state,
            dialect.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: self._navigation,
            dialect.MAVLINK_MSG_ID_TERRAIN_REPORT: self._terrain,
            dialect.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: self._target,
        }

    def _sys_status(self) -> Any:
        pilot = self.autopilot
        present = SENSORS | dialect.MAV_SYS_STATUS_PREARM_CHECK
        health = SENSORS
        if not pilot.estimator.ready:
            health &= ~dialect.MAV_SYS_STATUS_AHRS
        if pilot.estimator.gps_lost:
            health &= ~dialect.MAV_SYS_STATUS_SENSOR_GPS
        if pilot.arming.armed or pilot.arming.healthy:
            health |= dialect.MAV_SYS_STATUS_PREARM_CHECK
        return dialect.MAVLink_sys_status_message(
            present,
            present,
            health,
            50,
            round(pilot.battery.voltage_v * 1000),
            round(pilot.battery.current_a * 100),
            pilot.battery.percent,
            0,
            0,
            0,
            0,
            0,
            0,
        )

    def _target(self) -> Any:
        """Nothing but a place, with its height above the sea; none where there is no target."""
        pilot, point = self.autopilot, self.autopilot.target_point
        if point is None:
            return None
        place = pilot.frame.to_location(point)
        return dialect.MAVLink_position_target_global_int_message(
            pilot.boot_ms,
            dialect.MAV_FRAME_GLOBAL,
            PLACE_ALONE,
            round(place.latitude_deg * 1e7),
            round(place.longitude_deg * 1e7),
            place.altitude_amsl_m,
            *[0.0] * 8,
        )

    def _global_position(self) -> Any:
        """Before the estimator is ready, ArduPilot says zeros."""
        pilot, body = self.autopilot, self.autopilot.body
        place = pilot.frame.to_location(pilot.position)
        known = pilot.estimator.ready or pilot.estimator.found
        return dialect.MAVLink_global_position_int_message(
            pilot.boot_ms,
            round(place.latitude_deg * 1e7) if known else 0,
            round(place.longitude_deg * 1e7) if known else 0,
            round(place.altitude_amsl_m * 1e3) if known else 0,
            round((body.up_m - pilot.home.point.up_m) * 1e3),
            round(body.north_mps * 100),
            round(body.east_mps * 100),
            round(-body.up_mps * 100),
            round(math.degrees(body.yaw_rad) * 100) % 36000,
        )

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

    def _hud(self) -> Any:
        pilot, body = self.autopilot, self.autopilot.body
        altitude_m = pilot.frame.origin.altitude_amsl_m + body.up_m
        return dialect.MAVLink_vfr_hud_message(
            body.ground_speed_mps,
            body.ground_speed_mps,
            round(math.degrees(body.yaw_rad)) % 360,
            0 if not pilot.arming.armed else 40 if body.on_ground else 50,
            altitude_m,
            body.up_mps,
        )

    def _extended_state(self) -> Any:
        pilot = self.autopilot
        state: int = dialect.MAV_LANDED_STATE_IN_AIR
        if not pilot.firmware.tells_landed:
            state = dialect.MAV_LANDED_STATE_UNDEFINED
        elif pilot.body.on_ground or pilot.spec.kind in (Kind.ROVER, Kind.BOAT):
            state = dialect.MAV_LANDED_STATE_ON_GROUND
        elif pilot.modes.maneuver.taking_off:
            state = dialect.MAV_LANDED_STATE_TAKEOFF
        elif pilot.modes.maneuver.landing:
            state = dialect.MAV_LANDED_STATE_LANDING
        return dialect.MAVLink_extended_sys_state_message(pilot.firmware.vtol_state, state)

    def _terrain(self) -> Any:
        """There are no terrain data, so that the height is that above the sea. What drives or
        floats has none to tell."""
        pilot = self.autopilot
        if not pilot.firmware.tells_landed:
            return None
        place = pilot.frame.to_location(pilot.position)
        known = pilot.estimator.ready or pilot.estimator.found
        return dialect.MAVLink_terrain_report_message(
            round(place.latitude_deg * 1e7) if known else 0,
            round(place.longitude_deg * 1e7) if known else 0,
            0,
            0.0,
            place.altitude_amsl_m if known else 0.0,
            504,
            0,
        )

    def _navigation(self) -> Any:
        pilot, body = self.autopilot, self.autopilot.body
        target = pilot.target_point
        bearing_deg = distance_m = rise_m = 0.0
        if target is not None:
            bearing_deg = math.degrees(pilot.position.bearing_rad(target))
            distance_m = pilot.position.distance_m(target)
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
