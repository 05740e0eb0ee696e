"""Components that only PX4 has: mission checks, landing detection, OFFBOARD, telemetry, texts."""

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.failsafes import Px4Failsafes
from m2pem_plugin_mavlink.simulator.firmware.px4_modes import HOLD, LAND, OFFBOARD, RETURN, TAKEOFF
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    Mode,
    makes,
    on_message,
)
from m2pem_plugin_mavlink.simulator.messages import Sender
from m2pem_plugin_mavlink.simulator.px4_maneuvers import Orbit
from m2pem_plugin_mavlink.simulator.specification import Kind


class LandingDetector(Component):
    """Reports takeoff and landing; after disarming enters the last mode that may be armed, other
    than AUTO.TAKEOFF (PX4: Commander, UserModeIntention)."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._after_disarming = HOLD
        self._armed = False
        self._on_ground = True

    def step(self, dt_s: float) -> None:
        """Look at the ground and the motors."""
        autopilot = self.autopilot
        on_ground = autopilot.body.on_ground
        if on_ground != self._on_ground and autopilot.spec.kind is Kind.COPTER:
            autopilot.say("Landing detected" if on_ground else "Takeoff detected")
        self._on_ground = on_ground
        if self._armed and not autopilot.arming.armed:
            autopilot.modes.switch(self._after_disarming)
        self._armed = autopilot.arming.armed

    def entered(self, mode: Mode) -> None:
        """A mode has been entered."""
        if mode.armable and mode.number != TAKEOFF:
            self._after_disarming = mode.number


ACTIONS = {4: LAND, 5: HOLD}
"""COM_OBL_RC_ACT: the mode that follows on OFFBOARD; else it is RETURN, because modes for a pilot
cannot be entered without a remote control."""


class OffboardMonitor(Component):
    """Leaves OFFBOARD when no setpoints have come for COM_OF_LOSS_T."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._received_s = -1e9

    @property
    def streaming(self) -> bool:
        """Setpoints are coming."""
        autopilot = self.autopilot
        return autopilot.now_s - self._received_s <= autopilot.parameters["COM_OF_LOSS_T"]

    @on_message("SET_POSITION_TARGET_LOCAL_NED")
    def _received(self, message: Any, sender: Sender) -> None:
        self._received_s = self.autopilot.now_s

    def refusals(self) -> Iterator[str]:
        """It is not armed in OFFBOARD without setpoints."""
        if self.autopilot.modes.mode.number == OFFBOARD and not self.streaming:
            yield "No offboard signal"

    def step(self, dt_s: float) -> None:
        """Look whether they still come."""
        autopilot = self.autopilot
        if autopilot.modes.mode.number != OFFBOARD or not autopilot.arming.armed or self.streaming:
            return
        mode = ACTIONS.get(int(autopilot.parameters["COM_OBL_RC_ACT"]), RETURN)
        autopilot.component(Px4Failsafes).act("no setpoints", mode, at_once=True)


class Px4Reports(Component):
    """ESTIMATOR_STATUS, ALTITUDE, ORBIT_EXECUTION_STATUS."""

    @property
    def _time_us(self) -> int:
        return int(self.autopilot.since_boot_s * 1e6)

    @makes(dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS)
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

    @makes(dialect.MAVLINK_MSG_ID_ALTITUDE)
    def _altitude(self) -> Any:
        autopilot = self.autopilot
        up_m = autopilot.body.up_m
        amsl_m = autopilot.frame.origin.altitude_amsl_m + up_m
        relative_m = up_m - autopilot.home.point.up_m
        return dialect.MAVLink_altitude_message(
            self._time_us, amsl_m, amsl_m, up_m, relative_m, up_m, up_m
        )

    @makes(dialect.MAVLINK_MSG_ID_ORBIT_EXECUTION_STATUS)
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
            *center.scaled[:2],
            center.altitude_amsl_m,
        )


class SatelliteMonitor(Component):
    """Says on the ground that the satellites are gone, when they go."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._lost = False

    def step(self, dt_s: float) -> None:
        """Look at the receiver."""
        autopilot = self.autopilot
        lost = autopilot.estimator.gps_lost
        if lost and not self._lost and not autopilot.arming.armed:
            autopilot.warn(autopilot.firmware.check_text(autopilot.firmware.reason_satellites))
        self._lost = lost
