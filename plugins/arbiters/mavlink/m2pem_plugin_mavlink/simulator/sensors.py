"""The position estimator and the battery of a simulated autopilot."""

import math

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import ellipsoidal_m
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, makes

LEVELLED = 0.2
"""After this part of the time it knows its attitude."""
SENSORS_WELL = 0.55
"""After this part of the time, modes that need no position may be armed (ArduPilot: 23 of 41 s)."""


class Estimator(Component):
    """The state of the position estimator. `found`: the position was known before."""

    found = False

    @property
    def gps_lost(self) -> bool:
        """Whether there are no satellites."""
        return self.autopilot.injected_faults.gps_lost

    def step(self, dt_s: float) -> None:
        """Remember that it knew."""
        self.found = self.found or self.ready

    @property
    def ready(self) -> bool:
        """Whether the position is known."""
        return self._waited >= 1 and not self.gps_lost

    @property
    def levelled(self) -> bool:
        """Whether the attitude is known."""
        return self._waited >= LEVELLED

    @property
    def sensors_well(self) -> bool:
        """Whether modes that need no position may be armed."""
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

    @makes(dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT)
    def _status(self) -> object:
        variance = 0.05 if self.ready else 0.6
        return dialect.MAVLink_ekf_status_report_message(
            self.flags, variance, variance, variance, 0.02, 0.0, 0.0
        )

    @makes(dialect.MAVLINK_MSG_ID_GPS_RAW_INT)
    def _gps(self) -> object:
        """The receiver has a fix long before the estimator uses it."""
        autopilot, body = self.autopilot, self.autopilot.body
        course_deg = math.degrees(math.atan2(body.east_mps, body.north_mps))
        fixed = self._waited >= 0.1 and not self.gps_lost
        place = autopilot.frame.to_location(autopilot.position)
        height_m = ellipsoidal_m(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m)
        return dialect.MAVLink_gps_raw_int_message(
            int(autopilot.since_boot_s * 1e6),
            dialect.GPS_FIX_TYPE_RTK_FIXED if fixed else dialect.GPS_FIX_TYPE_NO_FIX,
            *(place.scaled if fixed else (0, 0, 0)),
            121 if fixed else 9999,
            200 if fixed else 9999,
            round(body.ground_speed_mps * 100),
            round(course_deg % 360 * 100),
            10 if fixed else 0,
            alt_ellipsoid=round(height_m * 1e3) if fixed else 0,
        )


FULL_V, EMPTY_V = 12.6, 10.2
"""Three lithium cells; ArduPilot takes less than 10.5 V for low."""
IDLE = 0.02
"""What electronics alone take, as a part of what moving takes."""


class Battery(Component):
    """`left`: 0 to 1; it may be set."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.left = getattr(getattr(autopilot, "battery", None), "left", 1.0)
        self._load = IDLE

    @property
    def voltage_v(self) -> float:
        """Falls with the charge."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.left

    @property
    def current_a(self) -> float:
        """What is drawn now."""
        capacity_mah: float = self.autopilot.parameters[self.autopilot.firmware.capacity]
        return capacity_mah * 3.6 / self.autopilot.spec.battery_s * self._load

    @property
    def percent(self) -> int:
        """As it is reported."""
        return max(0, min(100, int(self.left * 100 + 1e-6)))

    def step(self, dt_s: float) -> None:
        """Drain it."""
        armed, body = self.autopilot.arming.armed, self.autopilot.body
        self._load = IDLE if not armed else 1.0 if body.moving or not body.on_ground else 0.1
        self.left = max(0.0, self.left - dt_s * self._load / self.autopilot.spec.battery_s)

    @makes(dialect.MAVLINK_MSG_ID_BATTERY_STATUS)
    def _status(self) -> object:
        used_mah = (1 - self.left) * self.autopilot.parameters[self.autopilot.firmware.capacity]
        return dialect.MAVLink_battery_status_message(
            0,
            dialect.MAV_BATTERY_FUNCTION_UNKNOWN,
            dialect.MAV_BATTERY_TYPE_UNKNOWN,
            0x7FFF,
            [round(self.voltage_v * 1000), *[0xFFFF] * 9],
            round(self.current_a * 100),
            round(used_mah),
            -1,
            self.percent,
        )
