"""The position estimator (EKF): it takes a while until it knows where the vehicle is.

Its flags go as ArduPilot's do: nothing at first, then attitude and height (0xA7, with the flag that
says "constant position"), then everything (0x33F).
"""

import math
from collections.abc import Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.part import Part, ReportMaker

LEVELLED = 0.2
"""After this part of the time it knows its attitude."""
SENSORS_WELL = 0.55
"""After this part of the time, modes that need no position may be armed (ArduPilot: 23 of 41 s)."""


class Estimator(Part):
    """Knows where the vehicle is, or not yet, or (`lost`) no longer. `gps_lost`: no satellites."""

    gps_lost = False

    @property
    def ready(self) -> bool:
        """It knows where the vehicle is."""
        return self._waited >= 1 and not self.gps_lost

    @property
    def levelled(self) -> bool:
        """It knows which way is up."""
        return self._waited >= LEVELLED

    @property
    def sensors_well(self) -> bool:
        """What needs no position may begin."""
        return self._waited >= SENSORS_WELL

    @property
    def flags(self) -> int:
        """EKF_STATUS_FLAGS."""
        if self.ready:
            return 0x33F
        return 0xA7 if self.levelled else 0x400

    @property
    def _waited(self) -> float:
        wait_s = self.autopilot.spec.estimator_s
        return self.autopilot.since_boot_s / wait_s if wait_s > 0 else 1.0

    def reports(self) -> Mapping[int, ReportMaker]:
        """EKF_STATUS_REPORT and GPS_RAW_INT."""
        return {
            dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT: self._status,
            dialect.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps,
        }

    def _status(self) -> object:
        variance = 0.05 if self.ready else 0.6
        return dialect.MAVLink_ekf_status_report_message(
            self.flags, variance, variance, variance, 0.02, 0.0, 0.0
        )

    def _gps(self) -> object:
        """The receiver has a fix long before the estimator uses it."""
        pilot, body = self.autopilot, self.autopilot.body
        fixed = self._waited >= 0.1 and not self.gps_lost
        place = pilot.frame.to_location(pilot.position)
        return dialect.MAVLink_gps_raw_int_message(
            int(pilot.since_boot_s * 1e6),
            dialect.GPS_FIX_TYPE_RTK_FIXED if fixed else dialect.GPS_FIX_TYPE_NO_FIX,
            round(place.latitude_deg * 1e7) if fixed else 0,
            round(place.longitude_deg * 1e7) if fixed else 0,
            round(place.altitude_amsl_m * 1e3) if fixed else 0,
            121 if fixed else 9999,
            200 if fixed else 9999,
            round(body.ground_speed_mps * 100),
            round(course_cdeg(body.north_mps, body.east_mps)),
            10 if fixed else 0,
        )


def course_cdeg(north_mps: float, east_mps: float) -> float:
    """Direction of movement, 0..36000."""
    return math.degrees(math.atan2(east_mps, north_mps)) % 360 * 100
