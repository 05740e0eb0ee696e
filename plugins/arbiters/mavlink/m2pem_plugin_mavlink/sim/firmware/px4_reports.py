"""Telemetry and texts that PX4 sends and ArduPilot does not."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.maneuvers.orbiting import Orbit
from m2pem_plugin_mavlink.sim.part import Part, ReportMaker

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot


class Px4Reports(Part):
    """ESTIMATOR_STATUS, ALTITUDE, ORBIT_EXECUTION_STATUS."""

    def reports(self) -> Mapping[int, ReportMaker]:
        """By message id."""
        return {
            dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: self._estimator,
            dialect.MAVLINK_MSG_ID_ALTITUDE: self._altitude,
            dialect.MAVLINK_MSG_ID_ORBIT_EXECUTION_STATUS: self._orbit,
        }

    @property
    def _time_us(self) -> int:
        return int(self.autopilot.since_boot_s * 1e6)

    def _estimator(self) -> Any:
        """Its flags have the same numbers as those of ArduPilot's EKF_STATUS_REPORT, but "constant
        position" means also that it is at rest (since July 2024)."""
        ready, body = self.autopilot.estimator.ready, self.autopilot.body
        ratio, accuracy_m = (0.05, 0.3) if ready else (0.8, 50.0)
        flags = 0x37F if ready else self.autopilot.estimator.flags & 0x37F
        if body.on_ground and not body.moving:
            flags |= dialect.ESTIMATOR_CONST_POS_MODE
        return dialect.MAVLink_estimator_status_message(
            self._time_us, flags, ratio, ratio, ratio, 0.02, 0.0, 0.0, accuracy_m, 0.4
        )

    def _altitude(self) -> Any:
        pilot = self.autopilot
        up_m = pilot.body.up_m
        amsl_m = pilot.frame.origin.altitude_amsl_m + up_m
        relative_m = up_m - pilot.home.point.up_m
        return dialect.MAVLink_altitude_message(
            self._time_us, amsl_m, amsl_m, up_m, relative_m, up_m, up_m
        )

    def _orbit(self) -> Any:
        """Only while it goes around something."""
        maneuver, frame = self.autopilot.modes.maneuver, self.autopilot.frame
        if not isinstance(maneuver, Orbit) or maneuver.circle is None:
            return None
        center = frame.to_location(maneuver.circle.center)
        return dialect.MAVLink_orbit_execution_status_message(
            self._time_us,
            maneuver.circle.radius_m,
            dialect.MAV_FRAME_GLOBAL,
            round(center.latitude_deg * 1e7),
            round(center.longitude_deg * 1e7),
            center.altitude_amsl_m,
        )


class SatelliteWatch(Part):
    """Says on the ground that the satellites are gone, when they go."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._lost = False

    def step(self, dt_s: float) -> None:
        """Look at the receiver."""
        pilot = self.autopilot
        lost = pilot.estimator.gps_lost
        if lost and not self._lost and not pilot.arming.armed:
            pilot.warn(pilot.firmware.check_text(pilot.firmware.reason_satellites))
        self._lost = lost
