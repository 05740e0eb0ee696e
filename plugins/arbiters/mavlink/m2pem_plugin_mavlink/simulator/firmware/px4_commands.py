"""Commands that PX4 takes in another way than ArduPilot (PX4: Commander, navigator)."""

import math
from collections.abc import Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.firmware.px4_components import (
    OffboardMonitor,
)
from m2pem_plugin_mavlink.simulator.firmware.px4_modes import (
    HOLD,
    LAND,
    MISSION,
    NAMES,
    OFFBOARD,
    ORBIT,
    RETURN,
    TAKEOFF,
)
from m2pem_plugin_mavlink.simulator.geometry import Location, Point, wrapped_rad
from m2pem_plugin_mavlink.simulator.interfaces import CommandHandler, Component
from m2pem_plugin_mavlink.simulator.messages import Command, Result
from m2pem_plugin_mavlink.simulator.missions.execution import MissionAvailability
from m2pem_plugin_mavlink.simulator.px4_maneuvers import Hold, Orbit, TakeOff
from m2pem_plugin_mavlink.simulator.specification import Kind

CHANGE_MODE = 1
"""Parameter 2 of DO_REPOSITION; PX4 does without no reposition."""
FORCE = 21196
AUTOMATIC = 4
"""Parameter 2 of DO_SET_MODE: parameter 3 says which of the automatic modes."""
ORBIT_MPS = 3.0
WIDEST_ORBIT_M = 1000.0
"""MC_ORBIT_RAD_MAX."""


class Px4Commands(Component):
    """Refusals are TEMPORARILY_REJECTED, with a text that gives no reason."""

    def commands(self) -> Mapping[int, CommandHandler]:
        """By MAV_CMD."""
        handlers: dict[int, CommandHandler] = {
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            dialect.MAV_CMD_MISSION_START: self._start_mission,
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _: self._enter(RETURN),
            dialect.MAV_CMD_NAV_LOITER_UNLIM: lambda _: self._enter(HOLD),
            dialect.MAV_CMD_CONDITION_YAW: lambda _: Result.UNSUPPORTED,
        }
        if self.autopilot.spec.kind is Kind.COPTER:
            handlers[dialect.MAV_CMD_NAV_TAKEOFF] = self._take_off
            handlers[dialect.MAV_CMD_NAV_LAND] = lambda _: self._enter(LAND)
            handlers[dialect.MAV_CMD_DO_ORBIT] = self._orbit
        return handlers

    def _arm(self, command: Command) -> Result:
        arming, force = self.autopilot.arming, command.param2 == FORCE
        if command.param1 not in (0, 1):
            return Result.UNSUPPORTED
        if command.param1 == 1:
            done = arming.arm(force=force)
        else:
            done = arming.disarm(force=force)
            if not done:
                self.autopilot.warn("Disarming denied: not landed")
        return Result.ACCEPTED if done else Result.TEMPORARILY_REJECTED

    def _set_mode(self, command: Command) -> Result:
        firmware = self.autopilot.firmware
        number = firmware.mode_number(int(command.param1), int(command.param2), int(command.param3))
        if number is None or number not in self.autopilot.modes.by_number:
            kind = "auto" if command.param2 == AUTOMATIC else "main"
            self.autopilot.warn(f"Unsupported {kind} mode")
            return Result.TEMPORARILY_REJECTED
        return self._enter(number)

    def _enter(self, mode: int) -> Result:
        """While nothing is armed, every mode may be chosen."""
        autopilot = self.autopilot
        if (
            mode == OFFBOARD
            and autopilot.arming.armed
            and not autopilot.component(OffboardMonitor).streaming
        ):
            autopilot.warn(f"Switching to {NAMES[mode]} is currently not available")
            return Result.TEMPORARILY_REJECTED
        return Result.ACCEPTED if autopilot.modes.switch(mode) else Result.TEMPORARILY_REJECTED

    def _take_off(self, command: Command) -> Result:
        """The height is above the sea; it climbs as soon as it is armed."""
        result = self._enter(TAKEOFF)
        maneuver = self.autopilot.modes.maneuver
        if result is Result.ACCEPTED and isinstance(maneuver, TakeOff):
            maneuver.climb_to(self._up_m(command.z))
        return result

    def _reposition(self, command: Command) -> Result:
        """The mode changes first; that a place is refused after that, only a text says."""
        autopilot = self.autopilot
        if int(command.param2) != CHANGE_MODE:
            return Result.UNSUPPORTED
        result = self._enter(HOLD)
        maneuver = autopilot.modes.maneuver
        if result is not Result.ACCEPTED or not isinstance(maneuver, Hold):
            return result
        aimless = not command.has_position
        if aimless and not math.isfinite(command.z) and not math.isfinite(command.param4):
            maneuver.pause()
            return result
        point = self._place(command, maneuver.destination)
        if autopilot.guided.forbidden(point):
            autopilot.warn("Reposition is outside geofence")
            return result
        if command.param1 > 0:
            autopilot.modes.set_speed(command.param1)
        yaw_rad = wrapped_rad(command.param4) if math.isfinite(command.param4) else None
        maneuver.go_to(point, yaw_rad)
        return result

    def _change_speed(self, command: Command) -> Result:
        """In any mode; without a speed, as it is set up."""
        self.autopilot.modes.set_speed(command.param2 if command.param2 > 0 else None)
        return Result.ACCEPTED

    def _orbit(self, command: Command) -> Result:
        autopilot = self.autopilot
        radius_m = command.param1 if math.isfinite(command.param1) else 20.0
        if not 1.0 <= abs(radius_m) <= WIDEST_ORBIT_M:
            return Result.DENIED
        result = self._enter(ORBIT)
        maneuver = autopilot.modes.maneuver
        if result is Result.ACCEPTED and isinstance(maneuver, Orbit):
            speed_mps = command.param2 if command.param2 > 0 else ORBIT_MPS
            maneuver.around(self._place(command), radius_m, speed_mps)
        return result

    def _start_mission(self, command: Command) -> Result:
        """It enters the mode and arms."""
        autopilot = self.autopilot
        missions = self.autopilot.component(MissionAvailability)
        first = int(command.param1)
        if not -1 <= first < len(autopilot.plans[0]):
            return Result.DENIED
        if not missions.available:
            autopilot.warn("Mission start denied! No valid mission")
            return Result.DENIED
        if first > 0:
            autopilot.mission.set_current(first)
        started = autopilot.modes.switch(MISSION) and autopilot.arming.arm(by="mission start")
        return Result.ACCEPTED if started else Result.TEMPORARILY_REJECTED

    def _up_m(self, amsl_m: float) -> float | None:
        """Above the frame's origin."""
        if not math.isfinite(amsl_m):
            return None
        return amsl_m - self.autopilot.frame.origin.altitude_amsl_m

    def _place(self, command: Command, before: Point | None = None) -> Point:
        """Where it says; NaN or nothing means where it was to go before (None: here), at the height
        that it has."""
        autopilot = self.autopilot
        point = before or autopilot.position
        if command.has_position:
            location = Location(command.latitude_deg, command.longitude_deg, 0.0)
            point = autopilot.frame.to_point(location)
        point = point.at_height(autopilot.body.up_m)
        up_m = self._up_m(command.z)
        if up_m is not None and autopilot.spec.kind is Kind.COPTER:
            point = point.at_height(up_m)
        return point
